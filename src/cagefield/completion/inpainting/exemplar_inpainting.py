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

from cagefield.completion.inpainting.coherence_transport import smooth_columns
from cagefield.typing import Array, Mask

PATCH_HALF_WIDTH = 4
"""Half the width of a patch, columns of its level."""

MAX_LEVELS = 4
"""Maximum number of pyramid levels, each of half the resolution of the one before."""

ROUNDS_PER_LEVEL = (4, 5, 6, 8)
"""Rounds of search and blend on each level, finest first."""

MAX_KNOWN_PATCHES = 4000
"""Maximum number of known patches that are searched."""

MIN_KNOWN_PATCHES = 100
"""Minimum number of known patches for a texture."""

WEIGHT_DEVIATION_SHARE = 0.7
"""Standard deviation of a patch's weights over its half width: its middle counts the most."""

MAX_COMPONENTS = 24
"""Maximum number of principal components by which patches are compared."""

MAX_PCA_PATCHES = 2000
"""Maximum number of patches from which the principal components are computed."""

WEIGHT_DECAY_PER_COLUMN = 1.3
"""Factor by which a patch's weight falls with every column of distance from the rim."""

MAX_DECAY_COLUMNS = 12.0
"""Distance from the rim, columns, beyond which the weight stays."""

DIFFERENCE_PERCENTILE = 75.0
"""Percentile of the differences of patches from what they are most alike, at which they count less."""

GOOD_FIT_DIFFERENCE = 0.3
"""Difference of a patch at the rim from its match, relative to the variance of the known patches, up to
which the texture is used in full."""

BAD_FIT_DIFFERENCE = 1.0
"""Such a difference from which on the initial colors stay."""

MAX_DENSE_PATCHES = 20_000
"""Maximum number of patches with a stride of one column; larger holes get a larger stride, at most
PATCH_HALF_WIDTH."""

PATCHES_PER_BATCH = 512
"""Number of patches that are compared at a time."""


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
        colours = np.where(self.given[..., None], smooth_columns(self.colours, self.given), self.colours)
        return _Level(
            self.sought[::2, ::2],
            self.given[::2, ::2],
            colours[::2, ::2],
            smooth_columns(self.start, np.ones_like(self.given))[::2, ::2],
            self.firm[::2, ::2],
        )

    def with_own(self, picture: Array) -> Array:
        """A picture [U,V,C] of the sought columns, with the colours that are known."""
        own = np.where(self.given, 1.0, np.where(self.sought, self.firm, 0.0))[..., None]
        return np.asarray(picture + own * (self.colours - picture))


def inpaint_texture(
    sought: Mask, given: Mask, colours: Array, start: Array, firm: Array, *, seed: int = 0
) -> Array:
    """Colours [U,V,C] of the sought columns [U,V], by the pattern of the given ones [U,V].

    colours [U,V,C]: the given columns', and those of sought ones that are `firm` [U,V], from 0 to 1, to which
    the pattern fits; start [U,V,C]: what the sought ones are without a pattern, and stay where too few
    patches are given.
    """
    levels = [_Level(sought & ~given, given, colours, start, firm)]
    while len(levels) < MAX_LEVELS and min(given.shape) >> len(levels) > 2 * PATCH_HALF_WIDTH:
        levels.append(levels[-1].coarser())
    chance = np.random.default_rng(seed)
    found = levels[-1].start
    for number, level in reversed([*enumerate(levels)]):
        begun = found if number == len(levels) - 1 else _upsample(found, level.given.shape)
        found, fits = _complete_level(level, begun, ROUNDS_PER_LEVEL[number], chance)
    return np.asarray(start + fits[..., None] * (found - start))


def _complete_level(
    level: _Level, begun: Array, rounds: int, chance: np.random.Generator
) -> tuple[Array, Array]:
    """(the picture [U,V,C] that was begun, with a pattern where it is sought, how well that fits [U,V]).

    As it starts, where too little of a pattern is known.
    """
    width = np.ones((2 * PATCH_HALF_WIDTH + 1,) * 2, bool)
    known = np.argwhere(ndimage.binary_erosion(level.given, width))
    at = np.argwhere(ndimage.binary_dilation(level.sought, width) & (level.given | level.sought))
    if len(known) < MIN_KNOWN_PATCHES or not len(at):
        return level.start, np.zeros(level.given.shape)
    if len(known) > MAX_KNOWN_PATCHES:
        known = known[chance.choice(len(known), MAX_KNOWN_PATCHES, replace=False)]
    apart = min(PATCH_HALF_WIDTH, int(np.ceil(np.sqrt(len(at) / MAX_DENSE_PATCHES))))
    at = at[(at % apart == 0).all(axis=1)]
    begun = np.where(level.sought[..., None], begun, level.start)
    sources = _extract_patches(_pad_edges(level.with_own(begun)), known)
    compared = _PatchDescriptor.of(sources)
    theirs = compared(sources)
    away = np.minimum(ndimage.distance_transform_edt(level.sought), MAX_DECAY_COLUMNS)
    sure = WEIGHT_DECAY_PER_COLUMN ** -away[tuple(at.T)]
    for _ in range(rounds):
        nearest, strange = _match_patches(level.with_own(begun), at, compared, theirs)
        usual = max(float(np.percentile(strange, DIFFERENCE_PERCENTILE)), 1e-12)
        votes, total = _blend_patches(
            at, sources, nearest, sure * np.exp(-0.5 * strange / usual), begun.shape
        )
        begun = np.where((level.sought & (total > 0.0))[..., None], votes, begun)
    return begun, _texture_weight(level, at, strange / max(float((theirs**2).sum(axis=1).mean()), 1e-12))


