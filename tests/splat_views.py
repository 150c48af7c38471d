"""Splats and cameras that try a rasterizer: all lenses, all shapes, in float64 for the oracle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.rendering.splats.raster_splats import DeformedSplats

NEAR = 0.3
LENSES = {
    "pinhole": (),
    "opencv": (-0.12, 0.05, 0.04, -0.03),
    "opencv_fisheye": (0.1, -0.03, 0.02, -0.01),
}


def camera(lens: str = "pinhole", width: int = 75, height: int = 50) -> Camera:
    """A camera 4 units from the origin with the center of its lens off that of its picture."""
    plain = Camera.look_at((2.5, -3.0, 1.0), (0, 0, 0), width=width, height=height, fov_x=0.9)
    center = (0.42 * width, 0.56 * height)
    return replace(plain, fy=1.1 * plain.fy, cx=center[0], cy=center[1], model=lens, distortion=LENSES[lens])


def covariances(quaternions: NDArray, log_scales: NDArray) -> NDArray:
    """R diag(s^2) R^T as [N,6] (xx, xy, xz, yy, yz, zz), in the precision of the arguments."""
    axes = rotation_matrices(quaternions) * np.exp(log_scales)[:, None, :]
    return (axes @ axes.transpose(0, 2, 1)).reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]]


def unit(vectors: NDArray) -> NDArray:
    """The vectors [N,K] at length 1."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def parameters(count: int, degree: int = 0, seed: int = 0) -> dict[str, NDArray]:
    """Means, log scales, unit quaternions, logits and harmonics of random splats, float64."""
    chance = np.random.default_rng(seed)
    return {
        "means": chance.uniform(-1.2, 1.2, (count, 3)),
        "log_scales": np.log(chance.uniform(0.05, 0.4, (count, 3))),
        "quaternions": unit(chance.normal(size=(count, 4))),
        "logits": chance.normal(size=count),
        "sh": 0.4 * chance.normal(size=(count, (degree + 1) ** 2, 3)),
    }


def splats_of(
    values: dict[str, NDArray], antialiased: bool = False, rotations: NDArray | None = None
) -> DeformedSplats:
    """The splats of `parameters`, float64."""
    return DeformedSplats(
        values["means"],
        covariances(values["quaternions"], values["log_scales"]),
        1.0 / (1.0 + np.exp(-values["logits"])),
        values["sh"],
        rotations,
        antialiased,
    )


def single(splats: DeformedSplats) -> DeformedSplats:
    """The splats in float32, as the kernels take them."""

    def rounded(values: NDArray) -> NDArray:
        return np.ascontiguousarray(values, np.float32)

    return replace(
        splats,
        means=rounded(splats.means),
        covariances=rounded(splats.covariances),
        opacities=rounded(splats.opacities),
        sh=rounded(splats.sh),
        rotations=None if splats.rotations is None else rounded(splats.rotations),
    )


def all_kinds(
    eye: NDArray, degree: int = 1, antialiased: bool = False, turned: bool = False, seed: int = 0
) -> DeformedSplats:
    """Float32 splats of all kinds for a camera at `eye` [3] that looks at the origin.

    Common ones; some behind the camera, some around NEAR; huge ones, dots far smaller than a pixel, flat ones
    that are seen edge-on; opacities from 0 to 1.
    """
    chance = np.random.default_rng(seed)
    values = parameters(60, degree, seed)
    ahead = unit(-eye)
    values["means"][:5] = eye - ahead * chance.uniform(0.1, 4.0, (5, 1))
    values["means"][5:10] = eye + ahead * (NEAR * np.linspace(0.9, 1.2, 5))[:, None]
    values["log_scales"][5:10] = np.log(0.03)
    values["log_scales"][10:15] = np.log(chance.uniform(1.0, 6.0, (5, 3)))
    values["log_scales"][15:20] = np.log(1e-4)
    # Axis z of these turns from +z to what is square to the way ahead.
    square = unit(np.cross(ahead, chance.normal(size=(5, 3))))
    values["quaternions"][20:25] = unit(
        np.stack([1 + square[:, 2], -square[:, 1], square[:, 0], 0 * square[:, 0]], axis=1)
    )
    values["log_scales"][20:25] = np.log([0.5, 0.3, 1e-5])
    turns = rotation_matrices(unit(chance.normal(size=(60, 4)))) if turned else None
    splats = splats_of(values, antialiased, turns)
    opacities = splats.opacities.copy()
    opacities[25:30] = (0.0, 1.0, 0.9999, 1.0 / 255.0, 0.004)
    opacities[10:15] *= 0.3
    return single(replace(splats, opacities=opacities))
