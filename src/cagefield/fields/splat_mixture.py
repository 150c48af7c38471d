"""Splats as a density and a colour at points: what a ray through them must integrate to, told exactly.

Notation: splat n has the mean m, the covariance C = R diag(s^2) R^T, the opacity o and the Gaussian
G(p) = exp(-(p - m)^T C^-1 (p - m) / 2). Along a ray with direction d, G falls off as a normal distribution of
standard deviation s_d = (d^T C^-1 d)^(-1/2) from its largest value g on the ray. A picture of splats takes
the opacity o g from that ray (EWA splatting: exact for parallel rays, and for a perspective camera as nearly
as a splat is small against its distance).

The density is the one whose integral along every ray is that opacity: with -ln(1 - o g) = sum_k (o g)^k / k
and the integral of G^k along the ray, g^k sqrt(2 pi / k) s_d,

    sigma_n(p, d) = Li_1/2(o G(p)) / (sqrt(2 pi) s_d),    Li_1/2(z) = sum_k z^k / sqrt(k)

has the integral sum_k (o g)^k / k, hence 1 - exp(-integral of sigma_n) = o g: for all opacities below 1, all
shapes, all directions and at any distance from the mean. (A density proportional to G itself would be right
at the mean alone, and too wide around it: by half at o = .9.) Densities of several splats add up, as their
transmittances multiply: a ray loses the same in both, whatever their order. The colour at a point is that of
the splats there, weighted by their densities.

For grids, which sample and interpolate, `grid_sigma` differs in two ways. Li_1/2 has a sharp peak where o is
near 1; along the thinnest axis, with u the position on it in units of its scale, the profile is normal
instead, with the same integral,

    sigma_n(p) = -ln(1 - o g) exp(-u^2 / 2) / (sqrt(2 pi) s_d),    g = G(p) exp(u^2 / 2),

whose samples a distance of 2 scales apart sum up to that integral within 2 %. And it depends on no direction:
1 / s_d is its root mean square over all, sqrt((1/s_1^2 + 1/s_2^2 + 1/s_3^2) / 3). On a layer of flat splats
that is .58 of what it is face on. There a ray at an angle loses as much as one that is face on, but in a grid
1 / cos as much: half is right on average over what is seen.

A splat counts where o G is at least `LEAST`; its opacity is at most `MAX_OPACITY`, as in pictures.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.typing import Float32

MAX_OPACITY = 0.99
"""Highest opacity of a splat, in pictures as here, where an opaque one would have no finite density."""

LEAST = 1e-3
"""Opacity on a ray that is left out, splat by splat."""

FINEST = 2.0**-20
"""Smallest cells against the extent of all splats: coordinates of cells stay small."""

BLOCK = 1 << 13
"""Points that a thread asks for at a time."""


@dataclass(frozen=True, eq=False)
class SplatMixture:
    """The splats of a field in a hash table of cells, level by level: large splats in large cells.

    A splat whose box has the largest half extent r is in all the cells of size 2^l in [r, 2r) that it
    overlaps, 27 at most. A point looks into one cell of each level. `packed`, `layers` (for `grid_sigma`: the
    thinnest axis over its scale, and 1 / (sqrt(2 pi) s_d)) and `harmonics` have a row for each splat that is
    seen; `cells` are the arrays of the table, as `cagefield.fields.kernels.splat_mixture` takes them.
    """

    packed: Float32
    layers: Float32
    harmonics: Float32
    cells: tuple[NDArray[Any], ...]

    @classmethod
    def of(
        cls, means: Float32, log_scales: Float32, quaternions: Float32, opacities: Float32, sh: Float32
    ) -> SplatMixture:
        """The mixture of splats; the arrays are those of a `SplatField`."""
        from cagefield.fields.kernels import splat_mixture as kernels

        seen = np.flatnonzero(opacities > LEAST)
        opacity = np.minimum(opacities[seen].astype(np.float64), MAX_OPACITY)
        scales = np.exp(log_scales[seen].astype(np.float64))
        rotations = rotation_matrices(quaternions[seen].astype(np.float64))
        end = 2.0 * np.log(opacity / LEAST)
        half = np.sqrt(end[:, None] * np.einsum("nij,nj->ni", rotations**2, scales**2))
        packed = np.empty((len(seen), kernels.PACKED), np.float32)
        packed[:, :9] = (rotations.transpose(0, 2, 1) / scales[:, :, None]).reshape(-1, 9)
        packed[:, 9:12] = means[seen]
        packed[:, 12] = -np.log(opacity)
        packed[:, 13] = end
        thinnest = np.argmin(scales, axis=1)
        layers = np.empty((len(seen), 4), np.float32)
        layers[:, :3] = packed[:, :9].reshape(-1, 3, 3)[np.arange(len(seen)), thinnest]
        layers[:, 3] = np.sqrt((scales**-2.0).mean(axis=1) / (2.0 * np.pi))
        largest = np.maximum(half.max(axis=1), FINEST * _extent(means[seen]))
        exponents, levels = np.unique(np.ceil(np.log2(largest)), return_inverse=True)
        sizes = np.exp2(exponents)
        # Neighbours in memory are neighbours in space.
        order = np.lexsort((*np.floor(means[seen] / sizes[levels][:, None]).T, levels))
        packed, half, levels = packed[order], half[order], levels[order]

        nothing = np.empty(0, np.int64), np.empty(0, np.int32)
        count = kernels.overlapped_cells(packed, half, levels, sizes, *nothing)
        keys, ids = np.empty(count, np.int64), np.empty(count, np.int32)
        kernels.overlapped_cells(packed, half, levels, sizes, keys, ids)
        by_key = np.argsort(keys, kind="stable")
        cells, first, counts = np.unique(keys[by_key], return_index=True, return_counts=True)
        table = np.full(1 << (2 * len(cells) + 1).bit_length(), kernels.EMPTY, np.int64)
        starts, ends = np.zeros(len(table), np.int64), np.zeros(len(table), np.int64)
        slots = kernels.fill_table(cells, table)
        starts[slots], ends[slots] = first, first + counts
        return cls(
            packed,
            layers[order],
            np.ascontiguousarray(sh[seen[order]]),
            (sizes, table, starts, ends, ids[by_key]),
        )

    def grid_sigma(self, positions: NDArray[Any]) -> Float32:
        """The density for grids [N] at positions [N,3], per world unit."""
        from cagefield.fields.kernels import splat_mixture as kernels

        points = _three(positions, "positions")
        sigma = np.empty(len(points), np.float32)

        def ask(rows: slice) -> None:
            kernels.densities(self.packed, self.layers, *self.cells, points[rows], sigma[rows])

        _in_blocks(len(points), ask)
        return sigma

    def along(self, positions: NDArray[Any], viewdirs: NDArray[Any]) -> tuple[Float32, Float32]:
        """(sigma [N,K], rgb [N,K,3]) at positions [N,3] seen along unit viewdirs [N,K,3].

        Colours have no upper limit, as in pictures before these are clipped.
        """
        from cagefield.fields.kernels import splat_mixture as kernels

        points, along = _three(positions, "positions"), np.ascontiguousarray(viewdirs, np.float32)
        if along.ndim != 3 or along.shape[0] != len(points) or along.shape[2] != 3:
            raise FieldError(f"viewdirs must be [{len(points)}, K, 3], got {list(along.shape)}")
        views = along.shape[1]
        sigma = np.empty((len(points), views), np.float32)
        rgb = np.empty((len(points), views, 3), np.float32)
        degree = int(np.sqrt(self.harmonics.shape[1])) - 1

        def ask(rows: slice) -> None:
            basis = spherical_harmonics.sh_basis(along[rows].reshape(-1, 3), degree).astype(np.float32)
            basis = basis.reshape(-1, views, basis.shape[1])
            kernels.colours(
                self.packed,
                self.harmonics,
                *self.cells,
                points[rows],
                along[rows],
                basis,
                sigma[rows],
                rgb[rows],
            )

        _in_blocks(len(points), ask)
        return sigma, rgb


def _extent(means: Float32) -> float:
    """The largest edge of the box of all means."""
    return float((means.max(axis=0) - means.min(axis=0)).max()) if len(means) else 0.0


def _three(values: NDArray[Any], name: str) -> Float32:
    points = np.ascontiguousarray(values, np.float32)
    if points.ndim != 2 or points.shape[1] != 3:
        raise FieldError(f"{name} must be [N,3], got {list(points.shape)}")
    return points


def _in_blocks(count: int, ask: Callable[[slice], None]) -> None:
    """Asks for `count` rows in blocks, on as many threads as there are processors; kernels hold no lock."""
    blocks = [slice(start, start + BLOCK) for start in range(0, count, BLOCK)]
    if len(blocks) < 2:
        for block in blocks:
            ask(block)
        return
    with ThreadPoolExecutor(min(len(blocks), os.cpu_count() or 1)) as pool:
        list(pool.map(ask, blocks))