def _texture_weight(level: _Level, at: NDArray[np.int64], strange: Array) -> Array:
    """How well [U,V] a pattern fits to what is given, by how strange [N] patches around columns [N,2] are."""
    rim = level.given[tuple(at.T)]
    unknown, fits = np.ones(level.given.shape, bool), np.zeros(level.given.shape)
    unknown[tuple(at[rim].T)] = False
    fits[tuple(at[rim].T)] = np.clip(
        (BAD_FIT_DIFFERENCE - strange[rim]) / (BAD_FIT_DIFFERENCE - GOOD_FIT_DIFFERENCE), 0.0, 1.0
    )
    if not unknown.all():
        nearest = ndimage.distance_transform_edt(unknown, return_distances=False, return_indices=True)
        fits = ndimage.gaussian_filter(fits[tuple(nearest)], PATCH_HALF_WIDTH)
    return fits


@dataclass(frozen=True, eq=False)
class _PatchDescriptor:
    """What patches [N,K,C] are compared by: the components [K*C,D] in which they differ the most."""

    mean: Array
    components: Array

    @classmethod
    def of(cls, patches: Array) -> _PatchDescriptor:
        rows = _weight_patches(patches[:MAX_PCA_PATCHES])
        mean = rows.mean(axis=0)
        last = rows.shape[1] - 1
        spread = (rows - mean).T @ (rows - mean)
        return cls(mean, eigh(spread, subset_by_index=(max(0, last - MAX_COMPONENTS + 1), last))[1])

    def __call__(self, patches: Array) -> Array:
        """[N,D] of patches [N,K,C]."""
        return np.asarray((_weight_patches(patches) - self.mean) @ self.components)


def _upsample(values: Array, shape: tuple[int, ...]) -> Array:
    """Values [U,V,C] for columns half as wide, [*shape,C]."""
    at = np.meshgrid(*(0.5 * np.arange(size) for size in shape[:2]), indexing="ij")
    channels = [
        ndimage.map_coordinates(values[..., c], at, order=1, mode="nearest") for c in range(values.shape[-1])
    ]
    return np.stack(channels, axis=-1)


@functools.cache
def _window() -> tuple[NDArray[np.int64], Array]:
    """(where the columns of a patch [K,2] are from its middle, their weights [K])."""
    steps = np.arange(-PATCH_HALF_WIDTH, PATCH_HALF_WIDTH + 1)
    away = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    return away, np.exp(-0.5 * (away**2).sum(axis=1) / (WEIGHT_DEVIATION_SHARE * PATCH_HALF_WIDTH) ** 2)


def _pad_edges(picture: Array) -> Array:
    """A picture [U,V,C] whose edge goes on for half a patch."""
    return np.pad(
        picture,
        ((PATCH_HALF_WIDTH, PATCH_HALF_WIDTH), (PATCH_HALF_WIDTH, PATCH_HALF_WIDTH), (0, 0)),
        mode="edge",
    )


def _extract_patches(wide: Array, at: NDArray[np.int64]) -> Array:
    """The patches [N,K,C] around columns [N,2] of a picture that was widened."""
    rows = at[:, None] + _window()[0] + PATCH_HALF_WIDTH
    return np.asarray(wide[rows[..., 0], rows[..., 1]])


def _weight_patches(patches: Array) -> Array:
    """Rows [N,K*C] whose distances are those of patches [N,K,C] with their weights."""
    return np.asarray((patches * np.sqrt(_window()[1])[:, None]).reshape(len(patches), -1))


def _match_patches(
    picture: Array, at: NDArray[np.int64], compared: _PatchDescriptor, those: Array
) -> tuple[NDArray[np.int64], Array]:
    """(which numbers [M,D] are the nearest to those of a picture's patches [N], how far they are)."""
    rows, apart = np.zeros(len(at), np.int64), np.zeros(len(at))
    length, wide = (those**2).sum(axis=1), _pad_edges(picture)
    for first in range(0, len(at), PATCHES_PER_BATCH):
        each = slice(first, first + PATCHES_PER_BATCH)
        these = compared(_extract_patches(wide, at[each]))
        far = length - 2.0 * these @ those.T
        rows[each] = far.argmin(axis=1)
        apart[each] = far[np.arange(len(far)), rows[each]] + (these**2).sum(axis=1)
    return rows, np.maximum(apart, 0.0)


def _blend_patches(
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
    for first in range(0, len(at), 8 * PATCHES_PER_BATCH):
        each = slice(first, first + 8 * PATCHES_PER_BATCH)
        rows = at[each, None] + away
        inside = ((rows >= 0) & (rows < shape[:2])).all(axis=2)
        cell = np.ravel_multi_index(tuple(np.moveaxis(rows[inside], -1, 0)), shape[:2])
        weights = (weight[each, None] * share)[inside]
        said = sources[nearest[each]][inside]
        total += np.bincount(cell, weights, size)
        for channel in range(shape[2]):
            sums[:, channel] += np.bincount(cell, weights * said[:, channel], size)
    return (sums / np.maximum(total, 1e-300)[:, None]).reshape(shape), total.reshape(shape[:2])
