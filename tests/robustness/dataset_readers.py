"""Data sets and pictures: honest seeds, and how they are read."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image
from reader_seeds import Read, Reader

from cagefield.datasets import load_dataset
from cagefield.datasets.photos import read_photo
from cagefield.datasets.point_files import read_points
from cagefield.rendering.images import read_image
from posed_photos import room_capture
from scenes import ball_scene


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


DATASET_READERS: dict[str, Reader] = {
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
}
