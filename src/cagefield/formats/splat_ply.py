"""Splat files in PLY, the layout of 3D Gaussian splatting's own code and of most other programs.

An element "vertex" with the columns x y z, f_dc_0..2, f_rest_0..(3K-1) (all of red, then green, then blue, K
= 0, 3, 8, 15 or 24), opacity (logit), scale_0..2 (natural logarithms), rot_0..3 (w x y z, of any length), in
any order, beside others. A file of 2DGS has no scale_2: its splats are flat. red, green, blue (0 to 255)
stand in for f_dc. A comment says where the splats were trained with the antialiased filter: "SplatRenderMode:
mip" (Brush) or "antialiased 1" (Postshot).

Source: graphdeco-inria/gaussian-splatting, scene/gaussian_model.py; the PlayCanvas manual, "PLY".
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from cagefield import sh as spherical_harmonics
from cagefield.atomic_files import replaced_file
from cagefield.errors import FieldError
from cagefield.formats.splat_axes import PLY
from cagefield.formats.splat_table import BATCH, OnProgress, SplatBatch, SplatSource, SplatTable
from cagefield.ply import Columns, PlyTable, open_ply
from cagefield.typing import AnyArray

FLAT = 1e-3
"""Third scale of a splat of 2DGS, against the smaller of its two."""

REST = {3 * ((degree + 1) ** 2 - 1): degree for degree in range(5)}
"""Degree of the harmonics by the number of columns f_rest_*."""

_SHAPE = ("x", "y", "z", "opacity", "scale_0", "scale_1", "rot_0", "rot_1", "rot_2", "rot_3")


def open_splat_ply(path: Path) -> SplatSource:
    """The splats of a PLY file in 3DGS' layout.

    Raises:
        FieldError: no such file, another kind of PLY, a file that is damaged.
    """
    comments, tables = open_ply(path)
    vertex = tables.get("vertex", PlyTable(0, (), lambda first, last: {}))
    dc = names_of("f_dc_", 3) if "f_dc_0" in vertex.columns else ("red", "green", "blue")
    missing = [name for name in (*_SHAPE, *dc) if name not in vertex.columns]
    if missing:
        raise FieldError(
            f"{path}: no file of splats, its vertices lack {', '.join(missing)}; a mesh or a point cloud "
            "cannot be imported"
        )
    degree = degree_of(path, vertex.columns)

    def batches() -> Iterator[SplatBatch]:
        for first in range(0, vertex.count, BATCH):
            yield _batch(vertex.rows(first, first + BATCH), dc, degree)

    antialiased, discs = said_of(comments)
    if vertex.count and "scale_2" not in vertex.columns:
        antialiased, discs = False, True
    return SplatSource(path, vertex.count, degree, PLY, batches, antialiased, discs, end=vertex.end)


def write_splat_ply(path: Path, table: SplatTable, on_progress: OnProgress = lambda _: None) -> None:
    """Writes the splats in 3DGS' layout, complete or not at all."""
    above = (table.sh_degree + 1) ** 2 - 1
    names = [*"xyz", "nx", "ny", "nz", *names_of("f_dc_", 3), *names_of("f_rest_", 3 * above), "opacity"]
    names += [*names_of("scale_", 3), *names_of("rot_", 4)]
    header = ["ply", "format binary_little_endian 1.0", "comment written by cagefield"]
    header += mode_comment(table)
    header += [f"element vertex {table.count}", *(f"property float {name}" for name in names), "end_header"]
    with replaced_file(path) as temporary, temporary.open("wb") as out:
        out.write("\n".join([*header, ""]).encode())
        done = 0
        for batch in table.batches():
            opacity = np.clip(batch.opacities.astype(np.float64), 1e-7, 1.0 - 1e-7)
            groups: Sequence[AnyArray] = (
                batch.means,
                np.zeros((len(batch), 3), np.float32),
                batch.sh[:, 0],
                batch.sh[:, 1:].transpose(0, 2, 1).reshape(len(batch), 3 * above),
                np.log(opacity / (1.0 - opacity))[:, None],
                batch.log_scales,
                batch.quaternions,
            )
            out.write(np.concatenate(groups, axis=1).astype("<f4").tobytes())
            done += len(batch)
            on_progress(done / table.count)


def names_of(stem: str, count: int) -> tuple[str, ...]:
    """Names of numbered columns."""
    return tuple(f"{stem}{index}" for index in range(count))


def stack_of(columns: Columns, names: Iterable[str]) -> AnyArray:
    """Columns side by side, float64 [n, names]."""
    return np.stack([columns[name].astype(np.float64) for name in names], axis=1)


def degree_of(path: Path, columns: Iterable[str]) -> int:
    """Degree of the harmonics in columns f_rest_*. Raises FieldError for a number of them that has none."""
    found = {name for name in columns if name.startswith("f_rest_")}
    if len(found) not in REST or found != set(names_of("f_rest_", len(found))):
        raise FieldError(
            f"{path}: it has {len(found)} columns f_rest_*, expected 0, 9, 24, 45 or 72; export it again"
        )
    return REST[len(found)]


def harmonics_of(dc: AnyArray, columns: Columns, degree: int) -> AnyArray:
    """Coefficients [n,(degree+1)^2,3] of those of degree 0 [n,3] and the columns f_rest_*."""
    if not degree:
        return dc[:, None]
    above = (degree + 1) ** 2 - 1
    rest = stack_of(columns, names_of("f_rest_", 3 * above)).reshape(len(dc), 3, above)
    return np.concatenate([dc[:, None], rest.transpose(0, 2, 1)], axis=1)


def said_of(comments: Iterable[str]) -> tuple[bool, bool]:
    """Whether comments say that the splats want the antialiased filter, and that they are discs."""
    said = [comment.lower().replace(":", " ").replace("=", " ").split() for comment in comments]
    discs = ["splatrendermode", "2dgs"] in said
    return not discs and (["splatrendermode", "mip"] in said or ["antialiased", "1"] in said), discs


def mode_comment(table: SplatTable) -> list[str]:
    """The header's line that says how the splats are drawn; none for 3DGS' own way."""
    mode = "2dgs" if table.discs else "mip" if table.antialiased else ""
    return [f"comment SplatRenderMode: {mode}"] if mode else []


def _batch(columns: Columns, dc: Sequence[str], degree: int) -> SplatBatch:
    colour = stack_of(columns, dc)
    if dc[0] == "red":
        colour = (colour / 255.0 - 0.5) / spherical_harmonics.C0
    log_scales = stack_of(columns, ("scale_0", "scale_1"))
    flat = log_scales.min(axis=1, initial=np.inf)[:, None] + np.log(FLAT)
    third = stack_of(columns, ("scale_2",)) if "scale_2" in columns else flat
    with np.errstate(over="ignore"):
        opacities = 1.0 / (1.0 + np.exp(-stack_of(columns, ("opacity",))[:, 0]))
    return SplatBatch(
        stack_of(columns, "xyz"),
        np.concatenate([log_scales, third], axis=1),
        stack_of(columns, names_of("rot_", 4)),
        opacities,
        harmonics_of(colour, columns, degree),
    )
