"""A street of houses as a capture: more photos than one training should hold, each of a short part of it.

    python -m benchmarks.captures.street OUT [--photos 208] [--size 192] [--length 48]

OUT/images and OUT/sparse/0 (COLMAP text), as `cagefield train` reads them. The walker goes along the street
and photographs obliquely to the left and to the right in turn. Houses, ground and sky are boxes, which rays
meet in closed form; facades have windows, ground and sky soft noise.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.procedural.capture_writer import write_colmap
from cagefield.procedural.textures import noise
from cagefield.procedural.tracks import simulate_tracks
from cagefield.typing import Array, Float32

EYE = 1.6
"""Height of the camera above the ground, meters."""
ROAD = 4.5
"""Distance of the facades from the middle of the street, meters."""
FOV_X = np.radians(70.0)
SUPERSAMPLING = 2


@dataclass(frozen=True, eq=False)
class Street:
    """Boxes [B,2,3] with a color [B,3] and a kind [B]: 0 a house, 1 the ground, 2 the inside of the sky."""

    boxes: Array
    colors: Array
    kinds: Array

    @classmethod
    def built(cls, length: float, seed: int = 0) -> Street:
        """Houses of random width, depth, height and color along both sides, lamp posts before them."""
        rng = np.random.default_rng(seed)
        boxes, colors, kinds = [], [], []
        for side in (-1.0, 1.0):
            x = -8.0
            while x < length + 8.0:
                width, deep, tall = rng.uniform(3.0, 5.5), rng.uniform(3.0, 5.0), rng.uniform(3.0, 7.5)
                back = ROAD + rng.uniform(0.0, 0.8)
                y = np.sort([side * back, side * (back + deep)])
                boxes.append([[x, y[0], 0.0], [x + width, y[1], tall]])
                colors.append(rng.uniform(0.35, 0.9, 3))
                kinds.append(0)
                post = side * (ROAD - 0.9)
                boxes.append([[x, post - 0.08, 0.0], [x + 0.16, post + 0.08, 2.6]])
                colors.append(rng.uniform(0.1, 0.3, 3))
                kinds.append(0)
                x += width + rng.uniform(0.0, 1.2)
        boxes.append([[-60.0, -60.0, -1.0], [length + 60.0, 60.0, 0.0]])
        boxes.append([[-50.0, -40.0, -2.0], [length + 50.0, 40.0, 40.0]])
        colors += [np.array([0.45, 0.43, 0.4]), np.array([0.62, 0.75, 0.9])]
        return cls(np.array(boxes), np.array(colors), np.array([*kinds, 1, 2]))

    def shoot(self, origin: Array, directions: Array) -> tuple[Float32, Float32]:
        """(rgb [N,3], distance [N]) along unit directions [N,3]."""
        inverse = 1.0 / np.where(directions == 0.0, 1e-12, directions).T
        distance = np.full(len(directions), np.inf)
        owner = np.zeros(len(directions), np.intp)
        for number, (box, kind) in enumerate(zip(self.boxes, self.kinds, strict=True)):
            enter, leave = np.full(len(directions), -np.inf), np.full(len(directions), np.inf)
            for axis in range(3):
                ends = (box[:, axis, None] - origin[axis]) * inverse[axis]
                np.maximum(enter, np.minimum(ends[0], ends[1]), out=enter)
                np.minimum(leave, np.maximum(ends[0], ends[1]), out=leave)
            t = leave if kind == 2 else np.where((enter < leave) & (enter > 0.0), enter, np.inf)
            nearer = t < distance
            distance[nearer], owner[nearer] = t[nearer], number
        points = origin + distance[:, None] * directions
        return self._colors(points, owner), distance.astype(np.float32)

    def _colors(self, points: Array, owner: NDArray[np.intp]) -> Float32:
        """rgb [N,3] at surface points [N,3] of boxes [N], lit from above and from +x."""
        low, high = self.boxes[owner, 0], self.boxes[owner, 1]
        gaps = np.minimum(np.abs(points - low), np.abs(points - high))
        axis = gaps.argmin(axis=1)
        rgb = self.colors[owner].astype(np.float32)
        kind = self.kinds[owner]
        house = kind == 0
        along = np.where(axis == 0, points[:, 1], points[:, 0]) - np.where(axis == 0, low[:, 1], low[:, 0])
        u, v = np.mod(along, 1.3) - 0.65, np.mod(points[:, 2], 1.7) - 0.95
        glass = np.clip((0.32 - np.abs(u)) / 0.04 + 0.5, 0, 1) * np.clip(
            (0.45 - np.abs(v)) / 0.04 + 0.5, 0, 1
        )
        glass = np.where(house & (axis < 2) & (high[:, 2] > 2.7), glass, 0.0)[:, None]
        rgb = rgb * (1.0 - glass) + np.array([0.2, 0.25, 0.32]) * glass
        fine = points.astype(np.float32)
        grain = np.where(
            kind == 2, 0.25 * noise(fine, 9.0), 0.1 * noise(fine, 0.35) + 0.06 * noise(fine, 0.12)
        )
        lines = (kind == 1) & (np.abs(points[:, 1]) < 0.08) & (np.mod(points[:, 0], 2.0) < 1.1)
        rgb = np.where(lines[:, None], 0.9, rgb)
        light = np.where(kind == 2, 1.0, np.array([0.78, 0.9, 1.0])[axis])
        return np.clip(rgb * (light * (1.0 + grain))[:, None], 0.0, 1.0).astype(np.float32)


def walk(count: int, length: float, size: int) -> list[Camera]:
    """Cameras along the street, 55 degrees to the left and to the right of its direction in turn."""
    cameras = []
    for n in range(count):
        side = 1.0 if n % 2 else -1.0
        x = length * (n // 2 * 2) / max(1, count - 2)
        eye = np.array([x, -0.8 * side + 0.25 * np.sin(1.7 * n), EYE + 0.1 * np.sin(0.9 * n)])
        turned = np.radians(55.0 + 8.0 * np.sin(0.37 * n))
        target = eye + np.array([np.cos(turned), side * np.sin(turned), 0.12])
        cameras.append(
            Camera.look_at(eye, target, up=(0, 0, 1), width=size, height=3 * size // 4, fov_x=FOV_X)
        )
    return cameras


def photograph(street: Street, camera: Camera) -> tuple[Float32, Float32]:
    """(rgb [H,W,3] of SUPERSAMPLING^2 rays a pixel, distance [H,W] of the pixels' centers)."""
    fine = camera.resized(SUPERSAMPLING * camera.width, SUPERSAMPLING * camera.height)
    rgb, _ = street.shoot(camera.origin, fine.rays()[1].astype(np.float64))
    shape = (camera.height, SUPERSAMPLING, camera.width, SUPERSAMPLING, 3)
    _, distance = street.shoot(camera.origin, camera.rays()[1].astype(np.float64))
    return rgb.reshape(shape).mean(axis=(1, 3)), distance.reshape(camera.height, camera.width)


def write_street(
    out: Path, photos: int = 208, size: int = 192, length: float = 48.0, seed: int = 0, gains: bool = True
) -> Path:
    """The capture in a new folder; with `gains` the photos' exposures differ by up to 12 %."""
    street, cameras = Street.built(length, seed), walk(photos, length, size)
    rng = np.random.default_rng(seed + 1)
    exposures = np.exp(rng.uniform(-0.06, 0.06, photos)) if gains else np.ones(photos)
    pictures, distances = [], []
    (out / "images").mkdir(parents=True)
    names = [f"{n:04d}.png" for n in range(photos)]
    for name, camera, exposure in zip(names, cameras, exposures, strict=True):
        rgb, distance = photograph(street, camera)
        pictures.append((255.0 * np.clip(exposure * rgb, 0.0, 1.0) + 0.5).astype(np.uint8))
        distances.append(distance)
        Image.fromarray(pictures[-1]).save(out / "images" / name)
    tracks = simulate_tracks(pictures, distances, cameras, seed=seed)
    write_colmap(tracks, cameras, names, out / "sparse/0")
    print(f"{out}: {photos} photos of {size} x {3 * size // 4}, {len(tracks)} points")
    return out


def main() -> None:
    """Writes the capture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--photos", type=int, default=208)
    parser.add_argument("--size", type=int, default=192)
    parser.add_argument("--length", type=float, default=48.0)
    options = parser.parse_args()
    write_street(options.out, options.photos, options.size, options.length)


if __name__ == "__main__":
    main()
