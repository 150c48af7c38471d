"""Exemplar-based inpainting of a support's texture.

A membrane, and transported lines, leave a smooth spot in a texture. Coarse to fine, over several rounds,
each patch that overlaps the hole is matched to its most similar known patch; each column becomes the
weighted mean of the patches that cover it. Weights grow with similarity and towards the rim.

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
from cagefield.compute.cancellation import check_cancelled
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
"""Standard deviation of the weights in a patch, as a share of its half width."""

MAX_COMPONENTS = 24
"""Maximum number of principal components by which patches are compared."""

MAX_PCA_PATCHES = 2000
"""Maximum number of patches from which the principal components are computed."""

WEIGHT_DECAY_PER_COLUMN = 1.3
"""Factor by which a patch's weight falls with every column of distance from the rim."""

MAX_DECAY_COLUMNS = 12.0
"""Distance from the rim, columns, beyond which the weight stays."""

DIFFERENCE_PERCENTILE = 75.0
"""Percentile of the differences of patches from their matches that scales the weight of similarity."""

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
    """Input of `inpaint_texture` on one level of a pyramid.

    hole, given: masks [U,V]; colors, initial: [U,V,C]; confidence: [U,V] of stored colors in the hole.
    """

    hole: Mask
    given: Mask
    colors: Array
    initial: Array
    confidence: Array

    def coarser(self) -> _Level:
        """Level of half the resolution."""
        # Confidence is subsampled, not smoothed; the colors of uncertain columns are smooth already.
        colors = np.where(self.given[..., None], smooth_columns(self.colors, self.given), self.colors)
        return _Level(
            self.hole[::2, ::2],
            self.given[::2, ::2],
            colors[::2, ::2],
            smooth_columns(self.initial, np.ones_like(self.given))[::2, ::2],
            self.confidence[::2, ::2],
        )

    def with_known(self, image: Array) -> Array:
        """Image [U,V,C] with stored colors in the given columns, and by confidence in the hole."""
        weight = np.where(self.given, 1.0, np.where(self.hole, self.confidence, 0.0))[..., None]
        return np.asarray(image + weight * (self.colors - image))


def inpaint_texture(
    hole: Mask, given: Mask, colors: Array, initial: Array, confidence: Array, *, seed: int = 0
) -> Array:
    """Colors [U,V,C] of the hole columns [U,V], with the texture of the given columns [U,V].

    colors [U,V,C]: of the given columns, and of hole columns with a `confidence` [U,V] from 0 to 1, which
    the texture fits; initial [U,V,C]: colors of the hole without texture, which stay where too few patches
    are given.
    """
    levels = [_Level(hole & ~given, given, colors, initial, confidence)]
    while len(levels) < MAX_LEVELS and min(given.shape) >> len(levels) > 2 * PATCH_HALF_WIDTH:
        levels.append(levels[-1].coarser())
    rng = np.random.default_rng(seed)
    texture = levels[-1].initial
    for number, level in reversed([*enumerate(levels)]):
        guess = texture if number == len(levels) - 1 else _upsample(texture, level.given.shape)
        texture, weight = _complete_level(level, guess, ROUNDS_PER_LEVEL[number], rng)
    return np.asarray(initial + weight[..., None] * (texture - initial))


