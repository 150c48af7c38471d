"""RealityCapture's and RealityScan's cameras: a CSV file of all photos, or an XMP file beside each.

CSV "Internal/External camera parameters": name, x, y, alt, heading (yaw), pitch, roll, f, px, py, k1..k4, t1,
t2, by the names of its columns. Angles in degrees: with z up, the OpenGL camera-to-world rotation is
Rz(-heading) Rx(pitch) Ry(roll). f is the 35 mm equivalent: f max(w,h) / 36 pixels; px and py are shares of
max(w,h) from the middle of the photo.
CSV "OpenCV-compliant": name, tx, ty, tz, R00..R22 (world to camera, OpenCV axes), f, px, py in pixels.
XMP (namespace xcr): Position, Rotation (world to camera, OpenCV axes, row by row), FocalLength35mm,
PrincipalPointU, PrincipalPointV, DistortionModel, DistortionCoeficients k1 k2 k3 k4 t1 t2.
t1 and t2 are OpenCV's p2 and p1. The division model x_d = x_u / (1 + k1 r_u^2) is fitted by Brown's.

Source: calibration.xml of RealityScan 2, the templates of its exports; M. Hornáček, "On the Coordinate
Systems Employed in the Import, Estimation, and Export of Camera Geometry by RealityScan" (2026), sections 3
to 5.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from cagefield.datasets.hidden_files import is_hidden
from cagefield.datasets.notices import warn
from cagefield.datasets.photos import EXTENSIONS
from cagefield.datasets.programs.number_parsing import parse_number, parse_numbers
from cagefield.datasets.programs.program_dataset import (
    OPENCV_AXIS_SIGNS,
    Frame,
    Lenses,
    ProgramCapture,
    build_brown_lens,
    build_program_dataset,
)
from cagefield.datasets.programs.xml_files import read_xml
from cagefield.datasets.views import Dataset
from cagefield.errors import DatasetError
from cagefield.files.safe_open import read_bytes

FloatArray = npt.NDArray[np.float64]
Row = Mapping[str, str]

FILM_WIDTH_MM = 36.0
"""Longer side of the film that 35 mm equivalent focal lengths refer to."""

MAX_DIVISION_ERROR_PIXELS = 0.1
"""Maximum error of Brown's model fitted to the division model of a lens."""

_XCR_NAMESPACE = "{http://www.capturingreality.com/ns/xcr/1.1#}"
_COLUMN_SYNONYMS = {"yaw": "heading", "f_35mm": "f", "px_norm": "px", "py_norm": "py", "z": "alt"}
_ANGLE_COLUMNS = {"name", "x", "y", "alt", "heading", "pitch", "roll", "f"}
_MATRIX_COLUMNS = {
    "name",
    "tx",
    "ty",
    "tz",
    "f_pix",
    "px_pix",
    "py_pix",
    *(f"r{i}{j}" for i in range(3) for j in range(3)),
}
_CSV_HEAD_BYTES = 1 << 12  # bytes in which a CSV file has its columns' names
_MAX_PROBED_FILES = 50  # XMP files that are looked at: photos that are not aligned have no pose


def is_reality_capture(file: Path) -> bool:
    """Whether a CSV file has the columns of cameras."""
    try:
        with file.open("rb") as content:
            start = content.read(_CSV_HEAD_BYTES).decode("utf-8-sig", errors="replace")
    except OSError:
        return False
    return any(_columns(line) is not None for line in start.splitlines()[:3])


def find_reality_capture(folder: Path) -> Path | None:
    """First CSV file of cameras in a folder; None where there is none."""
    files = sorted(f for f in folder.glob("*.[cC][sS][vV]") if not is_hidden([f.name]))
    return next((file for file in files if file.is_file() and is_reality_capture(file)), None)


def find_xmp(folder: Path) -> Path | None:
    """Folder, or its folder `images`, in which XMP files with poses lie beside photos; None where there is
    none.
    """
    for photo_folder in (folder, folder / "images"):
        if photo_folder.is_dir() and any(
            _has_pose(file) for file in _xmp_files(photo_folder)[:_MAX_PROBED_FILES]
        ):
            return photo_folder
    return None


def _has_pose(file: Path) -> bool:
    """Whether an XMP file of a usual size has a RealityCapture pose."""
    try:
        content = read_bytes(file, _CSV_HEAD_BYTES << 4)
    except OSError:
        return False
    return b"capturingreality" in content and b"Rotation" in content


