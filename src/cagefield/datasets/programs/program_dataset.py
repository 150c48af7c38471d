"""Captures as capture programs write them: frames with cameras and names of photos, made a data set.

Readers of programs give `Frame`s in the program's world; `program_dataset` finds their photos, fits the
intrinsics to them, levels the world and reports what is left out.
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
from cagefield.datasets.capture_dataset import unbounded_capture
from cagefield.datasets.colmap.colmap_lenses import LensView, lens_views, report_resampled
from cagefield.datasets.notices import warn
from cagefield.datasets.photo_names import find_photos, photo_files, view_name
from cagefield.datasets.photos import choose_downscale, read_header
from cagefield.datasets.scene_bounds import cube_of_interest, depths_of_points, levelling_rotation
from cagefield.datasets.views import Dataset, SparsePoints, View, named, report_missing
from cagefield.errors import CameraError, DatasetError

FloatArray = npt.NDArray[np.float64]

OPENCV_AXES = np.array([1.0, -1.0, -1.0, 1.0])
"""Factors of a pose's columns from OpenCV's camera axes (y down, z forward) to OpenGL's, and back."""


Lenses = tuple[LensView, ...]
"""The views that show a photo: one, or the faces of a panorama."""


@dataclass(frozen=True)
class Frame:
    """A photo's `name` in the program's file, its OpenGL camera-to-world `pose` [4,4], and its lens.

    `lenses` is a function of the photo's width and height where the program gives intrinsics by these.
    """

    name: str
    pose: FloatArray
    lenses: Lenses | Callable[[int, int], Lenses]


def brown_lens(
    where: str,
    size: tuple[int, int],
    focal: tuple[float, float],
    center: tuple[float, float],
    radial: Sequence[float] = (),
    tangential: Sequence[float] = (),
) -> Lenses:
    """The lens of Brown's model: up to four `radial` coefficients, and OpenCV's p1, p2.

    Raises DatasetError, which begins with `where`, for values that no camera has.
    """
    k1, k2, k3, k4 = (*radial, 0.0, 0.0, 0.0, 0.0)[:4]
    p1, p2 = tuple(tangential) or (0.0, 0.0)
    distortion = (k1, k2, p1, p2, k3, k4)
    model: Lens = "opencv" if any(distortion) else "pinhole"
    with _named_values(where):
        camera = Camera(
            np.eye(4), *size, *focal, *center, model=model, distortion=distortion if any(distortion) else ()
        )
    return (LensView(camera),)


def colmap_lens(where: str, model: str, params: Sequence[float], size: tuple[int, int]) -> Lenses:
    """The lens of one of COLMAP's camera models. Raises DatasetError, which begins with `where`."""
    with _named_values(where):
        return lens_views(model, tuple(params), *size)


@contextlib.contextmanager
def _named_values(where: str) -> Iterator[None]:
    try:
        yield
    except (CameraError, DatasetError) as error:
        raise DatasetError(f"{where}: {error}") from error


@dataclass
class ProgramCapture:
    """Content of a program's file.

    Attributes:
        file: it, or its folder, for messages.
        folder: the data set's, below which the photos are.
        photos: the folder that names are relative to.
        frames: those with a pose.
        left_out: names of other frames, by the reason ("are not aligned").
        up: the world's up axis [3], where the program says; else it is estimated from the cameras.
        points: sparse points in the program's world.
    """

    file: Path
    folder: Path
    photos: Path
    frames: list[Frame]
    left_out: dict[str, list[str]] = field(default_factory=dict)
    up: tuple[float, float, float] | None = None
    points: SparsePoints | None = None


def program_dataset(capture: ProgramCapture, downscale: int | None, holdout: int) -> Dataset:
    """The unbounded data set of a capture; every `holdout`-th view tests.

    Raises DatasetError where no frame is left, or a photo has another aspect than its intrinsics.
    """
    frames = _with_sensible_poses(capture)
    total = len(capture.frames) + sum(map(len, capture.left_out.values()))
    for reason, names in capture.left_out.items():
        if names and frames:
            warn(
                f"{capture.file}: {len(names)} of {total} photos are left out, they {reason}: {named(names)}"
            )
    if not frames:
        reasons = "; ".join(f"{len(names)} {reason}" for reason, names in capture.left_out.items() if names)
        raise DatasetError(
            f"{capture.file}: no photo in it has a pose{' (' + reasons + ')' if reasons else ''}; align the "
            "photos and export their cameras again"
        )
    located = _located(capture, frames)
    levelling = _levelling(np.stack([frame.pose for frame, _ in located]), capture.up)
    moved = []
    for view in _views(capture, located):
        pose = levelling @ view.camera.c2w
        moved.append(replace(view, camera=view.camera.with_c2w(pose)))
    factor = choose_downscale(max(max(v.camera.width, v.camera.height) for v in moved), downscale)
    views = [view.downscaled(factor) for view in moved]
    cameras = [view.camera for view in views]
    points = None if capture.points is None else _moved_points(capture.points, levelling, views)
    positions = None if points is None else points.positions
    depths = None if positions is None else depths_of_points(cameras, positions)
    return unbounded_capture(
        capture.folder,
        views,
        holdout,
        cube_of_interest(cameras, points=positions),
        levelling,
        None if depths is None else (float(depths[:, 0].min()), float(depths[:, 1].max())),
        points,
    )


