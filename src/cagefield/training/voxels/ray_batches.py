"""Posed photos on the compute device, cut into small square patches of neighboring rays.

Neighboring rays read the same voxels, so a batch of patches fetches each voxel about once; independent random
rays would fetch it for every ray.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cagefield.datasets.views import View
from cagefield.errors import DatasetError

if TYPE_CHECKING:
    from cagefield.training.voxels.kernels.ray_batches import PhotoArgs


@dataclass(frozen=True, eq=False)
class DevicePhotos:
    """Photos and cameras as flat device arrays.

    Attributes:
        names: [V] names of the views.
        sizes: [V, 2] int (width, height).
        views: device [V, 4] int32 (first pixel, width, first direction, height).
        poses: device [V, 12] float32, first three rows of c2w.
        directions: device [sum of distinct W*H, 3] float32 unit camera-space directions.
        pixels: device [sum W*H, 4] uint8 straight RGBA.
        valid: [sum W*H] bool mask of valid pixels; None where all are valid. valid_args: device uint8 copy
            for kernels, a single 1 without mask.
        has_alpha: True when any photo has a transparent pixel.
    """

    names: tuple[str, ...]
    sizes: NDArray[np.int64]
    views: Any
    poses: Any
    directions: Any
    pixels: Any
    valid: NDArray[np.bool_] | None
    valid_args: Any
    has_alpha: bool

    @classmethod
    def load(cls, views: Sequence[View]) -> DevicePhotos:
        """Photos of the views, read from disk.

        Raises:
            DatasetError: no view, or an unreadable photo.
        """
        from cagefield.compute.device_buffers import to_device

        if not views:
            raise DatasetError("no training photo: the data set is empty")
        table = np.zeros((len(views), 4), np.int32)
        poses = np.zeros((len(views), 12), np.float32)
        first_direction: dict[int, int] = {}
        directions: list[NDArray[np.float32]] = []
        pixels = []
        masks = []
        n_pixels = n_directions = 0
        for i, view in enumerate(views):
            camera = view.camera
            local = camera.local_directions()
            if id(local) not in first_direction:
                first_direction[id(local)] = n_directions
                directions.append(local)
                n_directions += len(local)
            image = view.load()
            if image.shape[2] == 3:
                image = np.concatenate([image, np.full((*image.shape[:2], 1), 255, np.uint8)], axis=2)
            table[i] = n_pixels, camera.width, first_direction[id(local)], camera.height
            poses[i] = camera.c2w[:3].reshape(-1)
            pixels.append(image.reshape(-1, 4))
            valid = view.valid_pixels()
            masks.append(np.ones(len(pixels[-1]), bool) if valid is None else valid.ravel())
            n_pixels += camera.width * camera.height
        flat, mask = np.concatenate(pixels), np.concatenate(masks)
        masked = not mask.all()
        return cls(
            names=tuple(v.name for v in views),
            sizes=table[:, [1, 3]].astype(np.int64),
            views=to_device(table),
            poses=to_device(poses),
            directions=to_device(np.concatenate(directions)),
            pixels=to_device(flat),
            valid=mask if masked else None,
            valid_args=to_device(mask.astype(np.uint8) if masked else np.ones(1, np.uint8)),
            has_alpha=bool((flat[mask, 3] < 255).any()),
        )

    def args(self, gains: Any) -> PhotoArgs:
        """Kernel arguments of the photos, with device gains [V,3]."""
        from cagefield.training.voxels.kernels.ray_batches import PhotoArgs

        return PhotoArgs(
            self.views,
            self.poses,
            gains,
            self.directions,
            self.pixels,
            self.valid_args,
            int(self.valid is not None),
        )

    def patches(self, size: int) -> NDArray[np.int32]:
        """PatchSampler [P, 3] (view, first column, first row) of size x size pixels that tile the photos.

        Patches without a valid pixel are left out.
        """
        tiles_of_views = []
        first = 0
        for view, (width, height) in enumerate(self.sizes):
            row, column = np.meshgrid(np.arange(0, height, size), np.arange(0, width, size), indexing="ij")
            tiles = np.stack([np.full(row.size, view), column.ravel(), row.ravel()], axis=1)
            if self.valid is not None:
                valid = self.valid[first : first + width * height].reshape(height, width)
                whole = np.pad(valid, ((0, -height % size), (0, -width % size)))
                tiles = tiles[whole.reshape(len(row), size, -1, size).any(axis=(1, 3)).ravel()]
            first += width * height
            tiles_of_views.append(tiles)
        return np.concatenate(tiles_of_views).astype(np.int32)
