"""The order in which a training takes the patches of its photos: every one once an epoch, at random."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cagefield.rendering.voxels.device_grid import to_device
from cagefield.training.voxels.grid_state import GridState
from cagefield.training.voxels.kernels.pixel_patches import touched_patches
from cagefield.training.voxels.kernels.ray_batches import PatchArgs
from cagefield.training.voxels.ray_batches import Photos
from cagefield.training.voxels.voxel_space import VoxelSpace


class Patches:
    """The patches that are taken, and how far the epoch is.

    Attributes:
        chosen: [P,3] int32 (view, first column, first row) of the patches that are taken at all.
        epoch: which of the seed's orders they are taken in. position: how many of it were taken.
    """

    def __init__(self, photos: Photos, size: int, seed: int) -> None:
        self._photos, self._size, self._seed = photos, size, seed
        self._all = photos.patches(size)
        self.chosen = self._all
        self.epoch = 0
        self.position = 0
        self._shuffle()

    def choose(self, space: VoxelSpace, grid: GridState) -> None:
        """Begins an epoch of the patches that meet an occupied block: the gradients of others are zero.

        Of a contracted grid's all are taken.
        """
        self.chosen = self._all if space.contracted else self._all[self._touched(space, grid)]
        self._shuffle()

    def compile(self, space: VoxelSpace, grid: GridState) -> None:
        """Compiles what `choose` needs, which is no training; chooses nothing."""
        if not space.contracted:
            self._touched(space, grid)

    def take(self, count: int) -> NDArray[np.int32]:
        """The next so many patches [count,3], of a new epoch where this one has fewer left.

        There are fewer where not so many are chosen.
        """
        count = min(len(self.chosen), count)
        if self.position + count > len(self.chosen):
            self._shuffle()
        taken = self.chosen[self._order[self.position : self.position + count]]
        self.position += count
        return taken

    def are_known(self, chosen: NDArray[np.int32]) -> bool:
        """Whether these [P,3] are patches of the photos, and some at all."""
        known = {tuple(patch) for patch in self._all.tolist()}
        return len(chosen) > 0 and all(tuple(patch) in known for patch in chosen.tolist())

    def go_to(self, chosen: NDArray[np.int32], epoch: int, position: int) -> None:
        """Goes on where others with these patches, of the same photos and seed, stood."""
        self.chosen, self.epoch, self.position = chosen, epoch, position
        self._order = self._permutation()

    def _shuffle(self) -> None:
        self.epoch += 1
        self.position = 0
        self._order = self._permutation()

    def _permutation(self) -> NDArray[np.int64]:
        return np.random.default_rng((self._seed, self.epoch)).permutation(len(self.chosen))

    def _touched(self, space: VoxelSpace, grid: GridState) -> NDArray[np.bool_]:
        """Which of all patches [P] have a ray that meets an occupied block of a bounded grid."""
        touched = to_device(np.zeros(len(self._all), np.int32))
        patches = PatchArgs(to_device(self._all), len(self._all), self._size)
        gains = to_device(np.zeros(1, np.float32))
        touched_patches(touched, patches, self._photos.args(gains), grid.args, grid.bricks, space.near)
        return touched.to_numpy() > 0
