"""Hostile checkpoints of every program that is read: one line, nothing run, memory that the file can hold."""

from __future__ import annotations

import os
import tracemalloc
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="checkpoints are PyTorch's")

import torch

import nerfacto_files
import ngp_files
from cagefield.errors import FieldError
from cagefield.formats.external.read_external import read_external
from plenoctree_files import plenoctree_arrays, write_plenoctree
from svox2_files import svox2_arrays, write_svox2
from svraster_files import svraster_content, write_svraster
from tensorf_files import tensorf_content, write_tensorf
from tiers import nightly_except

Make = Callable[[Path], Path]


def nerfacto(folder: Path) -> Path:
    return nerfacto_files.write_run(folder)


HONEST: dict[str, Make] = {
    "TensoRF": lambda folder: write_tensorf(folder / "a.th", tensorf_content()),
    "nerfacto": nerfacto,
    "SVRaster": lambda folder: write_svraster(folder / "a.pt", svraster_content(outside=0)),
    "svox2": lambda folder: write_svox2(folder / "a.npz", svox2_arrays()),
    "PlenOctree": lambda folder: write_plenoctree(folder / "a.npz", plenoctree_arrays()),
    "Instant-NGP": lambda folder: ngp_files.write(folder / "a.ingp", ngp_files.snapshot()),
}
TORCH, NPZ = ("TensoRF", "nerfacto", "SVRaster"), ("svox2", "PlenOctree")
LIMIT = 64 << 20
"""Bytes that a refusal may take: none of the honest files holds a hundredth of it."""


class Runs:
    """An object whose pickle makes a folder."""

    def __init__(self, proof: Path) -> None:
        self.proof = proof

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.proof),)


def refused(path: Path) -> str:
    """The line of the refusal, which takes no more than LIMIT."""
    tracemalloc.start()
    try:
        with pytest.raises(FieldError) as caught:
            read_external(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    message = str(caught.value)
    assert "\n" not in message and len(message) < 600 and str(path) in message
    assert peak < LIMIT
    return message


@pytest.mark.parametrize("name", HONEST)
def test_honest_files_are_read(tmp_path: Path, name: str) -> None:
    assert read_external(HONEST[name](tmp_path)) is not None


@pytest.mark.parametrize("name", TORCH)
def test_code_in_a_pickle_is_not_run(tmp_path: Path, name: str) -> None:
    path = HONEST[name](tmp_path)
    content = torch.load(path, weights_only=False)
    content["more"] = Runs(tmp_path / "proof")
    torch.save(content, path)
    assert "holds Python objects beside tensors (posix.mkdir)" in refused(path)
    assert not (tmp_path / "proof").exists()


@pytest.mark.parametrize("name", NPZ)
def test_code_in_an_array_of_objects_is_not_run(tmp_path: Path, name: str) -> None:
    path = HONEST[name](tmp_path)
    with np.load(path) as arrays:
        content = dict(arrays.items())
    for key in content:
        changed = {**content, key: np.array([Runs(tmp_path / "proof")], object)}
        np.savez(path, **changed)
        try:
            read_external(path)  # one that the reader does not need
        except FieldError as error:
            assert "\n" not in str(error)
    assert not (tmp_path / "proof").exists()


@pytest.mark.parametrize("name", nightly_except((*TORCH, *NPZ), "svox2"))
def test_an_archive_that_unpacks_to_a_thousand_times_its_size_is_refused(tmp_path: Path, name: str) -> None:
    """Each entry replaced by 300 MB of zeros that deflate to 300 kB, its name and header kept."""
    path = HONEST[name](tmp_path)
    with zipfile.ZipFile(path) as archive:
        parts = {entry: archive.read(entry) for entry in archive.namelist()}
    largest = max(parts, key=lambda entry: len(parts[entry]))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for entry, data in parts.items():
            if entry != largest:
                archive.writestr(entry, data)
                continue
            with archive.open(entry, "w") as bomb:
                bomb.write(data[:128] if name in NPZ else b"")
                for _ in range(300):
                    bomb.write(bytes(1 << 20))
    assert path.stat().st_size < 1 << 20
    refused(path)


def lying(name: str, folder: Path) -> Path:
    """A file whose largest array says that it has 2^40 numbers, and holds a few."""
    path = HONEST[name](folder)
    if name in NPZ:
        with np.load(path) as arrays:
            content = dict(arrays.items())
        largest = max(content, key=lambda key: content[key].nbytes)
        np.savez(path, **content)
        raw = bytearray(path.read_bytes())
        shape = str(content[largest].shape).encode()
        longer = b"(" + b"1099511627776," + b")"
        at = raw.find(shape, raw.find(largest.encode()))
        room = raw.find(b"}", at) - at
        raw[at : at + room] = (longer + b", ").ljust(room)[:room]
        path.write_bytes(bytes(raw))
        return path
    content = torch.load(path, weights_only=False)

    def widened(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: widened(part) for key, part in value.items()}
        return (
            value.reshape(-1)[:1].expand(1 << 40) if torch.is_tensor(value) and value.numel() > 64 else value
        )

    torch.save(widened(content), path)
    return path


@pytest.mark.parametrize("name", (*TORCH, *NPZ))
def test_sizes_that_lie_allocate_nothing(tmp_path: Path, name: str) -> None:
    refused(lying(name, tmp_path))


def test_binaries_of_a_snapshot_that_lie_allocate_nothing(tmp_path: Path) -> None:
    """A binary of 2^32 - 1 bytes in a file of a few hundred."""
    content = ngp_files.packed(ngp_files.snapshot())
    at = content.find(b"params_binary") + len("params_binary")
    assert content[at] == 0xC6
    (tmp_path / "a.msgpack").write_bytes(content[: at + 1] + b"\xff\xff\xff\xff" + content[at + 5 :])
    refused(tmp_path / "a.msgpack")


def test_a_cyclic_config_is_refused(tmp_path: Path) -> None:
    path = HONEST["nerfacto"](tmp_path)
    (tmp_path / "config.yml").write_text("pipeline: &x\n  model: *x\n")
    with pytest.raises(FieldError, match="nested too deeply") as caught:
        read_external(path)
    assert "\n" not in str(caught.value)
