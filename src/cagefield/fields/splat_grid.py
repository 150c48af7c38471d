"""Density and color of splats at all vertices of a regular grid.

Values are those of `SplatMixture.grid_sigma` and `SplatMixture.evaluate` (`cagefield.fields.splat_mixture`).
Each splat adds to the vertices within its end, in place of a search for the splats of each vertex: a grid
finer than the splats needs no index, and about a tenth of the time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cagefield.compute import devices
from cagefield.compute.cancellation import check_cancelled
from cagefield.compute.parallel_parts import map_parts
from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.fields.splat_mixture import PackedSplats
from cagefield.typing import Array, Float32, Mask

SLABS_PER_THREAD = 16
"""Slabs of a grid for each thread: some hold more splats, and a computation can be cancelled between them."""


@dataclass(frozen=True, eq=False)
class SplatGrid:
    """Splats over a grid of `count` [3] vertices, `edge` apart from `low` [3], world units."""

    splats: SplatField
    low: Array
    edge: float
    count: tuple[int, int, int]

    def covered(self, deviations: float) -> Mask:
        """Mask [X,Y,Z] of the vertices in the boxes around splats, up to so many standard deviations."""
        from cagefield.fields.kernels.splat_grid import mark_boxes

        packed, covered = self._packed, np.zeros(self.count, bool)
        half = deviations / np.sqrt(packed.rows[:, 13:14].astype(np.float64)) * packed.half

        def mark(first: int, end: int) -> None:
            mark_boxes(packed.rows, half, self.low, self.edge, first, covered[first:end])

        self._in_slabs(mark)
        return covered

    def density(self) -> Float32:
        """Density [X,Y,Z] per world unit, independent of the direction (`SplatMixture.grid_sigma`)."""
        from cagefield.fields.kernels.splat_grid import add_densities

        packed, sigma = self._packed, np.zeros(self.count)

        def add(first: int, end: int) -> None:
            add_densities(
                packed.rows, packed.layers, packed.half, self.low, self.edge, first, sigma[first:end]
            )

        self._in_slabs(add)
        return sigma.astype(np.float32)

    def colors(self, mask: Mask) -> Float32:
        """Colors [M,3] along +z at the vertices of a mask [X,Y,Z], by the splats' constant harmonics.

        They have no upper limit, as in images before clipping, and are 0 where no splat is.
        """
        from cagefield.fields.kernels.splat_grid import add_colors

        packed = self._packed
        vertices = np.flatnonzero(mask)
        row = np.full(self.count, -1, np.int32)
        row.reshape(-1)[vertices] = np.arange(len(vertices), dtype=np.int32)
        own = np.maximum(0.5 + C0 * self.splats.sh[packed.visible, 0].astype(np.float64), 0.0)
        weight, total = np.zeros(len(vertices)), np.zeros((len(vertices), 3))

        def add(first: int, end: int) -> None:
            add_colors(
                packed.rows, own, packed.half, self.low, self.edge, first, row[first:end], weight, total
            )

        self._in_slabs(add)
        return (total / np.where(weight > 0.0, weight, 1.0)[:, None]).astype(np.float32)

    @cached_property
    def _packed(self) -> PackedSplats:
        splats = self.splats
        return PackedSplats.from_arrays(splats.means, splats.log_scales, splats.quaternions, splats.opacities)

    def _in_slabs(self, add: Callable[[int, int], None]) -> None:
        """Calls `add` with the first and end vertex of slabs along x, by all threads."""
        check_cancelled()
        slab = -(-self.count[0] // (SLABS_PER_THREAD * devices.threads()))
        map_parts(lambda part: add(part.start, part.stop), self.count[0], slab)
