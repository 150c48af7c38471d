"""Smooth poses through those of keyframes, which stand still between two keyframes of one pose.

The eye follows a natural cubic spline and the direction a rotation spline, periodic in a loop. A pause, two
successive keyframes of one pose, divides them: the camera rests there, without the overshoot of a spline, and
the time within the segments beside it is eased, so that the velocity goes to zero and comes from it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation, RotationSpline

Floats = npt.NDArray[np.float64]


class _Span(NamedTuple):
    """Keyframes `first` to `last` that move, and whether the camera rests before and after them."""

    first: int
    last: int
    rests_before: bool
    rests_after: bool


class PoseSpline:
    """Poses c2w [N,4,4] at times, through those of K keyframes."""

    def __init__(self, poses: Sequence[Floats], times: Floats, *, loop: bool) -> None:
        """`poses` [K,4,4] at `times` [K], K >= 2, ascending; of a loop the last pose is the first."""
        matrices = np.stack(poses)
        if loop:
            # Three rounds, so that the seam is as smooth as the rest.
            round_poses, period = matrices[:-1], times[-1]
            matrices = np.concatenate([round_poses, round_poses, matrices])
            times = np.concatenate([times[:-1] - period, times[:-1], times + period])
        self._poses, self._times = matrices, times
        self._spans = _spans([_is_same(one, other) for one, other in pairwise(matrices)])
        is_periodic = loop and self._spans == [_Span(0, len(matrices) - 1, False, False)]
        self._splines = [self._spline(span, is_periodic) for span in self._spans]

    def __call__(self, times: Floats) -> Floats:
        """Poses c2w [N,4,4] at times [N]."""
        segments = np.clip(np.searchsorted(self._times, times, side="right") - 1, 0, len(self._times) - 2)
        poses = self._poses[segments].copy()
        for span, (eyes, rotations) in zip(self._spans, self._splines, strict=True):
            rows = np.flatnonzero((segments >= span.first) & (segments < span.last))
            if len(rows):
                at = self._eased(span, times[rows], segments[rows])
                poses[rows, :3, :3], poses[rows, :3, 3] = rotations(at).as_matrix(), eyes(at)
        return poses

    def _spline(self, span: _Span, is_periodic: bool) -> tuple[Callable[[Floats], Floats], RotationSpline]:
        """(spline of the eye, rotation spline) of a span."""
        from scipy.interpolate import CubicSpline

        rows = slice(span.first, span.last + 1)
        times, poses = self._times[rows], self._poses[rows]
        ends = "periodic" if is_periodic else "natural"
        eyes = CubicSpline(times, poses[:, :3, 3], bc_type=ends)
        return eyes, RotationSpline(times, Rotation.from_matrix(poses[:, :3, :3]))

    def _eased(self, span: _Span, times: Floats, segments: npt.NDArray[np.intp]) -> Floats:
        """Times [N] of a span's splines; in the segments beside a pause their rate goes to zero."""
        start, end = self._times[segments], self._times[segments + 1]
        u = (times - start) / (end - start)
        leaves = (segments == span.first) & span.rests_before
        arrives = (segments == span.last - 1) & span.rests_after
        eased = np.where(leaves, u * u * (2.0 - u), u)
        eased = np.where(arrives, 1.0 - (1.0 - u) ** 2 * (1.0 + u), eased)
        eased = np.where(leaves & arrives, u * u * (3.0 - 2.0 * u), eased)
        return np.asarray(np.where(leaves | arrives, start + eased * (end - start), times))


def _spans(rests: Sequence[bool]) -> list[_Span]:
    """Spans that move between pauses, from whether the camera rests in each segment."""
    spans: list[_Span] = []
    first = 0
    for segment, is_rest in enumerate([*rests, True]):
        if is_rest:
            if segment > first:
                spans.append(_Span(first, segment, first > 0, segment < len(rests)))
            first = segment + 1
    return spans


def _is_same(one: Floats, other: Floats) -> bool:
    """True for two poses between which the camera rests."""
    return np.allclose(one, other, rtol=1e-9, atol=1e-12)