def _complete_level(
    level: _Level, estimate: Array, rounds: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """(image [U,V,C] with a texture in the hole, its weight [U,V] against the initial colors).

    The initial colors with weight 0 where fewer than MIN_KNOWN_PATCHES patches are given.
    """
    check_cancelled()
    width = np.ones((2 * PATCH_HALF_WIDTH + 1,) * 2, bool)
    known_columns = np.argwhere(ndimage.binary_erosion(level.given, width))
    columns = np.argwhere(ndimage.binary_dilation(level.hole, width) & (level.given | level.hole))
    if len(known_columns) < MIN_KNOWN_PATCHES or not len(columns):
        return level.initial, np.zeros(level.given.shape)
    if len(known_columns) > MAX_KNOWN_PATCHES:
        known_columns = known_columns[rng.choice(len(known_columns), MAX_KNOWN_PATCHES, replace=False)]
    stride = min(PATCH_HALF_WIDTH, int(np.ceil(np.sqrt(len(columns) / MAX_DENSE_PATCHES))))
    columns = columns[(columns % stride == 0).all(axis=1)]
    estimate = np.where(level.hole[..., None], estimate, level.initial)
    sources = _extract_patches(_pad_edges(level.with_known(estimate)), known_columns)
    descriptor = _PatchDescriptor.fit(sources)
    known_descriptors = descriptor(sources)
    depth = np.minimum(ndimage.distance_transform_edt(level.hole), MAX_DECAY_COLUMNS)
    rim_weight = WEIGHT_DECAY_PER_COLUMN ** -depth[tuple(columns.T)]
    for _ in range(rounds):
        nearest, difference = _match_patches(
            level.with_known(estimate), columns, descriptor, known_descriptors
        )
        scale = max(float(np.percentile(difference, DIFFERENCE_PERCENTILE)), 1e-12)
        blended, total = _blend_patches(
            columns, sources, nearest, rim_weight * np.exp(-0.5 * difference / scale), estimate.shape
        )
        estimate = np.where((level.hole & (total > 0.0))[..., None], blended, estimate)
    return estimate, _texture_weight(
        level, columns, difference / max(float((known_descriptors**2).sum(axis=1).mean()), 1e-12)
    )


def _texture_weight(level: _Level, columns: NDArray[np.int64], difference: Array) -> Array:
    """Weight [U,V] of the texture against the initial colors.

    difference [N]: relative difference of the patches around columns [N,2] from their matches.
    """
    check_cancelled()
    is_given = level.given[tuple(columns.T)]
    unknown, weight = np.ones(level.given.shape, bool), np.zeros(level.given.shape)
    unknown[tuple(columns[is_given].T)] = False
    weight[tuple(columns[is_given].T)] = np.clip(
        (BAD_FIT_DIFFERENCE - difference[is_given]) / (BAD_FIT_DIFFERENCE - GOOD_FIT_DIFFERENCE), 0.0, 1.0
    )
    if not unknown.all():
        nearest = ndimage.distance_transform_edt(unknown, return_distances=False, return_indices=True)
        weight = ndimage.gaussian_filter(weight[tuple(nearest)], PATCH_HALF_WIDTH)
    return weight


@dataclass(frozen=True, eq=False)
class _PatchDescriptor:
    """Principal components [K*C,D] of weighted patches [N,K,C], by which patches are compared."""

    mean: Array
    components: Array

    @classmethod
    def fit(cls, patches: Array) -> _PatchDescriptor:
        """Descriptor from the principal components of patches [N,K,C]."""
        rows = _weight_patches(patches[:MAX_PCA_PATCHES])
        mean = rows.mean(axis=0)
        last = rows.shape[1] - 1
        scatter = (rows - mean).T @ (rows - mean)
        return cls(mean, eigh(scatter, subset_by_index=(max(0, last - MAX_COMPONENTS + 1), last))[1])

    def __call__(self, patches: Array) -> Array:
        """Descriptors [N,D] of patches [N,K,C]."""
        return np.asarray((_weight_patches(patches) - self.mean) @ self.components)


def _upsample(values: Array, shape: tuple[int, ...]) -> Array:
    """Bilinear interpolation [*shape,C] of values [U,V,C] at twice the resolution."""
    positions = np.meshgrid(*(0.5 * np.arange(size) for size in shape[:2]), indexing="ij")
    channels = [
        ndimage.map_coordinates(values[..., c], positions, order=1, mode="nearest")
        for c in range(values.shape[-1])
    ]
    return np.stack(channels, axis=-1)


@functools.cache
def _window() -> tuple[NDArray[np.int64], Array]:
    """(offsets [K,2] of the columns of a patch from its center, their weights [K])."""
    steps = np.arange(-PATCH_HALF_WIDTH, PATCH_HALF_WIDTH + 1)
    offsets = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    return offsets, np.exp(-0.5 * (offsets**2).sum(axis=1) / (WEIGHT_DEVIATION_SHARE * PATCH_HALF_WIDTH) ** 2)


def _pad_edges(image: Array) -> Array:
    """Image [U,V,C] padded by half a patch with its edge values."""
    return np.pad(
        image,
        ((PATCH_HALF_WIDTH, PATCH_HALF_WIDTH), (PATCH_HALF_WIDTH, PATCH_HALF_WIDTH), (0, 0)),
        mode="edge",
    )


def _extract_patches(padded: Array, columns: NDArray[np.int64]) -> Array:
    """Patches [N,K,C] around columns [N,2] of a padded image."""
    rows = columns[:, None] + _window()[0] + PATCH_HALF_WIDTH
    return np.asarray(padded[rows[..., 0], rows[..., 1]])


def _weight_patches(patches: Array) -> Array:
    """Rows [N,K*C] whose distances are the weighted distances of patches [N,K,C]."""
    return np.asarray((patches * np.sqrt(_window()[1])[:, None]).reshape(len(patches), -1))


def _match_patches(
    image: Array, columns: NDArray[np.int64], descriptor: _PatchDescriptor, descriptors: Array
) -> tuple[NDArray[np.int64], Array]:
    """(nearest rows [N] of descriptors [M,D], squared distances [N]) of patches of an image.

    columns [N,2]: centers of the patches.
    """
    check_cancelled()
    rows, distance = np.zeros(len(columns), np.int64), np.zeros(len(columns))
    squared_norm, padded = (descriptors**2).sum(axis=1), _pad_edges(image)
    for first in range(0, len(columns), PATCHES_PER_BATCH):
        batch = slice(first, first + PATCHES_PER_BATCH)
        queries = descriptor(_extract_patches(padded, columns[batch]))
        partial_distance = squared_norm - 2.0 * queries @ descriptors.T
        rows[batch] = partial_distance.argmin(axis=1)
        distance[batch] = partial_distance[np.arange(len(partial_distance)), rows[batch]] + (queries**2).sum(
            axis=1
        )
    return rows, np.maximum(distance, 0.0)


def _blend_patches(
    columns: NDArray[np.int64],
    sources: Array,
    nearest: NDArray[np.int64],
    weight: Array,
    shape: tuple[int, ...],
) -> tuple[Array, Array]:
    """(weighted means [U,V,C] of overlapping patches, sums of weights [U,V]).

    Patch `nearest` [N] of patches [M,K,C] lies at columns [N,2] with a weight [N].
    """
    check_cancelled()
    offsets, window_weight = _window()
    size = shape[0] * shape[1]
    sums, total = np.zeros((size, shape[2])), np.zeros(size)
    # Batches, because indexing copies their patches.
    for first in range(0, len(columns), 8 * PATCHES_PER_BATCH):
        batch = slice(first, first + 8 * PATCHES_PER_BATCH)
        covered = columns[batch, None] + offsets
        is_inside = ((covered >= 0) & (covered < shape[:2])).all(axis=2)
        cell = np.ravel_multi_index(tuple(np.moveaxis(covered[is_inside], -1, 0)), shape[:2])
        weights = (weight[batch, None] * window_weight)[is_inside]
        values = sources[nearest[batch]][is_inside]
        total += np.bincount(cell, weights, size)
        for channel in range(shape[2]):
            sums[:, channel] += np.bincount(cell, weights * values[:, channel], size)
    return (sums / np.maximum(total, 1e-300)[:, None]).reshape(shape), total.reshape(shape[:2])
