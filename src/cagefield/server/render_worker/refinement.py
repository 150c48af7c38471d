"""Refinements of the picture of edits, in the order in which they show; each has all of those before.

A drag's picture waits for none of them. When nothing moves any more the whole picture comes as a draft, and
then once more for each refinement that changes it; the next gesture cancels.
"""

from __future__ import annotations

from enum import IntEnum


class Refinement(IntEnum):
    """DRAFT: coarse lattices, no splat is split, patches and light that are known already.

    INPAINTED: holes of discrete edits are inpainted. EXACT: the edits' own lattices, split splats. LIT:
    light, feathered seams; the final picture.
    """

    DRAFT = 0
    INPAINTED = 1
    EXACT = 2
    LIT = 3

    @property
    def is_coarse(self) -> bool:
        """Whether maps are coarse, and no splat is split."""
        return self < Refinement.EXACT


FINAL = Refinement.LIT
"""Refinement of the final picture."""
