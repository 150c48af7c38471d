"""Masks of photos without poses: found by their names, turned upright as the photos are."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps

from cagefield.datasets.mask_files import MaskFolder, dynamic_mask, opened_folder
from cagefield.datasets.masks import read_mask, resample_mask
from cagefield.datasets.notices import warn
from cagefield.datasets.raw_photos import RawPhoto
from cagefield.datasets.views import PhotoMask
from cagefield.errors import DatasetError
from cagefield.files.atomic import replaced_file
from cagefield.images.image_files import opened_picture

VALID_FOLDER = "valid"
"""Folder of masks at their upright photo's size, NAME.png for the photo NAME: 0 excludes, 255 does not."""

_ORIENTATION = 0x0112
_TRANSPOSED = (5, 6, 7, 8)


@dataclass(frozen=True)
class RawMasks:
    """Masks by the names of photos."""

    masks: dict[str, PhotoMask] = field(default_factory=dict)

    @classmethod
    def of(
        cls, base: Path, names: Sequence[str], folder: Path | None = None, *, quiet: bool = False
    ) -> RawMasks:
        """The masks of the photos `names` in the folder `base`: of `folder`, else those beside them.

        Beside them are the folders `masks` in `base` and beside it, and Instant-NGP's files.

        Raises DatasetError where `folder` has none of theirs.
        """
        if folder is not None:
            given = opened_folder(folder.expanduser())
            found = given.of(names)
            if not found:
                raise DatasetError(
                    f"{folder}: none of its {len(given.files)} masks is of a photo of {base}; name them "
                    f"NAME.png, {names[0]}.png say"
                )
            places = [given]
        else:
            beside = [base / "masks", *([base.with_name("masks")] if base.name == "images" else [])]
            places = [MaskFolder(place) for place in beside if place.is_dir()]
            found = {}
            for place in places:
                found = place.of([name for name in names if name not in found]) | found
        masks = {name: PhotoMask(file) for name, file in found.items()}
        if folder is None:
            for name in names:
                file = dynamic_mask(base / name)
                if file is not None and name not in masks:
                    masks[name] = PhotoMask(file, "white")
        if masks and not quiet:
            for place in places:
                place.report_unused(found.values())
            warn(
                f"{base}: {len(masks)} of {len(names)} photos have masks; where they exclude are no features"
            )
        return cls(masks)

    def digest(self) -> str:
        """Identity of these masks: a digest of names, sizes in bytes and times of change."""
        if not self.masks:
            return ""
        states = [
            (name, str(mask.path), mask.path.stat().st_size, mask.path.stat().st_mtime_ns)
            for name, mask in sorted(self.masks.items())
        ]
        return hashlib.sha256(repr(states).encode()).hexdigest()[:24]

    def write(self, name: str, source: Path, photo: RawPhoto, folder: Path) -> None:
        """Writes the mask of the photo `name`, where it has one, as `photo` was turned upright from `source`.

        A mask that has the upright photo's aspect and not the stored one's is upright itself.

        Raises DatasetError where it cannot be read, or has another aspect than the photo.
        """
        mask = self.masks.get(name)
        if mask is None:
            return
        valid = read_mask(mask.path, mask.excluded)
        with opened_picture(source) as image:
            orientation = image.getexif().get(_ORIENTATION, 1)
        stored = (photo.height, photo.width) if orientation in _TRANSPOSED else (photo.width, photo.height)
        wide = valid.shape[1] > valid.shape[0]
        if orientation in _TRANSPOSED and wide == (photo.width > photo.height):
            stored, orientation = (photo.width, photo.height), 1
        picture = Image.fromarray(resample_mask(valid, *stored, mask.path).astype(np.uint8) * 255)
        if orientation != 1:
            picture.getexif()[_ORIENTATION] = orientation
            picture = ImageOps.exif_transpose(picture)
        target = folder / f"{photo.name}.png"
        target.parent.mkdir(parents=True, exist_ok=True)
        with replaced_file(target) as draft:
            picture.save(draft, format="PNG")
