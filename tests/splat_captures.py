"""Captures with a known answer: photos of a field of splats, as data sets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cagefield.cameras.camera import Camera, turntable
from cagefield.datasets.views import Dataset, SparsePoints, View
from cagefield.fields.splat_field import SplatField
from cagefield.images.image_files import write_png
from cagefield.rendering.splats.splat_renderer import SplatRenderer
from scenes import SH_C0
from splat_scenes import ball_of_splats

BOX = np.array([[-1.0] * 3, [1.0] * 3])


def painted_ball(count: int = 250) -> SplatField:
    """A ball of splats of random colors."""
    ball = ball_of_splats(count)
    colors = np.random.default_rng(5).uniform(0.05, 0.95, (count, 1, 3))
    return SplatField(
        ball.means,
        ball.log_scales,
        ball.quaternions,
        np.full(count, 0.95),
        (colors - 0.5) / SH_C0,
        bounds=BOX,
    )


def around(count: int, elevation: float, size: int = 64) -> list[Camera]:
    """Cameras on a ring around the origin."""
    return turntable((0, 0, 0), 2.2, count, elevation=elevation, width=size, height=size, fov_x=0.6)


def photos_of(field: SplatField, cameras: Sequence[Camera], cut_out: bool = False) -> list[NDArray[np.uint8]]:
    """uint8 pictures of the field over black, or with straight alpha."""
    renderer, pictures = SplatRenderer(field), []
    for camera in cameras:
        frame = renderer.render(camera, background=None if cut_out else "black")
        assert frame is not None
        picture = np.dstack([frame.rgb, frame.opacity]) if cut_out else frame.rgb
        pictures.append(np.rint(255 * picture.clip(0, 1)).astype(np.uint8))
    return pictures


def write_views(
    folder: Path, cameras: Sequence[Camera], photos: Sequence[NDArray[np.uint8]]
) -> tuple[View, ...]:
    """Views of photos written to a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    views = []
    for n, (camera, photo) in enumerate(zip(cameras, photos, strict=True)):
        path = folder / f"{n:02}.png"
        write_png(path, photo)
        views.append(View(f"{folder.name}/{n:02}", camera, path))
    return tuple(views)


def as_dataset(
    folder: Path,
    train: tuple[View, ...],
    test: tuple[View, ...] = (),
    points: SparsePoints | None = None,
    white: bool = False,
    unbounded: bool = False,
) -> Dataset:
    """A data set in the box [-1, 1]^3."""
    return Dataset(folder.name, folder, train, test, (), unbounded, BOX, white, points=points)


def points_near(field: SplatField, far: float = 0.03, count: int = 120) -> SparsePoints:
    """Gray points at some of the field's splats, each off by about `far` along each axis."""
    chance = np.random.default_rng(2)
    means = field.means[:: max(1, len(field) // count)]
    return SparsePoints(means + far * chance.normal(size=means.shape), np.full(means.shape, 128, np.uint8))


def ring_capture(folder: Path) -> Dataset:
    """Twelve photos of a painted ball, two of them for tests, with points that all photos may see."""
    ball, cameras = painted_ball(), around(12, 0.4, 48)
    views = write_views(folder, cameras, photos_of(ball, cameras))
    return as_dataset(Path("ball"), views[2:], views[:2], points_near(ball), unbounded=True)


def points_along_x(dataset: Dataset, seed: int = 3) -> SparsePoints:
    """Points along x, each seen by the photos whose number is near its place; one photo sees few of them."""
    chance = np.random.default_rng(seed)
    x = chance.uniform(0, len(dataset.train), 400)
    positions = np.stack([x, chance.normal(0, 0.2, 400), chance.normal(0, 0.2, 400)], axis=1)
    names = [view.name for view in dataset.train]
    seen = [frozenset(name for n, name in enumerate(names) if abs(n + 0.5 - at) < 1.2 and n != 4) for at in x]
    seen[0] |= {names[4]}
    return SparsePoints(positions, np.zeros((400, 3), np.uint8), tuple(seen))
