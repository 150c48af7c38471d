"""Writer of splats as binary USD (.usdc) and as a package of it (.usdz), by usd-core; see `usd_stage`.

The library holds all values of a file in memory until it is written; equal arrays are stored once. A package
is a zip without compression, its file at a multiple of 64 bytes.

Source: OpenUSD, "Usdz File Format Specification".
"""

from __future__ import annotations

import errno
import os
import struct
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from cagefield.errors import FieldError
from cagefield.files.atomic import replaced_file
from cagefield.files.memory import memory_shortage
from cagefield.formats.splats.splat_table import OnProgress, SplatTable
from cagefield.formats.splats.usd_library import import_usd, message_of, quiet_usd
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
    no_splats,
)
from cagefield.typing import AnyArray

_ALIGNMENT = 64
_FLOATS_PER_SPLAT = 11
_MAX_PACKAGE_BYTES = (1 << 32) - (1 << 28)


def write_usdc(
    path: Path, info: StageInfo, frames: Iterable[Frame], on_progress: OnProgress = lambda _: None
) -> None:
    """Write the frames of a stage as .usdc, complete or not at all.

    Raises:
        FieldError: no usd-core, or values beyond the free memory.
    """
    usd = import_usd(path, f"as {path.suffix} is written")
    with quiet_usd(usd):
        layer = _layer(usd, path, info, frames, on_progress)
        with replaced_file(path) as temporary:
            _export(usd, layer, temporary)
        on_progress(1.0)


def write_usdz(
    path: Path, info: StageInfo, frames: Iterable[Frame], on_progress: OnProgress = lambda _: None
) -> None:
    """Write the frames of a stage as .usdz, a package of one .usdc. Raises as `write_usdc`."""
    with tempfile.TemporaryDirectory(prefix="cagefield-") as folder:
        inner = Path(folder) / f"{info.names[0]}.usdc"
        usd = import_usd(path, "as .usdz is written")
        with quiet_usd(usd):
            _export(usd, _layer(usd, path, info, frames, on_progress), inner)
        with replaced_file(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as archive:
            entry = zipfile.ZipInfo(inner.name, (2000, 1, 1, 0, 0, 0))
            entry.external_attr = 0o644 << 16
            header = 30 + len(inner.name.encode()) + 4
            padding = -header % _ALIGNMENT
            entry.extra = struct.pack("<HH", 0x1986, padding) + bytes(padding)
            entry.file_size = inner.stat().st_size
            if entry.file_size > _MAX_PACKAGE_BYTES:
                raise FieldError(f"{path}: its content exceeds 4 GB, the most of a .usdz; write .usdc")
            with inner.open("rb") as source, archive.open(entry, "w") as out:
                while part := source.read(1 << 22):
                    out.write(part)
        on_progress(1.0)


def _export(usd: Any, layer: Any, path: Path) -> None:
    """Write a layer. Raises OSError where the library cannot."""
    try:
        done = layer.Export(str(path))
    except usd.Tf.ErrorException as error:
        raise _os_error(path, message_of(error)) from None
    if not done:
        raise _os_error(path, "the USD library could not write it")


def _os_error(path: Path, reason: str) -> OSError:
    for code in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EACCES):
        if os.strerror(code) in reason:
            return OSError(code, os.strerror(code), str(path))
    return OSError(errno.EIO, reason, str(path))


def _layer(usd: Any, path: Path, info: StageInfo, frames: Iterable[Frame], on_progress: OnProgress) -> Any:
    """Layer in memory with all prims and values."""
    Sdf = usd.Sdf
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    layer.defaultPrim = ROOT_NAME
    layer.documentation = "cagefield"
    layer.pseudoRoot.SetInfo("upAxis", "Y")
    layer.pseudoRoot.SetInfo("metersPerUnit", 1.0)
    if info.fps is not None:
        layer.startTimeCode, layer.endTimeCode = 0.0, float(info.frames - 1)
        layer.timeCodesPerSecond = layer.framesPerSecond = info.fps
    root = _prim(usd, layer, f"/{ROOT_NAME}", "Xform")
    prims = [_prim(usd, layer, f"{root.path}/{name}", PRIM_TYPE) for name in info.names]
    for prim, offset in zip(prims, info.offsets, strict=True):
        degree = Sdf.AttributeSpec(prim, SH_DEGREE, Sdf.ValueTypeNames.Int, Sdf.VariabilityUniform)
        degree.default = info.sh_degree
        if any(offset):
            _transform(usd, prim, "translate", "double3").default = usd.Gf.Vec3d(*offset)
    for number, frame in enumerate(frames):
        for n, (prim, table) in enumerate(zip(prims, frame, strict=True)):
            if info.is_written(n, number):
                _add_values(usd, layer, path, prim, info.sh_degree, table, info.time_code(n, number))
        on_progress(0.8 * (number + 1) / info.frames)
    if info.camera:
        _add_camera(usd, layer, info)
    return layer


