"""Files of splats: honest seeds, and how they are read."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from reader_seeds import Reader

from cagefield.formats.splats.splat_files import read_splats, write_splats
from cagefield.scene.import_splats import import_splats
from gltf_assets import Asset
from splat_damage import old_spz, sample_file
from splat_scenes import random_splats


def _read(name: str, folder: Path) -> None:
    import_splats(read_splats(folder / name))


def _splat_reader(ending: str, kind: str, count: int) -> Reader:
    name = f"a{ending}"

    def make(folder: Path) -> None:
        (folder / name).write_bytes(sample_file(random_splats(count), folder, ending))

    return Reader(make, partial(_read, name), {name: kind})


def _make_old_spz(version: int, count: int) -> Callable[[Path], None]:
    return lambda folder: _write(folder / "a.spz", old_spz(version, count))


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def _make_sog_folder(count: int, folder: Path) -> None:
    import zipfile

    content = sample_file(random_splats(count), folder, ".sog")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(folder / "sog")


def _scene_of(count: int) -> Asset:
    """Two primitives below turned and stretched nodes, instances, sparse values."""
    asset = Asset()
    first, second = asset.splats(random_splats(count)), asset.splats(random_splats(count, degree=0))
    child = asset.node(mesh=asset.mesh(first, second), scale=[1.0, 2.0, -1.0])
    root = asset.node(children=[child], rotation=[0.0, 0.6, 0.0, 0.8], translation=[0.0, 1.0, 2.0])
    shifts = {"TRANSLATION": asset.accessor(np.eye(3))}
    shown = asset.node(mesh=0, matrix=[float(n % 5 == 0) for n in range(16)])
    asset.json["nodes"][shown]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": shifts}}
    asset.scene(root, shown)
    opacity = asset.json["accessors"][first["attributes"]["KHR_gaussian_splatting:OPACITY"]]
    indices = {"bufferView": asset.view(np.array([1, 7], "<u2").tobytes()), "componentType": 5123}
    values = {"bufferView": asset.view(np.array([0.25, 0.75], "<f4").tobytes())}
    opacity["sparse"] = {"count": 2, "indices": indices, "values": values}
    return asset


def _make_glb_scene(count: int, folder: Path) -> None:
    _scene_of(count).write(folder / "a.glb")


def _make_gltf_scene(count: int, folder: Path) -> None:
    _scene_of(count).write(folder / "a.gltf", "a.bin")


def _make_gltf_spz(count: int, folder: Path) -> None:
    asset = Asset()
    content = asset.view(sample_file(random_splats(count), folder, ".spz"))
    said = {"KHR_spz_gaussian_splats_compression": {"bufferView": content}}
    primitive = {"mode": 0, "attributes": {"POSITION": 0}, "extensions": said}
    asset.scene(asset.node(mesh=asset.mesh(primitive)))
    asset.write(folder / "a.gltf")


def _make_gltf_draft(count: int, folder: Path) -> None:
    field, asset = random_splats(count, degree=0), Asset()
    attributes = {
        "POSITION": asset.accessor(field.means),
        "COLOR_0": asset.accessor(np.full((count, 4), 200), "u1", normalized=True),
        "_SCALE": asset.accessor(field.log_scales),
        "_ROTATION": asset.accessor(field.quaternions[:, [1, 2, 3, 0]]),
    }
    asset.scene(asset.node(mesh=asset.mesh({"mode": 0, "attributes": attributes})))
    asset.write(folder / "a.glb")


def _make_far_ply(count: int, folder: Path) -> None:
    write_splats(replace(random_splats(count), offset=(5e5, 5e6, 300.0)), folder / "a.ply")


def _make_streamed_sog(count: int, folder: Path) -> None:
    _make_sog_folder(count, folder)
    (folder / "sog").rename(folder / "0_0")
    (folder / "sog").mkdir()
    (folder / "0_0").rename(folder / "sog" / "0_0")
    rows = [{"file": 0, "offset": at, "count": count // 2} for at in (0, count // 2)]
    tree = {"children": [{"lods": {"0": part, "1": {**part, "count": 0}}} for part in rows]}
    meta = {"lodLevels": 2, "environment": None, "filenames": ["0_0/meta.json"], "tree": tree}
    (folder / "sog" / "lod-meta.json").write_text(json.dumps(meta))


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
        "usda": _splat_reader(".usda", "text", count),
        "usdc": _splat_reader(".usdc", "bytes", count),
        "usdz": _splat_reader(".usdz", "bytes", count),
        "glb scene": Reader(partial(_make_glb_scene, count), partial(_read, "a.glb"), {"a.glb": "glb"}),
        "gltf scene": Reader(
            partial(_make_gltf_scene, count), partial(_read, "a.gltf"), {"a.gltf": "json", "a.bin": "bytes"}
        ),
        "gltf spz": Reader(partial(_make_gltf_spz, count), partial(_read, "a.gltf"), {"a.gltf": "json"}),
        "gltf draft": Reader(partial(_make_gltf_draft, count), partial(_read, "a.glb"), {"a.glb": "glb"}),
        "far ply": Reader(partial(_make_far_ply, count), partial(_read, "a.ply"), {"a.ply": "ply"}),
        "streamed sog": Reader(
            partial(_make_streamed_sog, count),
            lambda folder: read_splats(folder / "sog"),
            {"sog/lod-meta.json": "json", "sog/0_0/meta.json": "json", "sog/0_0/means_l.webp": "bytes"},
        ),
        "splatfacto .ckpt, old": Reader(
            partial(_make_old_checkpoint, count), partial(_read, "a.ckpt"), {"a.ckpt": "bytes"}
        ),
        "splatfacto .ckpt": _splat_reader(".ckpt", "zip", count),
    }


SPLAT_READERS = splat_readers()
