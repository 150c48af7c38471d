"""Masks of photos found by their names: in a folder of masks, or beside the photos.

A folder of masks has NAME.png for the photo NAME, with its extension (`a.jpg.png`, COLMAP's way) or without
(`a.png`), in the same folders or without them; black excludes. Beside a photo it is `dynamic_mask_NAME.png`,
where white excludes (Instant-NGP).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np

from cagefield.datasets.hidden_files import DYNAMIC_MASK
from cagefield.datasets.masks import check_aspect, read_mask
from cagefield.datasets.notices import warn
from cagefield.datasets.photo_names import name_key, picture_tree, stem_key
from cagefield.datasets.photos import EXTENSIONS, read_header
from cagefield.datasets.views import Dataset, PhotoMask, View, named
from cagefield.errors import DatasetError


class MaskFolder:
    """The masks of a folder, by the names of photos."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files: dict[tuple[str, ...], Path] = {}
        for parts in picture_tree(folder):
            key = (*map(name_key, parts[:-1]), stem_key(parts[-1]))
            self.files.setdefault(key, folder.joinpath(*parts))

    def of(self, names: Iterable[str]) -> dict[str, Path]:
        """The masks of photos: in the same folders, else in fewer of them where it fits one photo."""
        found: dict[str, Path] = {}
        loose: dict[Path, list[str]] = {}
        for name in dict.fromkeys(names):
            parts = PurePosixPath(name).parts
            for skipped in range(len(parts)):
                folders = tuple(map(name_key, parts[skipped:-1]))
                keys = ((*folders, name_key(parts[-1])), (*folders, stem_key(parts[-1])))
                file = next((self.files[key] for key in keys if key in self.files), None)
                if file is not None:
                    loose.setdefault(file, []).append(name)
                    break
        for file, photos in loose.items():
            if len(photos) > 1:
                warn(f"{file}: it fits {len(photos)} photos and is used for none: {named(photos)}")
            else:
                found[photos[0]] = file
        return found

    def report_unused(self, used: Iterable[Path]) -> None:
        """Warns once of masks that are of no photo."""
        taken = set(used)
        unused = [str(file.relative_to(self.folder)) for file in self.files.values() if file not in taken]
        if unused:
            warn(f"{self.folder}: {len(unused)} masks are of no photo: {named(unused)}")


def opened_folder(folder: Path) -> MaskFolder:
    """The folder of masks that the user names. Raises DatasetError where there is none, or nothing in it."""
    if not folder.is_dir():
        raise DatasetError(f"{folder} is no folder; give the folder of the masks, NAME.png for each photo")
    found = MaskFolder(folder)
    if not found.files:
        raise DatasetError(f"{folder}: no masks in it; name them NAME.png, NAME that of the photo")
    return found


def dynamic_mask(photo: Path) -> Path | None:
    """Instant-NGP's mask beside a photo, None where it has none."""
    for name in (photo.stem, photo.name):
        for extension in EXTENSIONS:
            file = photo.with_name(f"{DYNAMIC_MASK}{name}{extension}")
            if file.is_file():
                return file
    return None


def with_masks(dataset: Dataset, folder: Path | None = None) -> Dataset:
    """The data set with the masks of `folder`, else with those that its files name or that are beside photos.

    One warning says how many photos have masks, and what share of them they exclude; photos of which they
    exclude all are left out, and named.

    Raises DatasetError where `folder` has no mask of any photo, a mask cannot be read or has another aspect
    than its photo, and where no training photo is left.
    """
    views = {view.image_path: view for part in _splits(dataset) for view in part}
    if folder is None:
        masks = {photo: view.mask for photo, view in views.items() if view.mask is not None}
        masks |= _beside(dataset.path, [view for view in views.values() if view.mask is None])
    else:
        given = opened_folder(folder.expanduser())
        names = {_photo_name(view): photo for photo, view in views.items()}
        found = given.of(names)
        if not found:
            raise DatasetError(
                f"{folder}: none of its {len(given.files)} masks is of a photo of {dataset.path}; name them "
                f"NAME.png, {next(iter(names))}.png say"
            )
        given.report_unused(found.values())
        masks = {names[name]: PhotoMask(file) for name, file in found.items()}
    if not masks:
        return dataset
    shares = {photo: _excluded_share(photo, mask) for photo, mask in masks.items()}
    warn(
        f"{dataset.path}: {len(masks)} of {len(views)} photos have masks, which exclude "
        f"{np.mean(list(shares.values())):.1%} of their pixels from features, training and figures"
    )
    empty = {photo for photo, share in shares.items() if share == 1.0}
    if empty:
        left_out = [_photo_name(view) for photo, view in views.items() if photo in empty]
        warn(
            f"{dataset.path}: {len(empty)} photos are left out, masks exclude all of them: {named(left_out)}"
        )

    def masked(part: Sequence[View]) -> tuple[View, ...]:
        return tuple(
            replace(view, mask=masks.get(view.image_path)) for view in part if view.image_path not in empty
        )

    train, test, val = (masked(part) for part in _splits(dataset))
    if not train:
        raise DatasetError(
            f"{dataset.path}: masks exclude every pixel of the training photos; black excludes: invert them"
        )
    return replace(dataset, train=train, test=test, val=val)


def _excluded_share(photo: Path, mask: PhotoMask) -> float:
    """The share of a photo that its mask excludes. Raises DatasetError where the mask is not the photo's."""
    valid, header = read_mask(mask.path, mask.excluded), read_header(photo)
    check_aspect(valid, header.width, header.height, mask.path)
    return 1.0 - float(valid.mean())


def _splits(dataset: Dataset) -> tuple[tuple[View, ...], ...]:
    return dataset.train, dataset.test, dataset.val


def _photo_name(view: View) -> str:
    """The view's name with the name of its photo's file, which a panorama's face has not."""
    return str(PurePosixPath(view.name).with_name(view.image_path.name))


def _beside(path: Path, views: Sequence[View]) -> Mapping[Path, PhotoMask]:
    """Masks in folders `masks` of the data set, and beside photos."""
    found: dict[Path, PhotoMask] = {}
    folders: dict[tuple[Path, ...], list[View]] = {}
    places: dict[Path, tuple[Path, ...]] = {}
    for view in views:
        parent = view.image_path.parent
        if parent not in places:
            places[parent] = tuple(folder for folder in _mask_folders(path, parent) if folder.is_dir())
        folders.setdefault(places[parent], []).append(view)
    used: dict[Path, MaskFolder] = {}
    taken: list[Path] = []
    for those, some in folders.items():
        for place in those:
            folder = used.setdefault(place, MaskFolder(place))
            names = {_photo_name(view): view.image_path for view in some if view.image_path not in found}
            for name, file in folder.of(names).items():
                found[names[name]] = PhotoMask(file)
                taken.append(file)
    for folder in used.values():
        if any(file in taken for file in folder.files.values()):
            folder.report_unused(taken)
    for view in views:
        beside = dynamic_mask(view.image_path)
        if beside is not None and view.image_path not in found:
            found[view.image_path] = PhotoMask(beside, "white")
    return found


def _mask_folders(path: Path, photos: Path) -> list[Path]:
    """Where the masks of a folder of photos may be: beside it or a folder above it, within the data set."""
    found: list[Path] = []
    base = path if path.is_dir() else path.parent
    for folder in (photos, *photos.parents)[:4]:
        number = re.fullmatch(r"images_([1-9]\d*)", folder.name)
        if number is not None:
            found.append(folder.with_name(f"masks_{number[1]}"))
        found.append(folder / "masks")
        if folder == base:
            break
    return found
