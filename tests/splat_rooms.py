"""A room of splats: a floor, and a box on it that shades it."""

from __future__ import annotations

import numpy as np

from cagefield.completion.lighting.ambient_occlusion import LightModel
from cagefield.fields.sh import C0
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.geometry.quaternions import quaternions_from_matrices

STEP = 0.05
REACH, STRENGTH = 0.3, 0.7
"""How far a corner lacks light, and how much of it."""

LIGHT = LightModel((REACH,), (STRENGTH,))
BOX = Cage.box((0.1, 0.0, 0.3), (0.5, 0.5, 0.6))
"""The box on the floor, z = 0."""


def cage() -> Cage:
    """Around the box, from half of a splat above the floor on."""
    return Cage.box((0.1, 0.0, 0.35), (0.62, 0.62, 0.64))


def room(box: bool, scale: float = 1.0, by: tuple[float, float] = (0.0, 0.0)) -> SplatField:
    """A colored floor of flat splats, and a box on it, each shaded by how near the other is.

    Under the box, which no photo would show, the floor is black.
    """
    axis = np.arange(-1.0, 1.0 + 0.5 * STEP, STEP)
    x, y = (part.reshape(-1) for part in np.meshgrid(axis, axis, indexing="ij"))
    floor = np.stack([x, y, np.zeros_like(x)], axis=1)
    color = np.stack([0.45 + 0.2 * x, 0.55 + 0.15 * y, 0.5 - 0.1 * x], axis=1)
    points, rgb, normals = [floor], [color], [np.tile([0.0, 0.0, 1.0], (len(x), 1))]
    if box:
        low, high = BOX.aabb + np.array([*by, 0.0])
        away = np.linalg.norm(np.maximum(np.maximum(low - floor, floor - high), 0.0), axis=1)
        color *= 1.0 - STRENGTH * np.clip(1.0 - away / REACH, 0.0, 1.0)[:, None]
        color[away == 0.0] = 0.0
        along = np.arange(-0.225, 0.25, STEP)
        for axis_number in range(3):
            for side in (-1.0, 1.0):
                u, v = (part.reshape(-1) for part in np.meshgrid(along, along * 1.2, indexing="ij"))
                face = np.zeros((len(u), 3))
                others = [k for k in range(3) if k != axis_number]
                half = 0.5 * (high - low)
                face[:, others[0]], face[:, others[1]] = u, v
                face[:, axis_number] = side * half[axis_number]
                normal = np.zeros(3)
                normal[axis_number] = side
                face = face + 0.5 * (low + high)
                points.append(face)
                shade = 1.0 - STRENGTH * np.clip(1.0 - face[:, 2] / REACH, 0.0, 1.0)
                rgb.append(np.array([0.8, 0.3, 0.2]) * shade[:, None])
                normals.append(np.tile(normal, (len(face), 1)))
    means, n = np.concatenate(points), np.concatenate(normals)
    aside = np.cross(n, np.eye(3)[(np.argmax(np.abs(n), axis=1) + 1) % 3])
    frames = np.stack([aside, np.cross(n, aside), n], axis=2)
    return SplatField(
        scale * means,
        np.broadcast_to(np.log(scale * np.array([0.7, 0.7, 0.1]) * STEP), means.shape),
        quaternions_from_matrices(frames),
        np.full(len(means), 0.95),
        ((np.concatenate(rgb) - 0.5) / C0)[:, None],
        bounds=scale * np.array([[-1.0, -1.0, -0.1], [1.0, 1.0, 0.7]]),
    )
