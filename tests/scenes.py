"""Small scenes for tests: a ball of constant density and color, sampled on a voxel grid."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cagefield.cameras.camera import Camera, turntable
from cagefield.fields.voxel_field import VoxelField
from cagefield.scene.scene import Scene

SH_C0 = 0.28209479177387814


def ball_field(density: float = 40.0, resolution: int = 17, radius: float = 0.5) -> VoxelField:
    """A red ball around the origin in the box [-1, 1]^3, SH degree 0."""
    axis = np.linspace(-1.0, 1.0, resolution)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    vertices = np.flatnonzero(np.linalg.norm(grid, axis=1) <= radius)
    color = (np.array([0.9, 0.2, 0.1]) - 0.5) / SH_C0
    return VoxelField(
        bounds=np.array([[-1.0] * 3, [1.0] * 3]),
        resolution=(resolution,) * 3,
        vertices=vertices,
        density=np.full(len(vertices), density, np.float32),
        sh=np.broadcast_to(color.astype(np.float32), (len(vertices), 1, 3)),
    )


def ball_scene() -> Scene:
    """The red ball with 3 training and 2 test cameras of 24 x 16 pixels, no edits, white background."""
    return Scene(ball_field(), cameras={"train": ball_cameras(3), "test": ball_cameras(2, 0.5)})


def ball_cameras(count: int, elevation: float = 0.3) -> tuple[Camera, ...]:
    """Cameras of 24 x 16 pixels on a circle around the ball."""
    return turntable((0, 0, 0), 3.0, count, elevation=elevation, width=24, height=16, fov_x=0.8)


def files_of(path: Path) -> dict[str, bytes]:
    """Relative name -> content of every file under a folder."""
    return {str(file.relative_to(path)): file.read_bytes() for file in path.rglob("*") if file.is_file()}
