"""Data sets described by `transforms*.json`: NeRF-synthetic, Instant-NGP and nerfstudio.

All three give OpenGL camera-to-world matrices, which are used as they are. The keys of the three dialects are
read alike; a key in a frame wins over the same key of the file:
  size        w, h; else the size of the photo. Where all photos have another one with the same aspect, the
              intrinsics are scaled, with a warning
  focal       fl_x, fl_y in pixels; x_fov, y_fov in degrees; camera_angle_x, camera_angle_y in radians
  axis        cx, cy in pixels; else the middle of the image
  lens        camera_model (see `transforms_lenses`), is_fisheye, k1..k4, p1, p2
  photo       file_path, relative to the file, with or without extension (see `photo_names`); mask_path
  scene       aabb_scale, scale, offset (Instant-NGP), applied_transform, applied_scale (nerfstudio)
  points      ply_file_path (nerfstudio): a PLY file of sparse points in the file's world
  splits      transforms_train/val/test.json, or train_filenames, val_filenames, test_filenames in one file
`applied_transform` [3,4] is nerfstudio's map of the reconstruction's coordinates before it wrote the poses,
`applied_scale` its further scale: the file's world = applied_scale x applied_transform x the
reconstruction's. The product becomes `Dataset.source_to_world` and moves nothing. A uniform scale in the
rotation of a pose is taken out. Frames whose pose is missing or not finite, whose photo is missing or listed
before, and those without file_path are left out, and named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.datasets.capture_dataset import common_rescaled_size, warn_of_scaling
from cagefield.datasets.colmap.colmap_lenses import LensView, report_resampled
from cagefield.datasets.far_origin import move_near_origin
from cagefield.datasets.notices import warn
from cagefield.datasets.photo_names import FoundPhotos, find_photos, view_name
from cagefield.datasets.photos import choose_downscale, is_cut_out, read_header
from cagefield.datasets.scene_bounds import cube_of_interest, depths_of_points
from cagefield.datasets.transforms.point_files import read_points
from cagefield.datasets.transforms.transforms_json import (
    read_box,
    read_json,
    read_matrix,
    read_number,
    remove_scale,
)
from cagefield.datasets.transforms.transforms_lenses import build_frame_lenses
from cagefield.datasets.views import (
    Dataset,
    PhotoMask,
    SparsePoints,
    View,
    hold_out,
    join_names,
    report_missing,
    report_unposed,
)
from cagefield.errors import CameraError, DatasetError
from cagefield.files.safe_open import real_path

MAX_NAME_CHARACTERS = 255
"""Maximum characters of a file's name on the usual file systems."""

SPLITS = ("train", "test", "val")

TRANSFORMS_FILES = ("transforms.json", "transform.json")
"""Names of a file that describes all views, in order of preference."""

_SYNTHETIC_HALF_SIZE = 1.5  # the NeRF-synthetic scenes fit in [-1.5, 1.5]^3
_NGP_SCALE, _NGP_OFFSET = 0.33, 0.5  # Instant-NGP: unit cube coordinates = scale * file coordinates + offset


def split_file(folder: Path, split: str) -> Path:
    """File of one split's views: transforms_train.json, or transform_train.json where that exists."""
    names = [folder / f"{word}_{split}.json" for word in ("transforms", "transform")]
    return next((file for file in names if file.is_file()), names[0])


def camera_file(folder: Path) -> Path | None:
    """File of this format in a folder, None where there is none."""
    files = [split_file(folder, "train"), *(folder / name for name in TRANSFORMS_FILES)]
    return next((file for file in files if file.is_file()), None)


