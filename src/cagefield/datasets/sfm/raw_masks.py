"""Masks of photos without poses: found by their names, turned upright with the photos."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from cagefield.datasets.mask_files import MaskFolder, find_dynamic_mask, open_mask_folder
from cagefield.datasets.masks import read_mask, resample_mask
from cagefield.datasets.notices import warn
from cagefield.datasets.raw_photos import RawPhoto
from cagefield.datasets.views import PhotoMask
from cagefield.errors import DatasetError
from cagefield.files.atomic import replaced_file
from cagefield.images.image_files import open_image_file

VALID_FOLDER = "valid"
"""Folder of masks at their upright photo's size, NAME.png for the photo NAME: 0 is excluded, 255 valid."""

_ORIENTATION_TAG = 0x0112
_TRANSPOSED_ORIENTATIONS = (5, 6, 7, 8)


@dataclass(frozen=True)
class RawMasks:
    """Masks by the names of photos."""

    masks: dict[str, PhotoMask] = field(default_factory=dict)

    @classmethod
    def find(
        cls, base: Path, names: Sequence[str], folder: Path | None = None, *, quiet: bool = False
    ) -> RawMasks:
        """Masks of the photos `names` in the folder `base`: from `folder`, else from files beside the photos.

        Files beside the photos are the folders `masks` in `base` and beside it, and Instant-NGP's masks.

        Raises DatasetError where `folder` has no mask of these photos.
        """
        if folder is not None:
            given = open_mask_folder(folder.expanduser())
            mask_files = given.find_masks(names)
            if not mask_files:
                raise DatasetError(
                    f"{folder}: none of its {len(given.files)} masks is of a photo of {base}; name them "
                    f"NAME.png, {names[0]}.png say"
                )
            folders = [given]
        else:
            beside = [base / "masks", *([base.with_name("masks")] if base.name == "images" else [])]
            folders = [MaskFolder(mask_folder) for mask_folder in beside if mask_folder.is_dir()]
            mask_files = {}
            for mask_folder in folders:
                mask_files = (
                    mask_folder.find_masks([name for name in names if name not in mask_files]) | mask_files
                )
        masks = {name: PhotoMask(file) for name, file in mask_files.items()}
        if folder is None:
            for name in names:
                file = find_dynamic_mask(base / name)
                if file is not None and name not in masks:
                    masks[name] = PhotoMask(file, "white")
        if masks and not quiet:
            for mask_folder in folders:
                mask_folder.report_unused(mask_files.values())
            warn(
                f"{base}: {len(masks)} of {len(names)} photos have masks; where they exclude are no features"
            )
        return cls(masks)

    def digest(self) -> str:
        """Digest of the masks' names, sizes in bytes and times of change."""
        if not self.masks:
            return ""
        states = [
            (name, str(mask.path), mask.path.stat().st_size, mask.path.stat().st_mtime_ns)
            for name, mask in sorted(self.masks.items())
        ]
        return hashlib.sha256(repr(states).encode()).hexdigest()[:24]

    def write(self, name: str, source: Path, photo: RawPhoto, folder: Path) -> None:
        """Write the mask of the photo `name`, where it has one, turned upright as `photo` was from `source`.

        A mask that has the upright photo's aspect and not the stored one's is upright itself.

        Raises DatasetError where it cannot be read, or has another aspect than the photo.
        """
        mask = self.masks.get(name)
        if mask is None:
            return
        valid = read_mask(mask.path, mask.excluded)
        with open_image_file(source) as image:
            orientation = image.getexif().get(_ORIENTATION_TAG, 1)
        stored = (
            (photo.height, photo.width)
            if orientation in _TRANSPOSED_ORIENTATIONS
            else (photo.width, photo.height)
        )
        is_landscape = valid.shape[1] > valid.shape[0]
        if orientation in _TRANSPOSED_ORIENTATIONS and is_landscape == (photo.width > photo.height):
            stored, orientation = (photo.width, photo.height), 1
        image = Image.fromarray(resample_mask(valid, *stored, mask.path).astype(np.uint8) * 255)
        if orientation != 1:
            image.getexif()[_ORIENTATION_TAG] = orientation
            image = ImageOps.exif_transpose(image)
        target = folder / f"{photo.name}.png"
        target.parent.mkdir(parents=True, exist_ok=True)
        with replaced_file(target) as draft:
            image.save(draft, format="PNG")
