"""Splat files, opened by their content, or by the suffix of their name for contents without magic number.

| suffix | format | read | written |
| --- | --- | --- | --- |
| .ply | 3DGS and derivatives | yes | yes |
| .compressed.ply | PlayCanvas | yes | yes |
| .spz | Niantic, versions 1 to 4 | yes | 3, or 4 |
| .sog, a folder with meta.json | PlayCanvas, versions 1 and 2 | yes | 2, as one file |
| lod-meta.json, a folder with it | PlayCanvas, streamed SOG | finest level | no |
| .splat | antimatter15 | yes | yes |
| .ksplat | mkkellogg | yes | no |
| .glb, .gltf | KHR_gaussian_splatting | yes | .glb |
| .usda, .usdc, .usdz, .usd | OpenUSD, with usd-core | yes | yes, .usda without usd-core |
| .ckpt | nerfstudio's splatfacto | yes | no |
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path

from cagefield.errors import FieldError
from cagefield.files.ply import open_ply
from cagefield.files.safe_open import check_regular
from cagefield.formats.splats.antimatter15_splat import open_splat_rows
from cagefield.formats.splats.compressed_ply import open_compressed_ply
from cagefield.formats.splats.detection import (
    CHECKPOINT_SUFFIXES,
    EMPTY_FILE,
    GZIP_ARCHIVE,
    LOD_META,
    META,
    ZIP_ARCHIVE,
    describe_other_file,
    detect_format,
)
from cagefield.formats.splats.gltf import open_splat_gltf
from cagefield.formats.splats.gltf_buffers import GltfAsset
from cagefield.formats.splats.ksplat import open_ksplat
from cagefield.formats.splats.nerfstudio import is_splatfacto, open_splatfacto
from cagefield.formats.splats.sog import open_sog
from cagefield.formats.splats.sog_lod import open_sog_lod
from cagefield.formats.splats.splat_ply import MESH, POINT_CLOUD_CURE, open_splat_ply
from cagefield.formats.splats.splat_table import SplatSource
from cagefield.formats.splats.spz import open_spz
from cagefield.formats.splats.usd import open_splat_usd

READABLE = (
    *(".ply", ".compressed.ply", ".spz", ".sog", ".splat", ".ksplat", ".glb", ".gltf", ".ckpt"),
    *(".usda", ".usdc", ".usdz", ".usd"),
    *(META, LOD_META),
)

_MESHES = ("an OBJ mesh", "an STL mesh", "an FBX mesh", "an OFF mesh")
_CLOUDS = ("a LAS point cloud", "a PCD point cloud")
_NAMES = {
    ".ply": "a PLY", ".spz": "an SPZ", ".sog": "a SOG", ".ksplat": "a .ksplat", ".glb": "a binary glTF",
    ".gltf": "a glTF", META: "a SOG's meta.json", LOD_META: "a streamed SOG's lod-meta.json",
    ".usda": "a USD text", ".usdc": "a binary USD", ".usdz": "a USD package",
}  # fmt: skip
_ALSO_VALID_SUFFIXES = {
    META: (META, ".json"),
    LOD_META: (LOD_META, META, ".json"),
    ".usda": (".usd",),
    ".usdc": (".usd",),
}


def _open_any_ply(path: Path) -> SplatSource:
    _, tables = open_ply(path)
    packed = "vertex" in tables and "packed_position" in tables["vertex"].columns
    return (open_compressed_ply if packed else open_splat_ply)(path)


_OPEN: dict[str, Callable[[Path], SplatSource]] = {
    ".ply": _open_any_ply,
    ".compressed.ply": _open_any_ply,
    ".spz": open_spz,
    ".sog": open_sog,
    META: open_sog,
    LOD_META: open_sog_lod,
    ".splat": open_splat_rows,
    ".ksplat": open_ksplat,
    ".glb": open_splat_gltf,
    ".gltf": open_splat_gltf,
    ".ckpt": open_splatfacto,
    ".usda": open_splat_usd,
    ".usdc": open_splat_usd,
    ".usdz": open_splat_usd,
    ".usd": open_splat_usd,
}


def format_suffix(path: Path) -> str:
    """Suffix that names a file's format, such as ".compressed.ply"; "" for an unknown one."""
    name = path.name.lower()
    if path.is_dir():
        return META
    return max((ending for ending in READABLE if name.endswith(ending)), key=len, default="")