def load_transforms(path: Path, downscale: int | None, holdout: int) -> Dataset:
    """Data set of a folder with `transforms.json` or `transforms_train.json`, or of one such file.

    A scene of cut-out photos (RGBA, not all opaque) is bounded: [-1.5, 1.5]^3 in the NeRF-synthetic layout,
    else the cube of interest. Anything else is unbounded, with the cube of interest as its inner box.
    `aabb_scale` decides where it is given: 1 means bounded by Instant-NGP's unit cube, more means unbounded.
    A missing test split is replaced by the validation split, and where there is none by every `holdout`-th
    view.
    """
    folder = path if path.is_dir() else path.parent
    split_files = {split: split_file(folder, split) for split in SPLITS}
    synthetic = path in split_files.values() if path.is_file() else split_files["train"].is_file()
    if synthetic:
        if not split_files["train"].is_file():
            raise DatasetError(
                f"{split_files['train']} is missing; the training views must be described there"
            )
        files = {split: _TransformsFile(file) for split, file in split_files.items() if file.is_file()}
    else:
        files = {"train": _TransformsFile(path if path.is_file() else camera_file(folder) or folder)}
    main_file = files["train"]
    _read_views(folder if synthetic else main_file.path, folder, list(files.values()))
    if synthetic:
        views = {split: files[split].views if split in files else [] for split in SPLITS}
    else:
        views = main_file.split_views()
    if not views["train"]:
        raise DatasetError(f"{main_file.path}: none of the training views' photos is there; check file_path")
    all_views = [view for split in SPLITS for view in views[split]]
    factor = choose_downscale(max(max(v.camera.width, v.camera.height) for v in all_views), downscale)
    split = {name: tuple(view.downscaled(factor) for view in views[name]) for name in SPLITS}
    train, test = split["train"], split["test"] or split["val"]
    if not test:
        train, test = hold_out(train, holdout)
    cut_out = _are_cut_outs(views["train"])
    points = main_file.points()
    unbounded, bounds = _bounds(
        main_file, [view.camera for view in views["train"]], cut_out, synthetic, points
    )
    point_depths = (
        None if points is None else depths_of_points([v.camera for v in all_views], points.positions)
    )
    dataset = Dataset(
        name=real_path(folder).name,
        path=folder,
        train=train,
        test=test,
        val=split["val"],
        unbounded=unbounded,
        bounds=bounds,
        white_background=cut_out,
        source_to_world=main_file.source_to_world(),
        depths=None
        if point_depths is None
        else (float(point_depths[:, 0].min()), float(point_depths[:, 1].max())),
        points=points,
    )
    return move_near_origin(dataset)


def _read_views(where: Path, folder: Path, files: Sequence[_TransformsFile]) -> None:
    """Find the photos and masks of all files together, and report frames that are left out."""
    total = sum(file.total for file in files)
    names = [name for file in files for name in file.names("file_path")]
    photos = find_photos(folder, names)
    masks = find_photos(folder, [name for file in files for name in file.names("mask_path")])
    for file in files:
        file.read_views(folder, photos, masks)

    def gather(kind: str) -> list[str]:
        return [name for file in files for name in getattr(file, kind)]

    report_missing(where, gather("missing"), total)
    photos.report(where, folder)
    report_unposed(where, gather("unposed"), total)
    missing_masks = list(dict.fromkeys(masks.ambiguous + gather("without_mask")))
    for affected, note in (
        (gather("unnamed"), "frames are left out, they have no file_path"),
        (gather("repeated"), "frames are left out, their photos are listed before"),
        (missing_masks, "masks are not used, their files are missing"),
    ):
        if affected:
            warn(f"{where}: {len(affected)} {note}: {join_names(affected)}")
    report_resampled(str(where), [lens for file in files for lens in file.lenses])
    scales = [scale for file in files for scale in file.scales]
    if scales:
        warn(
            f"{where}: the rotations of {len(scales)} poses are scaled by {min(scales):.4g} to "
            f"{max(scales):.4g}; the scale is taken out"
        )


