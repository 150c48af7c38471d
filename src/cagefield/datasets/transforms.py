"""Data sets described by `transforms*.json`: NeRF-synthetic, Instant-NGP and nerfstudio.

All three give OpenGL camera-to-world matrices, which are used as they are. The keys of the three dialects are
read alike; a key in a frame wins over the same key of the file:
  size        w, h; else the size of the photo. Where all photos have another one with the same aspect, the
              intrinsics are scaled, with a warning
  focal       fl_x, fl_y in pixels; x_fov, y_fov in degrees; camera_angle_x, camera_angle_y in radians
  axis        cx, cy in pixels; else the middle of the image
  lens        camera_model (PINHOLE, SIMPLE_PINHOLE, OPENCV, OPENCV_FISHEYE), is_fisheye, k1..k4, p1, p2
  photo       file_path, relative to the file, with or without extension
  scene       aabb_scale, scale, offset (Instant-NGP), applied_transform (nerfstudio)
  points      ply_file_path (nerfstudio): a PLY file of sparse points in the file's world
  splits      transforms_train/val/test.json, or train_filenames, val_filenames, test_filenames in one file
`applied_transform` [3,4] is what nerfstudio did to the reconstruction's coordinates before it wrote the
poses: the file's world = applied_transform x the reconstruction's. It becomes `Dataset.source_to_world` and
moves nothing.
"""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield import json_text
from cagefield.cameras import Camera
from cagefield.datasets.captures import uniform_size, warn_of_scaling
from cagefield.datasets.photos import Header, choose_downscale, find_photo, is_cut_out, read_header
from cagefield.datasets.point_files import read_points
from cagefield.datasets.region import cube_of_interest, depths_of_points
from cagefield.datasets.views import Dataset, SparsePoints, View, hold_out, report_missing
from cagefield.errors import CameraError, DatasetError
from cagefield.lenses import Lens
from cagefield.regular_files import read_text, real_path

LONGEST = 255
"""Characters in a file's name, at most, on the systems there are."""

SPLITS = ("train", "test", "val")

_SYNTHETIC_HALF_SIZE = 1.5  # the NeRF-synthetic scenes fit in [-1.5, 1.5]^3
_NGP_SCALE, _NGP_OFFSET = 0.33, 0.5  # Instant-NGP: unit cube coordinates = scale * file coordinates + offset
_LENSES: dict[str, Lens] = {
    "PINHOLE": "opencv",
    "SIMPLE_PINHOLE": "opencv",
    "OPENCV": "opencv",
    "OPENCV_FISHEYE": "opencv_fisheye",
}


def load_transforms(path: Path, downscale: int | None, holdout: int) -> Dataset:
    """The data set of a folder with `transforms.json` or `transforms_train.json`, or of one such file.

    A scene of cut-out photos (RGBA, not all opaque) is bounded: [-1.5, 1.5]^3 in the NeRF-synthetic layout,
    else the cube of interest. Anything else is unbounded, with the cube of interest as its inner box.
    `aabb_scale` decides where it is given: 1 means bounded by Instant-NGP's unit cube, more means unbounded.
    A missing test split is replaced by the validation split, and where there is none by every `holdout`-th
    view.
    """
    folder = path if path.is_dir() else path.parent
    split_files = {split: folder / f"transforms_{split}.json" for split in SPLITS}
    synthetic = path.name.startswith("transforms_") if path.is_file() else split_files["train"].is_file()
    if synthetic:
        if not split_files["train"].is_file():
            raise DatasetError(
                f"{split_files['train']} is missing; the training views must be described there"
            )
        files = {split: _TransformsFile(file) for split, file in split_files.items() if file.is_file()}
        main = files["train"]
        views = {split: files[split].views if split in files else [] for split in SPLITS}
    else:
        main = _TransformsFile(path if path.is_file() else folder / "transforms.json")
        files = {"train": main}
        views = main.split_views()
    missing = [name for file in files.values() for name in file.missing]
    report_missing(folder if synthetic else main.path, missing, sum(file.total for file in files.values()))
    if not views["train"]:
        raise DatasetError(f"{main.path}: none of the training views' photos is there; check file_path")
    everything = [view for split in SPLITS for view in views[split]]
    factor = choose_downscale(max(max(v.camera.width, v.camera.height) for v in everything), downscale)
    split = {name: tuple(view.downscaled(factor) for view in views[name]) for name in SPLITS}
    train, test = split["train"], split["test"] or split["val"]
    if not test:
        train, test = hold_out(train, holdout)
    cut_out = _are_cut_out(views["train"])
    points = main.points()
    unbounded, bounds = _extent(main, [view.camera for view in views["train"]], cut_out, synthetic, points)
    found = None if points is None else depths_of_points([v.camera for v in everything], points.positions)
    return Dataset(
        name=real_path(folder).name,
        path=folder,
        train=train,
        test=test,
        val=split["val"],
        unbounded=unbounded,
        bounds=bounds,
        white_background=cut_out,
        source_to_world=main.applied_transform(),
        depths=None if found is None else (float(found[:, 0].min()), float(found[:, 1].max())),
        points=points,
    )


