"""Checkpoints of nerfacto and snapshots of Instant-NGP: honest seeds, and how they are read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from reader_seeds import Reader

import ngp_files


def _read(name: str) -> Callable[[Path], Any]:
    """As `cagefield import` reads it, but for the baking."""

    def read(folder: Path) -> None:
        from cagefield.formats.external.read_external import read_external
        from cagefield.scene.import_external import cameras_of

        found = read_external(folder / name)
        if found is not None:
            cameras_of(found, None)

    return read


def _nerfacto(layout: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        import nerfacto_files

        nerfacto_files.write_config(folder)
        nerfacto_files.write_checkpoint(folder / "a.ckpt", nerfacto_files.arrays(0, layout), layout)

    return make


def _snapshot(name: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        ngp_files.write(folder / name, ngp_files.snapshot())

    return make


def _make_field(folder: Path) -> None:
    from cagefield.fields.external.external_file import save_external
    from cagefield.formats.external.instant_ngp import read_instant_ngp

    ngp_files.write(folder / "b.ingp", ngp_files.snapshot())
    found = read_instant_ngp(folder / "b.ingp").field
    (folder / "b.ingp").unlink()
    save_external(found, folder / "a.safetensors")  # type: ignore[arg-type]


def _make_nerfacto_field(folder: Path) -> None:
    from cagefield.fields.external.external_file import save_external
    from cagefield.formats.external.read_external import read_external

    _nerfacto("torch")(folder)
    found = read_external(folder / "a.ckpt")
    save_external(found.field, folder / "a.safetensors")  # type: ignore[union-attr, arg-type]
    for name in ("a.ckpt", "config.yml", "dataparser_transforms.json"):
        (folder / name).unlink()


def _read_field(folder: Path) -> None:
    from cagefield.scene.scene_files import read_original

    read_original(folder / "a.safetensors")


HASH_GRID_READERS: dict[str, Reader] = {
    "nerfacto .ckpt": Reader(_nerfacto("torch"), _read("a.ckpt"), {"a.ckpt": "zip"}),
    "nerfacto .ckpt, tcnn": Reader(_nerfacto("tcnn"), _read("a.ckpt"), {"a.ckpt": "zip"}),
    "nerfacto config.yml": Reader(_nerfacto("torch"), _read("a.ckpt"), {"config.yml": "yaml"}),
    "original, nerfacto": Reader(_make_nerfacto_field, _read_field, {"a.safetensors": "safetensors"}),
    "nerfacto transforms": Reader(
        _nerfacto("torch"), _read("a.ckpt"), {"dataparser_transforms.json": "json"}
    ),
    "Instant-NGP .msgpack": Reader(_snapshot("a.msgpack"), _read("a.msgpack"), {"a.msgpack": "bytes"}),
    "Instant-NGP .ingp": Reader(_snapshot("a.ingp"), _read("a.ingp"), {"a.ingp": "bytes"}),
    "original, Instant-NGP": Reader(_make_field, _read_field, {"a.safetensors": "safetensors"}),
}
HASH_GRID_NEED_TORCH = tuple(name for name in HASH_GRID_READERS if "nerfacto" in name)
