"""Mask files found by the names of the photos: in a folder of masks, or beside the photos.

A folder of masks has NAME.png for the photo NAME, with its extension (`a.jpg.png`, COLMAP's way) or without
(`a.png`), in the photo's subfolders or without them; black excludes. Beside a photo its mask is
`dynamic_mask_NAME.png`, where white excludes (Instant-NGP).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePosixPath

import numpy as np

from cagefield.datasets.hidden_files import DYNAMIC_MASK_PREFIX
from cagefield.datasets.masks import check_aspect, read_mask
from cagefield.datasets.notices import warn
from cagefield.datasets.photo_names import iterate_image_paths, name_key, stem_key
from cagefield.datasets.photos import EXTENSIONS, read_header
from cagefield.datasets.views import Dataset, PhotoMask, View, join_names
from cagefield.errors import DatasetError


class MaskFolder:
    """Mask files of a folder, indexed by the photos' names."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.files: dict[tuple[str, ...], Path] = {}
        for parts in iterate_image_paths(folder):
            key = (*map(name_key, parts[:-1]), stem_key(parts[-1]))
            self.files.setdefault(key, folder.joinpath(*parts))

    def find_masks(self, names: Iterable[str]) -> dict[str, Path]:
        """Mask file of each photo name that has one.

        A mask in the photo's subfolders is preferred, else one in fewer of them where it fits one photo
        alone.
        """
        masks: dict[str, Path] = {}
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
                warn(f"{file}: it fits {len(photos)} photos and is used for none: {join_names(photos)}")
            else:
                masks[photos[0]] = file
        return masks

    def report_unused(self, used: Iterable[Path]) -> None:
        """Warn once of masks that belong to no photo."""
        used_files = set(used)
        unused = [
            str(file.relative_to(self.folder)) for file in self.files.values() if file not in used_files
        ]
        if unused:
            warn(f"{self.folder}: {len(unused)} masks are of no photo: {join_names(unused)}")


def open_mask_folder(folder: Path) -> MaskFolder:
    """Folder of masks that the user names. Raises DatasetError where it is missing or has no masks."""
    if not folder.is_dir():
        raise DatasetError(f"{folder} is no folder; give the folder of the masks, NAME.png for each photo")
    mask_folder = MaskFolder(folder)
    if not mask_folder.files:
        raise DatasetError(f"{folder}: no masks in it; name them NAME.png, NAME that of the photo")
    return mask_folder


def find_dynamic_mask(photo: Path) -> Path | None:
    """Instant-NGP's mask beside a photo, None where there is none."""
    for name in (photo.stem, photo.name):
        for extension in EXTENSIONS:
            file = photo.with_name(f"{DYNAMIC_MASK_PREFIX}{name}{extension}")
            if file.is_file():
                return file
    return None


def attach_masks(dataset: Dataset, folder: Path | None = None) -> Dataset:
    """Data set with the masks of `folder`, else with the masks that its files name or that lie beside photos.

    One warning gives the number of masked photos and the excluded share of their pixels; photos that are
    wholly excluded are left out, and named.

    Raises DatasetError where `folder` has no mask of any photo, a mask cannot be read or has another aspect
    than its photo, and where no training photo is left.
    """
    views = {view.image_path: view for part in _splits(dataset) for view in part}
    if folder is None:
        masks = {photo: view.mask for photo, view in views.items() if view.mask is not None}
        masks |= _masks_beside(dataset.path, [view for view in views.values() if view.mask is None])
    else:
        given = open_mask_folder(folder.expanduser())
        names = {_photo_name(view): photo for photo, view in views.items()}
        mask_files = given.find_masks(names)
        if not mask_files:
            raise DatasetError(
                f"{folder}: none of its {len(given.files)} masks is of a photo of {dataset.path}; name them "
                f"NAME.png, {next(iter(names))}.png say"
            )
        given.report_unused(mask_files.values())
        masks = {names[name]: PhotoMask(file) for name, file in mask_files.items()}
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
            f"{dataset.path}: {len(empty)} photos are left out, masks exclude all of them: "
            f"{join_names(left_out)}"
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
    """Share of a photo that its mask excludes. Raises DatasetError where the mask's aspect is not the
    photo's.
    """
    valid, header = read_mask(mask.path, mask.excluded), read_header(photo)
    check_aspect(valid, header.width, header.height, mask.path)
    return 1.0 - float(valid.mean())


def _splits(dataset: Dataset) -> tuple[tuple[View, ...], ...]:
    return dataset.train, dataset.test, dataset.val


def _photo_name(view: View) -> str:
    """Name of the view's photo: the view's name with the file name of its photo (a panorama's face has its
    own).
    """
    return str(PurePosixPath(view.name).with_name(view.image_path.name))


def _masks_beside(path: Path, views: Sequence[View]) -> Mapping[Path, PhotoMask]:
    """Masks by photo, from folders `masks` of the data set and from files beside the photos."""
    masks: dict[Path, PhotoMask] = {}
    folders: dict[tuple[Path, ...], list[View]] = {}
    candidates: dict[Path, tuple[Path, ...]] = {}
    for view in views:
        parent = view.image_path.parent
        if parent not in candidates:
            candidates[parent] = tuple(folder for folder in _mask_folders(path, parent) if folder.is_dir())
        folders.setdefault(candidates[parent], []).append(view)
    mask_folders: dict[Path, MaskFolder] = {}
    used_files: list[Path] = []
    for folders_of_masks, group in folders.items():
        for mask_folder in folders_of_masks:
            folder = mask_folders.setdefault(mask_folder, MaskFolder(mask_folder))
            names = {_photo_name(view): view.image_path for view in group if view.image_path not in masks}
            for name, file in folder.find_masks(names).items():
                masks[names[name]] = PhotoMask(file)
                used_files.append(file)
    for folder in mask_folders.values():
        if any(file in used_files for file in folder.files.values()):
            folder.report_unused(used_files)
    for view in views:
        beside = find_dynamic_mask(view.image_path)
        if beside is not None and view.image_path not in masks:
            masks[view.image_path] = PhotoMask(beside, "white")
    return masks


def _mask_folders(path: Path, photos: Path) -> list[Path]:
    """Candidate mask folders of a folder of photos: beside it or a folder above it, within the data set."""
    candidates: list[Path] = []
    base = path if path.is_dir() else path.parent
    for folder in (photos, *photos.parents)[:4]:
        number = re.fullmatch(r"images_([1-9]\d*)", folder.name)
        if number is not None:
            candidates.append(folder.with_name(f"masks_{number[1]}"))
        candidates.append(folder / "masks")
        if folder == base:
            break
    return candidates
