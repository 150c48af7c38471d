"""Scenes, edits, autosaves and camera paths: honest seeds, and how they are read."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import yaml
from reader_seeds import Reader, example_edits, example_keys, written

from cagefield import Hotspot, Scene
from cagefield.cameras.camera_paths import load_camera_path
from cagefield.cameras.keyframe_files import dump_path, load_keys
from cagefield.edits import EditStack, dump_edits, load_edits
from cagefield.errors import CagefieldError
from cagefield.fields.nerf_file import load_nerf, save_nerf
from cagefield.scene.hotspots import resolved_view, view_of_camera
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from nerf_networks import small_field
from scenes import ball_cameras, ball_field, ball_scene
from splat_scenes import ball_of_splats


def example_hotspots() -> tuple[Hotspot, ...]:
    """A hotspot with a camera and markup in its texts, and one without."""
    view = view_of_camera(ball_scene().cameras["test"][0])
    return (
        Hotspot("<b>Top</b>", (0.0, 0.0, 0.5), "</script>\nsecond line", view),
        Hotspot("Side", (0.5, 0.0, 0.0)),
    )


def _make_hotspots(folder: Path) -> None:
    make_scene_folder(folder)
    document = {"hotspots": [hotspot.to_dict() for hotspot in example_hotspots()]}
    (folder / "hotspots.yaml").write_text(yaml.safe_dump(document))


def _read_hotspots(folder: Path) -> None:
    from cagefield.scene.hotspots import hotspots_from_file

    scene = dataclasses.replace(
        opened_scene(folder / "scene"), hotspots=hotspots_from_file(folder / "hotspots.yaml")
    )
    for hotspot in scene.hotspots:
        resolved_view(hotspot, scene.first_camera, scene.up)


def make_scene_folder(
    folder: Path, resolution: int = 17, cameras: int = 3, edits: Callable[[], EditStack] = example_edits
) -> None:
    """A scene of the ball; it has `cameras` to train from."""
    seen = ball_scene().cameras | {"train": ball_cameras(cameras)}
    scene = Scene(ball_field(resolution=resolution), cameras=seen, hotspots=example_hotspots())
    scene.with_edits(edits()).save(folder / "scene")
    (folder / "scene" / "camera_path.json").write_text(dump_path(example_keys(), loop=True))


def _read_scene(folder: Path) -> None:
    from cagefield.server.web.launch import hello_of

    scene = Scene.open(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
    hello_of(scene, "scene").model_dump_json()
    dump_edits(session.document.stack)


def edits_reader(
    format: str, edits: Callable[[], EditStack] = example_edits, dumped: tuple[str, ...] = ("yaml", "json")
) -> Reader:
    """Of a file of edits, which are written again in the formats `dumped`."""
    name = f"e.{format}"

    def read(folder: Path) -> None:
        stack = load_edits(folder / name)
        for other in dumped:
            dump_edits(stack, format=other)

    def make(folder: Path) -> None:
        (folder / name).write_text(dump_edits(edits(), format=format))

    return Reader(make, read, {name: format})


def _make_autosave(edits: Callable[[], EditStack], folder: Path) -> None:
    make_scene_folder(folder, edits=edits)
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


def _make_path(keys: int, fps: float, folder: Path) -> None:
    (folder / "path.json").write_text(dump_path(example_keys(keys), loop=False, fps=fps))
    transform = {"transform": np.eye(4)[:3].tolist(), "scale": 0.5}
    (folder / "dataparser_transforms.json").write_text(json.dumps(transform))


def _read_path(folder: Path) -> None:
    load_camera_path(folder / "path.json", dataparser_transforms=folder / "dataparser_transforms.json")


def field_readers(resolution: int = 17, splats: int = 600, width: int = 16) -> dict[str, Reader]:
    """Of fields: voxels [resolution]^3, so many splats, and networks of a width."""
    return {
        "voxel field": Reader(
            partial(make_scene_folder, resolution=resolution),
            _read_scene,
            {"scene/field.safetensors": "safetensors"},
        ),
        "splat field": Reader(
            lambda folder: Scene(ball_of_splats(splats), cameras=ball_scene().cameras).save(folder / "scene"),
            _read_scene,
            {"scene/field.safetensors": "safetensors"},
        ),
        "nerf field": Reader(
            written("n.safetensors", lambda file: save_nerf(small_field(width=width), file)),
            lambda folder: load_nerf(folder / "n.safetensors"),
            {"n.safetensors": "safetensors"},
        ),
    }


def autosave_reader(edits: Callable[[], EditStack] = example_edits) -> Reader:
    """Of an autosave of three edits or more."""
    return Reader(
        partial(_make_autosave, edits), _read_autosave, {"scene/../.scene.cagefield-autosave.json": "json"}
    )


def path_readers(keys: int = 3, fps: float = 4.0) -> dict[str, Reader]:
    """Of camera paths of so many keyframes, and so many cameras a second."""
    make = partial(_make_path, keys, fps)
    return {
        "camera path": Reader(make, _read_path, {"path.json": "json", "dataparser_transforms.json": "json"}),
        "keyframes": Reader(make, lambda folder: load_keys(folder / "path.json"), {"path.json": "json"}),
    }


def scene_reader(cameras: int = 3, edits: Callable[[], EditStack] = example_edits) -> Reader:
    """Of a scene but for its field."""
    return Reader(
        partial(make_scene_folder, cameras=cameras, edits=edits),
        _read_scene,
        {
            "scene/scene.json": "json",
            "scene/cameras.json": "json",
            "scene/edits.yaml": "yaml",
            "scene/camera_path.json": "json",
        },
    )


SCENE_READERS: dict[str, Reader] = {
    "edits.yaml": edits_reader("yaml"),
    "edits.json": edits_reader("json"),
    "scene folder": scene_reader(),
    **field_readers(),
    "autosave": autosave_reader(),
    "hotspots": Reader(_make_hotspots, _read_hotspots, {"hotspots.yaml": "yaml"}),
    **path_readers(),
    "dataparser_transforms": Reader(
        partial(_make_path, 3, 4.0), _read_path, {"dataparser_transforms.json": "json"}
    ),
}
