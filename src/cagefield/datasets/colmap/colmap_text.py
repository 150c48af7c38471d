"""COLMAP models in text form, as COLMAP and other programs write them.

Names may hold spaces, lines end as on any system, a file may begin with a byte order mark, an image may lack
its second line (its observations), the points may be missing. The objects have the attributes of pycolmap's
that this package reads. Rigs and frames are not read: images have their own poses.

Source: COLMAP, "Output Format", text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from cagefield.datasets.notices import warn
from cagefield.errors import DatasetError
from cagefield.files.safe_open import open_regular

MAX_ID = 1 << 62

_MAX_LINE_CHARACTERS = 60  # characters of a line in an error


@dataclass(frozen=True)
class LensModel:
    """Name of a camera model, in COLMAP's spelling."""

    name: str


@dataclass(frozen=True)
class TextCamera:
    """Camera of one line of cameras.txt."""

    camera_id: int
    model: LensModel
    width: int
    height: int
    params: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Rigid:
    """Rigid motion: rotation [3,3] and translation [3]."""

    rotation: npt.NDArray[np.float64]
    translation: npt.NDArray[np.float64]

    def matrix(self) -> npt.NDArray[np.float64]:
        """Matrix [3,4] of the rotation and the translation."""
        return np.concatenate([self.rotation, self.translation[:, None]], axis=1)


@dataclass(frozen=True, eq=False)
class TextImage:
    """Image of one first line in images.txt."""

    image_id: int
    camera_id: int
    name: str
    cam_from_world: Rigid


@dataclass(frozen=True)
class TrackElement:
    """Observation of a point in an image."""

    image_id: int


@dataclass(frozen=True)
class Track:
    """Observations of a point."""

    elements: tuple[TrackElement, ...]


@dataclass(frozen=True, eq=False)
class TextPoint:
    """Point of one line of points3D.txt."""

    xyz: npt.NDArray[np.float64]
    color: npt.NDArray[np.uint8]
    error: float
    track: Track


@dataclass(frozen=True)
class TextModel:
    """COLMAP model: cameras, images and points by their numbers."""

    cameras: dict[int, TextCamera] = field(default_factory=dict)
    images: dict[int, TextImage] = field(default_factory=dict)
    points3D: dict[int, TextPoint] = field(default_factory=dict)  # noqa: N815 - pycolmap's name


def read_text_model(folder: Path) -> TextModel:
    """Model of cameras.txt, images.txt and, where it exists, points3D.txt.

    Raises DatasetError, with file and line, for unreadable values, and for a camera that is missing.
    """
    model = TextModel()
    _read_cameras(folder / "cameras.txt", model)
    _read_images(folder / "images.txt", model)
    if (folder / "points3D.txt").is_file():
        for number, tokens in _rows(folder / "points3D.txt"):
            _read_point(f"{folder / 'points3D.txt'}, line {number}", tokens, model)
    return model


def _read_cameras(file: Path, model: TextModel) -> None:
    for number, tokens in _rows(file):
        where = f"{file}, line {number}"
        if len(tokens) < 5:
            raise _line_error(where, tokens, "must be CAMERA_ID MODEL WIDTH HEIGHT PARAMS")
        camera_id, width, height = (_integer(where, tokens, index) for index in (0, 2, 3))
        params = tuple(_float(where, tokens, index) for index in range(4, len(tokens)))
        model.cameras[camera_id] = TextCamera(camera_id, LensModel(tokens[1]), width, height, params)


