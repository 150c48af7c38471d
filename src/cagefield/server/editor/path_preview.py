"""The preview: a page plays the camera path, and pictures show the edits as the path's video will then."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cagefield.cameras.keyframes import Timeline
from cagefield.edits import Edit


@dataclass(frozen=True)
class Preview:
    """Preview of a camera path: the page, the page's number for it, the path, and the edits at the present
    time."""

    page: int
    number: int
    timeline: Timeline
    edits: tuple[Edit, ...]

    def is_of(self, page: int, number: int) -> bool:
        """True for the preview that `page` identifies by `number`."""
        return (self.page, self.number) == (page, number)

    def parts(self, seconds: float) -> dict[int, float]:
        """How far each edit that a key names has gone at a time; before and after the path as at its ends."""
        at = np.array([min(max(seconds, 0.0), self.timeline.seconds)])
        return {name: float(values[0]) for name, values in self.timeline.parts(at).items()}