def open_splats(path: Path, time_code: float | None = None) -> SplatSource:
    """Open splat file; values are read batch by batch.

    `time_code` is one of a USD file. A warning names a content of another format than the suffix.

    Raises:
        FieldError: missing file, unknown format, or a damaged file.
    """
    if not path.exists():
        raise FieldError(f"{path}: no such file; give a file of splats ({', '.join(READABLE[:-2])})")
    ending = format_suffix(path)
    try:
        if not path.is_dir():
            check_regular(path)
        found = detect_format(path)
    except OSError as error:
        raise FieldError(f"{path}: cannot be read ({error.strerror or error})") from None
    if found is None:
        return _open_by_suffix(path, ending)
    if found not in _OPEN:
        raise FieldError(f"{path}: a zip of a streamed SOG; unpack it and give its folder")
    if not path.is_dir() and not path.name.lower().endswith((found, *_ALSO_VALID_SUFFIXES.get(found, ()))):
        said = f"not what its name says ({ending})" if ending else "which its name does not say"
        warnings.warn(f"{path}: its content is {_NAMES[found]}, {said}; it is read as that", stacklevel=2)
    if time_code is not None:
        if _OPEN[found] is not open_splat_usd:
            raise FieldError(f"{path}: time codes are USD's; leave --time-code out")
        return open_splat_usd(path, time_code)
    return _OPEN[found](path)


def holds_splats(path: Path) -> bool:
    """Whether to read a file as splats, by its content or its suffix.

    True for a checkpoint with tensors of splats, and for a mesh or an image, so that the reader's error names
    it.
    """
    try:
        if path.is_dir() or (path.is_file() and detect_format(path) is not None):
            return True
        ending = format_suffix(path)
        if ending == ".ckpt":
            return is_splatfacto(path)
        return bool(ending) or (path.is_file() and describe_other_file(path) not in (None, ZIP_ARCHIVE))
    except OSError:
        return bool(format_suffix(path))


def source_files(path: Path) -> list[Path]:
    """Files that splats are read from: all files of a folder, and the buffers of a .gltf.

    Raises:
        FieldError: an unreadable .gltf.
    """
    if path.is_dir():
        return sorted(file for file in path.rglob("*") if file.is_file())
    if detect_format(path) not in (".gltf", ".glb"):
        return [path]
    try:
        return [path, *GltfAsset(path).external_files()]
    except (ValueError, TypeError, KeyError, OSError):
        return [path]  # the reader reports the problem


def _open_by_suffix(path: Path, ending: str) -> SplatSource:
    """Open file of the format of its suffix; its content has no magic number."""
    if path.is_dir():
        raise FieldError(f"{path}: a folder without {META} or {LOD_META}; give a file of splats")
    if ending in (".splat", ".ckpt"):
        return _OPEN[ending](path)
    kind = describe_other_file(path)
    if kind in _MESHES:
        raise FieldError(f"{path}: {kind}: {MESH}")
    if kind in _CLOUDS:
        raise FieldError(f"{path}: {kind}, no splats; as a PLY, {POINT_CLOUD_CURE}")
    if ending and (kind is None or ending == ".ply"):
        return _OPEN[ending](path)  # the reader reports the problem
    if kind == EMPTY_FILE:
        raise FieldError(f"{path}: {kind}; copy it again")
    if kind in (None, ZIP_ARCHIVE, GZIP_ARCHIVE) and path.suffix.lower() in CHECKPOINT_SUFFIXES:
        raise FieldError(
            f"{path}: no splats; of a checkpoint `cagefield import {path} -o SCENE` makes a scene"
        )
    of = f" ({kind})" if kind else ""
    raise FieldError(f"{path}: no format of splats that is known{of}; these are: {', '.join(READABLE)}")
