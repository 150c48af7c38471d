"""Splat files in PLY, in the layout of 3D Gaussian splatting (3DGS).

An element "vertex" with the columns x y z, f_dc_0..2, f_rest_0..(3K-1) (all of red, then green, then blue, K
= 0, 3, 8, 15 or 24), opacity (logit), scale_0..2 (natural logarithms), rot_0..3 (w x y z, of any length), in
any order, beside others. A file of 2DGS has no scale_2: its splats are discs. red, green, blue replace f_dc:
integers up to the maximum of their type, or floats from 0 to 1 or 255. A comment marks splats trained with
the
antialiased filter: "SplatRenderMode: mip" (Brush) or "antialiased 1" (Postshot).

Source: graphdeco-inria/gaussian-splatting, scene/scene/gaussian_model.py; the PlayCanvas manual, "PLY".
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.files.atomic import replaced_file
from cagefield.files.ply import Columns, PlyTable, open_ply, ply_elements
from cagefield.formats.splats.axes import PLY_AXES
from cagefield.formats.splats.splat_table import BATCH_SPLATS, OnProgress, SplatBatch, SplatSource, SplatTable
from cagefield.typing import AnyArray

DISC_THICKNESS_RATIO = 1e-3
"""Third scale of a 2DGS disc, relative to the smaller of its two scales."""

DEGREE_BY_REST_COLUMNS = {3 * ((degree + 1) ** 2 - 1): degree for degree in range(5)}
"""SH degree by the number of columns f_rest_*."""

_NORMALS = ("nx", "ny", "nz")
"""Columns of 3DGS files that are always 0 and can be ignored."""

MESH = "a mesh of triangles, no field; render photos of it and train on them (`cagefield train`)"
POINT_CLOUD_CURE = (
    "it serves `cagefield train` as the sparse points of a capture: its ply_file_path in transforms.json"
)

_SHAPE_COLUMNS = ("x", "y", "z", "opacity", "scale_0", "scale_1", "rot_0", "rot_1", "rot_2", "rot_3")


def open_splat_ply(path: Path) -> SplatSource:
    """Open PLY file in 3DGS' layout.

    Raises:
        FieldError: missing file, another kind of PLY, or a damaged file.
    """
    comments, tables = open_ply(path)
    vertex = tables.get("vertex", PlyTable(0, (), lambda first, last: {}))
    dc = column_names("f_dc_", 3) if "f_dc_0" in vertex.columns else ("red", "green", "blue")
    missing = [name for name in (*_SHAPE_COLUMNS, *dc) if name not in vertex.columns]
    if missing:
        raise FieldError(f"{path}: {_describe_other_ply(path, vertex, missing)}")
    degree = sh_degree_from_columns(path, vertex.columns)
    whole = _largest_color(vertex, dc) if dc[0] == "red" else 0.0
    warn_about_ignored(
        path, vertex, {*_SHAPE_COLUMNS, "scale_2", *dc, *column_names("f_rest_", 3 * ((degree + 1) ** 2 - 1))}
    )

    def batches() -> Iterator[SplatBatch]:
        for first in range(0, vertex.count, BATCH_SPLATS):
            yield _batch(vertex.rows(first, first + BATCH_SPLATS), dc, whole, degree)

    antialiased, discs = render_mode_from_comments(comments)
    if vertex.count and "scale_2" not in vertex.columns:
        antialiased, discs = False, True
    dtypes = [values.dtype for name, values in vertex.rows(0, 1).items() if name in set("xyz")]
    is_double = any(dtype.itemsize > 4 or dtype.kind in "iu" for dtype in dtypes)  # as all text is
    end = vertex.end
    return SplatSource(path, vertex.count, degree, PLY_AXES, batches, antialiased, discs, end, is_double)


def write_splat_ply(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Write the splats in 3DGS' layout, complete or not at all; coordinates with an offset as doubles."""
    above = (table.sh_degree + 1) ** 2 - 1
    names = [
        *"xyz",
        "nx",
        "ny",
        "nz",
        *column_names("f_dc_", 3),
        *column_names("f_rest_", 3 * above),
        "opacity",
    ]
    names += [*column_names("scale_", 3), *column_names("rot_", 4)]
    header = ["ply", "format binary_little_endian 1.0", "comment written by cagefield"]
    header += render_mode_comment(table)
    offset, coordinate_type = np.array(table.offset), "double" if any(table.offset) else "float"
    header += [f"element vertex {table.count}", *(f"property {coordinate_type} {name}" for name in names[:3])]
    header += [*(f"property float {name}" for name in names[3:]), "end_header"]
    row = np.dtype([("mean", "<f8" if any(table.offset) else "<f4", 3), ("rest", "<f4", len(names) - 3)])
    with replaced_file(path) as temporary, temporary.open("wb") as out:
        out.write("\n".join([*header, ""]).encode())
        done = 0
        for batch in table.batches():
            opacity = np.clip(batch.opacities.astype(np.float64), 1e-7, 1.0 - 1e-7)
            groups: Sequence[AnyArray] = (
                np.zeros((len(batch), 3), np.float32),
                batch.sh[:, 0],
                batch.sh[:, 1:].transpose(0, 2, 1).reshape(len(batch), 3 * above),
                np.log(opacity / (1.0 - opacity))[:, None],
                batch.log_scales,
                batch.quaternions,
            )
            rows = np.zeros(len(batch), row)
            rows["mean"], rows["rest"] = batch.means + offset, np.concatenate(groups, axis=1)
            out.write(rows.tobytes())
            done += len(batch)
            on_progress(done / table.count)