def load_reality_capture(file: Path, downscale: int | None, holdout: int) -> Dataset:
    """Unbounded data set of a CSV file of cameras, whose photos lie beside it or below.

    Raises DatasetError for unknown columns and invalid numbers.
    """
    try:
        text = read_bytes(file).decode("utf-8-sig")
    except (OSError, ValueError) as error:
        raise DatasetError(f"{file}: cannot be read ({error})") from None
    lines = text.splitlines()
    first = next((n for n, line in enumerate(lines[:3]) if _columns(line) is not None), None)
    columns = None if first is None else _columns(lines[first])
    if first is None or columns is None:
        raise DatasetError(
            f"{file}: no columns name, x, y, alt, heading, pitch, roll, f; export 'Internal/External camera "
            "parameters'"
        )
    frames = []
    read = _frame_by_matrix if columns >= _MATRIX_KEYS else _frame_by_angles
    names = _column_names(lines[first])
    try:
        rows = list(csv.reader(io.StringIO("\n".join(lines[first + 1 :]))))
    except csv.Error as error:
        raise DatasetError(f"{file}: is no CSV ({error}); export it again") from None
    for number, row in enumerate(rows, start=first + 2):
        if not row or not "".join(row).strip():
            continue
        if len(row) < len(names):
            raise DatasetError(
                f"{file}: line {number} has {len(row)} values of {len(names)}; it may be cut off"
            )
        values = {name: value.strip() for name, value in zip(names, row, strict=False)}
        frames.append(read(f"{file}: line {number}", values))
    return build_program_dataset(
        ProgramCapture(file, file.parent, file.parent, frames, up=(0.0, 0.0, 1.0)), downscale, holdout
    )


def load_xmp(folder: Path, downscale: int | None, holdout: int) -> Dataset:
    """Unbounded data set of a folder of photos with an XMP file beside each.

    Raises DatasetError where no XMP file has a pose, or values are invalid.
    """
    capture = ProgramCapture(folder, folder, folder, [], up=(0.0, 0.0, 1.0))
    for file in _xmp_files(folder):
        values = _xmp_values(file)
        if "Rotation" not in values or "Position" not in values:
            capture.left_out.setdefault("have no pose in their XMP files", []).append(file.stem)
            continue
        rotation = parse_numbers(f"{file}: Rotation", values["Rotation"], 9).reshape(3, 3)
        position = parse_numbers(f"{file}: Position", values["Position"], 3)
        capture.frames.append(Frame(file.stem, _pose(rotation, position), _xmp_lenses(file, values)))
    return build_program_dataset(capture, downscale, holdout)


# ---- CSV ----

_MATRIX_KEYS = frozenset(_MATRIX_COLUMNS)


def _column_names(line: str) -> list[str]:
    names = [name.strip().lstrip("#").split("(")[0].strip().lower() for name in line.split(",")]
    return [_COLUMN_SYNONYMS.get(name, name) for name in names]


def _columns(line: str) -> frozenset[str] | None:
    """Names of columns in a line, None where they are not the columns of cameras."""
    names = frozenset(_column_names(line))
    return names if names >= _ANGLE_COLUMNS or names >= _MATRIX_COLUMNS else None


def _number(where: str, row: Row, key: str) -> float:
    return parse_number(f"{where}: column {key!r}", row.get(key, "0"))


def _frame_by_angles(where: str, row: Row) -> Frame:
    heading, pitch, roll = (_number(where, row, key) for key in ("heading", "pitch", "roll"))
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("ZXY", (-heading, pitch, roll), degrees=True).as_matrix()
    pose[:3, 3] = [_number(where, row, key) for key in ("x", "y", "alt")]
    radial, tangential = _coefficients(where, row)
    f, px, py = (_number(where, row, key) for key in ("f", "px", "py"))
    return Frame(row["name"], pose, _film_lens(where, f, (px, py), radial, tangential))


def _frame_by_matrix(where: str, row: Row) -> Frame:
    rotation = np.array([_number(where, row, f"r{i}{j}") for i in range(3) for j in range(3)]).reshape(3, 3)
    translation = np.array([_number(where, row, key) for key in ("tx", "ty", "tz")])
    f, px, py = (_number(where, row, key) for key in ("f_pix", "px_pix", "py_pix"))
    radial, tangential = _coefficients(where, row)

    def lenses(width: int, height: int) -> Lenses:
        return build_brown_lens(where, (width, height), (f, f), (px, py), radial, tangential)

    return Frame(row["name"], _pose(rotation, -rotation.T @ translation), lenses)


def _coefficients(where: str, row: Row) -> tuple[list[float], tuple[float, float]]:
    """(k1..k4, OpenCV's p1, p2)."""
    radial = [_number(where, row, key) for key in ("k1", "k2", "k3", "k4")]
    return radial, (_number(where, row, "t2"), _number(where, row, "t1"))


def _film_lens(
    where: str, f: float, center: tuple[float, float], radial: list[float], tangential: tuple[float, float]
) -> Callable[[int, int], Lenses]:
    """Lens of a 35 mm equivalent focal length, for photos of any size."""

    def lenses(width: int, height: int) -> Lenses:
        scale = float(max(width, height))
        focal = f * scale / FILM_WIDTH_MM
        middle = 0.5 * width + center[0] * scale, 0.5 * height + center[1] * scale
        return build_brown_lens(where, (width, height), (focal, focal), middle, radial, tangential)

    return lenses


