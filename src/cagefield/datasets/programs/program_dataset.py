"""Data sets from the cameras and photo names of a capture program's file.

Readers of programs give `Frame`s in the program's world; `build_program_dataset` finds their photos, fits the
intrinsics to them, levels the world and reports frames that are left out.
"""

from __future__ import annotations

import contextlib
import os
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from cagefield.cameras.camera import Camera
from cagefield.cameras.lenses import Lens
from cagefield.datasets.capture_dataset import build_unbounded_dataset
from cagefield.datasets.colmap.colmap_lenses import LensView, lens_views, report_resampled
from cagefield.datasets.notices import warn
from cagefield.datasets.photo_names import find_photos, photo_files, view_name
from cagefield.datasets.photos import choose_downscale, read_header
from cagefield.datasets.scene_bounds import cube_of_interest, depths_of_points, leveling_rotation
from cagefield.datasets.views import Dataset, SparsePoints, View, join_names, report_missing
from cagefield.errors import CameraError, DatasetError

FloatArray = npt.NDArray[np.float64]

OPENCV_AXIS_SIGNS = np.array([1.0, -1.0, -1.0, 1.0])
"""Factors of a pose's columns from OpenCV's camera axes (y down, z forward) to OpenGL's, and back."""


Lenses = tuple[LensView, ...]
"""Views that show a photo: one, or the faces of a panorama."""


@dataclass(frozen=True)
class Frame:
    """Name of a photo in the program's file, its OpenGL camera-to-world `pose` [4,4], and its lens.

    `lenses` is a function of the photo's width and height where the program gives intrinsics relative to
    these.
    """

    name: str
    pose: FloatArray
    lenses: Lenses | Callable[[int, int], Lenses]


def build_brown_lens(
    where: str,
    size: tuple[int, int],
    focal: tuple[float, float],
    center: tuple[float, float],
    radial: Sequence[float] = (),
    tangential: Sequence[float] = (),
) -> Lenses:
    """Lens of Brown's model: up to four `radial` coefficients, and OpenCV's p1, p2.

    Raises DatasetError, which begins with `where`, for values that no camera has.
    """
    k1, k2, k3, k4 = (*radial, 0.0, 0.0, 0.0, 0.0)[:4]
    p1, p2 = tuple(tangential) or (0.0, 0.0)
    distortion = (k1, k2, p1, p2, k3, k4)
    model: Lens = "opencv" if any(distortion) else "pinhole"
    with _prefix_errors(where):
        camera = Camera(
            np.eye(4), *size, *focal, *center, model=model, distortion=distortion if any(distortion) else ()
        )
    return (LensView(camera),)


def build_colmap_lens(where: str, model: str, params: Sequence[float], size: tuple[int, int]) -> Lenses:
    """Lens of one of COLMAP's camera models. Raises DatasetError, which begins with `where`."""
    with _prefix_errors(where):
        return lens_views(model, tuple(params), *size)


@contextlib.contextmanager
def _prefix_errors(where: str) -> Iterator[None]:
    try:
        yield
    except (CameraError, DatasetError) as error:
        raise DatasetError(f"{where}: {error}") from error


@dataclass
class ProgramCapture:
    """Content of a program's file.

    Attributes:
        file: the file or its folder, for messages.
        folder: the data set's folder, below which the photos are.
        photos: the folder that names are relative to.
        frames: frames with a pose.
        left_out: names of other frames, by the reason ("are not aligned").
        up: the world's up axis [3], where the program gives it; else it is estimated from the cameras.
        points: sparse points in the program's world.
    """

    file: Path
    folder: Path
    photos: Path
    frames: list[Frame]
    left_out: dict[str, list[str]] = field(default_factory=dict)
    up: tuple[float, float, float] | None = None
    points: SparsePoints | None = None


def build_program_dataset(capture: ProgramCapture, downscale: int | None, holdout: int) -> Dataset:
    """Unbounded data set of a capture; every `holdout`-th view tests.

    Raises DatasetError where no frame is left, or a photo has another aspect than its intrinsics.
    """
    frames = _filter_frames(capture)
    total = len(capture.frames) + sum(map(len, capture.left_out.values()))
    for reason, names in capture.left_out.items():
        if names and frames:
            warn(
                f"{capture.file}: {len(names)} of {total} photos are left out, they {reason}: "
                f"{join_names(names)}"
            )
    if not frames:
        reasons = "; ".join(f"{len(names)} {reason}" for reason, names in capture.left_out.items() if names)
        raise DatasetError(
            f"{capture.file}: no photo in it has a pose{' (' + reasons + ')' if reasons else ''}; align the "
            "photos and export their cameras again"
        )
    located_frames = _locate_photos(capture, frames)
    leveling = _leveling(np.stack([frame.pose for frame, _ in located_frames]), capture.up)
    leveled_views = []
    for view in _views(capture, located_frames):
        pose = leveling @ view.camera.c2w
        leveled_views.append(replace(view, camera=view.camera.with_c2w(pose)))
    factor = choose_downscale(max(max(v.camera.width, v.camera.height) for v in leveled_views), downscale)
    views = [view.downscaled(factor) for view in leveled_views]
    cameras = [view.camera for view in views]
    points = None if capture.points is None else _transform_points(capture.points, leveling, views)
    positions = None if points is None else points.positions
    depths = None if positions is None else depths_of_points(cameras, positions)
    return build_unbounded_dataset(
        capture.folder,
        views,
        holdout,
        cube_of_interest(cameras, points=positions),
        leveling,
        None if depths is None else (float(depths[:, 0].min()), float(depths[:, 1].max())),
        points,
    )


