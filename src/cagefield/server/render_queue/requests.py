"""Pictures, and edits for pages that draw themselves, as the scheduler asks for them."""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.server.render_worker.refinement import Refinement
from cagefield.server.render_worker.view import Display, Region


@dataclass(frozen=True)
class Request:
    """A picture to be rendered with a refinement; `last` is the last tile of a view in full resolution.

    `complete` says that with it everything is drawn that was not as it should be.
    """

    number: int
    page: int
    camera: int
    revision: int
    display: Display
    region: Region
    moving: bool
    refinement: Refinement
    last: bool
    complete: bool = True


@dataclass(frozen=True)
class EditsRequest:
    """Edits with a refinement for a page that draws them itself."""

    number: int
    page: int
    revision: int
    refinement: Refinement
    moving: bool
    """Whether they are those of a drag."""
