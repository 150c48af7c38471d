"""Every reader of files and messages: an honest seed, which of its files are damaged, and how it is read."""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from cagefield import Scene
from cagefield.cages import Cage
from cagefield.camera_paths import load_camera_path
from cagefield.datasets import load_dataset
from cagefield.datasets.photos import read_photo
from cagefield.datasets.point_files import read_points
from cagefield.edits import Edit, EditStack, dump_edits, load_edits
from cagefield.edits.operations import MoveCorner, Rotate, Scale, Translate
from cagefield.errors import CagefieldError
from cagefield.fields.nerf_file import load_nerf, save_nerf
from cagefield.formats.nerf_pytorch_config import read_config
from cagefield.formats.splat_files import read_splats
from cagefield.formats.splat_import import import_splats
from cagefield.keyframe_files import dump_path, load_keys
from cagefield.keyframes import Keyframe
from cagefield.rendering.images import read_image
from cagefield.server.editor.persistence import SceneStore
from cagefield.server.editor.session import Session
from cagefield.training.checkpoint import read_checkpoint, write_checkpoint
from nerf_networks import krrish94_state, small_field, yenchenlin_state
from posed_photos import room_capture
from scenes import ball_scene
from splat_damage import sample_files
from splat_scenes import ball_of_splats, random_splats

Read = Callable[[Path], Any]


@dataclass(frozen=True)
class Reader:
    """`make` writes an honest seed into a folder, `read` reads it; `damaged`: its files and their kinds."""

    make: Callable[[Path], None]
    read: Read
    damaged: Mapping[str, str]


def _edits() -> EditStack:
    inner = Cage.box((0.0, 0.0, 0.0), (0.5, 0.5, 0.5), (0.0, 0.1, 0.2))
    moved = Edit(
        inner,
        operations=(
            Translate((0.1, 0.0, 0.0)),
            Rotate((0.0, 0.0, 10.0)),
            Scale((1.1, 1.0, 1.0)),
            MoveCorner(3, (0.02, 0.0, 0.0)),
        ),
        outer=inner.grown((0.4, 0.4, 0.4)),
        name="arm up",
        lattice=16,
    )
    other = Edit(
        Cage.box((0.3, 0.3, 0.0), (0.2, 0.2, 0.2)),
        operations=(Translate((0.0, 0.3, 0.0)),),
        adjustment="discrete",
        keep_source=True,
    )
    gone = Edit(Cage.box((-0.3, 0.3, 0.0), (0.2, 0.2, 0.2)), deleted=True, adjustment="discrete")
    return EditStack([moved, other, gone])


def _keys() -> tuple[Keyframe, ...]:
    cameras = ball_scene().cameras["train"]
    return tuple(
        Keyframe(tuple(camera.c2w.reshape(-1).tolist()), 40.0, 0.3, {1: 0.5, 2: 1.0}) for camera in cameras
    )


# ---- scenes, edits, paths ----