# ---- XMP ----


def _xmp_files(folder: Path) -> list[Path]:
    """XMP files of a folder that lie beside a photo of their name."""
    files = [file for file in folder.iterdir() if not is_hidden([file.name])]
    stems = {file.stem for file in files if file.suffix.lower() in EXTENSIONS}
    return sorted(file for file in files if file.suffix.lower() == ".xmp" and file.stem in stems)


def _xmp_values(file: Path) -> dict[str, str]:
    """Values of an XMP file in the namespace of RealityCapture, as attributes or elements."""
    values: dict[str, str] = {}
    for element in read_xml(file).iter():
        values |= {
            k.removeprefix(_XCR_NAMESPACE): v
            for k, v in element.attrib.items()
            if k.startswith(_XCR_NAMESPACE)
        }
        if element.tag.startswith(_XCR_NAMESPACE) and element.text:
            values[element.tag.removeprefix(_XCR_NAMESPACE)] = element.text
    return values


def _xmp_lenses(file: Path, values: Mapping[str, str]) -> Callable[[int, int], Lenses]:
    def value(key: str, default: str = "0") -> float:
        return parse_number(f"{file}: {key}", values.get(key, default))

    if "FocalLength35mm" not in values:
        raise DatasetError(f"{file}: has no FocalLength35mm; export the XMP files with their calibration")
    f, center = value("FocalLength35mm"), (value("PrincipalPointU"), value("PrincipalPointV"))
    if value("Skew") or value("AspectRatio", "1") != 1.0:
        warn(f"{file}: its skew and aspect ratio are not used")
    model = values.get("DistortionModel", "perspective").strip().lower()
    text = values.get("DistortionCoeficients") or values.get("DistortionCoefficients") or "0 0 0 0 0 0"
    k1, k2, k3, k4, t1, t2 = parse_numbers(f"{file}: DistortionCoeficients", text, 6).tolist()
    if model in ("none", "perspective"):
        return _film_lens(str(file), f, center, [], (0.0, 0.0))
    if model.startswith("brown"):
        return _film_lens(str(file), f, center, [k1, k2, k3, k4], (t2, t1))
    if model != "division":
        raise DatasetError(f"{file}: DistortionModel {model!r:.40} cannot be read; export undistorted photos")
    return lambda width, height: _film_lens(
        str(file), f, center, _fit_brown_to_division(str(file), k1, f, width, height), (0.0, 0.0)
    )(width, height)


def _fit_brown_to_division(where: str, k1: float, f: float, width: int, height: int) -> list[float]:
    """Radial coefficients [4] of Brown's model fitted to 1 / (1 + k1 r^2) - 1 over the whole photo, by least
    squares.

    Raises DatasetError where the error exceeds MAX_DIVISION_ERROR_PIXELS.
    """
    if not k1:
        return []
    focal = f * max(width, height) / FILM_WIDTH_MM
    if not focal > 0:
        raise DatasetError(f"{where}: FocalLength35mm must be positive, got {f:g}")
    corner = 0.5 * float(np.hypot(width, height)) / focal
    radius = _undistort_radius(k1, corner) * np.sqrt(np.linspace(0.0, 1.0, 400)[1:])
    with np.errstate(all="ignore"):
        target = 1.0 / (1.0 + k1 * radius**2) - 1.0
    if not np.isfinite(target).all() or not radius[-1] > 0:
        raise DatasetError(f"{where}: its division model (k1 = {k1:g}) makes no sense; export it again")
    powers = (radius / radius[-1])[:, None] ** (2, 4, 6, 8)
    coefficients = np.linalg.lstsq(powers * radius[:, None], target * radius, rcond=None)[0]
    error = focal * float(np.abs((powers @ coefficients - target) * radius).max())
    if not error <= MAX_DIVISION_ERROR_PIXELS:
        raise DatasetError(
            f"{where}: its division model (k1 = {k1:g}) cannot be read, Brown's misses it by "
            f"{error:.2g} pixels; align with a Brown model, or export undistorted photos"
        )
    return [float(k / radius[-1] ** n) for k, n in zip(coefficients, (2, 4, 6, 8), strict=True)]


def _undistort_radius(k1: float, distorted: float) -> float:
    """Radius that the division model takes to `distorted`; the largest possible radius where there is
    none.
    """
    root = 1.0 - 4.0 * k1 * distorted**2
    return 2.0 * distorted / (1.0 + float(np.sqrt(max(root, 0.0))))


def _pose(rotation: FloatArray, position: FloatArray) -> FloatArray:
    """OpenGL camera-to-world matrix [4,4] of a world-to-camera rotation in OpenCV axes."""
    pose = np.eye(4)
    pose[:3, :3] = rotation.T
    pose[:3, 3] = position
    return pose * OPENCV_AXIS_SIGNS
