"""Checkpoints of other programs' fields, and the files of scenes that keep them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from reader_seeds import Reader

from plenoctree_files import plenoctree_arrays, write_plenoctree
from svox2_files import svox2_arrays, write_svox2
from svraster_files import svraster_content, write_svraster
from tensorf_files import tensorf_content, write_tensorf


def _read(name: str) -> Callable[[Path], Any]:
    """As `cagefield import` reads it, but for the baking."""

    def read(folder: Path) -> None:
        from cagefield.formats.external.read_external import read_external
        from cagefield.scene.import_external import cameras_of

        found = read_external(folder / name)
        if found is not None:
            cameras_of(found, None)

    return read


def _tensorf(model: str, shading: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        write_tensorf(folder / "a.th", tensorf_content(model, shading))

    return make


def _svraster(quantized: bool) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        write_svraster(folder / "a.pt", svraster_content(outside=0, quantized=quantized))

    return make


def _kept(name: str, make: Callable[[Path], None]) -> Callable[[Path], None]:
    """The field of a checkpoint as a scene keeps it; the checkpoint goes."""

    def keep(folder: Path) -> None:
        from cagefield.fields.external.external_file import save_external
        from cagefield.formats.external.read_external import read_external

        make(folder)
        found = read_external(folder / name)
        (folder / name).unlink()
        save_external(found.field, folder / "a.safetensors")  # type: ignore[union-attr, arg-type]

    return keep


def _read_field(folder: Path) -> None:
    from cagefield.scene.scene_files import read_original

    read_original(folder / "a.safetensors")


def _svox2(compress: bool, **changes: Any) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        write_svox2(folder / "a.npz", svox2_arrays(**changes), compress)

    return make


def _plenoctree(folder: Path) -> None:
    write_plenoctree(folder / "a.npz", plenoctree_arrays())


def _original(name: str, make: Callable[[Path], None]) -> Reader:
    return Reader(_kept(name, make), _read_field, {"a.safetensors": "safetensors"})


_BACKGROUND = {"background_data": np.zeros((8, 4, 4), np.float32), "background_links": np.zeros((4, 2), int)}

EXTERNAL_READERS: dict[str, Reader] = {
    "TensoRF .th": Reader(_tensorf("TensorVMSplit", "MLP_Fea"), _read("a.th"), {"a.th": "zip"}),
    "TensoRF .th, VM": Reader(_tensorf("TensorVM", "RGB"), _read("a.th"), {"a.th": "zip"}),
    "TensoRF .th, lines": Reader(_tensorf("TensorCP", "SH"), _read("a.th"), {"a.th": "zip"}),
    "original, TensoRF": _original("a.th", _tensorf("TensorVMSplit", "MLP_Fea")),
    "PlenOctree .npz": Reader(_plenoctree, _read("a.npz"), {"a.npz": "zip"}),
    "original, PlenOctree": _original("a.npz", _plenoctree),
    "SVRaster .pt": Reader(_svraster(False), _read("a.pt"), {"a.pt": "zip"}),
    "SVRaster .pt, quantized": Reader(_svraster(True), _read("a.pt"), {"a.pt": "zip"}),
    "original, SVRaster": _original("a.pt", _svraster(False)),
    "svox2 .npz": Reader(_svox2(False), _read("a.npz"), {"a.npz": "zip"}),
    "svox2 .npz, deflated": Reader(_svox2(True, **_BACKGROUND), _read("a.npz"), {"a.npz": "zip"}),
}
EXTERNAL_NEED_TORCH = (
    "TensoRF .th",
    "TensoRF .th, VM",
    "TensoRF .th, lines",
    "original, TensoRF",
    "SVRaster .pt",
    "SVRaster .pt, quantized",
    "original, SVRaster",
)
