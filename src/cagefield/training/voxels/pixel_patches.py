"""Random order of a training's pixel patches: every patch once per epoch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.compute.device_buffers import to_device
from cagefield.training.voxels.grid_state import GridState
from cagefield.training.voxels.kernels.pixel_patches import touched_patches
from cagefield.training.voxels.kernels.ray_batches import PatchArgs
from cagefield.training.voxels.ray_batches import DevicePhotos
from cagefield.training.voxels.voxel_space import VoxelSpace


class PatchSampler:
    """Sampler of pixel patches without replacement, and the state of its epoch.

    Attributes:
        selected: [P,3] int32 (view, first column, first row) of the patches to sample.
        epoch: number of the random order. position: number of patches sampled from this order.
    """

    def __init__(self, photos: DevicePhotos, size: int, seed: int) -> None:
        self._photos, self._size, self._seed = photos, size, seed
        self._all = photos.patches(size)
        self.selected = self._all
        self.epoch = 0
        self.position = 0
        self._shuffle()

    def select_occupied(self, space: VoxelSpace, grid: GridState) -> None:
        """Start an epoch of the patches whose rays meet an occupied block; others have zero gradients.

        A contracted grid selects every patch.
        """
        self.selected = self._all if space.contracted else self._all[self._occupied_patches(space, grid)]
        self._shuffle()

    def compile(self, space: VoxelSpace, grid: GridState) -> None:
        """Compile the kernel of `select_occupied` ahead of time; selects nothing."""
        if not space.contracted:
            self._occupied_patches(space, grid)

    def take(self, count: int) -> NDArray[np.int32]:
        """Next patches [count,3], from a new epoch where this one has fewer left.

        `count` is at most the number of selected patches.
        """
        count = min(len(self.selected), count)
        if self.position + count > len(self.selected):
            self._shuffle()
        batch = self.selected[self._order[self.position : self.position + count]]
        self.position += count
        return batch

    def contains_all(self, selected: NDArray[np.int32]) -> bool:
        """Whether the list [P,3] is not empty and contains patches of the photos only."""
        known = {tuple(patch) for patch in self._all.tolist()}
        return len(selected) > 0 and all(tuple(patch) in known for patch in selected.tolist())

    def restore(self, selected: NDArray[np.int32], epoch: int, position: int) -> None:
        """Set the state to a checkpoint's, of equal photos and seed."""
        self.selected, self.epoch, self.position = selected, epoch, position
        self._order = self._permutation()

    def _shuffle(self) -> None:
        self.epoch += 1
        self.position = 0
        self._order = self._permutation()

    def _permutation(self) -> NDArray[np.int64]:
        return np.random.default_rng((self._seed, self.epoch)).permutation(len(self.selected))

    def _occupied_patches(self, space: VoxelSpace, grid: GridState) -> NDArray[np.bool_]:
        """Mask [P] of the patches with a ray that meets an occupied block of a bounded grid."""
        touched = to_device(np.zeros(len(self._all), np.int32))
        patches = PatchArgs(to_device(self._all), len(self._all), self._size)
        gains = to_device(np.zeros(1, np.float32))
        touched_patches(touched, patches, self._photos.args(gains), grid.args, grid.bricks, space.near)
        return touched.to_numpy() > 0
