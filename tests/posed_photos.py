"""Tiny captures with a known answer: black photos with a bright spot where one world point must appear."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.datasets import View
from cagefield.procedural.textures import noise

POINT = np.array([0.15, -0.1, 0.2])
WIDTH, HEIGHT = 96, 64


def ring(n: int, radius: float = 4.0, sweep: float = 2 * np.pi) -> list[np.ndarray]:
    """OpenGL camera-to-world matrices on a ring, level, looking at (0, 0, 0) from above."""
    poses = []
    for azimuth in sweep * np.arange(n) / n:
        eye = radius * np.array([np.cos(azimuth), np.sin(azimuth), 0.5])
        back = eye / np.linalg.norm(eye)
        right = np.cross((0, 0, 1), back) / np.linalg.norm(np.cross((0, 0, 1), back))
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(back, right), back, eye], axis=1)
        poses.append(pose)
    return poses


def project(pose, point, focal, axis, k=(0.0, 0.0), p=(0.0, 0.0), fisheye=None):
    """Pixel position of a world point, written out from OpenCV's documentation."""
    x, y, z = np.linalg.inv(pose)[:3] @ (*point, 1.0) * (1, -1, -1)
    if fisheye is not None:
        r = np.hypot(x, y)
        t = np.arctan2(r, z)
        t *= 1 + sum(coefficient * t ** (2 * n + 2) for n, coefficient in enumerate(fisheye))
        x, y = t * x / r, t * y / r
    else:
        x, y = x / z, y / z
        s = x * x + y * y
        g = 1 + k[0] * s + k[1] * s * s
        x, y = (
            g * x + 2 * p[0] * x * y + p[1] * (s + 2 * x * x),
            g * y + p[0] * (s + 2 * y * y) + 2 * p[1] * x * y,
        )
    return np.array([focal[0] * x + axis[0], focal[1] * y + axis[1]])


def spot(position, width=WIDTH, height=HEIGHT, radius=3.0) -> np.ndarray:
    """uint8 [H,W,3] with a Gaussian spot at pixel coordinates `position`."""
    x, y = np.arange(width) + 0.5 - position[0], (np.arange(height) + 0.5 - position[1])[:, None]
    return np.repeat(
        np.rint(255 * np.exp(-(x**2 + y**2) / (2 * radius**2))).astype(np.uint8)[..., None], 3, axis=2
    )


