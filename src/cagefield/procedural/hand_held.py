"""Cameras of a hand-held phone, and the photos that it takes.

A walk is a smooth path with jitter; the camera looks roughly at its subject, a little rolled. A photo is an
image with the phone's exposure, noise and 8 bits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d, maximum_filter, minimum_filter
from scipy.spatial.transform import Rotation

from cagefield.cameras.camera import Camera
from cagefield.procedural.parts import transform_vectors
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.srgb import decode_srgb, encode_srgb
from cagefield.typing import Array, Float32

MIN_EDGE_CONTRAST = 0.03
"""Minimum difference of a pixel from a neighbor for finer sampling."""

SHOT_NOISE_VARIANCE, READ_NOISE_DEVIATION = 2.0e-4, 3.0e-3
"""Variance per unit of linear light, and deviation in the dark: about 42 dB on a wall."""


@dataclass(frozen=True)
class Phone:
    """Phone whose photos have width x height pixels and a horizontal field of view in degrees.

    distortion  OPENCV coefficients k1, k2, p1, p2; empty for a pinhole
    adapts      share of the change of the scene's brightness that the exposure compensates, 0 to 1
    """

    width: int = 360
    height: int = 640
    fov_x_deg: float = 52.0
    distortion: tuple[float, ...] = ()
    adapts: float = 0.5

    def camera(self, eye: ArrayLike, target: ArrayLike, roll_deg: float) -> Camera:
        """Camera at `eye` [3] that looks at `target` [3], rotated about its axis by `roll_deg`."""
        camera = Camera.look_at(
            eye, target, width=self.width, height=self.height, fov_x=float(np.radians(self.fov_x_deg))
        )
        pose = camera.c2w.copy()
        pose[:3, :3] = pose[:3, :3] @ Rotation.from_euler("z", roll_deg, degrees=True).as_matrix()
        if not self.distortion:
            return replace(camera, c2w=pose)
        return replace(camera, c2w=pose, model="opencv", distortion=self.distortion)

    def resized(self, longer_side: int) -> Phone:
        """Phone with photos of another size and the given longer side."""
        scale = longer_side / max(self.width, self.height)
        return replace(
            self, width=max(1, round(self.width * scale)), height=max(1, round(self.height * scale))
        )


def random_walk(rng: np.random.RandomState, count: int, spread: ArrayLike, smooth: float = 2.5) -> Array:
    """Smooth random path [count,K] about 0 with the standard deviations `spread` [K]."""
    size = np.atleast_1d(np.asarray(spread, np.float64))
    path = gaussian_filter1d(rng.standard_normal((count + 20, len(size))), smooth, axis=0)[10:-10]
    return path / np.maximum(path.std(axis=0), 1e-9) * size


def draw_roll_angles(rng: np.random.RandomState, count: int) -> Array:
    """Random roll angles [count] of the phone in degrees: a few degrees, sometimes many more."""
    angles = rng.normal(0, 2.0, count)
    angles[rng.uniform(size=count) < 0.1] *= 6.0
    return np.clip(angles, -25.0, 25.0)


def orbit_target(
    phone: Phone,
    target: ArrayLike,
    *,
    count: int,
    seed: int,
    start_deg: float,
    sweep_deg: float,
    distance: tuple[float, float],
    height: tuple[float, float],
    sway: float = 0.08,
    turns: int = 1,
) -> tuple[Camera, ...]:
    """Cameras on an arc about a target [3], seen from above from `start_deg` (0 is +x) on.

    Distance (level) and height above the target vary within their limits along the arc, `turns` times round;
    `sway` is the jitter of the eye and of the target, relative to the distance.
    """
    rng = np.random.RandomState(seed)
    share = (np.arange(count) + 0.5 + rng.uniform(-0.3, 0.3, count)) / count
    angle = np.radians(start_deg + sweep_deg * np.mod(turns * share, 1 if turns > 1 else 2))
    wave = np.clip(0.5 + random_walk(rng, count, (0.3, 0.3)), 0, 1)
    level = distance[0] + (distance[1] - distance[0]) * wave[:, 0]
    up = height[0] + (height[1] - height[0]) * wave[:, 1]
    middle = np.asarray(target, np.float64)
    eyes = middle + np.stack([level * np.cos(angle), level * np.sin(angle), up], 1)
    eyes += sway / 2 * level[:, None] * rng.uniform(-1, 1, (count, 3))
    targets = middle + sway * level[:, None] * rng.uniform(-1, 1, (count, 3))
    return tuple(
        phone.camera(*where) for where in zip(eyes, targets, draw_roll_angles(rng, count), strict=True)
    )


def look_outwards(
    phone: Phone, middle: ArrayLike, *, count: int, seed: int, radius: float, drop_deg: float, turns: int = 2
) -> tuple[Camera, ...]:
    """Cameras on a loop about a point [3] that look away from it, about `drop_deg` below the horizon."""
    rng = np.random.RandomState(seed)
    share = (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    angle = 2 * np.pi * turns * share
    where = random_walk(rng, count, (0.25 * radius, 0.25 * radius, 0.15 * radius), 1.5)
    eyes = np.asarray(middle, np.float64) + where
    eyes[:, 0] += radius * np.cos(angle + 2.0)
    eyes[:, 1] += radius * np.sin(angle + 2.0)
    drop = np.radians(drop_deg + random_walk(rng, count, 9.0, 1.0)[:, 0])
    heading = angle + np.radians(rng.normal(0, 6.0, count))
    ahead = np.stack([np.cos(heading) * np.cos(drop), np.sin(heading) * np.cos(drop), -np.sin(drop)], 1)
    return tuple(
        phone.camera(eye, eye + d, roll)
        for eye, d, roll in zip(eyes, ahead, draw_roll_angles(rng, count), strict=True)
    )


def render_image(scene: ProceduralScene, camera: Camera) -> tuple[Float32, Float32]:
    """(rgb [H,W,3], distance [H,W] along the rays through the pixels' centers, inf for no surface).

    One ray a pixel, and the mean of four where the image has an edge. rgb may exceed 1.
    """
    shape = (camera.height, camera.width)
    rgb, _, hits = scene.shoot(camera.origin, pixel_directions(camera))
    image = rgb.reshape(*shape, 3)
    rows, columns = np.nonzero(local_contrast(image) > MIN_EDGE_CONTRAST)
    if len(rows):
        sharp, _, _ = scene.shoot(camera.origin, fine_directions(camera, rows, columns))
        image[rows, columns] = sharp.reshape(len(rows), 4, 3).mean(axis=1)
    return image, hits.t.reshape(shape)


def pixel_directions(camera: Camera) -> Float32:
    """Unit world directions [3,H*W] of the rays through the pixels' centers."""
    return transform_vectors(camera.c2w[:3, :3], camera.local_directions().T)


def fine_directions(camera: Camera, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Float32:
    """Unit world directions [3,4K] of four rays through each of K pixels."""
    fine = camera.resized(2 * camera.width, 2 * camera.height).local_directions()
    fine = fine.reshape(camera.height, 2, camera.width, 2, 3)
    return transform_vectors(camera.c2w[:3, :3], fine[rows, :, columns].reshape(-1, 3).T)


def local_contrast(image: Float32) -> Float32:
    """Largest difference [H,W] of a channel within 3x3 pixels."""
    size = (3, 3, 1)
    difference: Float32 = (maximum_filter(image, size) - minimum_filter(image, size)).max(axis=-1)
    return difference


def exposure_gains(pictures: Sequence[Float32], adapts: float, rng: np.random.RandomState) -> Float32:
    """Gains [V,3] of linear light: lower for bright images, with a little randomness and white balance."""
    brightness = np.array([decode_srgb(np.minimum(render_image, 1)).mean() for render_image in pictures])
    gains = (np.exp(np.log(brightness).mean()) / brightness) ** adapts
    gains = np.clip(gains * np.exp(rng.normal(0, 0.04, len(gains))), 0.55, 1.8)
    balance = np.exp(random_walk(rng, len(gains), (0.012, 0.0, 0.012)))
    return (gains[:, None] * balance / np.exp(np.log(gains).mean())).astype(np.float32)


def develop_photo(rgb: Float32, gains: Float32, rng: np.random.RandomState) -> NDArray[np.uint8]:
    """Photo [H,W,3] uint8 of an image with exposure gains [3], with the sensor's noise."""
    light = decode_srgb(rgb) * gains
    light = light + rng.standard_normal(light.shape) * np.sqrt(
        SHOT_NOISE_VARIANCE * light + READ_NOISE_DEVIATION**2
    )
    return (encode_srgb(np.clip(light, 0, 1)) * 255 + 0.5).astype(np.uint8)
