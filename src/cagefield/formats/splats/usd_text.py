"""Writer of splats as USD text (.usda), in bounded memory and without a USD library; see `usd_stage`.

Floats have nine significant digits, by which float32 is read back exactly.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO

import numpy as np

from cagefield.files.atomic import replaced_file
from cagefield.formats.splats.splat_table import OnProgress, SplatBatch
from cagefield.formats.splats.usd_stage import (
    APERTURE_MM,
    CAMERA_NAME,
    COLUMNS,
    PRIM_TYPE,
    ROOT_NAME,
    SH_DEGREE,
    ExtentBounds,
    Frame,
    StageInfo,
)
from cagefield.typing import AnyArray

_ROWS_PER_TEXT = 1 << 13
_COPY_CHARACTERS = 1 << 22
_ATTRIBUTES = (("extent", "float3[]"), *((column.name, column.type_name) for column in COLUMNS))


def write_usda(
    path: Path, info: StageInfo, frames: Iterable[Frame], on_progress: OnProgress = lambda _: None
) -> None:
    """Write the frames of a stage as .usda, complete or not at all.

    Each attribute is collected in a temporary file: memory holds one batch.
    """
    with ExitStack() as stack:
        files = [
            [
                stack.enter_context(tempfile.TemporaryFile("w+", encoding="ascii", newline="\n"))
                for _ in _ATTRIBUTES
            ]
            for _ in info.names
        ]
        for number, frame in enumerate(frames):
            for prim, (spools, table) in enumerate(zip(files, frame, strict=True)):
                if info.is_written(prim, number):
                    batches = () if table is None else table.batches()
                    _append(spools, info.sh_degree, info.time_code(prim, number), batches)
            on_progress(0.8 * (number + 1) / info.frames)
        with replaced_file(path) as temporary, temporary.open("w", encoding="ascii", newline="\n") as out:
            out.write(_header(info))
            for n, name in enumerate(info.names):
                _write_prim(out, info, n, name, files[n])
                on_progress(0.8 + 0.2 * (n + 1) / len(info.names))
            if info.camera:
                out.write(_camera(info))
            out.write("}\n")


def _append(
    spools: Sequence[IO[str]], sh_degree: int, time_code: int | None, batches: Iterable[SplatBatch]
) -> None:
    """Append the values of a prim at a time code to the files of its attributes."""
    bounds = ExtentBounds()
    start = "[" if time_code is None else f"            {time_code}: ["
    for file in spools[1:]:
        file.write(start)
    is_first = True
    for batch in batches:
        padded = batch.pad_harmonics(sh_degree)
        bounds.add(padded)
        for file, column in zip(spools[1:], COLUMNS, strict=True):
            _write_rows(file, column.values(padded), is_first)
        is_first = is_first and not len(batch)
    spools[0].write(start)
    _write_rows(spools[0], bounds.rows(), True)
    for file in spools:
        file.write("]" if time_code is None else "],\n")


def _write_rows(file: IO[str], rows: AnyArray, is_first: bool) -> None:
    width = rows.shape[1]
    row = "%.9g" if width == 1 else "(" + ", ".join(["%.9g"] * width) + ")"
    for first in range(0, len(rows), _ROWS_PER_TEXT):
        part = rows[first : first + _ROWS_PER_TEXT]
        text = ", ".join([row] * len(part)) % tuple(part.ravel().tolist())
        file.write(text if is_first and not first else ", " + text)


def _header(info: StageInfo) -> str:
    times = ""
    if info.fps is not None:
        times = (
            f"    startTimeCode = 0\n    endTimeCode = {info.frames - 1}\n"
            f"    timeCodesPerSecond = {info.fps:.17g}\n    framesPerSecond = {info.fps:.17g}\n"
        )
    return (
        f'#usda 1.0\n(\n    defaultPrim = "{ROOT_NAME}"\n    doc = "cagefield"\n    metersPerUnit = 1\n'
        f'{times}    upAxis = "Y"\n)\n\ndef Xform "{ROOT_NAME}"\n{{\n'
    )


def _write_prim(out: IO[str], info: StageInfo, prim: int, name: str, spools: Sequence[IO[str]]) -> None:
    begin, end = " = ", "\n"
    if info.time_code(prim, 0) is not None:
        begin, end = ".timeSamples = {\n", "        }\n"
    out.write(f'    def {PRIM_TYPE} "{name}"\n    {{\n')
    for (attribute, type_name), file in zip(_ATTRIBUTES, spools, strict=True):
        out.write(f"        {type_name} {attribute}{begin}")
        file.seek(0)
        while part := file.read(_COPY_CHARACTERS):
            out.write(part)
        out.write(end)
    out.write(f"        uniform int {SH_DEGREE} = {info.sh_degree}\n")
    if any(info.offsets[prim]):
        shift = ", ".join(f"{value:.17g}" for value in info.offsets[prim])
        out.write(
            f"        double3 xformOp:translate = ({shift})\n"
            '        uniform token[] xformOpOrder = ["xformOp:translate"]\n'
        )
    out.write("    }\n\n")


def _camera(info: StageInfo) -> str:
    poses = "".join(f"            {n}: {_matrix(pose.matrix)},\n" for n, pose in enumerate(info.camera))
    focals = "".join(f"            {n}: {pose.focal_length:.9g},\n" for n, pose in enumerate(info.camera))
    return (
        f'    def Camera "{CAMERA_NAME}"\n    {{\n        float2 clippingRange = (0.01, 100000)\n'
        f"        float focalLength.timeSamples = {{\n{focals}        }}\n"
        f"        float horizontalAperture = {APERTURE_MM * info.aspect:.9g}\n"
        f"        float verticalAperture = {APERTURE_MM:.9g}\n"
        f"        matrix4d xformOp:transform.timeSamples = {{\n{poses}        }}\n"
        '        uniform token[] xformOpOrder = ["xformOp:transform"]\n    }\n'
    )


def _matrix(matrix: AnyArray) -> str:
    """A matrix of USD, whose vectors are rows."""
    rows = (", ".join(f"{value:.17g}" for value in row) for row in np.asarray(matrix).T.tolist())
    return "( " + ", ".join(f"({row})" for row in rows) + " )"
