"""Warnings of the readers, attributed to the line outside of `cagefield.datasets` that called them."""

from __future__ import annotations

import sys
import warnings


def warn(message: str) -> None:
    """Warn at the innermost caller outside of this package."""
    level, frame = 1, sys._getframe()
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("cagefield.datasets"):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, stacklevel=level)