@dataclass
class _TransformsFile:
    """One transforms file: its full-size views, and the names of frames that are left out, by reason."""

    path: Path
    values: dict[str, Any] = field(init=False)
    total: int = field(init=False)
    views: list[View] = field(init=False, default_factory=list)
    lenses: list[LensView] = field(init=False, default_factory=list)
    scales: list[float] = field(init=False, default_factory=list)
    missing: list[str] = field(init=False, default_factory=list)
    unposed: list[str] = field(init=False, default_factory=list)
    unnamed: list[str] = field(init=False, default_factory=list)
    repeated: list[str] = field(init=False, default_factory=list)
    without_mask: list[str] = field(init=False, default_factory=list)
    photo_by_name: dict[str, Path] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.values = read_json(self.path)
        frames = self.values.get("frames")
        if not isinstance(frames, list) or not frames:
            raise DatasetError(f"{self.path}: key 'frames' must be a list with at least one frame")
        self.total = len(frames)
        for index, frame in enumerate(frames):
            where = f"{self.path}: frames[{index}]"
            if not isinstance(frame, dict):
                raise DatasetError(f"{where} must be an object with file_path and transform_matrix")
            for key in ("file_path", "mask_path"):
                name = frame.get(key)
                if name is None or name == "":
                    continue
                if (
                    not isinstance(name, str)
                    or max(map(len, view_name(name).split("/"))) > MAX_NAME_CHARACTERS
                ):
                    raise DatasetError(f"{where}: key {key!r} must name the photo, got {name!r:.80}")

    def names(self, key: str) -> list[str]:
        """Names of files at a key of the frames."""
        return [frame[key] for frame in self.values["frames"] if frame.get(key)]

    def read_views(self, folder: Path, photos: FoundPhotos, masks: FoundPhotos) -> None:
        """Read the frames whose photos were found."""
        read: list[tuple[str, Path, npt.NDArray[np.float64], tuple[LensView, ...], PhotoMask | None]] = []
        seen_photos: set[Path] = set()
        for index, frame in enumerate(self.values["frames"]):
            file_path = frame.get("file_path")
            if not file_path:
                self.unnamed.append(f"frames[{index}]")
                continue
            name, photo = photos.relative_view_name(file_path, folder), photos.photos.get(file_path)
            if photo is not None:
                self.photo_by_name[view_name(file_path)] = photo
            where = f"{self.path}: frames[{index}] ({name})"
            pose = frame.get("transform_matrix")
            pose = None if pose is None else read_matrix(f"{where}: key 'transform_matrix'", pose)
            if photo is None:
                self.missing.append(name)
            elif pose is None or not np.isfinite(pose).all():
                self.unposed.append(name)
            elif photo in seen_photos:
                self.repeated.append(name)
            else:
                seen_photos.add(photo)
                pose, scale = remove_scale(pose)
                self.scales += [] if scale == 1.0 else [scale]
                try:
                    lenses = build_frame_lenses(where, self.values, frame, read_header(photo))
                    lenses[0].camera.with_c2w(pose)
                except CameraError as error:
                    raise DatasetError(f"{where}: {str(error).replace('c2w', 'transform_matrix')}") from error
                read.append((name, photo, pose, lenses, self._mask(frame, masks)))
        size = self._size_of_photos([(name, photo, lenses[0]) for name, photo, _, lenses, _ in read])
        for name, photo, pose, lenses, mask in read:
            sized = lenses if size is None else tuple(lens.resized(*size) for lens in lenses)
            self.lenses += sized
            self.views += [
                View(
                    lens.name(name),
                    lens.camera.with_c2w(lens.pose(pose)),
                    photo,
                    mask=mask,
                    source=lens.source,
                )
                for lens in sized
            ]

    def _mask(self, frame: dict[str, Any], masks: FoundPhotos) -> PhotoMask | None:
        name = frame.get("mask_path")
        if not name:
            return None
        if name not in masks.photos:
            self.without_mask.append(view_name(name))
            return None
        return PhotoMask(masks.photos[name])

    def _size_of_photos(self, read: Sequence[tuple[str, Path, LensView]]) -> tuple[int, int] | None:
        """(width, height) to which all photos were scaled since the file was written; None where sizes agree.

        Raises DatasetError where photos have another size for any other reason.
        """
        headers = [read_header(photo) for _, photo, _ in read]
        camera_sizes = [lens.size for _, _, lens in read]
        photo_sizes = [(header.width, header.height) for header in headers]
        if camera_sizes == photo_sizes:
            return None
        size = common_rescaled_size(camera_sizes, photo_sizes)
        if size is None:
            index = next(i for i in range(len(camera_sizes)) if camera_sizes[i] != photo_sizes[i])
            key, value = (
                ("w", camera_sizes[index][0])
                if camera_sizes[index][0] != photo_sizes[index][0]
                else ("h", camera_sizes[index][1])
            )
            raise DatasetError(
                f"{self.path}: frame {read[index][0]}: key {key!r} is {value}, but "
                f"{read[index][1]} is {photo_sizes[index][0]}x{photo_sizes[index][1]}; use the photos that "
                "the intrinsics belong to, or scale w, h, fl_x, fl_y, cx and cy to these"
            )
        warn_of_scaling(str(self.path), camera_sizes[0], size)
        return size

    def split_views(self) -> dict[str, list[View]]:
        """Views by split, from the file's own lists; all in train where it has no lists."""
        listed: dict[str, set[Path]] = {}
        unknown: list[str] = []
        for split in SPLITS:
            names = self.values.get(key := f"{split}_filenames")
            if names is None:
                continue
            if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
                raise DatasetError(f"{self.path}: key {key!r} must be a list of file names")
            listed[split] = {self.photo_by_name[n] for n in map(view_name, names) if n in self.photo_by_name}
            known_names = {*self.missing, *self.photo_by_name}
            unknown += [name for name in map(view_name, names) if name not in known_names]
        if unknown:
            warn(
                f"{self.path}: {len(unknown)} names in its lists of splits are no frame's: "
                f"{join_names(unknown)}"
            )
        held_out = listed.get("test", set()) | listed.get("val", set())
        listed.setdefault("train", {view.image_path for view in self.views} - held_out)
        unused = [v.name for v in self.views if v.image_path not in held_out | listed["train"]]
        if unused:
            warn(
                f"{self.path}: {len(unused)} frames are left out, its lists of splits have none of them: "
                f"{join_names(unused)}"
            )
        return {split: [v for v in self.views if v.image_path in listed.get(split, ())] for split in SPLITS}

    def points(self) -> SparsePoints | None:
        """Sparse points of `ply_file_path`; None, with a warning, where the file cannot be read."""
        name = self.values.get("ply_file_path")
        if name is None:
            return None
        if not isinstance(name, str) or not name:
            raise DatasetError(f"{self.path}: key 'ply_file_path' must name a PLY file, got {name!r:.80}")
        try:
            points = read_points(self.path.parent / view_name(name))
        except DatasetError as error:
            warn(f"{error}; {self.path} is used without its points")
            return None
        return points if len(points) else None

    def source_to_world(self) -> npt.NDArray[np.float64]:
        """Matrix [4,4] of nerfstudio's `applied_scale` x `applied_transform`; the identity without them."""
        where = str(self.path)
        transform = np.eye(4)
        if self.values.get("applied_transform") is not None:
            transform = read_matrix(f"{where}: key 'applied_transform'", self.values["applied_transform"])
        scale = read_number(where, self.values, "applied_scale")
        if scale is not None and scale <= 0:
            raise DatasetError(f"{where}: key 'applied_scale' must be positive, got {scale:g}")
        if not np.isfinite(transform).all() or abs(np.linalg.det(transform)) < 1e-12:
            raise DatasetError(f"{where}: key 'applied_transform' must be finite and invertible")
        transform[:3] *= 1.0 if scale is None else scale
        return transform


