"""Density and color of splats at points, consistent with the opacity of a splat image along every ray.

Notation: splat n has the mean m, the covariance C = R diag(s^2) R^T, the opacity o and the Gaussian
G(p) = exp(-(p - m)^T C^-1 (p - m) / 2). Along a ray with direction d, G falls off as a normal distribution of
standard deviation s_d = (d^T C^-1 d)^(-1/2) from its largest value g on the ray. A splat image has the
opacity o g on that ray (EWA splatting: exact for parallel rays; for a perspective camera the error is small
for splats that are small relative to their distance).

The density follows from this opacity on every ray: with -ln(1 - o g) = sum_k (o g)^k / k
and the integral of G^k along the ray, g^k sqrt(2 pi / k) s_d,

    sigma_n(p, d) = Li_1/2(o G(p)) / (sqrt(2 pi) s_d),    Li_1/2(z) = sum_k z^k / sqrt(k)

has the integral sum_k (o g)^k / k, hence 1 - exp(-integral of sigma_n) = o g: for all opacities below 1, all
shapes, all directions and at any distance from the mean. (A density proportional to G itself is
correct only at the mean, and too wide around it: by half at o = .9.) Densities of several splats add up, as
their transmittances multiply, in any order. The color at a point is the density-weighted mean of the splats'
colors.

For grids, which sample and interpolate, `grid_sigma` differs in two ways. Li_1/2 has a sharp peak where o is
near 1; along the thinnest axis, with u the position on it in units of its scale, the profile is normal
instead, with the same integral,

    sigma_n(p) = -ln(1 - o g) exp(-u^2 / 2) / (sqrt(2 pi) s_d),    g = G(p) exp(u^2 / 2),

whose samples at a distance of 2 scales sum up to that integral within 2 %. Second, it does not depend on the
direction: 1 / s_d is replaced by its root mean square over directions, sqrt((1/s_1^2 + 1/s_2^2 + 1/s_3^2) /
3). On a layer of flat splats this is .58 of the value along the normal. There the opacity of a ray does not
depend on its angle, but in a grid it grows as 1 / cos: half is right on average over visible directions.

A splat contributes where o G is at least `MIN_RAY_OPACITY`; its opacity is at most `MAX_OPACITY`, as in
images.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.parallel_parts import map_parts
from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.typing import Float32

MAX_OPACITY = 0.99
"""Maximum opacity of a splat, as in images; an opaque splat has no finite density."""

MIN_RAY_OPACITY = 1e-3
"""Minimum opacity of a splat on a ray; smaller contributions are left out."""

MIN_CELL_SHARE = 2.0**-20
"""Minimum cell size, relative to the extent of all splats; it bounds cell coordinates."""

SPLATS_PER_PART = 1 << 13
"""Number of splats that a thread packs at a time."""

BLOCK_POINTS = 1 << 13
"""Number of points that a thread evaluates at a time."""


@dataclass(frozen=True, eq=False)
class PackedSplats:
    """Visible splats [N] as kernels take them (`cagefield.fields.kernels.splat_mixture`).

    visible [N]: their rows in the field; rows [N,14]; layers [N,4]: the thinnest axis over its scale, and
    1 / (sqrt(2 pi) s_d); half [N,3]: half extents of the boxes around their ends, world units.
    """

    visible: NDArray[np.int64]
    rows: Float32
    layers: Float32
    half: NDArray[np.float64]

    @classmethod
    def from_arrays(
        cls, means: Float32, log_scales: Float32, quaternions: Float32, opacities: Float32
    ) -> PackedSplats:
        """Packed splats from the arrays of a `SplatField`."""
        from cagefield.fields.kernels.splat_mixture import PACKED_FLOATS

        visible = np.flatnonzero(opacities > MIN_RAY_OPACITY)
        rows = np.empty((len(visible), PACKED_FLOATS), np.float32)
        layers, half = np.empty((len(visible), 4), np.float32), np.empty((len(visible), 3))

        def pack(part: slice) -> None:
            splats = visible[part]
            opacity = np.minimum(opacities[splats].astype(np.float64), MAX_OPACITY)
            scales = np.exp(log_scales[splats].astype(np.float64))
            rotations = rotation_matrices(quaternions[splats].astype(np.float64))
            end = 2.0 * np.log(opacity / MIN_RAY_OPACITY)
            half[part] = np.sqrt(end[:, None] * np.einsum("nij,nj->ni", rotations**2, scales**2))
            axes = (rotations.transpose(0, 2, 1) / scales[:, :, None]).astype(np.float32)
            rows[part, :9] = axes.reshape(-1, 9)
            rows[part, 9:12] = means[splats]
            rows[part, 12] = -np.log(opacity)
            rows[part, 13] = end
            layers[part, :3] = axes[np.arange(len(splats)), np.argmin(scales, axis=1)]
            layers[part, 3] = np.sqrt((scales**-2.0).mean(axis=1) / (2.0 * np.pi))

        map_parts(pack, len(visible), SPLATS_PER_PART)
        return cls(visible, rows, layers, half)


@dataclass(frozen=True, eq=False)
class SplatMixture:
    """Splats of a field in a hash table of cells, level by level: large splats in large cells.

    A splat whose box has the largest half extent r is in all the cells of size 2^l in [r, 2r) that it
    overlaps, 27 at most. A query looks into one cell per level. `packed`, `layers` (as in `PackedSplats`)
    and `harmonics` have a row per visible splat; `cells` are the arrays of the table, as in
    `cagefield.fields.kernels.splat_mixture`.
    """

    packed: Float32
    layers: Float32
    harmonics: Float32
    cells: tuple[NDArray[Any], ...]

    @classmethod
    def build(
        cls, means: Float32, log_scales: Float32, quaternions: Float32, opacities: Float32, sh: Float32
    ) -> SplatMixture:
        """Mixture of splats, from the arrays of a `SplatField`."""
        from cagefield.fields.kernels import splat_mixture as kernels

        splats = PackedSplats.from_arrays(means, log_scales, quaternions, opacities)
        visible, packed, layers, half = splats.visible, splats.rows, splats.layers, splats.half
        largest = np.maximum(half.max(axis=1), MIN_CELL_SHARE * _extent(means[visible]))
        exponents, levels = np.unique(np.ceil(np.log2(largest)), return_inverse=True)
        sizes = np.exp2(exponents)
        # Sort for locality: neighbors in space are neighbors in memory.
        order = np.lexsort((*np.floor(means[visible] / sizes[levels][:, None]).T, levels))
        packed, half, levels = packed[order], half[order], levels[order]

        no_output = np.empty(0, np.int64), np.empty(0, np.int32)
        count = kernels.overlapped_cells(packed, half, levels, sizes, *no_output)
        keys, ids = np.empty(count, np.int64), np.empty(count, np.int32)
        kernels.overlapped_cells(packed, half, levels, sizes, keys, ids)
        by_key = np.argsort(keys, kind="stable")
        cells, first, counts = np.unique(keys[by_key], return_index=True, return_counts=True)
        table = np.full(1 << (2 * len(cells) + 1).bit_length(), kernels.FREE_SLOT, np.int64)
        starts, ends = np.zeros(len(table), np.int64), np.zeros(len(table), np.int64)
        slots = kernels.fill_table(cells, table)
        starts[slots], ends[slots] = first, first + counts
        return cls(
            packed,
            layers[order],
            np.ascontiguousarray(sh[visible[order]]),
            (sizes, table, starts, ends, ids[by_key]),
        )

    def grid_sigma(self, positions: NDArray[Any]) -> Float32:
        """Density [N] for grids at positions [N,3], per world unit."""
        from cagefield.fields.kernels import splat_mixture as kernels

        points = _as_points(positions, "positions")
        sigma = np.empty(len(points), np.float32)

        def evaluate_rows(rows: slice) -> None:
            kernels.densities(self.packed, self.layers, *self.cells, points[rows], sigma[rows])

        _run_in_blocks(len(points), evaluate_rows)
        return sigma

    def evaluate(self, positions: NDArray[Any], viewdirs: NDArray[Any]) -> tuple[Float32, Float32]:
        """(sigma [N,K], rgb [N,K,3]) at positions [N,3] along unit viewdirs [N,K,3].

        Colors have no upper limit, as in images before clipping.
        """
        from cagefield.fields.kernels import splat_mixture as kernels

        points, directions = _as_points(positions, "positions"), np.ascontiguousarray(viewdirs, np.float32)
        if directions.ndim != 3 or directions.shape[0] != len(points) or directions.shape[2] != 3:
            raise FieldError(f"viewdirs must be [{len(points)}, K, 3], got {list(directions.shape)}")
        views = directions.shape[1]
        sigma = np.empty((len(points), views), np.float32)
        rgb = np.empty((len(points), views, 3), np.float32)
        degree = int(np.sqrt(self.harmonics.shape[1])) - 1

        def evaluate_rows(rows: slice) -> None:
            basis = spherical_harmonics.sh_basis(directions[rows].reshape(-1, 3), degree).astype(np.float32)
            basis = basis.reshape(-1, views, basis.shape[1])
            kernels.colors(
                self.packed,
                self.harmonics,
                *self.cells,
                points[rows],
                directions[rows],
                basis,
                sigma[rows],
                rgb[rows],
            )

        _run_in_blocks(len(points), evaluate_rows)
        return sigma, rgb


def _extent(means: Float32) -> float:
    """Largest edge of the bounding box of all means."""
    return float((means.max(axis=0) - means.min(axis=0)).max()) if len(means) else 0.0


def _as_points(values: NDArray[Any], name: str) -> Float32:
    points = np.ascontiguousarray(values, np.float32)
    if points.ndim != 2 or points.shape[1] != 3:
        raise FieldError(f"{name} must be [N,3], got {list(points.shape)}")
    return points


def _run_in_blocks(count: int, evaluate_rows: Callable[[slice], None]) -> None:
    """Evaluate `count` rows in blocks, on all processors; kernels release the GIL."""
    if count:
        map_parts(evaluate_rows, count, BLOCK_POINTS)