def _prim(usd: Any, layer: Any, path: str, type_name: str) -> Any:
    prim = usd.Sdf.CreatePrimInLayer(layer, path)
    prim.specifier, prim.typeName = usd.Sdf.SpecifierDef, type_name
    return prim


def _transform(usd: Any, prim: Any, kind: str, type_name: str) -> Any:
    """Attribute of a prim's only transform."""
    Sdf = usd.Sdf
    order = Sdf.AttributeSpec(prim, "xformOpOrder", Sdf.ValueTypeNames.TokenArray, Sdf.VariabilityUniform)
    order.default = usd.Vt.TokenArray([f"xformOp:{kind}"])
    return Sdf.AttributeSpec(prim, f"xformOp:{kind}", Sdf.ValueTypeNames.Find(type_name))


def _add_values(
    usd: Any, layer: Any, path: Path, prim: Any, sh_degree: int, table: SplatTable | None, time: int | None
) -> None:
    """Set the attributes of a prim at a time code, or without one."""
    count = 0 if table is None else table.count
    needed = 8 * count * (_FLOATS_PER_SPLAT + 3 * (sh_degree + 1) ** 2)  # here, and in the library
    if (lacking := memory_shortage(needed)) is not None:
        raise FieldError(f"{path}: too many splats for {path.suffix}: {lacking}; or write .usda or .ply")
    bounds = ExtentBounds()
    parts: list[list[AnyArray]] = [[] for _ in COLUMNS]
    for batch in [no_splats(sh_degree)] if table is None else table.batches():
        padded = batch.pad_harmonics(sh_degree)
        bounds.add(padded)
        for part, column in zip(parts, COLUMNS, strict=True):
            part.append(column.values(padded))
    _set(usd, layer, prim, "extent", "float3[]", bounds.rows(), time)
    for column, part in zip(COLUMNS, parts, strict=True):
        _set(usd, layer, prim, column.name, column.type_name, np.concatenate(part), time)


def _set(
    usd: Any, layer: Any, prim: Any, name: str, type_name: str, rows: AnyArray, time: int | None
) -> None:
    Sdf, Vt = usd.Sdf, usd.Vt
    array = {"quatf[]": Vt.QuatfArray, "float[]": Vt.FloatArray}.get(type_name, Vt.Vec3fArray)
    if type_name == "quatf[]":
        rows = rows[:, [1, 2, 3, 0]]  # as the library stores them
    rows = np.ascontiguousarray(rows[:, 0] if type_name == "float[]" else rows, np.float32)
    value = array.FromNumpy(rows) if len(rows) else array()
    spec = layer.GetAttributeAtPath(f"{prim.path}.{name}") or Sdf.AttributeSpec(
        prim, name, Sdf.ValueTypeNames.Find(type_name)
    )
    if time is None:
        spec.default = value
    else:
        layer.SetTimeSample(spec.path, float(time), value)


def _add_camera(usd: Any, layer: Any, info: StageInfo) -> None:
    Sdf = usd.Sdf
    prim = _prim(usd, layer, f"/{ROOT_NAME}/{CAMERA_NAME}", "Camera")
    values = {"horizontalAperture": APERTURE_MM * info.aspect, "verticalAperture": APERTURE_MM}
    for name, value in values.items():
        Sdf.AttributeSpec(prim, name, Sdf.ValueTypeNames.Float).default = value
    clipping = Sdf.AttributeSpec(prim, "clippingRange", Sdf.ValueTypeNames.Float2)
    clipping.default = usd.Gf.Vec2f(0.01, 100000.0)
    focal = Sdf.AttributeSpec(prim, "focalLength", Sdf.ValueTypeNames.Float)
    transform = _transform(usd, prim, "transform", "matrix4d")
    for number, pose in enumerate(info.camera):
        layer.SetTimeSample(focal.path, float(number), usd.Vt.Float(pose.focal_length))
        matrix = usd.Gf.Matrix4d(*np.asarray(pose.matrix).T.ravel().tolist())
        layer.SetTimeSample(transform.path, float(number), matrix)
