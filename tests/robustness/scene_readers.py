"""Scenes, edits, autosaves and camera paths: honest seeds, and how they are read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
from reader_seeds import Read, Reader, example_edits, example_keys, written

from cagefield import Scene
from cagefield.camera_paths import load_camera_path
from cagefield.edits import dump_edits, load_edits
from cagefield.errors import CagefieldError
from cagefield.fields.nerf_file import load_nerf, save_nerf
from cagefield.keyframe_files import dump_path, load_keys
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from nerf_networks import small_field
from scenes import ball_scene
from splat_scenes import ball_of_splats


def make_scene_folder(folder: Path) -> None:
    ball_scene().with_edits(example_edits()).save(folder / "scene")
    (folder / "scene" / "camera_path.json").write_text(dump_path(example_keys(), loop=True))


def _read_scene(folder: Path) -> None:
    from cagefield.server.web.launch import hello_of

    scene = Scene.open(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
    hello_of(scene, "scene").model_dump_json()
    dump_edits(session.document.stack)


def _read_edits(name: str) -> Read:
    def read(folder: Path) -> None:
        stack = load_edits(folder / name)
        for format in ("yaml", "json"):
            dump_edits(stack, format=format)

    return read


def _make_autosave(folder: Path) -> None:
    make_scene_folder(folder)
    scene = Scene.open(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
    session.remove(2)
    session.change(1, name="another")
    store.autosave(session)
    assert store.autosave_path.name == ".scene.cagefield-autosave.json" and store.autosave_path.is_file()


_opened: dict[Path, Scene] = {}


def opened_scene(place: Path) -> Scene:
    """A scene that is read once."""
    if place not in _opened:
        _opened[place] = Scene.open(place)
    return _opened[place]


def _read_autosave(folder: Path) -> None:
    place = folder / "scene"
    scene = opened_scene(place)
    store = SceneStore(scene, place)
    document = store.recovered()
    aside = store.autosave_path.with_suffix(".damaged")
    if aside.is_file():
        aside.unlink()
        raise CagefieldError("it is damaged, and was put aside with a warning")
    if document is not None:
        session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
        session.restore(document)
        dump_edits(session.document.stack)


def _make_path(folder: Path) -> None:
    (folder / "path.json").write_text(dump_path(example_keys(), loop=False, fps=4.0))
    transform = {"transform": np.eye(4)[:3].tolist(), "scale": 0.5}
    (folder / "dataparser_transforms.json").write_text(json.dumps(transform))


def _read_path(folder: Path) -> None:
    load_camera_path(folder / "path.json", dataparser_transforms=folder / "dataparser_transforms.json")


SCENE_READERS: dict[str, Reader] = {
    "edits.yaml": Reader(
        written("e.yaml", lambda file: file.write_text(dump_edits(example_edits()))),
        _read_edits("e.yaml"),
        {"e.yaml": "yaml"},
    ),
    "edits.json": Reader(
        written("e.json", lambda file: file.write_text(dump_edits(example_edits(), format="json"))),
        _read_edits("e.json"),
        {"e.json": "json"},
    ),
    "scene folder": Reader(
        make_scene_folder,
        _read_scene,
        {
            "scene/scene.json": "json",
            "scene/cameras.json": "json",
            "scene/edits.yaml": "yaml",
            "scene/camera_path.json": "json",
        },
    ),
    "voxel field": Reader(make_scene_folder, _read_scene, {"scene/field.safetensors": "safetensors"}),
    "splat field": Reader(
        lambda folder: Scene(ball_of_splats(), cameras=ball_scene().cameras).save(folder / "scene"),
        _read_scene,
        {"scene/field.safetensors": "safetensors"},
    ),
    "nerf field": Reader(
        written("n.safetensors", lambda file: save_nerf(small_field(), file)),
        lambda folder: load_nerf(folder / "n.safetensors"),
        {"n.safetensors": "safetensors"},
    ),
    "autosave": Reader(_make_autosave, _read_autosave, {"scene/../.scene.cagefield-autosave.json": "json"}),
    "camera path": Reader(
        _make_path, _read_path, {"path.json": "json", "dataparser_transforms.json": "json"}
    ),
    "dataparser_transforms": Reader(_make_path, _read_path, {"dataparser_transforms.json": "json"}),
    "keyframes": Reader(_make_path, lambda folder: load_keys(folder / "path.json"), {"path.json": "json"}),
}