@dataclass
class _TransformsFile:
    """One file: its full-size views, the names of frames without a photo, and the number of frames."""

    path: Path
    values: dict[str, Any] = field(init=False)
    views: list[View] = field(init=False, default_factory=list)
    missing: list[str] = field(init=False, default_factory=list)
    total: int = field(init=False)

    def __post_init__(self) -> None:
        self.values = _read_json(self.path)
        frames = self.values.get("frames")
        if not isinstance(frames, list) or not frames:
            raise DatasetError(f"{self.path}: key 'frames' must be a list with at least one frame")
        self.total = len(frames)
        for index, frame in enumerate(frames):
            where = f"{self.path}: frames[{index}]"
            if not isinstance(frame, dict):
                raise DatasetError(f"{where} must be an object with file_path and transform_matrix")
            file_path = frame.get("file_path")
            if not isinstance(file_path, str) or not 0 < max(map(len, file_path.split("/"))) <= LONGEST:
                raise DatasetError(f"{where}: key 'file_path' must name the photo, got {file_path!r:.80}")
            name = _view_name(file_path)
            photo = find_photo(self.path.parent / name)
            if photo is None:
                self.missing.append(name)
            else:
                self.views.append(View(name, _camera(f"{where} ({name})", self.values, frame, photo), photo))
        self._scale_to_photos()

    def _scale_to_photos(self) -> None:
        """Scales the cameras where all photos were scaled alike since the file was written.

        Raises DatasetError where photos have another size for any other reason.
        """
        headers = [read_header(view.image_path) for view in self.views]
        said = [(view.camera.width, view.camera.height) for view in self.views]
        found = [(header.width, header.height) for header in headers]
        if said == found:
            return
        size = uniform_size(said, found)
        if size is None:
            index = next(i for i in range(len(said)) if said[i] != found[i])
            key, value = ("w", said[index][0]) if said[index][0] != found[index][0] else ("h", said[index][1])
            raise DatasetError(
                f"{self.path}: frame {self.views[index].name}: key {key!r} is {value}, but "
                f"{self.views[index].image_path} is {found[index][0]}x{found[index][1]}; use the photos that "
                "the intrinsics belong to, or scale w, h, fl_x, fl_y, cx and cy to these"
            )
        warn_of_scaling(str(self.path), said[0], size)
        self.views = [replace(view, camera=view.camera.resized(*size)) for view in self.views]

    def split_views(self) -> dict[str, list[View]]:
        """The views by split, as the file's own lists say; all in train where it has none."""
        listed: dict[str, set[str]] = {}
        for split in SPLITS:
            names = self.values.get(key := f"{split}_filenames")
            if names is None:
                continue
            if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
                raise DatasetError(f"{self.path}: key {key!r} must be a list of file names")
            listed[split] = {_view_name(name) for name in names}
        held_out = listed.get("test", set()) | listed.get("val", set())
        listed.setdefault("train", {view.name for view in self.views} - held_out)
        return {split: [v for v in self.views if v.name in listed.get(split, ())] for split in SPLITS}

    def points(self) -> SparsePoints | None:
        """The points of `ply_file_path`; None, with a warning, where the file cannot be read."""
        name = self.values.get("ply_file_path")
        if name is None:
            return None
        if not isinstance(name, str) or not name:
            raise DatasetError(f"{self.path}: key 'ply_file_path' must name a PLY file, got {name!r:.80}")
        try:
            found = read_points(self.path.parent / _view_name(name))
        except DatasetError as error:
            warnings.warn(f"{error}; {self.path} is used without its points", stacklevel=4)
            return None
        return found if len(found) else None

    def applied_transform(self) -> npt.NDArray[np.float64]:
        """nerfstudio's `applied_transform` as [4,4]; the identity where the file has none."""
        if self.values.get("applied_transform") is None:
            return np.eye(4)
        return _matrix(f"{self.path}: key 'applied_transform'", self.values["applied_transform"])


