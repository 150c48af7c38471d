"""Data sets and pictures: honest seeds, and how they are read."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from PIL import Image
from reader_seeds import Read, Reader

from cagefield.datasets import load_dataset
from cagefield.datasets.photos import read_photo
from cagefield.datasets.raw_photos import write_upright
from cagefield.datasets.sfm.raw_masks import RawMasks
from cagefield.datasets.transforms.point_files import read_points
from cagefield.images.image_files import read_image
from posed_photos import room_capture, save_llff
from scenes import ball_cameras


def _make_photo(file: Path) -> None:
    Image.fromarray(np.full((16, 24, 3), 90, np.uint8)).save(file)


def _make_transforms(count: int, folder: Path) -> None:
    folder.joinpath("capture", "images").mkdir(parents=True)
    frames = []
    for index, camera in enumerate(ball_cameras(count)):
        name = f"images/{index}.png"
        _make_photo(folder / "capture" / name)
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


def _make_colmap(text: bool, count: int, points: int, seen: int) -> Callable[[Path], None]:
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
        for index, pose in enumerate(camera.c2w for camera in ball_cameras(count)):
            rotation = (pose[:3, :3] * (1.0, -1.0, -1.0)).T
            rigid = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), -rotation @ pose[:3, 3])
            image = pycolmap.Image(name=f"{index}.png", camera_id=1, image_id=index + 1)
            image.points2D = pycolmap.Point2DList([pycolmap.Point2D(np.array([12.0, 8.0]))] * seen)
            model.add_image_with_trivial_frame(image, rigid)
            _make_photo(folder / "capture/images" / image.name)
        for point in np.random.default_rng(0).uniform(-0.5, 0.5, (points, 3)):
            track = pycolmap.Track()
            model.add_point3D(point, track, np.zeros(3, np.uint8))
        (folder / "capture" / "sparse" / "0").mkdir(parents=True)
        (model.write_text if text else model.write_binary)(folder / "capture" / "sparse" / "0")

    return make


def _read_capture(folder: Path) -> None:
    load_dataset(folder / "capture")


def _make_llff(count: int, folder: Path) -> None:
    """Of the room where nine photos are enough, else of gray ones."""
    if count == 9:
        room_capture(folder / "capture")
        return
    photo = np.full((16, 24, 3), 90, np.uint8)
    save_llff(folder / "capture", ball_cameras(count), [photo] * count, (1.0, 9.0))


def _make_picture(ending: str, size: tuple[int, int]) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        pixels = np.random.default_rng(0).integers(0, 256, (*size, 4)).astype(np.uint8)
        image = Image.fromarray(pixels if ending in (".png", ".webp", ".tif") else pixels[..., :3])
        image.save(folder / f"a{ending}")

    return make


def _read_picture(ending: str) -> Read:
    def read(folder: Path) -> None:
        read_photo(folder / f"a{ending}", 2)
        read_image(folder / f"a{ending}")

    return read


def _make_points(count: int, folder: Path) -> None:
    rows = "".join(f"{n * 0.1} {n * 0.2} {n} {n % 255} 2 3\n" for n in range(count))
    names = "".join(f"property float {name}\n" for name in "xyz")
    names += "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    head = f"ply\nformat ascii 1.0\nelement vertex {count}\n{names}end_header\n"
    (folder / "points.ply").write_text(head + rows)


def _colmap_reader(text: bool, count: int, points: int, seen: int) -> Reader:
    parts = ("cameras", "images", "points3D", "rigs", "frames")
    ending, kind = (".txt", "text") if text else (".bin", "bytes")
    damaged = {f"capture/sparse/0/{name}{ending}": kind for name in parts}
    return Reader(_make_colmap(text, count, points, seen), _read_capture, damaged)


def transforms_reader(count: int = 3) -> Reader:
    """Of a capture of `count` photos."""
    return Reader(partial(_make_transforms, count), _read_capture, {"capture/transforms.json": "json"})


def colmap_readers(count: int = 3, points: int = 20, seen: int = 1) -> dict[str, Reader]:
    """Of models of `count` photos, of `points`, and of so many places that each photo has seen."""
    return {
        "COLMAP, binary": _colmap_reader(False, count, points, seen),
        "COLMAP, text": _colmap_reader(True, count, points, seen),
    }


def llff_reader(count: int = 9) -> Reader:
    """Of poses of `count` photos."""
    return Reader(partial(_make_llff, count), _read_capture, {"capture/poses_bounds.npy": "npy"})


def picture_readers(size: tuple[int, int] = (12, 16)) -> dict[str, Reader]:
    """Of pictures [H,W]."""
    return {
        ending[1:]: Reader(
            _make_picture(ending, size),
            _read_picture(ending),
            {f"a{ending}": "png" if ending == ".png" else "bytes"},
        )
        for ending in (".png", ".jpg", ".webp", ".tif", ".bmp")
    }


def points_reader(count: int = 50) -> Reader:
    """Of a text of points."""
    return Reader(
        partial(_make_points, count), lambda folder: read_points(folder / "points.ply"), {"points.ply": "ply"}
    )


def _make_faulty_transforms(folder: Path) -> None:
    """Comments, commas before closing brackets, numbers in text, an infinite pose, map coordinates."""
    _make_transforms(4, folder)
    file = folder / "capture" / "transforms.json"
    values = json.loads(file.read_text())
    values |= {
        "fl_x": "30.0",
        "k1": "0.01",
        "totp": [float("nan")],
        "note": "a // b, }",
        "applied_scale": "0.5",
    }
    values["applied_transform"] = [[0, 1, 0, 3], [1, 0, 0, 4], [0, 0, -1, 5]]
    for frame in values["frames"]:
        for row, far in enumerate((500123.25, 5412345.5, 312.0)):
            frame["transform_matrix"][row] = [str(value) for value in frame["transform_matrix"][row]]
            frame["transform_matrix"][row][3] = repr(float(frame["transform_matrix"][row][3]) + far)
    values["frames"][3]["transform_matrix"] = [[float("-inf")] * 4] * 4
    file.write_text("// a capture\n" + json.dumps(values, indent=1)[:-1] + ", /* the end */ }")


def _make_written_by_others(folder: Path) -> None:
    """A text model: a byte order mark, spaces and backslashes in names, no second lines, an unused camera."""
    _make_colmap(True, 3, 20, 1)(folder)
    model = folder / "capture" / "sparse" / "0"
    for name in ("rigs", "frames"):
        (model / f"{name}.txt").unlink()
    lines = [line for line in (model / "images.txt").read_text().splitlines() if line.endswith(".png")]
    for n, line in enumerate(lines):
        old = line.split()[-1]
        new = folder / "capture" / "images" / f"cam {n % 2}" / f"photo {old}"
        new.parent.mkdir(exist_ok=True)
        (folder / "capture" / "images" / old).rename(new)
        lines[n] = line.removesuffix(old) + f"cam {n % 2}\\photo {old}"
    (model / "images.txt").write_text("\r\n".join(lines) + "\r\n")
    cameras = (model / "cameras.txt").read_text()
    (model / "cameras.txt").write_text("\ufeff" + cameras + "77 FULL_OPENCV 9 9 5 5 4 4 0 0 0 0 0 0 0 0\n")


LENSES = {
    "SIMPLE_RADIAL_FISHEYE": "30 12 8 0.01",
    "RADIAL_FISHEYE": "30 12 8 0.01 0.001",
    "FULL_OPENCV": "30 30 12 8 0.04 -0.02 0.001 0.001 0 0.01 0 0",
    "THIN_PRISM_FISHEYE": "30 30 12 8 0.01 0 0.001 0 0 0 0.001 0",
    "FOV": "30 30 12 8 0.1",
}
"""Parameters, by COLMAP's name of the lens."""