def _with_sensible_poses(capture: ProgramCapture) -> list[Frame]:
    """The frames with finite poses of distinct photos; the others are put in `left_out`."""
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


def _located(capture: ProgramCapture, frames: Sequence[Frame]) -> list[tuple[Frame, Path]]:
    """The frames whose photos are there, with them; names with folders become paths below the photos' folder.

    Raises DatasetError where no photo is there.
    """
    found = find_photos(capture.photos, [frame.name for frame in frames])
    # A name without a folder says nothing about where the photo is.
    found.moved = {name: path for name, path in found.moved.items() if "/" in view_name(name)}
    found.report(capture.file, capture.photos)
    report_missing(capture.file, sorted(f.name for f in frames if f.name not in found.photos), len(frames))
    _report_unnamed(capture, list(found.photos.values()))
    names = {name: found.name_of(name, capture.photos) for name in found.photos}
    if capture.points is not None:
        seen_by = tuple(frozenset(names.get(one, one) for one in seen) for seen in capture.points.seen_by)
        capture.points = replace(capture.points, seen_by=seen_by)
    return [
        (replace(frame, name=names[frame.name]), found.photos[frame.name])
        for frame in frames
        if frame.name in found.photos
    ]


def _report_unnamed(capture: ProgramCapture, used: Sequence[Path]) -> None:
    """Warns of photos in the folders of those that are used, which no frame names."""
    taken = {os.path.realpath(photo) for photo in used}
    listed = {
        Path(name.replace("\\", "/")).stem.casefold() for names in capture.left_out.values() for name in names
    }
    others = []
    for folder in sorted({photo.parent for photo in used}):
        for photo in photo_files(folder):
            if os.path.realpath(photo) not in taken and photo.stem.casefold() not in listed:
                others.append(photo.relative_to(folder).as_posix())
    if others:
        warn(
            f"{capture.file}: {len(others)} photos beside those it names have no camera in it and are left "
            f"out: {named(others)}"
        )


def _views(capture: ProgramCapture, frames: Sequence[tuple[Frame, Path]]) -> list[View]:
    """Full-size views, in the program's world; intrinsics are scaled where photos were scaled since."""
    views: list[View] = []
    shown: list[LensView] = []
    scaled: Counter[tuple[tuple[int, int], tuple[int, int]]] = Counter()
    for frame, photo in frames:
        where = f"{capture.file}: {frame.name}"
        header = read_header(photo)
        size = header.width, header.height
        lenses = frame.lenses if isinstance(frame.lenses, tuple) else frame.lenses(*size)
        said = lenses[0].size
        if size != said:
            _check_aspect(f"{where}: {photo}", size, said)
            scaled[said, size] += 1
            lenses = tuple(lens.resized(*size) for lens in lenses)
        shown += lenses
        with _named_values(where):
            views += [
                View(
                    lens.name(frame.name),
                    lens.camera.with_c2w(lens.pose(frame.pose)),
                    photo,
                    source=lens.source,
                )
                for lens in lenses
            ]
    for (said, size), count in scaled.items():
        warn(
            f"{capture.file}: the intrinsics of {count} photos are of {said[0]}x{said[1]} pixels, the photos "
            f"have {size[0]}x{size[1]}: the intrinsics are scaled by {size[0] / said[0]:.4g}"
        )
    report_resampled(str(capture.file), shown)
    return views


def _check_aspect(where: str, size: tuple[int, int], said: tuple[int, int]) -> None:
    """Raises DatasetError where a photo's `size` is no scaled one of what is `said`, to a pixel."""
    across, down = size[0] / said[0], size[1] / said[1]
    if abs(across - down) * max(said) > 1.0 + max(across, down):
        turned = ", not turned since" if size == said[::-1] else ""
        raise DatasetError(
            f"{where} is {size[0]}x{size[1]}, the intrinsics are of {said[0]}x{said[1]}; use the photos that "
            f"the program had{turned}"
        )


def _levelling(poses: FloatArray, up: tuple[float, float, float] | None) -> FloatArray:
    """A rotation [4,4] to a world whose up is +z."""
    motion = np.eye(4)
    motion[:3, :3] = levelling_rotation(poses, up)
    return motion


def _moved_points(points: SparsePoints, motion: FloatArray, views: Sequence[View]) -> SparsePoints:
    """The points in the leveled world, seen by some of `views`."""
    names = {view.name for view in views}
    positions = points.positions @ motion[:3, :3].T + motion[:3, 3]
    seen_by = tuple(seen & names for seen in points.seen_by)
    return SparsePoints(positions, points.rgb, seen_by if any(seen_by) else (), points.errors)