def _filter_frames(capture: ProgramCapture) -> list[Frame]:
    """Frames with finite poses of distinct photos; the others are added to `left_out`."""
    frames: list[Frame] = []
    names: set[str] = set()
    for frame in capture.frames:
        if not np.isfinite(frame.pose).all():
            capture.left_out.setdefault("have no finite pose", []).append(frame.name)
        elif frame.name in names:
            capture.left_out.setdefault("are listed twice", []).append(frame.name)
        else:
            names.add(frame.name)
            frames.append(frame)
    capture.frames = frames
    return frames


def _locate_photos(capture: ProgramCapture, frames: Sequence[Frame]) -> list[tuple[Frame, Path]]:
    """(frame, photo file) of the frames whose photos exist; a name with folders becomes a path below the
    photos.

    Raises DatasetError where no photo is there.
    """
    matches = find_photos(capture.photos, [frame.name for frame in frames])
    # A name without a folder says nothing about where the photo is.
    matches.moved = {name: path for name, path in matches.moved.items() if "/" in view_name(name)}
    matches.report(capture.file, capture.photos)
    report_missing(capture.file, sorted(f.name for f in frames if f.name not in matches.photos), len(frames))
    _report_unnamed(capture, list(matches.photos.values()))
    names = {name: matches.relative_view_name(name, capture.photos) for name in matches.photos}
    if capture.points is not None:
        seen_by = tuple(
            frozenset(names.get(one, one) for one in view_names) for view_names in capture.points.seen_by
        )
        capture.points = replace(capture.points, seen_by=seen_by)
    return [
        (replace(frame, name=names[frame.name]), matches.photos[frame.name])
        for frame in frames
        if frame.name in matches.photos
    ]


def _report_unnamed(capture: ProgramCapture, used: Sequence[Path]) -> None:
    """Warn of photos in the used photos' folders that no frame names."""
    used_paths = {os.path.realpath(photo) for photo in used}
    listed = {
        Path(name.replace("\\", "/")).stem.casefold() for names in capture.left_out.values() for name in names
    }
    unnamed = []
    for folder in sorted({photo.parent for photo in used}):
        for photo in photo_files(folder):
            if os.path.realpath(photo) not in used_paths and photo.stem.casefold() not in listed:
                unnamed.append(photo.relative_to(folder).as_posix())
    if unnamed:
        warn(
            f"{capture.file}: {len(unnamed)} photos beside those it names have no camera in it and are left "
            f"out: {join_names(unnamed)}"
        )


def _views(capture: ProgramCapture, frames: Sequence[tuple[Frame, Path]]) -> list[View]:
    """Full-size views, in the program's world; intrinsics are scaled where photos were scaled since."""
    views: list[View] = []
    shown_lenses: list[LensView] = []
    scaled: Counter[tuple[tuple[int, int], tuple[int, int]]] = Counter()
    for frame, photo in frames:
        where = f"{capture.file}: {frame.name}"
        header = read_header(photo)
        size = header.width, header.height
        lenses = frame.lenses if isinstance(frame.lenses, tuple) else frame.lenses(*size)
        camera_size = lenses[0].size
        if size != camera_size:
            _check_photo_aspect(f"{where}: {photo}", size, camera_size)
            scaled[camera_size, size] += 1
            lenses = tuple(lens.resized(*size) for lens in lenses)
        shown_lenses += lenses
        with _prefix_errors(where):
            views += [
                View(
                    lens.name(frame.name),
                    lens.camera.with_c2w(lens.pose(frame.pose)),
                    photo,
                    source=lens.source,
                )
                for lens in lenses
            ]
    for (camera_size, size), count in scaled.items():
        warn(
            f"{capture.file}: the intrinsics of {count} photos are of {camera_size[0]}x{camera_size[1]} "
            f"pixels, the photos "
            f"have {size[0]}x{size[1]}: the intrinsics are scaled by {size[0] / camera_size[0]:.4g}"
        )
    report_resampled(str(capture.file), shown_lenses)
    return views


def _check_photo_aspect(where: str, size: tuple[int, int], camera_size: tuple[int, int]) -> None:
    """Raise DatasetError where the aspect of a photo's `size` is not that of `camera_size`, to a pixel."""
    across, down = size[0] / camera_size[0], size[1] / camera_size[1]
    if abs(across - down) * max(camera_size) > 1.0 + max(across, down):
        turned = ", not turned since" if size == camera_size[::-1] else ""
        raise DatasetError(
            f"{where} is {size[0]}x{size[1]}, the intrinsics are of {camera_size[0]}x{camera_size[1]}; "
            f"use the photos that "
            f"the program had{turned}"
        )


def _leveling(poses: FloatArray, up: tuple[float, float, float] | None) -> FloatArray:
    """Rotation [4,4] to a world whose up is +z."""
    motion = np.eye(4)
    motion[:3, :3] = leveling_rotation(poses, up)
    return motion


def _transform_points(points: SparsePoints, motion: FloatArray, views: Sequence[View]) -> SparsePoints:
    """Sparse points in the leveled world, with the observations by `views` alone."""
    names = {view.name for view in views}
    positions = points.positions @ motion[:3, :3].T + motion[:3, 3]
    seen_by = tuple(view_names & names for view_names in points.seen_by)
    return SparsePoints(positions, points.rgb, seen_by if any(seen_by) else (), points.errors)