def _make_lens(model: str, folder: Path) -> None:
    _make_colmap(True, 3, 20, 1)(folder)
    file = folder / "capture" / "sparse" / "0" / "cameras.txt"
    file.write_text(f"1 {model} 24 16 {LENSES[model]}\n")


def _make_panoramas(folder: Path) -> None:
    _make_transforms(3, folder)
    file = folder / "capture" / "transforms.json"
    values = {"camera_model": "EQUIRECTANGULAR", "frames": json.loads(file.read_text())["frames"]}
    for frame in values["frames"]:
        Image.fromarray(np.full((16, 32, 3), 90, np.uint8)).save(folder / "capture" / frame["file_path"])
    file.write_text(json.dumps(values))


def _read_pixels(folder: Path) -> None:
    data = load_dataset(folder / "capture")
    for view in (*data.train, *data.test):
        view.load()
        view.valid_pixels()


def _make_masks(folder: Path) -> None:
    """`mask_path` of the first frame; of the second a mask in the folder `masks`."""
    _make_transforms(3, folder)
    capture = folder / "capture"
    file = capture / "transforms.json"
    values = json.loads(file.read_text())
    values["frames"][0]["mask_path"] = "hidden/0.png"
    file.write_text(json.dumps(values))
    mask = np.full((16, 24), 255, np.uint8)
    mask[4:8] = 0
    for name in ("hidden/0.png", "masks/1.png", "images/dynamic_mask_2.png"):
        (capture / name).parent.mkdir(exist_ok=True)
        Image.fromarray(mask).save(capture / name)


