"""Files of splats: honest seeds, and how they are read."""

from __future__ import annotations

import io
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from reader_seeds import Reader

from cagefield.formats.splat_files import read_splats
from cagefield.formats.splat_import import import_splats
from splat_damage import sample_file
from splat_scenes import random_splats


def _read(name: str, folder: Path) -> None:
    import_splats(read_splats(folder / name))


def _splat_reader(ending: str, kind: str, count: int) -> Reader:
    name = f"a{ending}"

    def make(folder: Path) -> None:
        (folder / name).write_bytes(sample_file(random_splats(count), folder, ending))

    return Reader(make, partial(_read, name), {name: kind})


def _make_old_spz(version: int, count: int) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        import gzip
        import struct

        chance = np.random.default_rng(0)
        widths = (6 if version == 1 else 9, 1, 3, 3, 3, 9)
        head = struct.pack("<4sIIBBBB", b"NGSP", version, count, 1, 12, 0, 0)
        streams = [chance.integers(0, 60, count * width, np.uint8) for width in widths]
        streams[1][:] = 200
        body = b"".join(stream.tobytes() for stream in streams)
        (folder / "a.spz").write_bytes(gzip.compress(head + body))

    return make


def _make_sog_folder(count: int, folder: Path) -> None:
    import zipfile

    content = sample_file(random_splats(count), folder, ".sog")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(folder / "sog")


def _make_old_checkpoint(count: int, folder: Path) -> None:
    """splatfacto's as older versions of PyTorch wrote it."""
    import torch

    content = torch.load(io.BytesIO(sample_file(random_splats(count), folder, ".ckpt")), weights_only=True)
    torch.save(content, folder / "a.ckpt", _use_new_zipfile_serialization=False)


def splat_readers(count: int = 120, old_spz: int = 100) -> dict[str, Reader]:
    """Of files of `count` splats; those of SPZ 1 and 2 have `old_spz`."""
    return {
        "ply": _splat_reader(".ply", "ply", count),
        "text ply": _splat_reader("-text.ply", "ply", count),
        "compressed.ply": _splat_reader(".compressed.ply", "ply", count),
        "spz 1": Reader(_make_old_spz(1, old_spz), partial(_read, "a.spz"), {"a.spz": "gzip"}),
        "spz 2": Reader(_make_old_spz(2, old_spz), partial(_read, "a.spz"), {"a.spz": "gzip"}),
        "spz 3": _splat_reader(".spz", "gzip", count),
        "spz 4": _splat_reader("-4.spz", "spz4", count),
        "splat": _splat_reader(".splat", "bytes", count),
        "ksplat": _splat_reader(".ksplat", "bytes", count),
        "sog": _splat_reader(".sog", "zip", count),
        "sog folder": Reader(
            partial(_make_sog_folder, count),
            lambda folder: read_splats(folder / "sog"),
            {"sog/meta.json": "json", "sog/means_l.webp": "bytes", "sog/shN_labels.webp": "bytes"},
        ),
        "glb": _splat_reader(".glb", "glb", count),
        "splatfacto .ckpt, old": Reader(
            partial(_make_old_checkpoint, count), partial(_read, "a.ckpt"), {"a.ckpt": "bytes"}
        ),
        "splatfacto .ckpt": _splat_reader(".ckpt", "zip", count),
    }


SPLAT_READERS = splat_readers()
