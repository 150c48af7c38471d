"""Small fields and scenes of splats for tests."""

from __future__ import annotations

import numpy as np

from cagefield.cameras.camera import turntable
from cagefield.fields.splat_field import SplatField
from cagefield.scene.scene import Scene
from scenes import SH_C0


def random_splats(count: int = 40, degree: int = 2, seed: int = 0) -> SplatField:
    """Splats of all shapes, opacities and colors in the box [-1, 1]^3."""
    chance = np.random.default_rng(seed)
    sh = chance.normal(size=(count, (degree + 1) ** 2, 3)) * 0.2
    return SplatField(
        chance.uniform(-1.0, 1.0, (count, 3)),
        np.log(chance.uniform(0.02, 0.3, (count, 3))),
        chance.normal(size=(count, 4)),
        chance.uniform(0.05, 1.0, count),
        sh,
    )


def ball_of_splats(count: int = 600, radius: float = 0.5, seed: int = 0) -> SplatField:
    """A red ball around the origin in the box [-1, 1]^3: flat splats on its surface, SH degree 0."""
    chance = np.random.default_rng(seed)
    normals = chance.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    # The rotation from +z to the normal: (1 + cos, axis x sin), of length sqrt(2 + 2 cos).
    quaternions = np.stack([1.0 + normals[:, 2], -normals[:, 1], normals[:, 0], np.zeros(count)], axis=1)
    size = 2.5 * radius / np.sqrt(count)
    scales = np.broadcast_to((size, size, 0.2 * size), (count, 3))
    color = (np.array([0.9, 0.2, 0.1]) - 0.5) / SH_C0
    return SplatField(
        radius * normals,
        np.log(scales),
        quaternions + np.array([1e-6, 0.0, 0.0, 0.0]),
        np.full(count, 0.8),
        np.broadcast_to(color, (count, 1, 3)),
        bounds=np.array([[-1.0] * 3, [1.0] * 3]),
    )


BALL_RADIUS = 0.25


def ball_and_floor() -> SplatField:
    """A red ball of radius .25 around the origin, over a gray floor at z = -.5."""
    ball = ball_of_splats(800, BALL_RADIUS)
    axis = np.linspace(-0.9, 0.9, 24)
    x, y = (values.reshape(-1) for values in np.meshgrid(axis, axis))
    floor = len(x)
    return SplatField(
        np.concatenate([ball.means, np.stack([x, y, np.full(floor, -0.5)], axis=1)]),
        np.concatenate([ball.log_scales, np.tile(np.log([0.05, 0.05, 0.005]), (floor, 1))]),
        np.concatenate([ball.quaternions, np.tile([1.0, 0, 0, 0], (floor, 1))]),
        np.concatenate([ball.opacities, np.full(floor, 0.9)]),
        np.concatenate([ball.sh, np.full((floor, 1, 3), (0.4 - 0.5) / SH_C0)]),
        bounds=np.array([[-1.0] * 3, [1.0] * 3]),
    )


def splat_scene() -> Scene:
    """The ball of splats with 3 training and 2 test cameras of 24 x 16 pixels, no edits, white background."""
    cameras = {
        split: turntable((0, 0, 0), 3.0, n, elevation=elevation, width=24, height=16, fov_x=0.8)
        for split, n, elevation in (("train", 3, 0.3), ("test", 2, 0.5))
    }
    return Scene(ball_of_splats(), cameras=cameras)


def assert_same_splats(got: SplatField, expected: SplatField, rtol: float = 0.0, atol: float = 0.0) -> None:
    """Fails unless two fields have the same splats, to the given tolerance."""
    for name in ("means", "log_scales", "quaternions", "opacities", "sh"):
        np.testing.assert_allclose(
            getattr(got, name), getattr(expected, name), rtol=rtol, atol=atol, err_msg=name
        )
    assert got.antialiased == expected.antialiased