def _make_raw_masks(folder: Path) -> None:
    (folder / "photos" / "masks").mkdir(parents=True)
    mask = np.full((16, 24), 255, np.uint8)
    mask[4:8] = 0
    for n in range(3):
        exif = Image.Exif()
        exif[0x0112] = 6
        photo = Image.fromarray(np.full((16, 24, 3), 90, np.uint8))
        photo.save(folder / "photos" / f"{n}.jpg", exif=exif)
        Image.fromarray(mask).save(folder / "photos" / "masks" / f"{n}.png")


def _read_raw_masks(folder: Path) -> None:
    photos = folder / "photos"
    names = [f"{n}.jpg" for n in range(3)]
    masks = RawMasks.find(photos, names)
    masks.digest()
    for name in names:
        photo = write_upright(photos / name, name, folder / "out")
        masks.write(name, photos / name, photo, folder / "valid")


def variant_readers() -> dict[str, Reader]:
    """Of data sets as other programs write them, with pixels and masks where these are at stake."""
    model = "capture/sparse/0"
    found = {
        "transforms.json, faulty": Reader(
            _make_faulty_transforms, _read_capture, {"capture/transforms.json": "text"}
        ),
        "COLMAP, text of others": Reader(
            _make_written_by_others,
            _read_capture,
            {f"{model}/{name}.txt": "text" for name in ("cameras", "images", "points3D")},
        ),
        "panoramas": Reader(_make_panoramas, _read_pixels, {"capture/transforms.json": "json"}),
        "masks": Reader(
            _make_masks,
            _read_pixels,
            {"capture/transforms.json": "json"}
            | dict.fromkeys(
                (f"capture/{name}" for name in ("hidden/0.png", "masks/1.png", "images/dynamic_mask_2.png")),
                "png",
            ),
        ),
        "masks of raw photos": Reader(
            _make_raw_masks, _read_raw_masks, {"photos/masks/0.png": "png", "photos/1.jpg": "bytes"}
        ),
    }
    for lens in LENSES:
        found[f"lens {lens}"] = Reader(
            partial(_make_lens, lens), _read_pixels, {f"{model}/cameras.txt": "small text"}
        )
    return found


DATASET_READERS: dict[str, Reader] = {
    "transforms.json": transforms_reader(),
    **variant_readers(),
    **colmap_readers(),
    "LLFF": llff_reader(),
    "points.ply": points_reader(),
    **picture_readers(),
}