def _make_scene(folder: Path) -> None:
    ball_scene().with_edits(_edits()).save(folder / "scene")
    (folder / "scene" / "camera_path.json").write_text(dump_path(_keys(), loop=True))


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
    _make_scene(folder)
    scene = Scene.open(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    session = Session(store.document(), scene.field.bounds, scene.field.sample_spacing)
    session.remove(2)
    session.change(1, name="another")
    store.autosave(session)
    assert store.autosave_path.name == ".scene.cagefield-autosave.json" and store.autosave_path.is_file()


_opened: dict[Path, Scene] = {}


def _scene(place: Path) -> Scene:
    """A scene that is read once."""
    if place not in _opened:
        _opened[place] = Scene.open(place)
    return _opened[place]


def _read_autosave(folder: Path) -> None:
    place = folder / "scene"
    scene = _scene(place)
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
    (folder / "path.json").write_text(dump_path(_keys(), loop=False, fps=4.0))
    transform = {"transform": np.eye(4)[:3].tolist(), "scale": 0.5}
    (folder / "dataparser_transforms.json").write_text(json.dumps(transform))


def _read_path(folder: Path) -> None:
    load_camera_path(folder / "path.json", dataparser_transforms=folder / "dataparser_transforms.json")


# ---- fields ----


def _written(name: str, write: Callable[[Path], Any]) -> Callable[[Path], None]:
    return lambda folder: write(folder / name)


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


def _torch_file(content: dict[str, Any], old: bool) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        import torch

        def tensors(value: Any) -> Any:
            if isinstance(value, dict):
                return {name: tensors(part) for name, part in value.items()}
            return torch.from_numpy(np.array(value)) if isinstance(value, np.ndarray) else value

        torch.save(tensors(content), folder / "a.tar", _use_new_zipfile_serialization=not old)

    return make


def _read_networks(folder: Path) -> None:
    from cagefield.formats.nerf_pytorch import read_checkpoint as read

    read(folder / "a.tar")


_YENCHENLIN = {"global_step": 5, "network_fn_state_dict": yenchenlin_state(0, width=8, depth=4)}
_KRRISH94 = {"iter": 9, "model_coarse_state_dict": krrish94_state(0), "loss": 0.1, "psnr": 21.0}
_CONFIG = """expname = x
dataset_type = blender
datadir = ./data
N_samples = 64
N_importance = 128
use_viewdirs = True
white_bkgd = True
"""
_CONFIG_YML = """dataset: {type: blender, basedir: x, near: 2.0, far: 6.0, no_ndc: true}
models:
  coarse: {log_sampling_xyz: true, log_sampling_dir: true, num_encoding_fn_xyz: 6}
nerf:
  validation: {num_coarse: 64, num_fine: 128, lindisp: false, white_background: true}
"""


def _make_training(folder: Path) -> None:
    write_checkpoint(folder / "a.training", "x", {"step": 3}, {"noise": np.arange(600.0).reshape(20, 30)})


# ---- data sets and pictures ----


def _make_transforms(folder: Path) -> None:
    folder.joinpath("capture", "images").mkdir(parents=True)
    frames = []
    for index, camera in enumerate(ball_scene().cameras["train"]):
        name = f"images/{index}.png"
        Image.fromarray(np.full((16, 24, 3), 90, np.uint8)).save(folder / "capture" / name)
        frames.append({"file_path": name, "transform_matrix": camera.c2w.tolist()})
    lens = {
        "w": 24,
        "h": 16,
        "fl_x": 30.0,
        "fl_y": 30.0,
        "cx": 12.0,
        "cy": 8.0,
        "k1": 0.01,
        "k2": 0.0,
        "p1": 0.0,
    }
    lens |= {"p2": 0.0, "camera_model": "OPENCV", "aabb_scale": 4}
    (folder / "capture" / "transforms.json").write_text(json.dumps(lens | {"frames": frames}))


def _make_colmap(text: bool) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        import pycolmap

        model = pycolmap.Reconstruction()
        camera = pycolmap.Camera(
            model="OPENCV",
            width=24,
            height=16,
            camera_id=1,
            params=[30.0, 30.0, 12.0, 8.0, 0.01, 0.0, 0.0, 0.0],
        )
        model.add_camera_with_trivial_rig(camera)
        (folder / "capture" / "images").mkdir(parents=True)
        for index, seen in enumerate(ball_scene().cameras["train"]):
            rotation = (seen.c2w[:3, :3] * (1.0, -1.0, -1.0)).T
            rigid = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), -rotation @ seen.c2w[:3, 3])
            image = pycolmap.Image(name=f"{index}.png", camera_id=1, image_id=index + 1)
            image.points2D = pycolmap.Point2DList([pycolmap.Point2D(np.array([12.0, 8.0]))])
            model.add_image_with_trivial_frame(image, rigid)
            Image.fromarray(np.full((16, 24, 3), 90, np.uint8)).save(folder / "capture/images" / image.name)
        for point in np.random.default_rng(0).uniform(-0.5, 0.5, (20, 3)):
            track = pycolmap.Track()
            model.add_point3D(point, track, np.zeros(3, np.uint8))
        (folder / "capture" / "sparse" / "0").mkdir(parents=True)
        (model.write_text if text else model.write_binary)(folder / "capture" / "sparse" / "0")

    return make


def _read_capture(folder: Path) -> None:
    load_dataset(folder / "capture")


def _make_llff(folder: Path) -> None:
    room_capture(folder / "capture")


