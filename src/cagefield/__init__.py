"""cagefield: edit the geometry of a captured radiance field with two nested cages."""

from __future__ import annotations

__version__ = "0.1.0"