def _read_json(path: Path) -> dict[str, Any]:
    try:
        values = json_text.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise DatasetError(
            f"{path}: not valid JSON at line {error.lineno}, column {error.colno} ({error.msg}); "
            "the file may be cut off, copy it again"
        ) from None
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path}: cannot be read ({error})") from None
    if not isinstance(values, dict):
        raise DatasetError(f"{path}: must be a JSON object with the key 'frames'")
    return values


def _view_name(file_path: str) -> str:
    """`file_path` with forward slashes and no leading ./"""
    return str(PurePosixPath(file_path.replace("\\", "/")))


def _number(where: str, source: dict[str, Any], key: str) -> float | None:
    value = source.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise DatasetError(f"{where}: key {key!r} must be a finite number, got {value!r:.40}")
    return float(value)


def _matrix(where: str, value: Any) -> npt.NDArray[np.float64]:
    try:
        matrix = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape == (3, 4):
        matrix = np.concatenate([matrix, [[0.0, 0.0, 0.0, 1.0]]])
    if matrix.shape != (4, 4):
        raise DatasetError(f"{where} must be 4 rows (or 3) of 4 numbers")
    return matrix


def _camera(where: str, values: dict[str, Any], frame: dict[str, Any], photo: Path) -> Camera:
    """The full-size camera of one frame."""
    merged = {**values, **frame}
    header = read_header(photo)
    width, height = _size(where, merged, header)
    fx, fy = _focal_lengths(where, frame, width, height)
    if fx is None and fy is None:
        fx, fy = _focal_lengths(where, values, width, height)
    fx, fy = (fy if fx is None else fx), (fx if fy is None else fy)
    if fx is None or fy is None:
        raise DatasetError(f"{where}: no focal length; give fl_x (pixels) or camera_angle_x (radians)")
    cx, cy = _number(where, merged, "cx"), _number(where, merged, "cy")
    model, distortion = _lens(where, merged)
    try:
        return Camera(
            _matrix(f"{where}: key 'transform_matrix'", frame.get("transform_matrix")),
            width,
            height,
            fx=fx,
            fy=fy,
            cx=0.5 * width if cx is None else cx,
            cy=0.5 * height if cy is None else cy,
            model=model,
            distortion=distortion,
        )
    except CameraError as error:
        raise DatasetError(f"{where}: {str(error).replace('c2w', 'transform_matrix')}") from error


def _size(where: str, merged: dict[str, Any], header: Header) -> tuple[int, int]:
    """(width, height) as the file says; the photo's where it says nothing."""
    width, height = _number(where, merged, "w"), _number(where, merged, "h")
    for key, value in (("w", width), ("h", height)):
        if value is not None and (value < 1 or value != int(value)):
            raise DatasetError(f"{where}: key {key!r} must be a whole number of pixels, got {value:g}")
    return int(width or header.width), int(height or header.height)


