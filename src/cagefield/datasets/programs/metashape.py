"""Agisoft Metashape's cameras.xml (File > Export > Export Cameras).

A camera's `transform` [4,4], row by row, maps OpenCV camera axes to the coordinates of its component; the
`transform` of the component, and of the chunk (rotation, translation, scale), maps these to the world. A
sensor's calibration has, for a photo of w x h pixels, with (x, y) = (X/Z, Y/Z) and r^2 = x^2 + y^2,

    x' = x (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) + p1 (r^2 + 2 x^2) + 2 p2 x y      (frame)
    y' = y (1 + k1 r^2 + k2 r^4 + k3 r^6 + k4 r^8) + p2 (r^2 + 2 y^2) + 2 p1 x y
    u = w/2 + cx + x' f + x' b1 + y' b2,  v = h/2 + cy + y' f

so p1 and p2 are OpenCV's p2 and p1; a fisheye's x, y and r are first scaled to the angle to the axis. The
skew b2 and the higher tangential coefficients p3 and p4 are not used; a warning gives the pixels they would
move.

Source: Agisoft Metashape User Manual, Professional Edition, appendix "Camera models".
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from cagefield.datasets.notices import warn
from cagefield.datasets.programs.number_parsing import parse_number, parse_numbers, parse_pixel_count
from cagefield.datasets.programs.program_dataset import (
    OPENCV_AXIS_SIGNS,
    Frame,
    Lenses,
    ProgramCapture,
    build_brown_lens,
    build_colmap_lens,
    build_program_dataset,
)
from cagefield.datasets.programs.xml_files import child_text, read_xml
from cagefield.datasets.undistortion import EQUIRECTANGULAR
from cagefield.datasets.views import Dataset, join_names
from cagefield.errors import DatasetError

FloatArray = npt.NDArray[np.float64]

CAMERAS_FILE = "cameras.xml"

MIN_REPORTED_SHIFT_PIXELS = 0.05
"""Minimum shift of a corner by an unused lens coefficient that is reported."""

_FALSE_TEXTS = ("0", "false")
_XML_HEAD_BYTES = 1 << 16  # bytes in which a file shows whether it is Metashape's


@dataclass(frozen=True)
class _Similarity:
    """x -> scale * rotation @ x + translation."""

    rotation: FloatArray
    translation: FloatArray
    scale: float

    def pose(self, inner: FloatArray) -> FloatArray:
        """Rigid pose [4,4] of a camera whose pose in the inner coordinates is given."""
        pose = np.eye(4)
        pose[:3, :3] = self.rotation @ inner[:3, :3]
        pose[:3, 3] = self.scale * self.rotation @ inner[:3, 3] + self.translation
        return pose


def is_metashape(file: Path) -> bool:
    """Whether an XML file has Metashape's chunks."""
    try:
        with file.open("rb") as content:
            start = content.read(_XML_HEAD_BYTES)
    except OSError:
        return False
    return b"<document" in start and b"<chunk" in start


def find_metashape(folder: Path) -> Path | None:
    """File cameras.xml of a folder, or the first XML file in it with Metashape's chunks."""
    files = sorted(file for file in folder.glob("*.[xX][mM][lL]") if not file.name.startswith("."))
    files.sort(key=lambda file: file.name.lower() != CAMERAS_FILE)
    return next((file for file in files if file.is_file() and is_metashape(file)), None)


def load_metashape(file: Path, downscale: int | None, holdout: int) -> Dataset:
    """Unbounded data set of the chunk of an XML file that has the most cameras with a pose.

    Raises DatasetError where no camera has a pose, or values are invalid.
    """
    root = read_xml(file)
    chunks = list(root.iter("chunk"))
    if not chunks:
        raise DatasetError(f"{file}: no chunk in it; export the cameras as XML from Metashape")
    sizes = [len(chunk.findall("cameras//camera/transform")) for chunk in chunks]
    chosen = int(np.argmax(sizes))
    other_chunks = [chunk.get("label") or str(n) for n, chunk in enumerate(chunks) if n != chosen]
    if other_chunks:
        warn(
            f"{file}: chunk {chunks[chosen].get('label') or chosen} is read, with {sizes[chosen]} cameras; "
            f"{len(other_chunks)} chunks are left out: {join_names(other_chunks)}"
        )
    return build_program_dataset(_capture(file, chunks[chosen]), downscale, holdout)


