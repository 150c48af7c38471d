"""Coarse-to-fine stages of a VoxelField's training: times of refinement and pruning.

The progress of a run goes from 0 to 1. Each stage has its resolution; at its start the grid of the previous
stage is pruned and refined, and each stage but the first prunes once more midway.
"""

from __future__ import annotations

from dataclasses import dataclass, field

STAGES = ((0.25, 0.0), (0.4375, 0.06), (0.75, 0.18), (1.0, 0.4))
"""(fraction of the final resolution, progress at which the stage starts); see `stages`."""

MAX_FIRST_RESOLUTION = 80
"""Maximum number of vertices along the longest axis of the first grid, which is dense."""

PRUNE_STAGE_SHARE = 0.4
"""Share of a stage after which the stage prunes once more."""

MIN_STAGE_STEPS = 60
"""Minimum number of steps before and after a stage's pruning, in a run limited by time."""

MIN_STAGE_STEPS_PER_SQUARE = 1 / 128
"""As MIN_STAGE_STEPS, per squared resolution: pruning removes every vertex that no batch has met."""

MIN_RESOLUTION = 16
"""Minimum number of vertices along the longest axis of any grid."""


def stages(final: int) -> tuple[tuple[int, float], ...]:
    """(vertices along the longest axis, progress at the start) of each stage of a run.

    While the first stage exceeds MAX_FIRST_RESOLUTION, a stage of half its resolution takes the first third
    of its time.
    """
    table = list(STAGES)
    while table[0][0] * final > MAX_FIRST_RESOLUTION:
        share, end = table[0][0], table[1][1]
        table[:1] = [(share / 2, 0.0), (share, end / 3)]
    return tuple((max(MIN_RESOLUTION, round(share * final)), start) for share, start in table)


@dataclass
class Schedule:
    """Current stage of a run.

    Attributes:
        final: vertices along the longest axis at the end. degree: SH degree at the end.
        by_clock: whether time limits the run. stage: index of the stage.
        start_step: step at the stage's start, or at its later pruning.
        is_pruned: whether the pruning within the stage is done; True for the first stage, which has none.
    """

    final: int
    degree: int
    by_clock: bool
    stage: int = 0
    start_step: int = 0
    is_pruned: bool = True
    _stages: tuple[tuple[int, float], ...] = field(init=False)

    def __post_init__(self) -> None:
        self._stages = stages(self.final)

    @property
    def is_last(self) -> bool:
        """Whether this is the last stage."""
        return self.stage + 1 == len(self._stages)

    @property
    def resolution(self) -> int:
        """Vertices along the longest axis in this stage."""
        return self._stages[self.stage][0]

    @property
    def sh_degree(self) -> int:
        """SH degree in this stage; at most 1 in the first, whose grid is dense."""
        return min(self.degree, 1) if self.stage == 0 else self.degree

    def is_over(self, done: float, step: int) -> bool:
        """Whether the next stage is due at this progress and step."""
        if self.is_last or done < self._stages[self.stage + 1][1]:
            return False
        return self._has_enough_steps(step)

    def _has_enough_steps(self, step: int) -> bool:
        """Whether the stage has enough steps: by the clock, a slow machine could prune an untrained grid."""
        least = max(MIN_STAGE_STEPS, MIN_STAGE_STEPS_PER_SQUARE * self.resolution**2)
        return not self.by_clock or step - self.start_step >= least

    def is_pruning_due(self, done: float, step: int) -> bool:
        """Whether the pruning within this stage is due at this progress and step."""
        start = self._stages[self.stage][1]
        end = 1.0 if self.is_last else self._stages[self.stage + 1][1]
        due = not self.is_pruned and done >= start + PRUNE_STAGE_SHARE * (end - start)
        return due and self._has_enough_steps(step)

    def prune(self, step: int) -> None:
        """Record the pruning within the stage at this step."""
        self.start_step, self.is_pruned = step, True

    def enter_next(self, step: int) -> None:
        """Start the next stage at this step."""
        self.stage, self.start_step, self.is_pruned = self.stage + 1, step, False
