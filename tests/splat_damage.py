"""Splat files of every format that is read, and damage done to them.

Bytes are changed where they lie, and, as checksums would hide the readers from that, also inside of what is
compressed: the file is unpacked, damaged and packed again.
"""

from __future__ import annotations

import contextlib
import gzip
import io
import struct
import tracemalloc
import warnings
import zipfile
from pathlib import Path

import numpy as np

from cagefield.errors import FieldError
from cagefield.fields import sh as spherical_harmonics
from cagefield.fields.splat_field import SplatField
from cagefield.formats.splats.splat_files import WRITABLE, read_splats, write_splats
from cagefield.formats.splats.splat_table import FieldTable
from cagefield.formats.splats.spz_writer import write_spz

SLACK = 1 << 18
"""Bytes beside the honest memory: messages, what modules keep from their first use."""


def sample_files(field: SplatField, folder: Path) -> dict[str, bytes]:
    """A file of each format, by its ending; of a checkpoint where PyTorch is there."""
    contents = {}
    for ending in (*WRITABLE, "-4.spz", ".ksplat", "-text.ply", ".ckpt"):
        with contextlib.suppress(ImportError):
            contents[ending] = sample_file(field, folder, ending)
    return contents


def sample_file(field: SplatField, folder: Path, ending: str) -> bytes:
    """A file of the format that an ending of `sample_files` stands for, written in a folder."""
    if ending == ".ksplat":
        return ksplat_of(field)
    if ending == ".ckpt":
        return checkpoint_of(field)
    if ending == "-text.ply":
        return text_ply_of(sample_file(field, folder, ".ply"))
    file = folder / f"sample{ending}"
    if ending == "-4.spz":
        write_spz(file, FieldTable(field), version=4)
    else:
        write_splats(field, file)
    content = file.read_bytes()
    file.unlink()
    return content


def ksplat_of(field: SplatField) -> bytes:
    """A file of level 0, degree 1."""
    head, section = bytearray(4096), bytearray(1024)
    head[:2] = 0, 1
    struct.pack_into("<IIII", head, 4, 1, 1, len(field), len(field))
    struct.pack_into("<IIII", section, 0, len(field), len(field), 0, 0)
    struct.pack_into("<H", section, 40, 1)
    parts = [field.means, np.exp(field.log_scales), field.quaternions]
    rows = [np.ascontiguousarray(part, "<f4").view(np.uint8).reshape(len(field), -1) for part in parts]
    rgba = np.concatenate([field.sh[:, 0] * spherical_harmonics.C0 + 0.5, field.opacities[:, None]], axis=1)
    rows.append(np.clip(np.round(rgba * 255.0), 0, 255).astype(np.uint8))
    rest = np.ascontiguousarray(field.sh[:, 1:].transpose(0, 2, 1).reshape(len(field), -1), "<f4")
    rows.append(rest.view(np.uint8).reshape(len(field), -1))
    return bytes(head) + bytes(section) + np.concatenate(rows, axis=1).tobytes()


def old_spz(version: int, count: int) -> bytes:
    """A file of SPZ 1 or 2 with harmonics of degree 1."""
    chance = np.random.default_rng(0)
    widths = (6 if version == 1 else 9, 1, 3, 3, 3, 9)
    head = struct.pack("<4sIIBBBB", b"NGSP", version, count, 1, 12, 0, 0)
    streams = [chance.integers(0, 60, count * width, np.uint8) for width in widths]
    streams[1][:] = 200
    return gzip.compress(head + b"".join(stream.tobytes() for stream in streams))


def text_ply_of(binary: bytes) -> bytes:
    """A binary file of floats as text."""
    head, body = binary.split(b"end_header\n", 1)
    rows = np.frombuffer(body, "<f4").reshape(-1, head.count(b"property float"))
    text = "".join(" ".join(f"{value:.9g}" for value in row) + "\n" for row in rows)
    return head.replace(b"binary_little_endian", b"ascii") + b"end_header\n" + text.encode()


def splatfacto_tensors(field: SplatField) -> dict[str, np.ndarray]:
    """Parameters that nerfstudio's splatfacto keeps of splats; its rotations are of any length."""
    return {
        "means": field.means, "scales": field.log_scales, "quats": 2.0 * field.quaternions,
        "opacities": np.log(field.opacities / (1.0 - field.opacities))[:, None],
        "features_dc": field.sh[:, 0], "features_rest": field.sh[:, 1:],
    }  # fmt: skip


def checkpoint_of(field: SplatField) -> bytes:
    import torch

    parts = splatfacto_tensors(field).items()
    pipeline = {f"_model.gauss_params.{name}": torch.tensor(np.array(part)) for name, part in parts}
    out = io.BytesIO()
    torch.save({"step": 3, "pipeline": pipeline}, out)
    return out.getvalue()


def damaged(ending: str, content: bytes, chance: np.random.Generator) -> bytes:
    """A file with some bytes changed, or cut off; every other time inside of what is packed."""
    if chance.random() < 0.5:
        if ending == ".spz":
            return gzip.compress(_changed(gzip.decompress(content), chance), 1)
        if ending in (".sog", ".ckpt"):
            return _changed_member(content, chance)
    return _changed(content, chance)


def _changed(content: bytes, chance: np.random.Generator) -> bytes:
    """A few bytes changed, most of them early, some to what large numbers have."""
    changed = bytearray(content)
    for _ in range(chance.integers(1, 6)):
        at = int(chance.integers(0, min(len(changed), 400) if chance.random() < 0.7 else len(changed)))
        size = int(chance.choice([1, 1, 1, 4]))
        values = chance.choice([0, 255, 127, int(chance.integers(256)), ord("9")], size).astype(np.uint8)
        changed[at : at + size] = values.tobytes()
    if chance.random() < 0.2:
        del changed[int(chance.integers(0, len(changed))) :]
    return bytes(changed)


def _changed_member(content: bytes, chance: np.random.Generator) -> bytes:
    """One file of a zip changed, and its checksum with it; the first (meta.json, data.pkl) most often."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    names = list(members)
    name = names[0] if chance.random() < 0.5 else names[int(chance.integers(len(names)))]
    members[name] = _changed(members[name], chance)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, member in members.items():
            archive.writestr(name, member)
    return out.getvalue()


def attack(path: Path, content: bytes, count: int, seed: int = 0) -> tuple[int, float, float]:
    """(damaged files that were refused, the most memory that reading one took, that of the whole file).

    Memory in bytes, as Python and NumPy account for it.

    Raises:
        AssertionError: a refusal that is not one line with the file's name.
        Exception: whatever else than a FieldError a reader lets through.
    """
    ending = path.name[1:]
    chance, refused = np.random.default_rng(seed), 0
    path.write_bytes(content)
    read_splats(path)  # what modules make at their first use
    honest = _peak(path)[1]
    most = 0.0
    for _ in range(count):
        path.write_bytes(damaged(ending, content, chance))
        message, peak = _peak(path)
        if peak > most:  # threads that other tests have left may have taken some of it meanwhile
            peak = min(peak, _peak(path)[1])
        most = max(most, peak)
        if message is not None:
            assert "\n" not in message and path.name in message, message
            refused += 1
    return refused, most, honest


def _peak(path: Path) -> tuple[str | None, float]:
    """(why a file is refused, or None; bytes that reading it took at most)."""
    tracemalloc.start()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            read_splats(path)
        return None, tracemalloc.get_traced_memory()[1]
    except FieldError as error:
        return str(error), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
