"""The stages of a VoxelField's training, coarse to fine: when its grid is refined, and when pruned.

A run's progress goes from 0 to 1. Each stage has its resolution; when it begins, the grid of the stage before
is pruned and refined, and somewhere within it is pruned once more.
"""

from __future__ import annotations

from dataclasses import dataclass

STAGES = ((0.25, 0.0), (0.4375, 0.06), (0.75, 0.18), (1.0, 0.4))
"""(fraction of the final resolution, progress at which the stage starts)."""

PRUNE_WITHIN = 0.4
"""A stage is pruned once more after this share of it."""

LEAST_STEPS = 60
"""Steps that a stage has at least when a run is limited by time."""

LEAST_RESOLUTION = 16
"""Vertices along the longest axis of any grid, at least."""


@dataclass
class Schedule:
    """Which stage a run is in.

    Attributes:
        by_clock: whether the run is limited by time.
        stage: number of the stage. began: the step at which it did.
        pruned: whether it was pruned within; the first stage is not.
    """

    by_clock: bool
    stage: int = 0
    began: int = 0
    pruned: bool = True

    @property
    def last(self) -> bool:
        """Whether no other stage comes."""
        return self.stage + 1 == len(STAGES)

    def resolution(self, final: int) -> int:
        """Vertices along the longest axis in this stage of a run that ends with `final`."""
        return max(LEAST_RESOLUTION, round(STAGES[self.stage][0] * final))

    def is_over(self, done: float, step: int) -> bool:
        """Whether the next stage is due at this progress and step."""
        if self.last or done < STAGES[self.stage + 1][1]:
            return False
        # By the clock, a slow machine could reach a stage's end before its grid has learnt anything.
        return not self.by_clock or step - self.began >= LEAST_STEPS

    def prunes(self, done: float) -> bool:
        """Whether the pruning within this stage is due at this progress."""
        start = STAGES[self.stage][1]
        end = 1.0 if self.last else STAGES[self.stage + 1][1]
        return not self.pruned and done >= start + PRUNE_WITHIN * (end - start)

    def enter_next(self, step: int) -> None:
        """The next stage begins at this step."""
        self.stage, self.began, self.pruned = self.stage + 1, step, False