def _capture(file: Path, chunk: Element) -> ProgramCapture:
    sensors = {sensor.get("id"): sensor for sensor in chunk.findall("sensors/sensor")}
    lenses: dict[str | None, Lenses] = {}
    components = {c.get("id"): c for c in chunk.findall("components/component")}
    cameras = list(chunk.iterfind("cameras//camera"))
    component_counts = Counter(
        camera.get("component_id") for camera in cameras if child_text(camera, "transform") is not None
    )
    main_component = component_counts.most_common(1)[0][0] if component_counts else None
    capture = ProgramCapture(file, file.parent, file.parent, [])
    for camera in cameras:
        label = camera.get("label") or f"camera {camera.get('id')}"
        where = f"{file}: camera {label}"
        transform = child_text(camera, "transform")
        if (camera.get("enabled") or "1").lower() in _FALSE_TEXTS:
            _leave_out(capture, "are disabled", label)
        elif transform is None:
            _leave_out(capture, "are not aligned", label)
        elif camera.get("component_id") != main_component and not _has_transform(
            components.get(main_component)
        ):
            _leave_out(capture, "are of another component than most", label)
        else:
            inner = parse_numbers(f"{where}: transform", transform, 16).reshape(4, 4) * OPENCV_AXIS_SIGNS
            sensor_id = camera.get("sensor_id")
            if sensor_id not in lenses:
                if sensor_id not in sensors:
                    raise DatasetError(f"{where}: there is no sensor {sensor_id!r:.40}; export it again")
                lenses[sensor_id] = _lenses(f"{file}: sensor {sensor_id}", sensors[sensor_id])
            pose = inner
            for outer in _outer_similarities(file, components.get(camera.get("component_id")), chunk):
                pose = outer.pose(pose)
            capture.frames.append(Frame(label, pose, lenses[sensor_id]))
    return capture


def _leave_out(capture: ProgramCapture, reason: str, label: str) -> None:
    capture.left_out.setdefault(reason, []).append(label)


def _has_transform(component: Element | None) -> bool:
    return component is not None and component.find("transform") is not None


def _outer_similarities(file: Path, component: Element | None, chunk: Element) -> list[_Similarity]:
    """Similarities from a component's coordinates to the world, in order of application."""
    similarities: list[_Similarity] = []
    for where, element in (("component", component), ("chunk", chunk)):
        transform = None if element is None else element.find("transform")
        if transform is None:
            continue
        one = _similarity(f"{file}: transform of the {where}", transform)
        if not any(_is_equal(one, other) for other in similarities):  # some exports have one twice
            similarities.append(one)
    return similarities


def _is_equal(one: _Similarity, other: _Similarity) -> bool:
    return bool(
        np.array_equal(one.rotation, other.rotation)
        and np.array_equal(one.translation, other.translation)
        and one.scale == other.scale
    )


def _similarity(where: str, transform: Element) -> _Similarity:
    rotation, translation = child_text(transform, "rotation"), child_text(transform, "translation")
    scale = child_text(transform, "scale")
    rotation_matrix = (
        np.eye(3) if rotation is None else parse_numbers(f"{where}: rotation", rotation, 9).reshape(3, 3)
    )
    shift = np.zeros(3) if translation is None else parse_numbers(f"{where}: translation", translation, 3)
    factor = 1.0 if scale is None else parse_number(f"{where}: scale", scale)
    if factor <= 0 or not np.isfinite(rotation_matrix).all() or not np.isfinite(shift).all():
        raise DatasetError(f"{where} must have finite numbers and a positive scale, got {factor:g}")
    if np.abs(rotation_matrix @ rotation_matrix.T - np.eye(3)).max() > 1e-3:
        raise DatasetError(f"{where}: rotation is no rotation; export the cameras again")
    return _Similarity(rotation_matrix, shift, factor)


