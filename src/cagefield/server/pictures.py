"""Pictures as they are asked for: a look at the scene, a region of a picture, a picture."""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.server.wire import View


@dataclass(frozen=True)
class Look:
    """What of the scene is shown: a view; without the edits `before`, or left of `split` (0 to 1)."""

    view: View = "colour"
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


@dataclass(frozen=True)
class Request:
    """A picture to be rendered: `exact` with the edits' own lattices, `final` the last tile of a view.

    `complete` says that with it everything is drawn that was not as it should be.
    """

    number: int
    page: int
    camera: int
    revision: int
    look: Look
    region: Region
    moving: bool
    exact: bool
    final: bool
    complete: bool = True
