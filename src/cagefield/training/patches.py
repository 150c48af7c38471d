"""The order in which a training takes the patches of its photos: every one once an epoch, at random."""

# Kernel annotations are read at run time, so this module has no `from __future__ import annotations`.

import numpy as np
import quadrants as qd
from numpy.typing import NDArray

from cagefield.devices import floats, ints
from cagefield.rendering.grid import F32, I32, ivec3, to_device, vec3
from cagefield.rendering.kernels.ray_grid import empty_run, safe_inverse, slab
from cagefield.training.grid_state import GridState
from cagefield.training.photos import Photos
from cagefield.training.voxel_space import VoxelSpace


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
        lower, scale = space.to_grid(grid)
        count = len(self._all)
        touched = to_device(np.zeros(count, np.int32))
        _touched_patches(
            touched,
            to_device(self._all),
            count,
            self._size,
            self._photos.views,
            self._photos.poses,
            self._photos.directions,
            grid.codes,
            ints(grid.brick_dims),
            floats(lower),
            floats(scale),
            ints(grid.resolution),
            space.near,
        )
        return touched.to_numpy() > 0


@qd.kernel(fastcache=True)
def _touched_patches(
    touched: I32,
    patches: I32,
    n_patches: qd.i32,
    patch_size: qd.i32,
    views: I32,
    poses: F32,
    directions: F32,
    codes: I32,
    brick_dims: ivec3,
    lower: vec3,
    scale: vec3,
    resolution: ivec3,
    near: qd.f32,
):
    """Sets touched[p] to 1 where any ray of patch p meets an occupied block of a bounded grid, else 0."""
    for patch in range(n_patches):
        found = 0
        for r in range(patch_size * patch_size):
            view = patches[3 * patch]
            column = patches[3 * patch + 1] + r % patch_size
            row = patches[3 * patch + 2] + r // patch_size
            if found == 0 and row < views[4 * view + 3] and column < views[4 * view + 1]:
                m = 12 * view
                at = 3 * (views[4 * view + 2] + row * views[4 * view + 1] + column)
                l = vec3(directions[at], directions[at + 1], directions[at + 2])
                d = vec3(
                    poses[m] * l.x + poses[m + 1] * l.y + poses[m + 2] * l.z,
                    poses[m + 4] * l.x + poses[m + 5] * l.y + poses[m + 6] * l.z,
                    poses[m + 8] * l.x + poses[m + 9] * l.y + poses[m + 10] * l.z,
                )
                go = (vec3(poses[m + 3], poses[m + 7], poses[m + 11]) - lower) * scale
                gd = d * scale
                inverse = safe_inverse(gd)
                hit = slab(go, inverse, vec3(0.0, 0.0, 0.0), qd.cast(resolution - 1, qd.f32))
                t = qd.max(hit.x, near)
                nudge = 0.05 / qd.abs(gd).max()
                while t < hit.y and found == 0:
                    run = empty_run(codes, go + t * gd, inverse, ivec3(0, 0, 0), brick_dims)
                    if run < 0.0:
                        found = 1
                    t += run + nudge
        touched[patch] = found
