"""Voxel grid in training: device arrays that can be pruned, cropped and refined.

Notation as in `cagefield.rendering.voxels.device_grid`: slot 0 is the empty vertex; slots follow `vertices`
in brick order.
"""

# Device arrays are created here, so this module is imported by the trainer only, once a device runs.

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from cagefield.compute import devices
from cagefield.compute.device_buffers import to_device
from cagefield.compute.devices import ints
from cagefield.compute.quadrants import qd
from cagefield.fields.voxel_field import VoxelField
from cagefield.rendering.voxels import occupancy
from cagefield.rendering.voxels.device_grid import transform_of
from cagefield.rendering.voxels.kernels.grid import GridArgs
from cagefield.rendering.voxels.kernels.ray_grid import OccupancyArgs
from cagefield.rendering.voxels.layer_slots import brick_order
from cagefield.training.voxels.kernels.accumulators import GROUP_BITS, HEADER_FLOATS

VERTICES_PER_CHUNK, MAX_THREADS = 2**16, 8
"""Vertices per interpolation task, and maximum number of threads for these tasks."""

MAX_ACCUMULATOR_BYTES = 2 * 1024**3
"""Maximum memory of all accumulators together; a large grid gets fewer accumulators than threads."""


@dataclass(eq=False)
class GridState:
    """Trainable voxel grid.

    Attributes:
        bounds: [2,3] as in VoxelField. resolution: vertices per axis. vertices: [M] linear indices, by slot.
        contracted: as VoxelField. degree: SH degree.
        density, sh, state, weight, accumulator, met, index, codes: device arrays; see
            `kernels.march`, `kernels.gauss_newton_voxels` and `kernels.accumulators`.
        threads: number of CPU threads available. workers: number of accumulators, at most `threads`.
    """

    bounds: NDArray[np.float64]
    resolution: tuple[int, int, int]
    contracted: bool
    degree: int
    threads: int
    workers: int
    vertices: NDArray[np.int64]
    density: Any
    sh: Any
    state: Any
    weight: Any
    accumulator: Any
    met: Any
    index: Any
    codes: Any
    brick_dims: tuple[int, int, int]
    vertex_at: Any
    cell: Any

    @classmethod
    def build(
        cls,
        bounds: NDArray[np.float64],
        resolution: tuple[int, int, int],
        vertices: NDArray[np.int64],
        density: NDArray[np.float32],
        sh: NDArray[np.float32],
        state: NDArray[np.float32] | None = None,
        *,
        contracted: bool,
        threads: int,
    ) -> "GridState":
        """State from vertices (any order), density [M], sh [M,K,3] and running curvatures [M,2]."""
        order = brick_order(vertices, resolution)
        vertices = vertices[order]
        count, terms = len(vertices), sh.shape[1]
        # Each array is on the device before the next is copied: a large grid's take most of the memory.
        densities, colors = _slots(density, order), _slots(sh, order)
        curvatures = _slots(np.zeros((count, 2), np.float32) if state is None else state, order)
        index = np.zeros(int(np.prod(resolution)), np.int32)
        index[vertices] = np.arange(1, count + 1, dtype=np.int32)
        indices = to_device(index)
        full = np.zeros(resolution, bool)
        full.reshape(-1)[vertices] = True
        bricks = occupancy.of_vertices(full)
        del index, full
        record = 4 * (count + 1) * (HEADER_FLOATS + 3 * terms)
        workers = max(1, min(threads, MAX_ACCUMULATOR_BYTES // record))
        accumulator = qd.ndarray(qd.f32, (workers * (count + 1) * (HEADER_FLOATS + 3 * terms),))
        accumulator.fill(0.0)
        groups = (count >> group_bits()) + 1
        return cls(
            bounds=bounds,
            resolution=resolution,
            contracted=contracted,
            degree={1: 0, 4: 1, 9: 2}[terms],
            threads=threads,
            workers=workers,
            vertices=vertices,
            density=densities,
            sh=colors,
            state=curvatures,
            weight=to_device(np.zeros(count + 1, np.float32)),
            accumulator=accumulator,
            met=to_device(np.zeros(workers * groups, np.uint8)),
            index=indices,
            codes=to_device(bricks.codes),
            brick_dims=tuple(bricks.codes.shape),
            vertex_at=to_device(np.concatenate([np.zeros(1, np.int32), vertices.astype(np.int32)])),
            cell=to_device(
                np.concatenate([np.ones(1, np.float32), cell_sizes(bounds, resolution, vertices, contracted)])
            ),
        )

    @classmethod
    def dense(
        cls,
        bounds: NDArray[np.float64],
        resolution: tuple[int, int, int],
        *,
        opacity: float,
        degree: int,
        contracted: bool,
        threads: int,
        keep: NDArray[np.bool_] | None = None,
    ) -> "GridState":
        """Gray grid with every vertex (of `keep` [nx*ny*nz]) stored, of optical depth `opacity` per voxel."""
        vertices = np.arange(int(np.prod(resolution))) if keep is None else np.flatnonzero(keep)
        count = len(vertices)
        return cls.build(
            bounds,
            resolution,
            vertices,
            (opacity / cell_sizes(bounds, resolution, vertices, contracted)).astype(np.float32),
            np.zeros((count, (degree + 1) ** 2, 3), np.float32),
            contracted=contracted,
            threads=threads,
        )

    @property
    def args(self) -> GridArgs:
        """Kernel arguments of the grid."""
        transform = transform_of(self.bounds, self.resolution, self.contracted)
        return GridArgs(self.index, self.density, self.sh, ints(self.resolution), *transform)

    @property
    def bricks(self) -> OccupancyArgs:
        """Kernel arguments of the grid's occupancy bricks."""
        return OccupancyArgs(self.codes, ints((0, 0, 0)), ints(self.brick_dims))

    @property
    def terms(self) -> int:
        """Number of SH coefficients per channel."""
        return (self.degree + 1) ** 2

    @property
    def slots(self) -> int:
        """Number of slots, the empty one included."""
        return len(self.vertices) + 1

    @property
    def record(self) -> int:
        """Number of floats of one accumulator."""
        return self.slots * (HEADER_FLOATS + 3 * self.terms)

    @property
    def group_bits(self) -> int:
        """Binary logarithm of the number of consecutive slots that share a flag of an accumulator."""
        return group_bits()

    @property
    def groups(self) -> int:
        """Number of flags of one accumulator."""
        return ((self.slots - 1) >> group_bits()) + 1

    def arrays(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """(density [M], sh [M,K,3], running curvatures [M,2], maximum weight [M]) on the host, by slot."""
        return (
            self.density.to_numpy()[1:],
            self.sh.to_numpy().reshape(-1, self.terms, 3)[1:],
            self.state.to_numpy().reshape(-1, 2)[1:],
            self.weight.to_numpy()[1:],
        )

    def to_field(self) -> VoxelField:
        """VoxelField on the host, without vertices that have no density at or around them."""
        density, sh, _, _ = self.arrays()
        full = np.zeros(self.resolution, bool)
        full.reshape(-1)[self.vertices] = density > 0
        near = ndimage.binary_dilation(full, np.ones((3, 3, 3))).reshape(-1)[self.vertices]
        order = np.argsort(self.vertices)
        order = order[near[order]]
        return VoxelField(
            self.bounds, self.resolution, self.vertices[order], density[order], sh[order], self.contracted
        )

    def prune(self, least_weight: float, *, dilate: int = 1) -> "GridState":
        """Grid without the vertices whose own and neighbors' maximum weights are below `least_weight`."""
        density, sh, state, weight = self.arrays()
        full = np.zeros(self.resolution, bool)
        full.reshape(-1)[self.vertices[weight > least_weight]] = True
        if dilate:
            full = ndimage.binary_dilation(full, np.ones((3, 3, 3)), iterations=dilate)
        keep = full.reshape(-1)[self.vertices]
        return GridState.build(
            self.bounds,
            self.resolution,
            self.vertices[keep],
            density[keep],
            sh[keep],
            state[keep],
            contracted=self.contracted,
            threads=self.threads,
        )

    def refine(
        self, bounds: NDArray[np.float64], resolution: tuple[int, int, int], degree: int
    ) -> "GridState":
        """Grid of another resolution and bounds, with values and curvatures interpolated trilinearly.

        The SH degree is at least the old one; new coefficients are 0. A new vertex is stored where its cell
        of the old grid has a stored corner. Curvatures are sums over the rays that meet a voxel, so they are
        scaled by the ratio of the voxels' volumes.
        """
        density, sh, state, _ = self.arrays()
        field_bounds = np.array([[-2.0] * 3, [2.0] * 3]) if self.contracted else self.bounds
        new_bounds = field_bounds if self.contracted else bounds
        old_n, new_n = np.array(self.resolution), np.array(resolution)
        old_cell = (field_bounds[1] - field_bounds[0]) / (old_n - 1)
        new_cell = (new_bounds[1] - new_bounds[0]) / (new_n - 1)
        index = np.zeros(self.resolution, np.int32)
        index.reshape(-1)[self.vertices] = np.arange(1, len(self.vertices) + 1, dtype=np.int32)
        lows, fractions = [], []
        for a in range(3):
            g = (new_bounds[0, a] + np.arange(new_n[a]) * new_cell[a] - field_bounds[0, a]) / old_cell[a]
            g = np.clip(g, 0, old_n[a] - 1)
            low = np.minimum(g.astype(np.int64), old_n[a] - 2)
            lows.append(low)
            fractions.append((g - low).astype(np.float32))
        near = index > 0
        for a in range(3):
            near = np.take(near, lows[a], axis=a) | np.take(near, lows[a] + 1, axis=a)
        vertices = np.flatnonzero(near)
        del near
        vertices = vertices[brick_order(vertices, resolution)]
        count, terms = len(vertices), self.terms
        values = np.concatenate([density[:, None], sh.reshape(len(density), -1), state], axis=1)
        values = np.concatenate([np.zeros((1, values.shape[1]), np.float32), values])
        volume = float(np.prod(new_cell / old_cell))
        densities = np.empty(count, np.float32)
        colors = np.zeros((count, (degree + 1) ** 2, 3), np.float32)
        curvatures = np.empty((count, 2), np.float32)

        def interpolate(begin: int) -> None:
            part = slice(begin, min(begin + VERTICES_PER_CHUNK, count))
            xyz = np.unravel_index(vertices[part], resolution)
            out = np.zeros((part.stop - begin, values.shape[1]), np.float32)
            stored = np.zeros(len(out), np.float32)
            for corner in range(8):
                weight = np.ones(len(out), np.float32)
                at = []
                for a, v in enumerate(xyz):
                    up = corner >> a & 1
                    f = fractions[a][v]
                    weight *= f if up else 1 - f
                    at.append(lows[a][v] + up)
                slot = index[at[0], at[1], at[2]]
                out += weight[:, None] * values[slot]
                stored += weight * (slot > 0)
            out[:, 1:] /= np.maximum(stored, 1e-6)[:, None]
            densities[part] = out[:, 0]
            colors[part, :terms] = out[:, 1 : 1 + 3 * terms].reshape(-1, terms, 3)
            curvatures[part] = out[:, 1 + 3 * terms :] * volume

        with ThreadPoolExecutor(min(devices.threads(), MAX_THREADS)) as threads:
            list(threads.map(interpolate, range(0, count, VERTICES_PER_CHUNK)))
        return GridState.build(
            bounds,
            resolution,
            vertices,
            densities,
            colors,
            curvatures,
            contracted=self.contracted,
            threads=self.threads,
        )

    def support_bounds(self) -> NDArray[np.float64]:
        """World-space box [2,3] of the stored vertices, one voxel larger, within `bounds` (bounded grids)."""
        cell = (self.bounds[1] - self.bounds[0]) / (np.array(self.resolution) - 1)
        at = np.stack(np.unravel_index(self.vertices, self.resolution), axis=1)
        lower = self.bounds[0] + (at.min(axis=0) - 1) * cell
        upper = self.bounds[0] + (at.max(axis=0) + 1) * cell
        return np.array([np.maximum(lower, self.bounds[0]), np.minimum(upper, self.bounds[1])])


def _slots(values: NDArray[np.float32], order: NDArray[np.int64]) -> Any:
    """Device array [M+1,...] of the values in `order`, after zeros for the empty slot."""
    padded = np.zeros((len(values) + 1, *values.shape[1:]), np.float32)
    np.take(values, order, axis=0, out=padded[1:])
    return to_device(padded)


def group_bits() -> int:
    """GridState.group_bits of the compute device's grids."""
    return 0 if devices.is_gpu() else GROUP_BITS


def cell_sizes(
    bounds: NDArray[np.float64],
    resolution: tuple[int, int, int],
    vertices: NDArray[np.int64],
    contracted: bool,
) -> NDArray[np.float32]:
    """World-space voxel size [M] at each vertex; radial, growing as m^2, for contracted grids."""
    n = np.array(resolution) - 1
    if not contracted:
        return np.full(len(vertices), ((bounds[1] - bounds[0]) / n).max(), np.float32)
    c = np.stack(np.unravel_index(vertices, resolution), axis=1) * (4.0 / n) - 2.0
    m = 1.0 / np.maximum(2.0 - np.maximum(np.abs(c).max(axis=1), 1.0), 2.0 / n.max())
    return ((4.0 / n).max() * ((bounds[1] - bounds[0]) / 2).max() * m**2).astype(np.float32)
