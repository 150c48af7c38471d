"""An outer cage that follows from the edit: the box around everything that it moves."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from cagefield.geometry.cage import Cage
from cagefield.geometry.hexahedron import BITS
from cagefield.typing import Array


class ReachCage(Cage):
    """The axis-aligned box around the reach of an edit, which is made anew with its operations.

    Moved by hand it becomes an ordinary `Cage`.
    """

    follows_edit: ClassVar[bool] = True

    @classmethod
    def around(cls, box: Array) -> ReachCage:
        """The cage of a box [2,3] (min, max)."""
        return cls(np.asarray(box[0] + BITS * (box[1] - box[0])))

    def mirrored(self, axis: int, at: float) -> ReachCage:
        """The box across the plane where coordinate `axis` is `at`."""
        return ReachCage(super().mirrored(axis, at).corners)