def column_names(stem: str, count: int) -> tuple[str, ...]:
    """Names of numbered columns."""
    return tuple(f"{stem}{index}" for index in range(count))


def stack_columns(columns: Columns, names: Iterable[str]) -> AnyArray:
    """Columns side by side, float64 [n, names]."""
    return np.stack([columns[name].astype(np.float64) for name in names], axis=1)


def sh_degree_from_columns(path: Path, columns: Iterable[str]) -> int:
    """SH degree of the columns f_rest_*. Raises FieldError for a number of columns without a degree."""
    found = {name for name in columns if name.startswith("f_rest_")}
    if len(found) not in DEGREE_BY_REST_COLUMNS or found != set(column_names("f_rest_", len(found))):
        raise FieldError(
            f"{path}: it has {len(found)} columns f_rest_*, expected 0, 9, 24, 45 or 72; export it again"
        )
    return DEGREE_BY_REST_COLUMNS[len(found)]


def harmonics_from_columns(dc: AnyArray, columns: Columns, degree: int) -> AnyArray:
    """Coefficients [n,(degree+1)^2,3] of degree 0 [n,3] and the columns f_rest_*."""
    if not degree:
        return dc[:, None]
    above = (degree + 1) ** 2 - 1
    rest = stack_columns(columns, column_names("f_rest_", 3 * above)).reshape(len(dc), 3, above)
    return np.concatenate([dc[:, None], rest.transpose(0, 2, 1)], axis=1)


def render_mode_from_comments(comments: Iterable[str]) -> tuple[bool, bool]:
    """(antialiased filter, 2DGS discs) as stated by the header's comments."""
    notes = [comment.lower().replace(":", " ").replace("=", " ").split() for comment in comments]
    discs = ["splatrendermode", "2dgs"] in notes
    return not discs and (["splatrendermode", "mip"] in notes or ["antialiased", "1"] in notes), discs


def render_mode_comment(table: SplatTable) -> list[str]:
    """Header lines that state the render mode; none for plain 3DGS."""
    mode = "2dgs" if table.discs else "mip" if table.antialiased else ""
    return [f"comment SplatRenderMode: {mode}"] if mode else []


def warn_about_ignored(
    path: Path, vertex: PlyTable, used: Iterable[str], elements: Iterable[str] = ()
) -> None:
    """Warn about ignored columns and elements, with their numbers."""
    columns = [name for name in vertex.columns if name not in {*used, *_NORMALS}]
    notes = []
    if columns:
        shown = ", ".join(columns[:6]) + ", ..." * (len(columns) > 6)
        notes += [f"{_pluralize(len(columns), 'column')} ({shown})"]
    others = {name: count for name, count in ply_elements(path).items() if name not in {"vertex", *elements}}
    if others:
        shown = ", ".join(f"{name} {count}" for name, count in list(others.items())[:8])
        notes += [f"{_pluralize(len(others), 'element')} (rows: {shown}{', ...' * (len(others) > 8)})"]
    if notes:
        warnings.warn(f"{path}: left out: {' and '.join(notes)[:300]}", stacklevel=3)


def _pluralize(count: int, noun: str) -> str:
    return f"{count} {noun}{'s' * (count != 1)}"


def _describe_other_ply(path: Path, vertex: PlyTable, missing: Sequence[str]) -> str:
    """Error message for a PLY file without splats: a mesh, a point cloud, or missing columns."""
    elements = ply_elements(path)
    lacking = f"its vertices lack {', '.join(missing)}"
    if elements.get("face") or elements.get("tristrips"):
        return f"{MESH}; {lacking}"
    if set("xyz") <= set(vertex.columns) and not {"opacity", "scale_0", "rot_0"} & set(vertex.columns):
        return f"a point cloud of {vertex.count} points, no splats ({lacking}); {POINT_CLOUD_CURE}"
    return f"no file of splats, {lacking}; export it again with them"


def _largest_color(vertex: PlyTable, names: Sequence[str]) -> float:
    """Value of full brightness of red, green and blue.

    For integers the maximum of their type; for floats the least of 1, 255 and 65535 that bounds all values.
    """
    code = vertex.types[names[0]]
    if code[0] != "f":
        return float(np.iinfo(code).max)
    most = 0.0
    for first in range(0, vertex.count, BATCH_SPLATS):
        values = stack_columns(vertex.rows(first, first + BATCH_SPLATS), names)
        most = max(most, float(np.max(values, where=np.isfinite(values), initial=0.0)))
    return next((full for full in (1.0, 255.0) if most <= full * (1.0 + 1e-3)), 65535.0)


def _batch(columns: Columns, dc: Sequence[str], whole: float, degree: int) -> SplatBatch:
    color = stack_columns(columns, dc)
    if dc[0] == "red":
        color = (color / whole - 0.5) / spherical_harmonics.C0
    log_scales = stack_columns(columns, ("scale_0", "scale_1"))
    flat = log_scales.min(axis=1, initial=np.inf)[:, None] + np.log(DISC_THICKNESS_RATIO)
    third = stack_columns(columns, ("scale_2",)) if "scale_2" in columns else flat
    with np.errstate(over="ignore"):
        opacities = 1.0 / (1.0 + np.exp(-stack_columns(columns, ("opacity",))[:, 0]))
    return SplatBatch(
        stack_columns(columns, "xyz"),
        np.concatenate([log_scales, third], axis=1),
        stack_columns(columns, column_names("rot_", 4)),
        opacities,
        harmonics_from_columns(color, columns, degree),
    )