def _lenses(where: str, sensor: Element) -> Lenses:
    kind = (sensor.get("type") or "frame").lower()
    calibration = _calibration(sensor)
    size = _size(where, sensor, calibration)
    if kind in ("spherical", "equirectangular"):
        return build_colmap_lens(where, EQUIRECTANGULAR, (), size)
    if calibration is not None:
        kind = (calibration.get("type") or kind).lower()
    if kind not in ("frame", "fisheye"):
        raise DatasetError(
            f"{where}: lens type {kind!r:.40} cannot be read, only frame, fisheye and spherical; export "
            "undistorted photos with their cameras"
        )
    value = _Values(where, calibration)
    if child_text(calibration, "fx") is not None:  # PhotoScan's first versions: all as OpenCV has it
        focal, center = (value("fx"), value("fy")), (value("cx"), value("cy"))
    else:
        f = value("f") if child_text(calibration, "f") is not None else _nominal_focal(where, sensor)
        focal = f + value("b1"), f
        center = 0.5 * size[0] + value("cx"), 0.5 * size[1] + value("cy")
    radial = [value(key) for key in ("k1", "k2", "k3", "k4")]
    p1, p2 = value("p2"), value("p1")
    _report_unused(where, size, focal[1], value)
    if kind == "frame":
        return build_brown_lens(where, size, focal, center, radial, (p1, p2))
    params = (*focal, *center, *radial[:2], p1, p2, *radial[2:], 0.0, 0.0)
    return build_colmap_lens(where, "THIN_PRISM_FISHEYE", params, size)


class _Values:
    """Numbers of a calibration by their tag, 0 for missing tags."""

    def __init__(self, where: str, calibration: Element | None) -> None:
        self._where, self._calibration = where, calibration

    def __call__(self, tag: str) -> float:
        text = child_text(self._calibration, tag)
        return 0.0 if text is None else parse_number(f"{self._where}: {tag}", text.strip())


def _calibration(sensor: Element) -> Element | None:
    """Adjusted calibration of a sensor; the initial one where there is no other."""
    calibrations = sensor.findall("calibration")
    return next(
        (one for one in calibrations if one.get("class") == "adjusted"),
        calibrations[0] if calibrations else None,
    )


def _size(where: str, sensor: Element, calibration: Element | None) -> tuple[int, int]:
    for element in (calibration, sensor):
        resolution = None if element is None else element.find("resolution")
        if resolution is not None:
            return (
                parse_pixel_count(f"{where}: resolution width", resolution.get("width")),
                parse_pixel_count(f"{where}: resolution height", resolution.get("height")),
            )
    raise DatasetError(f"{where}: has no resolution; export the cameras again")


def _nominal_focal(where: str, sensor: Element) -> float:
    """Focal length in pixels of a sensor without a calibration, from its millimeters."""
    values = {one.get("name"): one.get("value") for one in sensor.findall("property")}
    pixel, focal = values.get("pixel_width"), values.get("focal_length")
    if pixel is None or focal is None:
        raise DatasetError(f"{where}: has no focal length (calibration f); align the photos and export again")
    width = parse_number(f"{where}: pixel_width", pixel)
    if width <= 0:
        raise DatasetError(f"{where}: pixel_width must be positive, got {width:g}")
    return parse_number(f"{where}: focal_length", focal) / width


def _report_unused(where: str, size: tuple[int, int], focal: float, value: _Values) -> None:
    """Warn of skew and of higher tangential coefficients, by the pixels they move a corner."""
    if not focal > 0:
        return  # the camera says it
    x, y = (0.5 * side / focal for side in size)
    r2 = x * x + y * y
    skew = abs(value("b2")) * y
    tangential = np.hypot(value("p1") * (r2 + 2 * x * x), value("p2") * (r2 + 2 * y * y))
    higher = focal * tangential * abs(value("p3") * r2 + value("p4") * r2 * r2)
    for name, shift in (("skew b2", skew), ("tangential coefficients p3 and p4", higher)):
        if shift > MIN_REPORTED_SHIFT_PIXELS:
            warn(f"{where}: the {name} of its lens, up to {shift:.2g} pixels, is not used")
