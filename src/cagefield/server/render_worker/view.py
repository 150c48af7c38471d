"""Display options of the scene, and regions of an image."""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.server.protocol.common import View


@dataclass(frozen=True)
class Display:
    """Display of a view: without the edits where `before`, or left of `split` (0 to 1)."""

    view: View = "color"
    before: bool = False
    split: float | None = None


@dataclass(frozen=True)
class Region:
    """A part of a picture of `full` (width, height), pixels."""

    x: int
    y: int
    width: int
    height: int
    full_width: int
    full_height: int
