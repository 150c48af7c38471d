"""The stages of a VoxelField's training, coarse to fine: when its grid is refined, and when pruned.

A run's progress goes from 0 to 1. Each stage has its resolution; when it begins, the grid of the stage before
is pruned and refined, and somewhere within it is pruned once more.
"""

from __future__ import annotations

from dataclasses import dataclass, field

STAGES = ((0.25, 0.0), (0.4375, 0.06), (0.75, 0.18), (1.0, 0.4))
"""(fraction of the final resolution, progress at which the stage starts); see `stages`."""

LARGEST_FIRST = 80
"""Vertices along the longest axis of the first grid, at most: it is full."""

PRUNE_WITHIN = 0.4
"""A stage is pruned once more after this share of it."""

LEAST_STEPS = 60
"""Steps that a stage has at least, before and after its pruning, when a run is limited by time."""

STEPS_PER_SQUARE = 1 / 128
"""As LEAST_STEPS, for each vertex of a square of the longest axis: what no batch met would be pruned."""

LEAST_RESOLUTION = 16
"""Vertices along the longest axis of any grid, at least."""


def stages(final: int) -> tuple[tuple[int, float], ...]:
    """(vertices along the longest axis, progress at which it starts) of each stage of a run.

    Where the first of STAGES is larger than LARGEST_FIRST, stages of half the resolution and a third of the
    time come before it.
    """
    found = list(STAGES)
    while found[0][0] * final > LARGEST_FIRST:
        share, end = found[0][0], found[1][1]
        found[:1] = [(share / 2, 0.0), (share, end / 3)]
    return tuple((max(LEAST_RESOLUTION, round(share * final)), start) for share, start in found)


@dataclass
class Schedule:
    """Which stage a run is in.

    Attributes:
        final: vertices along the longest axis at the end. degree: SH degree at the end.
        by_clock: whether the run is limited by time.
        stage: number of the stage. began: the step at which it did, or was pruned.
        pruned: whether it was pruned within; the first stage is not.
    """

    final: int
    degree: int
    by_clock: bool
    stage: int = 0
    began: int = 0
    pruned: bool = True
    _stages: tuple[tuple[int, float], ...] = field(init=False)

    def __post_init__(self) -> None:
        self._stages = stages(self.final)

    @property
    def last(self) -> bool:
        """Whether no other stage comes."""
        return self.stage + 1 == len(self._stages)

    @property
    def resolution(self) -> int:
        """Vertices along the longest axis in this stage."""
        return self._stages[self.stage][0]

    @property
    def sh_degree(self) -> int:
        """SH degree in this stage: at most 1 in the first, whose grid is full."""
        return min(self.degree, 1) if self.stage == 0 else self.degree

    def is_over(self, done: float, step: int) -> bool:
        """Whether the next stage is due at this progress and step."""
        if self.last or done < self._stages[self.stage + 1][1]:
            return False
        return self._has_learnt(step)

    def _has_learnt(self, step: int) -> bool:
        """Whether batches have met the grid; by the clock, a slow machine could prune or refine it before."""
        least = max(LEAST_STEPS, STEPS_PER_SQUARE * self.resolution**2)
        return not self.by_clock or step - self.began >= least

    def prunes(self, done: float, step: int) -> bool:
        """Whether the pruning within this stage is due at this progress and step."""
        start = self._stages[self.stage][1]
        end = 1.0 if self.last else self._stages[self.stage + 1][1]
        due = not self.pruned and done >= start + PRUNE_WITHIN * (end - start)
        return due and self._has_learnt(step)

    def prune(self, step: int) -> None:
        """The stage is pruned at this step."""
        self.began, self.pruned = step, True

    def enter_next(self, step: int) -> None:
        """The next stage begins at this step."""
        self.stage, self.began, self.pruned = self.stage + 1, step, False