def _focal_lengths(
    where: str, source: dict[str, Any], width: int, height: int
) -> tuple[float | None, float | None]:
    """Focal lengths in pixels along x and y as far as `source` gives them."""
    found: list[float | None] = []
    for axis, side in (("x", width), ("y", height)):
        focal = _number(where, source, f"fl_{axis}")
        if focal is None:
            angle = _number(where, source, f"camera_angle_{axis}")
            degrees = _number(where, source, f"{axis}_fov")
            if degrees is not None:
                angle = math.radians(degrees)
            if angle is not None:
                if not 0.0 < angle < math.pi:
                    raise DatasetError(
                        f"{where}: the field of view along {axis} is {math.degrees(angle):g} degrees; it "
                        f"must lie between 0 and 180 (radians in camera_angle_{axis}, degrees in {axis}_fov)"
                    )
                focal = 0.5 * side / math.tan(0.5 * angle)
        found.append(focal)
    return found[0], found[1]


def _lens(where: str, merged: dict[str, Any]) -> tuple[Lens, tuple[float, ...]]:
    name = merged.get("camera_model", "OPENCV")
    if not isinstance(name, str) or name not in _LENSES:
        raise DatasetError(
            f"{where}: camera_model {name!r:.40} cannot be read, only {', '.join(_LENSES)}; "
            "undistort the photos first"
        )
    for key in ("lens_mode", "ftheta_p0", "latlong", "equirectangular"):
        if merged.get(key):
            raise DatasetError(f"{where}: the lens of key {key!r} cannot be read; undistort the photos first")
    fisheye = _LENSES[name] == "opencv_fisheye" or merged.get("is_fisheye") is True
    keys = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2", "k3", "k4")
    distortion = tuple(_number(where, merged, key) or 0.0 for key in keys)
    if fisheye:
        return "opencv_fisheye", distortion
    return ("opencv", distortion) if any(distortion) else ("pinhole", ())


def _are_cut_out(views: list[View]) -> bool:
    """Whether the photos are cut-outs: RGBA and, in the first, middle or last one, somewhere transparent."""
    probes = {view.image_path for view in (views[0], views[len(views) // 2], views[-1])}
    return any(is_cut_out(photo) for photo in probes)


def _extent(
    file: _TransformsFile,
    cameras: list[Camera],
    cut_out: bool,
    synthetic: bool,
    points: SparsePoints | None,
) -> tuple[bool, npt.NDArray[np.float64]]:
    """Whether the scene is unbounded, and its bounds [2,3]."""
    where = str(file.path)
    aabb_scale = _number(where, file.values, "aabb_scale")
    if aabb_scale is not None and aabb_scale <= 0:
        raise DatasetError(
            f"{where}: key 'aabb_scale' must be positive, got {aabb_scale:g}; 1 is the unit cube"
        )
    if aabb_scale is not None and aabb_scale <= 1:
        return False, _ngp_unit_cube(file)
    if synthetic and "aabb" in file.values:
        return False, _box(where, file.values["aabb"])
    if synthetic and cut_out and aabb_scale is None:
        return False, np.array([[-_SYNTHETIC_HALF_SIZE] * 3, [_SYNTHETIC_HALF_SIZE] * 3])
    positions = None if points is None else points.positions
    return aabb_scale is not None or not cut_out, cube_of_interest(cameras, points=positions)


def _box(where: str, value: object) -> npt.NDArray[np.float64]:
    """The scene's box that a file gives as [[min], [max]]."""
    try:
        box = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        box = np.full((2, 3), np.nan)
    if box.shape != (2, 3) or not np.isfinite(box).all() or not (box[0] < box[1]).all():
        raise DatasetError(f"{where}: key 'aabb' must be [[min x, y, z], [max x, y, z]], got {value!r:.80}")
    return box


def _ngp_unit_cube(file: _TransformsFile) -> npt.NDArray[np.float64]:
    """Instant-NGP's unit cube in the file's coordinates."""
    scale = _number(str(file.path), file.values, "scale")
    scale = _NGP_SCALE if scale is None else scale
    try:
        offset = np.broadcast_to(np.array(file.values.get("offset", _NGP_OFFSET), dtype=np.float64), 3)
    except (TypeError, ValueError):
        offset = np.full(3, np.nan)
    if scale <= 0 or not np.isfinite(offset).all():
        raise DatasetError(f"{file.path}: 'scale' must be positive and 'offset' 3 finite numbers")
    return np.stack([-offset / scale, (1.0 - offset) / scale])