def _are_cut_outs(views: list[View]) -> bool:
    """Whether the photos are cut-outs: RGBA and, in the first, middle or last photo, somewhere
    transparent.
    """
    probes = {view.image_path for view in (views[0], views[len(views) // 2], views[-1])}
    return any(is_cut_out(photo) for photo in probes)


def _bounds(
    file: _TransformsFile,
    cameras: list[Camera],
    cut_out: bool,
    synthetic: bool,
    points: SparsePoints | None,
) -> tuple[bool, npt.NDArray[np.float64]]:
    """(whether the scene is unbounded, its bounds [2,3])."""
    where = str(file.path)
    aabb_scale = read_number(where, file.values, "aabb_scale")
    if aabb_scale is not None and aabb_scale <= 0:
        raise DatasetError(
            f"{where}: key 'aabb_scale' must be positive, got {aabb_scale:g}; 1 is the unit cube"
        )
    if aabb_scale is not None and aabb_scale <= 1:
        return False, _ngp_unit_cube(file)
    if synthetic and "aabb" in file.values:
        return False, read_box(where, file.values["aabb"])
    if synthetic and cut_out and aabb_scale is None:
        return False, np.array([[-_SYNTHETIC_HALF_SIZE] * 3, [_SYNTHETIC_HALF_SIZE] * 3])
    positions = None if points is None else points.positions
    return aabb_scale is not None or not cut_out, cube_of_interest(cameras, points=positions)


def _ngp_unit_cube(file: _TransformsFile) -> npt.NDArray[np.float64]:
    """Instant-NGP's unit cube in the file's coordinates."""
    scale = read_number(str(file.path), file.values, "scale")
    scale = _NGP_SCALE if scale is None else scale
    try:
        offset = np.broadcast_to(np.array(file.values.get("offset", _NGP_OFFSET), dtype=np.float64), 3)
    except (TypeError, ValueError):
        offset = np.full(3, np.nan)
    if scale <= 0 or not np.isfinite(offset).all():
        raise DatasetError(f"{file.path}: 'scale' must be positive and 'offset' 3 finite numbers")
    return np.stack([-offset / scale, (1.0 - offset) / scale])
