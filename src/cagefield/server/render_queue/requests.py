"""Pictures, and edits for pages that draw themselves, as the scheduler asks for them."""

from __future__ import annotations

from dataclasses import dataclass

from cagefield.server.render_worker.view import Display, Region


@dataclass(frozen=True)
class Request:
    """A picture to be rendered: `exact` with the edits' own lattices, `final` the last tile of a view.

    `complete` says that with it everything is drawn that was not as it should be.
    """

    number: int
    page: int
    camera: int
    revision: int
    display: Display
    region: Region
    moving: bool
    exact: bool
    final: bool
    complete: bool = True


@dataclass(frozen=True)
class EditsRequest:
    """Edits for a page that draws them itself: `exact` with their own lattices."""

    number: int
    page: int
    revision: int
    exact: bool

    @property
    def moving(self) -> bool:
        """Whether they are those of a drag."""
        return not self.exact
