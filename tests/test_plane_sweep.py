"""Points by plane sweeping, of surfaces that are known: where they are, and where there are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.training.splats.plane_sweep import (
    FREE_DISTANCE_SHARE,
    SweptSurfaces,
    choose_neighbors,
    sweep_surfaces,
)

DISTANCE, NEAR = 4.0, 2.2
LENSES = {
    "pinhole": (),
    "opencv": (-0.2, 0.05, 0.01, -0.01),
    "opencv_fisheye": (0.05, -0.02, 0.01, 0.0),
}


def eye(degrees: float, across: float = 0.0, distance: float = DISTANCE) -> tuple[float, float, float]:
    """A place on a sphere around the origin, so many degrees from +z."""
    a, b = np.radians([degrees, across])
    return (distance * np.sin(a), distance * np.sin(b) * np.cos(a), distance * np.cos(a) * np.cos(b))


def cameras(lens: str = "pinhole") -> list[Camera]:
    """Five cameras above the plane z = 0, 8 degrees apart."""
    places = [(0, 0), (8, 0), (-8, 0), (0, 8), (0, -8)]
    plain = [
        Camera.look_at(eye(*place), (0, 0, 0), up=(0, 1, 0), width=72, height=56, fov_x=0.7)
        for place in places
    ]
    return [replace(camera, model=lens, distortion=LENSES[lens]) for camera in plain]


def painted(points: np.ndarray) -> np.ndarray:
    """Colors [N,3] in [0,1] of places [N,2]: waves of many directions, some pixels long."""
    chance = np.random.default_rng(3)
    waves, phases = 9.0 * chance.normal(size=(2, 24)), chance.uniform(0, 6, 24)
    amounts = chance.normal(size=(24, 3)) * 0.09
    return (0.5 + np.sin(points @ waves + phases) @ amounts).clip(0, 1)


def photo(camera: Camera, step: float = 0.0, plain: bool = False) -> np.ndarray:
    """uint8 [H,W,3] of the painted plane z = 0 with a square of half-size 0.5 raised to z = `step`."""
    origins, toward = (values.astype(np.float64) for values in camera.rays())
    low = origins - toward * (origins[:, 2:] / toward[:, 2:])
    high = origins + toward * ((step - origins[:, 2:]) / toward[:, 2:])
    raised = (np.abs(high[:, :2]) < 0.5).all(axis=1) & (step > 0)
    rgb = painted(np.where(raised[:, None], high[:, :2] + 7.0, low[:, :2]))
    if plain:
        rgb = np.full_like(rgb, 0.6)
    return np.rint(255 * rgb).astype(np.uint8).reshape(camera.height, camera.width, 3)


def found(views: list[Camera], images: list[np.ndarray], wanted: int = 100_000, **rest):
    """The points of photos whose depths are known roughly."""
    surfaces = surfaces_of(views, images, wanted, **rest)
    return surfaces.positions, surfaces.rgb


def surfaces_of(
    views: list[Camera], images: list[np.ndarray], wanted: int = 100_000, **rest
) -> SweptSurfaces:
    return sweep_surfaces(images, views, [NEAR] * len(views), [DISTANCE] * len(views), wanted, **rest)


@pytest.mark.parametrize("lens", LENSES)
def test_points_lie_on_the_plane_that_photos_show(lens):
    views = cameras(lens)
    images = [photo(camera) for camera in views]
    points, rgb = found(views, images)
    assert len(points) > 0.3 * len(views) * images[0][..., 0].size
    # 32 inverse depths, that is 0.23 of depth for a step; a parabola through the scores finds a part of it.
    step = DISTANCE**2 / NEAR / 31
    assert np.median(np.abs(points[:, 2])) < 0.3 * step
    assert np.quantile(np.abs(points[:, 2]), 0.95) < step
    # A pixel's color is that of the plane where the point is: off by what a little depth moves it.
    assert np.median(np.abs(rgb / 255.0 - painted(points[:, :2]))) < 0.05


def test_a_step_is_found_with_its_two_depths():
    views = cameras()
    points, _ = found(views, [photo(camera, step=0.8) for camera in views])
    middle = (np.abs(points[:, :2]) < 0.35).all(axis=1)
    outside = (np.abs(points[:, :2]) > 0.8).any(axis=1)
    assert middle.sum() > 200 and outside.sum() > 200
    assert abs(np.median(points[middle, 2]) - 0.8) < 0.1
    assert abs(np.median(points[outside, 2])) < 0.1


def test_photos_without_texture_give_no_points():
    views = cameras()
    surfaces = surfaces_of(views, [photo(camera, plain=True) for camera in views])
    assert surfaces.positions.shape == (0, 3) and surfaces.rgb.shape == (0, 3)
    assert surfaces.free_distances.shape == (len(views), 56, 72) and not surfaces.free_distances.any()


@pytest.mark.parametrize("lens", LENSES)
def test_rays_are_empty_until_shortly_before_what_photos_agree_on(lens):
    views = cameras(lens)
    surfaces = surfaces_of(views, [photo(camera) for camera in views])
    for camera, empty in zip(views, surfaces.free_distances, strict=True):
        origins, toward = (values.astype(np.float64) for values in camera.rays())
        true = -origins[:, 2] / toward[:, 2] / np.linalg.norm(toward, axis=1)
        share = empty.ravel()[empty.ravel() > 0] / true[empty.ravel() > 0]
        assert len(share) > 0.3 * len(true)
        # A step of inverse depth, by which it ends sooner, is 0.04 of this depth.
        assert np.quantile(share, 0.98) < 1.0 and 0.85 < np.median(share) < FREE_DISTANCE_SHARE


def test_photos_of_different_things_give_next_to_no_points():
    views = cameras()
    chance = np.random.default_rng(0)
    images = [chance.integers(0, 256, (56, 72, 3), np.uint8) for _ in views]
    points, _ = found(views, images)
    assert len(points) < 0.02 * 56 * 72 * len(views)


def test_cameras_too_close_together_give_no_points():
    views = [
        Camera.look_at(eye(0.2 * n), (0, 0, 0), up=(0, 1, 0), width=72, height=56, fov_x=0.7)
        for n in range(4)
    ]
    points, _ = found(views, [photo(camera) for camera in views])
    assert len(points) == 0


def test_points_are_thinned_evenly_to_about_as_many_as_wanted():
    views = cameras()
    images = [photo(camera) for camera in views]
    everything, _ = found(views, images)
    points, rgb = found(views, images, wanted=400)
    assert 150 < len(points) <= 400 and len(rgb) == len(points)
    again, _ = found(views, images, wanted=400)
    np.testing.assert_array_equal(points, again)
    kept = {tuple(point) for point in everything}
    assert all(tuple(point) in kept for point in points)
    # The four quarters of the plane keep the shares that they had, to the noise of a hundred points each.
    quarters = [(2 * (p[:, 0] > 0) + (p[:, 1] > 0)) for p in (everything, points)]
    shares = [np.bincount(quarter, minlength=4) / len(quarter) for quarter in quarters]
    np.testing.assert_allclose(shares[1], shares[0], atol=0.12)


def test_neighbors_are_those_nearest_to_the_best_angle():
    degrees = (0, 1, 4, 8, 12, 20, 50)
    views = [Camera.look_at(eye(d), (0, 0, 0), up=(0, 1, 0), width=72, height=56, fov_x=0.7) for d in degrees]
    chosen = choose_neighbors(views, [DISTANCE] * len(views))
    # by |log(angle / 8 degrees)|; one degree is too little parallax, 50 are another look
    assert [degrees[n] for n in chosen[0]] == [8, 12, 4, 20]
    assert [degrees[n] for n in chosen[6] if n >= 0] == [20]
    assert all(r not in row for r, row in enumerate(chosen))


def test_cameras_that_are_much_farther_or_look_away_are_no_neighbors():
    places = [eye(0), eye(8), eye(8, distance=3 * DISTANCE)]
    views = [Camera.look_at(p, (0, 0, 0), up=(0, 1, 0), width=72, height=56, fov_x=0.7) for p in places]
    views.append(Camera.look_at(eye(-8), eye(-8, distance=9.0), up=(0, 1, 0), width=72, height=56, fov_x=0.7))
    assert choose_neighbors(views, [DISTANCE] * 4)[0].tolist() == [1, -1, -1, -1]
