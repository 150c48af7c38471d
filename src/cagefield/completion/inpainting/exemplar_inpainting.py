"""The pattern of a support goes on through a hole: every small patch there is like one that is known.

A membrane, and lines that go on, are as near as one comes to what nobody saw, and leave a soft spot amid a
pattern, which everybody sees. So from coarse to fine, and some times over, each patch that touches the hole
finds the patch of what is known that is the most alike, and each column becomes the mean of what the patches
over it say, those that are alike and near the rim counting the most.

Source: Wexler, Shechtman and Irani, "Space-time completion of video" (2007), sections 3 and 4.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.linalg import eigh

from cagefield.completion.inpainting.coherence_transport import smoothed
from cagefield.typing import Array, Mask

HALF = 4
"""Half the width of a patch, columns of its level."""

LEVELS, ROUNDS = 4, (4, 5, 6, 8)
"""Levels, each half as fine as the one before it, and how often patches are looked for on each."""

SOME, ENOUGH = 4000, 100
"""Known patches that others are compared with, at most; from how many on there is a pattern."""

NARROW = 0.7
"""Standard deviation of a patch's weights over its half width: its middle counts the most."""

NUMBERS, LEARNT = 24, 2000
"""Numbers that a patch is compared by, and patches that they are found from (principal components)."""

INWARDS, DEEPEST = 1.3, 12.0
"""How much less a patch counts for every column that it is farther from the rim, up to so many."""

ALIKE = 75.0
"""Percentile of the differences of patches from what they are most alike, at which they count less."""

FITS, STRANGE = 0.3, 1.0
"""How far a patch at the rim is from what is most alike, over how far known patches are from their mean.

Up to the first the pattern goes on there, from the second on what it begins as stays.
"""

MOST, AT_ONCE = 20_000, 512
"""Patches of which each column has one of its own; of more, those some columns apart, at most HALF. And those
that are compared at a time."""


@dataclass(frozen=True, eq=False)
class _Level:
    """What `patterned` is given, on columns [U,V] of a width."""

    sought: Mask
    given: Mask
    colours: Array
    start: Array
    firm: Array

    def coarser(self) -> _Level:
        """The same with columns twice as wide."""
        # What is half firm is so on every level; its colours are smooth enough.
        colours = np.where(self.given[..., None], smoothed(self.colours, self.given), self.colours)
        return _Level(
            self.sought[::2, ::2],
            self.given[::2, ::2],
            colours[::2, ::2],
            smoothed(self.start, np.ones_like(self.given))[::2, ::2],
            self.firm[::2, ::2],
        )

    def with_own(self, picture: Array) -> Array:
        """A picture [U,V,C] of the sought columns, with the colours that are known."""
        own = np.where(self.given, 1.0, np.where(self.sought, self.firm, 0.0))[..., None]
        return np.asarray(picture + own * (self.colours - picture))


def patterned(
    sought: Mask, given: Mask, colours: Array, start: Array, firm: Array, *, seed: int = 0
) -> Array:
    """Colours [U,V,C] of the sought columns [U,V], by the pattern of the given ones [U,V].

    colours [U,V,C]: the given columns', and those of sought ones that are `firm` [U,V], from 0 to 1, to which
    the pattern fits; start [U,V,C]: what the sought ones are without a pattern, and stay where too few
    patches are given.
    """
    levels = [_Level(sought & ~given, given, colours, start, firm)]
    while len(levels) < LEVELS and min(given.shape) >> len(levels) > 2 * HALF:
        levels.append(levels[-1].coarser())
    chance = np.random.default_rng(seed)
    found = levels[-1].start
    for number, level in reversed([*enumerate(levels)]):
        begun = found if number == len(levels) - 1 else _finer(found, level.given.shape)
        found, fits = _completed(level, begun, ROUNDS[number], chance)
    return np.asarray(start + fits[..., None] * (found - start))


def _completed(level: _Level, begun: Array, rounds: int, chance: np.random.Generator) -> tuple[Array, Array]:
    """(the picture [U,V,C] that was begun, with a pattern where it is sought, how well that fits [U,V]).

    As it starts, where too little of a pattern is known.
    """
    width = np.ones((2 * HALF + 1,) * 2, bool)
    known = np.argwhere(ndimage.binary_erosion(level.given, width))
    at = np.argwhere(ndimage.binary_dilation(level.sought, width) & (level.given | level.sought))
    if len(known) < ENOUGH or not len(at):
        return level.start, np.zeros(level.given.shape)
    if len(known) > SOME:
        known = known[chance.choice(len(known), SOME, replace=False)]
    apart = min(HALF, int(np.ceil(np.sqrt(len(at) / MOST))))
    at = at[(at % apart == 0).all(axis=1)]
    begun = np.where(level.sought[..., None], begun, level.start)
    sources = _patches(_widened(level.with_own(begun)), known)
    compared = _Numbers.of(sources)
    theirs = compared(sources)
    away = np.minimum(ndimage.distance_transform_edt(level.sought), DEEPEST)
    sure = INWARDS ** -away[tuple(at.T)]
    for _ in range(rounds):
        nearest, strange = _nearest(level.with_own(begun), at, compared, theirs)
        usual = max(float(np.percentile(strange, ALIKE)), 1e-12)
        votes, total = _voted(at, sources, nearest, sure * np.exp(-0.5 * strange / usual), begun.shape)
        begun = np.where((level.sought & (total > 0.0))[..., None], votes, begun)
    return begun, _fits(level, at, strange / max(float((theirs**2).sum(axis=1).mean()), 1e-12))


