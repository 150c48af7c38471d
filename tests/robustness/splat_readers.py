"""Files of splats: honest seeds, and how they are read."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
from reader_seeds import Reader

from cagefield.formats.splat_files import read_splats
from cagefield.formats.splat_import import import_splats
from splat_damage import sample_files
from splat_scenes import random_splats


def _splat_reader(ending: str, kind: str) -> Reader:
    name = f"a{ending}"

    def make(folder: Path) -> None:
        (folder / name).write_bytes(sample_files(random_splats(120), folder)[ending])

    def read(folder: Path) -> None:
        import_splats(read_splats(folder / name))

    return Reader(make, read, {name: kind})


def _make_old_spz(version: int) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        import gzip
        import struct

        count, chance = 100, np.random.default_rng(0)
        widths = (6 if version == 1 else 9, 1, 3, 3, 3, 9)
        head = struct.pack("<4sIIBBBB", b"NGSP", version, count, 1, 12, 0, 0)
        streams = [chance.integers(0, 60, count * width, np.uint8) for width in widths]
        streams[1][:] = 200
        body = b"".join(stream.tobytes() for stream in streams)
        (folder / "a.spz").write_bytes(gzip.compress(head + body))

    return make


def _make_sog_folder(folder: Path) -> None:
    import zipfile

    content = sample_files(random_splats(120), folder)[".sog"]
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(folder / "sog")


def _make_old_checkpoint(folder: Path) -> None:
    """splatfacto's as older versions of PyTorch wrote it."""
    import torch

    (folder / "new.ckpt").write_bytes(sample_files(random_splats(120), folder)[".ckpt"])
    content = torch.load(folder / "new.ckpt", weights_only=True)
    torch.save(content, folder / "a.ckpt", _use_new_zipfile_serialization=False)


SPLAT_READERS: dict[str, Reader] = {
    "ply": _splat_reader(".ply", "ply"),
    "text ply": _splat_reader("-text.ply", "ply"),
    "compressed.ply": _splat_reader(".compressed.ply", "ply"),
    "spz 1": Reader(
        _make_old_spz(1), lambda folder: import_splats(read_splats(folder / "a.spz")), {"a.spz": "gzip"}
    ),
    "spz 2": Reader(
        _make_old_spz(2), lambda folder: import_splats(read_splats(folder / "a.spz")), {"a.spz": "gzip"}
    ),
    "spz 3": _splat_reader(".spz", "gzip"),
    "spz 4": _splat_reader("-4.spz", "spz4"),
    "splat": _splat_reader(".splat", "bytes"),
    "ksplat": _splat_reader(".ksplat", "bytes"),
    "sog": _splat_reader(".sog", "zip"),
    "sog folder": Reader(
        _make_sog_folder,
        lambda folder: read_splats(folder / "sog"),
        {"sog/meta.json": "json", "sog/means_l.webp": "bytes", "sog/shN_labels.webp": "bytes"},
    ),
    "glb": _splat_reader(".glb", "glb"),
    "splatfacto .ckpt, old": Reader(
        _make_old_checkpoint,
        lambda folder: import_splats(read_splats(folder / "a.ckpt")) and None,
        {"a.ckpt": "bytes"},
    ),
    "splatfacto .ckpt": _splat_reader(".ckpt", "zip"),
}