def _make_picture(ending: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        pixels = np.random.default_rng(0).integers(0, 256, (12, 16, 4)).astype(np.uint8)
        image = Image.fromarray(pixels if ending in (".png", ".webp", ".tif") else pixels[..., :3])
        image.save(folder / f"a{ending}")

    return make


def _read_picture(ending: str) -> Read:
    def read(folder: Path) -> None:
        read_photo(folder / f"a{ending}", 2)
        read_image(folder / f"a{ending}")

    return read


def _make_points(folder: Path) -> None:
    rows = "".join(f"{n * 0.1} {n * 0.2} {n} {n % 255} 2 3\n" for n in range(50))
    names = "".join(f"property float {name}\n" for name in "xyz")
    names += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    head = f"ply\nformat ascii 1.0\nelement vertex 50\n{names}end_header\n"
    (folder / "points.ply").write_text(head + rows)


# ---- messages of pages ----


def _make_messages(folder: Path) -> None:
    _make_scene(folder)
    start = ball_scene().cameras["test"][0]
    camera = {"seq": 1, "c2w": start.c2w.reshape(-1).tolist(), "width": 64, "height": 48, "fov_y_deg": 40.0}
    corners = _edits()[0].inner.corners.tolist()
    key = {"c2w": camera["c2w"], "fov_y_deg": 40.0, "seconds": 1.0, "parts": {"1": 0.5}}
    move = {"kind": "translate", "by": [0.1, 0.0, 0.0]}
    messages: list[dict[str, Any]] = [
        {"type": "camera", **camera},
        {"type": "display", "view": "depth", "split": 0.5},
        {"type": "presented", "picture": 1},
        {"type": "drawing", "here": "all"},
        {"type": "drag_begin", "drag": 1, "edit": 1, "target": "field"},
        {"type": "drag", "drag": 1, "seq": 1, "operation": move},
        {"type": "drag_end", "drag": 1, "seq": 2, "operation": move},
        {"type": "apply", "edit": 1, "target": "field", "operation": move},
        {"type": "set_cage", "edit": 1, "cage": "inner", "corners": corners},
        {"type": "place", "x": 0.5, "y": 0.5},
        {"type": "outer_margin", "edit": 1, "margin": 0.5},
        {
            "type": "change",
            "edit": 1,
            "name": "x",
            "enabled": True,
            "lattice": 16,
            "shell": "flow",
            "width": 0.5,
        },
        {"type": "scene_change", "preserve_opacity": False},
        *({"type": "command", "name": n, "edit": 1} for n in ("undo", "redo", "duplicate", "select", "save")),
        {"type": "command", "name": "remove_last_operation", "edit": 1},
        {"type": "mirror", "edit": 1, "axis": "x"},
        {"type": "reorder", "edit": 1, "to": 1},
        {"type": "go_to", "entry": 0},
        {"type": "save_as", "path": "other"},
        {"type": "load_edits", "text": dump_edits(_edits(), format="json"), "append": False},
        {"type": "load_edits", "text": dump_edits(_edits()), "append": True},
        {"type": "ask", "request": 1, "what": "edit_text", "edit": 1},
        {"type": "ask", "request": 2, "what": "path"},
        {"type": "set_path", "keys": [key, key], "loop": True},
        {"type": "play_begin", "play": 1},
        {"type": "play", "play": 1, "seconds": 0.5},
        {"type": "play_end", "play": 1},
        {"type": "render", "what": "camera_path", "out": "a.mp4", "width": 64, "height": 64, "fps": 4.0},
        {"type": "cancel_job", "job": 1},
    ]
    for number, message in enumerate(messages):
        (folder / f"message{number:02}.json").write_text(json.dumps(message))


def _read_messages(folder: Path) -> None:
    """The damaged message, or all that are whole, to an editor whose rendering process is never started."""
    from pydantic import ValidationError

    from cagefield.server.protocol.client_messages import page_messages
    from cagefield.server.protocol.validation_errors import refusal
    from cagefield.server.render_queue.coordinator import Coordinator
    from cagefield.server.web.handlers import MessageHandlers
    from cagefield.server.web.launch import hello_of

    scene = _scene(folder / "scene")
    store = SceneStore(scene, folder / "scene")
    coordinator = Coordinator(Session(store.document(), scene.field.bounds, 0.1), store, "cpu")
    page = coordinator.join(hello_of(scene, "scene"))
    handlers = MessageHandlers(coordinator, page)
    said = json.loads((folder / "which").read_text()) if (folder / "which").is_file() else None
    files = [said] if said else sorted(file.name for file in folder.glob("message*.json"))
    if said in _BEGUN_BY:
        files.insert(0, _BEGUN_BY[said])
    refused: CagefieldError | None = None
    refused_by = ""
    for name in files:
        text = (folder / name).read_bytes().decode("utf-8", "replace")
        try:
            rest = handlers.handle(page_messages.validate_json(text))
            if rest is not None:
                rest.close()
        except ValidationError as error:
            refused, refused_by = CagefieldError(refusal(error)), name
        except CagefieldError as error:
            refused, refused_by = error, name
        coordinator.state().model_dump_json()
    with contextlib.suppress(OSError):
        store.autosave_path.unlink()
    if refused is not None and refused_by == said:
        raise refused


_MESSAGES = 33

_BEGUN_BY = {
    "message05.json": "message04.json",
    "message06.json": "message04.json",
    "message29.json": "message28.json",
    "message30.json": "message28.json",
    "message32.json": "message31.json",
}
"""Messages of a drag, and of a preview, need one that begins it."""

READERS: dict[str, Reader] = {
    "edits.yaml": Reader(
        _written("e.yaml", lambda file: file.write_text(dump_edits(_edits()))),
        _read_edits("e.yaml"),
        {"e.yaml": "yaml"},
    ),
    "edits.json": Reader(
        _written("e.json", lambda file: file.write_text(dump_edits(_edits(), format="json"))),
        _read_edits("e.json"),
        {"e.json": "json"},
    ),
    "scene folder": Reader(
        _make_scene,
        _read_scene,
        {
            "scene/scene.json": "json",
            "scene/cameras.json": "json",
            "scene/edits.yaml": "yaml",
            "scene/camera_path.json": "json",
        },
    ),
    "voxel field": Reader(_make_scene, _read_scene, {"scene/field.safetensors": "safetensors"}),
    "splat field": Reader(
        lambda folder: Scene(ball_of_splats(), cameras=ball_scene().cameras).save(folder / "scene"),
        _read_scene,
        {"scene/field.safetensors": "safetensors"},
    ),
    "nerf field": Reader(
        _written("n.safetensors", lambda file: save_nerf(small_field(), file)),
        lambda folder: load_nerf(folder / "n.safetensors"),
        {"n.safetensors": "safetensors"},
    ),
    "autosave": Reader(_make_autosave, _read_autosave, {"scene/../.scene.cagefield-autosave.json": "json"}),
    "camera path": Reader(
        _make_path, _read_path, {"path.json": "json", "dataparser_transforms.json": "json"}
    ),
    "keyframes": Reader(_make_path, lambda folder: load_keys(folder / "path.json"), {"path.json": "json"}),
    "nerf .tar, new": Reader(_torch_file(_YENCHENLIN, False), _read_networks, {"a.tar": "zip"}),
    "nerf .ckpt, new": Reader(_torch_file(_KRRISH94, False), _read_networks, {"a.tar": "zip"}),
    "nerf .ckpt, old": Reader(_torch_file(_KRRISH94, True), _read_networks, {"a.tar": "bytes"}),
    "nerf config": Reader(
        _written("args.txt", lambda file: file.write_text(_CONFIG)),
        lambda folder: read_config(folder / "args.txt"),
        {"args.txt": "text"},
    ),
    "nerf config.yml": Reader(
        _written("config.yml", lambda file: file.write_text(_CONFIG_YML)),
        lambda folder: read_config(folder / "config.yml"),
        {"config.yml": "yaml"},
    ),
    "training": Reader(
        _make_training, lambda folder: read_checkpoint(folder / "a.training", "x"), {"a.training": "zip"}
    ),
    "transforms.json": Reader(_make_transforms, _read_capture, {"capture/transforms.json": "json"}),
    "COLMAP, binary": Reader(
        _make_colmap(False),
        _read_capture,
        {
            f"capture/sparse/0/{name}.bin": "bytes"
            for name in ("cameras", "images", "points3D", "rigs", "frames")
        },
    ),
    "COLMAP, text": Reader(
        _make_colmap(True),
        _read_capture,
        {
            f"capture/sparse/0/{name}.txt": "text"
            for name in ("cameras", "images", "points3D", "rigs", "frames")
        },
    ),
    "LLFF": Reader(_make_llff, _read_capture, {"capture/poses_bounds.npy": "npy"}),
    "points.ply": Reader(
        _make_points, lambda folder: read_points(folder / "points.ply"), {"points.ply": "ply"}
    ),
    "png": Reader(_make_picture(".png"), _read_picture(".png"), {"a.png": "png"}),
    **{
        ending[1:]: Reader(_make_picture(ending), _read_picture(ending), {f"a{ending}": "bytes"})
        for ending in (".jpg", ".webp", ".tif", ".bmp")
    },
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
    "splatfacto .ckpt": _splat_reader(".ckpt", "zip"),
    "messages": Reader(
        _make_messages, _read_messages, {f"message{number:02}.json": "json" for number in range(_MESSAGES)}
    ),
}
"""The readers, by what they read."""

NEED_TORCH = ("nerf .tar, new", "nerf .ckpt, new", "nerf .ckpt, old", "splatfacto .ckpt")