def _fits(level: _Level, at: NDArray[np.int64], strange: Array) -> Array:
    """How well [U,V] a pattern fits to what is given, by how strange [N] patches around columns [N,2] are."""
    rim = level.given[tuple(at.T)]
    unknown, fits = np.ones(level.given.shape, bool), np.zeros(level.given.shape)
    unknown[tuple(at[rim].T)] = False
    fits[tuple(at[rim].T)] = np.clip((STRANGE - strange[rim]) / (STRANGE - FITS), 0.0, 1.0)
    if not unknown.all():
        nearest = ndimage.distance_transform_edt(unknown, return_distances=False, return_indices=True)
        fits = ndimage.gaussian_filter(fits[tuple(nearest)], HALF)
    return fits


@dataclass(frozen=True, eq=False)
class _Numbers:
    """What patches [N,K,C] are compared by: the components [K*C,D] in which they differ the most."""

    mean: Array
    components: Array

    @classmethod
    def of(cls, patches: Array) -> _Numbers:
        rows = _weighted(patches[:LEARNT])
        mean = rows.mean(axis=0)
        last = rows.shape[1] - 1
        spread = (rows - mean).T @ (rows - mean)
        return cls(mean, eigh(spread, subset_by_index=(max(0, last - NUMBERS + 1), last))[1])

    def __call__(self, patches: Array) -> Array:
        """[N,D] of patches [N,K,C]."""
        return np.asarray((_weighted(patches) - self.mean) @ self.components)


def _finer(values: Array, shape: tuple[int, ...]) -> Array:
    """Values [U,V,C] for columns half as wide, [*shape,C]."""
    at = np.meshgrid(*(0.5 * np.arange(size) for size in shape[:2]), indexing="ij")
    channels = [
        ndimage.map_coordinates(values[..., c], at, order=1, mode="nearest") for c in range(values.shape[-1])
    ]
    return np.stack(channels, axis=-1)


@functools.cache
def _window() -> tuple[NDArray[np.int64], Array]:
    """(where the columns of a patch [K,2] are from its middle, their weights [K])."""
    steps = np.arange(-HALF, HALF + 1)
    away = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    return away, np.exp(-0.5 * (away**2).sum(axis=1) / (NARROW * HALF) ** 2)


def _widened(picture: Array) -> Array:
    """A picture [U,V,C] whose edge goes on for half a patch."""
    return np.pad(picture, ((HALF, HALF), (HALF, HALF), (0, 0)), mode="edge")


def _patches(wide: Array, at: NDArray[np.int64]) -> Array:
    """The patches [N,K,C] around columns [N,2] of a picture that was widened."""
    rows = at[:, None] + _window()[0] + HALF
    return np.asarray(wide[rows[..., 0], rows[..., 1]])


def _weighted(patches: Array) -> Array:
    """Rows [N,K*C] whose distances are those of patches [N,K,C] with their weights."""
    return np.asarray((patches * np.sqrt(_window()[1])[:, None]).reshape(len(patches), -1))


def _nearest(
    picture: Array, at: NDArray[np.int64], compared: _Numbers, those: Array
) -> tuple[NDArray[np.int64], Array]:
    """(which numbers [M,D] are the nearest to those of a picture's patches [N], how far they are)."""
    rows, apart = np.zeros(len(at), np.int64), np.zeros(len(at))
    length, wide = (those**2).sum(axis=1), _widened(picture)
    for first in range(0, len(at), AT_ONCE):
        each = slice(first, first + AT_ONCE)
        these = compared(_patches(wide, at[each]))
        far = length - 2.0 * these @ those.T
        rows[each] = far.argmin(axis=1)
        apart[each] = far[np.arange(len(far)), rows[each]] + (these**2).sum(axis=1)
    return rows, np.maximum(apart, 0.0)


def _voted(
    at: NDArray[np.int64],
    sources: Array,
    nearest: NDArray[np.int64],
    weight: Array,
    shape: tuple[int, ...],
) -> tuple[Array, Array]:
    """(means [U,V,C] of what patches [M,K,C] say, sums of their weights [U,V]).

    Those that are the nearest [N] say it `at` columns [N,2], each with a weight [N].
    """
    away, share = _window()
    size = shape[0] * shape[1]
    sums, total = np.zeros((size, shape[2])), np.zeros(size)
    # As many at a time as are quick: their patches are copied.
    for first in range(0, len(at), 8 * AT_ONCE):
        each = slice(first, first + 8 * AT_ONCE)
        rows = at[each, None] + away
        inside = ((rows >= 0) & (rows < shape[:2])).all(axis=2)
        cell = np.ravel_multi_index(tuple(np.moveaxis(rows[inside], -1, 0)), shape[:2])
        weights = (weight[each, None] * share)[inside]
        said = sources[nearest[each]][inside]
        total += np.bincount(cell, weights, size)
        for channel in range(shape[2]):
            sums[:, channel] += np.bincount(cell, weights * said[:, channel], size)
    return (sums / np.maximum(total, 1e-300)[:, None]).reshape(shape), total.reshape(shape[:2])
