"""Detection of a splat file's format from its content: magic numbers, JSON keys, names in a zip.

Formats are named by their usual suffixes. A .splat has no magic number; its reader checks its rows.
Descriptions of other common file types, such as meshes and images, serve error messages.
"""

from __future__ import annotations

import gzip
import struct
import zipfile
import zlib
from pathlib import Path, PurePosixPath

from cagefield.files import json_text
from cagefield.files.safe_open import open_regular, read_bytes

META, LOD_META = "meta.json", "lod-meta.json"

EMPTY_FILE = "an empty file"
GZIP_ARCHIVE = "a gzip archive of something else than SPZ; unpack it"
ZIP_ARCHIVE = "a zip archive without meta.json; unpack it"
"""Description of another zip archive; PyTorch checkpoints are such archives too."""

CHECKPOINT_SUFFIXES = (".th", ".pt", ".pth", ".tar", ".npz", ".ingp", ".msgpack")
"""Suffixes of radiance fields of other programs, which `cagefield import` reads."""

_START_BYTES = 4096
_MAX_JSON_BYTES = 64 << 20
_KSPLAT_HEADER, _KSPLAT_SECTION = 4096, 1024

_OTHER_TYPES = (
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"RIFF", "a WebP picture or another RIFF file"),
    (b"\x93NUMPY", "a NumPy array"),
    (b"\x89HDF", "an HDF5 file"),
    (b"Kaydara FBX", "an FBX mesh"),
    (b"solid ", "an STL mesh"),
    (b"OFF", "an OFF mesh"),
    (b"%PDF", "a PDF document"),
    (b"LASF", "a LAS point cloud"),
    (b"# .PCD", "a PCD point cloud"),
    (b"<", "a text of XML or HTML"),
    (b"version https://git-lfs", "a pointer of Git LFS, not the file that it stands for"),
    (b"7z\xbc\xaf", "a 7z archive"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard archive"),
)
_OBJ_WORDS = {b"v", b"vn", b"vt", b"f", b"o", b"g", b"mtllib", b"usemtl"}


def detect_format(path: Path) -> str | None:
    """Suffix of the content's format; "meta.json" and "lod-meta.json" for folders too.

    None for a content without magic number: a .splat, a checkpoint, or no splats. Raises OSError for an
    unreadable file.
    """
    if path.is_dir():
        return next((name for name in (LOD_META, META) if (path / name).is_file()), None)
    with open_regular(path) as file:
        start = file.read(_START_BYTES)
        size = file.seek(0, 2)
    if start.startswith((b"ply\n", b"ply\r", b"ply ")):
        return ".ply"
    if start.startswith(b"glTF"):
        return ".glb"
    if start.startswith(b"NGSP") or _gzip_start(path, start) == b"NGSP":
        return ".spz"
    if start.startswith((b"#usda", b"PXR-USDC")):
        return ".usda" if start.startswith(b"#usda") else ".usdc"
    if start.startswith(b"PK\x03\x04"):
        return _zip_format(path)
    if start.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
        return _json_format(path)
    return ".ksplat" if _is_ksplat(start, size) else None


def is_splat_folder(path: Path) -> bool:
    """Whether a folder holds a SOG or a streamed SOG."""
    return any((path / name).is_file() for name in (META, LOD_META))


def describe_other_file(path: Path) -> str | None:
    """Description of a known file type without splats, as a noun phrase; None for an unknown one."""
    with open_regular(path) as file:
        start = file.read(_START_BYTES)
    result = next((name for magic, name in _OTHER_TYPES if start.startswith(magic)), None)
    if result is None and not start:
        return EMPTY_FILE
    if result is None and start.startswith(b"\x1f\x8b"):
        return GZIP_ARCHIVE
    if result is None and start.startswith(b"PK\x03\x04"):
        return ZIP_ARCHIVE
    if result is None and is_text(start):
        words = {line.split()[0] for line in start.splitlines() if line.split()}
        return "an OBJ mesh" if b"v" in words and words <= _OBJ_WORDS | {b"#", b"s"} else "a text"
    return result


def is_text(content: bytes) -> bool:
    """Whether all bytes are printable ASCII, unlike in tables of binary numbers."""
    return all(32 <= byte < 127 or byte in b"\t\n\r" for byte in content)


def _gzip_start(path: Path, start: bytes) -> bytes:
    if not start.startswith(b"\x1f\x8b"):
        return b""
    try:
        with open_regular(path) as file, gzip.open(file) as stream:
            return stream.read(4)
    except (OSError, EOFError, zlib.error):
        return b""


def _zip_format(path: Path) -> str | None:
    try:
        with zipfile.ZipFile(path) as archive:
            files = archive.namelist()
            names = {PurePosixPath(name).name for name in files}
    except (zipfile.BadZipFile, NotImplementedError, ValueError, OSError):
        return None
    if LOD_META in names:
        return ".zip of " + LOD_META
    if files and files[0].lower().endswith((".usd", ".usda", ".usdc")):
        return ".usdz"
    return ".sog" if META in names else None


def _json_format(path: Path) -> str | None:
    try:
        result = json_text.loads(read_bytes(path, _MAX_JSON_BYTES).decode("utf-8-sig"))
    except UnicodeDecodeError:
        return None
    except (ValueError, OSError):
        return ".gltf" if path.name.lower().endswith(".gltf") else None
    if not isinstance(result, dict):
        return None
    if "tree" in result and "filenames" in result:
        return LOD_META
    if "means" in result:
        return META
    return ".gltf" if "asset" in result else None


def _is_ksplat(start: bytes, size: int) -> bool:
    """Whether the header's version, level, sections and splats fit a file of `size` bytes."""
    if len(start) < _KSPLAT_HEADER:
        return False
    sections, used, _, splats = struct.unpack_from("<IIII", start, 4)
    (level,) = struct.unpack_from("<H", start, 20)
    return (
        start[0] == 0
        and start[1] >= 1
        and start[2:4] == b"\0\0"
        and level <= 2
        and sections >= 1
        and used <= sections
        and _KSPLAT_HEADER + sections * _KSPLAT_SECTION + 24 * splats <= size
    )