def save(path: Path, pixels: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(pixels).save(path)


def save_cut_out(path: Path, width=WIDTH, height=HEIGHT) -> None:
    pixels = np.zeros((height, width, 4), dtype=np.uint8)
    pixels[height // 4 : height // 2, width // 4 : width // 2] = (200, 100, 50, 255)
    save(path, pixels)


def assert_spot_is_where_the_camera_says(view: View, point=POINT) -> None:
    """The bright spot's centroid in the loaded photo is the projection of `point`.

    8-bit rounding over the spot's 200 pixels moves a centroid by a few hundredths of a pixel.
    """
    weights = view.load()[..., 0].astype(float)
    weights[weights < 8] = 0
    x = (weights.sum(axis=0) * (np.arange(view.camera.width) + 0.5)).sum() / weights.sum()
    y = (weights.sum(axis=1) * (np.arange(view.camera.height) + 0.5)).sum() / weights.sum()
    positions, depth = view.camera.project(np.asarray(point, dtype=float)[None])
    assert depth[0] > 0
    np.testing.assert_allclose((x, y), positions[0], atol=0.05)


def save_llff(folder: Path, cameras: Sequence[Camera], photos: Sequence[np.ndarray], depths) -> None:
    """An LLFF folder: photos uint8 [H,W,3] in `images`, poses_bounds.npy with one (near, far) for all."""
    rows = []
    for index, (camera, photo) in enumerate(zip(cameras, photos, strict=True)):
        save(folder / "images" / f"{index:02}.png", photo)
        right, up, back, eye = camera.c2w[:3].T
        matrix = np.stack([-up, right, back, eye, (camera.height, camera.width, camera.fx)], axis=1)
        rows.append(np.concatenate([matrix.ravel(), depths]))
    np.save(folder / "poses_bounds.npy", np.array(rows))


def photo_of_a_room(camera: Camera) -> np.ndarray:
    """uint8 [H,W,3] of a ball of radius 1.5 at (0.5, 0, -6) before a wall z = -12 in soft stripes."""
    origins, toward = (values.astype(np.float64) for values in camera.rays())
    t = (-12.0 - origins[:, 2]) / np.where(toward[:, 2] < 0, toward[:, 2], -1e-9)
    x, y, _ = (origins + t[:, None] * toward).T
    rgb = 0.5 + 0.4 * np.stack([np.sin(0.5 * x), np.cos(0.4 * y), np.sin(0.3 * (x + y))], axis=1)
    rgb[toward[:, 2] >= -1e-6] = 0.5
    middle = origins - (0.5, 0.0, -6.0)
    b = (middle * toward).sum(axis=1)
    root = b**2 - (middle**2).sum(axis=1) + 1.5**2
    hit = (root > 0) & (b < 0)
    normal = (middle + (-b - np.sqrt(np.maximum(root, 0)))[:, None] * toward) / 1.5
    rgb[hit] = (np.array([0.9, 0.3, 0.1]) * (0.6 + 0.4 * normal[:, 1:2]))[hit]
    return np.rint(255 * rgb.clip(0, 1)).astype(np.uint8).reshape(camera.height, camera.width, 3)


def room_capture(folder: Path, forward_facing: bool = True) -> Path:
    """An LLFF capture of that room: nine cameras side by side, or on a third of a circle around the ball."""
    places = [(x, y, 0.3 * x * y) for y in (-0.8, 0, 0.8) for x in (-1.0, 0, 1.0)]
    if not forward_facing:
        places = [(0.5 + 5 * np.sin(a), 0.0, -6 + 5 * np.cos(a)) for a in np.linspace(-1.1, 1.1, 9)]
    places = [*places[4:], *places[:4]]  # the first and the ninth, which test, are not the outermost
    target = (0.2, 0, -9.0) if forward_facing else (0.5, 0, -6.0)
    cameras = [
        Camera.look_at(place, target, up=(0, 1, 0), width=24, height=18, fov_x=1.0) for place in places
    ]
    save_llff(folder, cameras, [photo_of_a_room(camera) for camera in cameras], (3.5, 14.0))
    return folder


def photo_of_textures(camera: Camera, cut_out: bool = False) -> np.ndarray:
    """uint8 [H,W,3] of a ball of radius 1 at the origin on a floor z = -1, both mottled.

    As a cut-out ([H,W,4]) it shows the ball alone.
    """
    origins, toward = (values.astype(np.float64) for values in camera.rays())
    b = (origins * toward).sum(axis=1)
    root = b**2 - (origins**2).sum(axis=1) + 1.0
    ball = (root > 0) & (b < 0)
    down = toward[:, 2] < -1e-3
    t = np.where(
        ball, -b - np.sqrt(np.maximum(root, 0)), -(1.0 + origins[:, 2]) / np.where(down, toward[:, 2], -1)
    )
    points = (origins + t[:, None] * toward).astype(np.float32)
    points[~(ball | down)] = 0.0
    mottle = np.stack(
        [noise(points + shift, 0.12) + noise(points - shift, 0.03) for shift in (0.0, 1.3, 2.6)], axis=1
    )
    rgb = np.where((ball | down)[:, None], 0.5 + 0.15 * mottle, 0.6)
    if cut_out:
        rgb = np.where(ball[:, None], rgb, 0.0)
        rgb = np.concatenate([rgb, ball[:, None].astype(float)], axis=1)
    return np.rint(255 * rgb.clip(0, 1)).astype(np.uint8).reshape(camera.height, camera.width, -1)


def photos_alone(folder: Path, n: int = 4, size: tuple[int, int] = (320, 240)) -> Path:
    """Photos of `photo_of_textures` without poses, which are found in a second."""
    width, height = size
    for index, pose in enumerate(ring(n, radius=3.2, sweep=n / 6)):
        camera = Camera(pose, width, height, 1.1 * width, 1.1 * width, width / 2, height / 2)
        save(folder / f"{index:02}.png", photo_of_textures(camera))
    return folder


def distance_to_textures(points: np.ndarray) -> np.ndarray:
    """How far points [N,3] lie from the ball and the floor of `photo_of_textures`, whichever is nearer."""
    return np.minimum(np.abs(np.linalg.norm(points, axis=1) - 1.0), np.abs(points[:, 2] + 1.0))


def textured_capture(
    folder: Path,
    n: int = 10,
    sweep: float = 1.6,
    cut_out: bool = False,
    lens: str = "opencv",
    size=(320, 240),
) -> Path:
    """An Instant-NGP capture of `photo_of_textures` in two folders whose photos have the same names."""
    width, height = size
    frames = []
    lenses = {
        "opencv": {"k1": 0.08, "k2": -0.03, "p1": 0.002, "p2": -0.001},
        "opencv_fisheye": {"k1": 0.03, "k2": -0.01, "k3": 0.0, "k4": 0.0},
    }
    for index, pose in enumerate(ring(n, sweep=sweep)):
        camera = Camera(
            pose, width, height, width * 1.1, width * 1.12, 0.49 * width, 0.52 * height, lens,
            tuple(lenses[lens].values()),
        )  # fmt: skip
        name = f"{'left' if index % 2 else 'right'}/{index // 2:03}.png"
        save(folder / name, photo_of_textures(camera, cut_out))
        frames.append(
            {"file_path": name, "transform_matrix": pose.tolist(), "fl_x": camera.fx, "fl_y": camera.fy}
        )  # fmt: skip
    values = {"cx": 0.49 * width, "cy": 0.52 * height, "frames": frames, **lenses[lens]}
    if lens == "opencv_fisheye":
        values["camera_model"] = "OPENCV_FISHEYE"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "transforms.json").write_text(json.dumps(values))
    return folder