def _read_images(file: Path, model: TextModel) -> None:
    declared_count = 0  # images, by the comment at the beginning
    is_second_line = False  # whether the line may hold the observations of the image before
    for number, line in _lines(file):
        tokens = line.split()
        if is_second_line and (not tokens or _is_observation_line(tokens)):
            is_second_line = False
            continue
        if not tokens or tokens[0].startswith("#"):
            if counted := re.search(r"Number of images: (\d+)", line):
                declared_count = int(counted[1])
            continue
        where = f"{file}, line {number}"
        if len(tokens) < 10:
            raise _line_error(where, tokens, "must be IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME")
        image_id, camera_id = _integer(where, tokens, 0), _integer(where, tokens, 8)
        name = line.split(maxsplit=9)[9].strip()
        if camera_id not in model.cameras:
            raise DatasetError(
                f"{where}: image {name} has the camera {camera_id}, which cameras.txt lacks; export it again"
            )
        values = np.array([_float(where, tokens, index) for index in range(1, 8)])
        rigid = Rigid(_rotation(values[:4]), values[4:])
        model.images[image_id] = TextImage(image_id, camera_id, name, rigid)
        is_second_line = True
    if len(model.images) < declared_count:
        warn(
            f"{file}: it says {declared_count} images and has {len(model.images)}; where it is cut off, "
            f"export it again"
        )


def _is_observation_line(tokens: list[str]) -> bool:
    """Whether a line holds triples of X, Y and POINT3D_ID."""
    if len(tokens) % 3:
        return False
    try:
        for x, y, point in zip(tokens[::3], tokens[1::3], tokens[2::3], strict=True):
            float(x), float(y), int(point)
    except ValueError:
        return False
    return True


def _read_point(where: str, tokens: list[str], model: TextModel) -> None:
    if len(tokens) < 7:
        raise _line_error(where, tokens, "must be POINT3D_ID X Y Z R G B ERROR TRACK")
    point_id = _integer(where, tokens, 0)
    xyz = np.array([_float(where, tokens, index) for index in (1, 2, 3)])
    color = np.array([_float(where, tokens, index) for index in (4, 5, 6)])
    error = _float(where, tokens, 7) if len(tokens) > 7 else -1.0
    elements = tuple(TrackElement(_integer(where, tokens, index)) for index in range(8, len(tokens), 2))
    color = np.clip(np.where(np.isfinite(color), color, 0.0), 0, 255).astype(np.uint8)
    model.points3D[point_id] = TextPoint(xyz, color, error, Track(elements))


def _rotation(quaternion: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Rotation [3,3] of a quaternion (w, x, y, z) of any length; NaN for length 0."""
    with np.errstate(all="ignore"):
        w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _lines(file: Path) -> Iterator[tuple[int, str]]:
    """(number, text) of each line, without a byte order mark and line ends."""
    try:
        with open_regular(file) as stream:
            for number, content in enumerate(stream, start=1):
                line = content.decode("utf-8-sig" if number == 1 else "utf-8")
                yield number, line.rstrip("\r\n")
    except UnicodeDecodeError:
        raise DatasetError(
            f"{file}: it is no UTF-8 text; save it as UTF-8, or rename the photos and export the model again"
        ) from None
    except OSError as error:
        raise DatasetError(f"{file}: cannot be read ({error.strerror}); export the model again") from None


def _rows(file: Path) -> Iterator[tuple[int, list[str]]]:
    """(number, tokens) of each line that is neither empty nor a comment."""
    for number, line in _lines(file):
        tokens = line.split()
        if tokens and not tokens[0].startswith("#"):
            yield number, tokens


def _integer(where: str, tokens: list[str], index: int) -> int:
    try:
        value = int(tokens[index])
    except ValueError:
        value = -1
    if not 0 <= value <= MAX_ID:
        raise _line_error(where, tokens, f"must have a whole number at place {index + 1}")
    return value


def _float(where: str, tokens: list[str], index: int) -> float:
    try:
        return float(tokens[index])
    except ValueError:
        raise _line_error(where, tokens, f"must have a number at place {index + 1}") from None


def _line_error(where: str, tokens: list[str], wanted: str) -> Any:
    line = " ".join(tokens)
    shown = line if len(line) <= _MAX_LINE_CHARACTERS else line[:_MAX_LINE_CHARACTERS] + "..."
    return DatasetError(f"{where}: {wanted}, got {shown!r}; export the model again")
