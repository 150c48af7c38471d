"""Cameras: closed forms for pinholes, round trips and an independent library for lenses, rejected input."""

from __future__ import annotations

import json
import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cagefield.cameras import lenses
from cagefield.cameras.camera import Camera, turntable
from cagefield.errors import CameraError

LENSES = {
    "pinhole": ("pinhole", ()),
    "phone": ("opencv", (0.0578421, -0.0805099, -0.000980296, 0.00015575)),
    "barrel": ("opencv", (-0.28, 0.07, 0.0, 0.0)),
    "strong": ("opencv", (-0.35, 0.18, 0.01, -0.008, -0.02, 0.004)),
    "pincushion": ("opencv", (0.6, 0.4, 0.02, 0.015, 0.1, 0.05)),
    "equidistant": ("opencv_fisheye", (0.0, 0.0, 0.0, 0.0)),
    "fisheye": ("opencv_fisheye", (0.05, -0.012, 0.003, -0.0004)),
    "strong fisheye": ("opencv_fisheye", (-0.12, 0.04, -0.01, 0.001)),
}


def _pose(seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=seed).as_matrix()
    pose[:3, 3] = rng.normal(size=3)
    return pose


def _camera(lens: str, **changes) -> Camera:
    model, distortion = LENSES[lens]
    values = {"width": 64, "height": 48, "fx": 40.0, "fy": 43.0, "cx": 30.5, "cy": 25.25}
    return Camera(c2w=_pose(), **{**values, **changes}, model=model, distortion=distortion)


def _centers(camera: Camera) -> np.ndarray:
    columns, rows = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    return np.stack([columns.ravel(), rows.ravel()], axis=1)


def test_pinhole_directions_in_closed_form():
    camera = Camera.from_fov(np.eye(4), 4, 2, math.radians(90))
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == pytest.approx((2, 2, 2, 1))
    local = camera.local_directions().reshape(2, 4, 3)
    # the top left pixel's center is 1.5 px left of and 0.5 px above the axis, at 2 px focal length
    expected = np.array([-1.5, 0.5, -2.0])
    np.testing.assert_allclose(local[0, 0], expected / np.linalg.norm(expected), atol=1e-7)
    np.testing.assert_allclose(local[1, 3], -expected / np.linalg.norm(expected) * (1, 1, -1), atol=1e-7)
    assert not local.flags.writeable
    assert camera.local_directions() is camera.with_c2w(_pose()).local_directions()


@pytest.mark.parametrize("lens", LENSES)
def test_project_undoes_rays(lens):
    camera = _camera(lens)
    origins, directions = camera.rays()
    assert origins.dtype == directions.dtype == np.float32
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=2e-7)
    distance = np.linspace(0.5, 7.0, len(directions))[:, None]
    positions, depth = camera.project(origins + distance * directions.astype(np.float64))
    # float32 directions are good to 1e-7 relative; the steepest of these lenses turns that into 1e-5 px
    np.testing.assert_allclose(positions, _centers(camera), atol=2e-4)
    expected = distance[:, 0] * -camera.local_directions()[:, 2]
    np.testing.assert_allclose(depth, expected, atol=2e-6)


@pytest.mark.parametrize("lens", LENSES)
def test_unproject_is_exact_in_float64(lens):
    model, coefficients = LENSES[lens]
    camera = _camera(lens)
    image = (_centers(camera) - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    directions, seen = lenses.unproject(image, model, coefficients)
    assert seen.all()
    np.testing.assert_allclose(lenses.project(directions, model, coefficients), image, atol=1e-12)


@settings(max_examples=60, deadline=None)
@given(
    k=st.tuples(*[st.floats(-0.4, 0.4)] * 2, *[st.floats(-0.02, 0.02)] * 2, *[st.floats(-0.1, 0.1)] * 2),
    fisheye=st.booleans(),
)
def test_directions_the_lens_sees_come_back(k, fisheye):
    model, coefficients = ("opencv_fisheye", (k[0], k[1], k[4], k[5])) if fisheye else ("opencv", k)
    fold = lenses.polynomial_fold(lenses.radial_coefficients(model, coefficients), np.pi if fisheye else 2.0)
    # inside 90 % of the fold (tangential terms shift it a little), all round
    r, a = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 0.9 * fold, 12), np.linspace(0, 6, 9)))
    tangent = np.sin(r) if fisheye else r
    directions = np.stack(
        [tangent * np.cos(a), tangent * np.sin(a), np.cos(r) if fisheye else np.ones_like(r)], 1
    )
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    if not fisheye:
        slopes = _jacobian_determinants(directions, coefficients)
        directions = directions[
            slopes > 0.05
        ]  # next to a fold of the tangential terms two directions share a pixel
    image = lenses.project(directions, model, coefficients)
    again, seen = lenses.unproject(image, model, coefficients)
    # whatever is found has the right image ...
    np.testing.assert_allclose(lenses.project(again[seen], model, coefficients), image[seen], atol=1e-8)
    # ... and a fisheye, or a lens without tangential terms, is one to one
    if fisheye or (k[2] == k[3] == 0):
        assert seen.all()
        np.testing.assert_allclose(again, directions, atol=1e-7)  # slope 0.1 at worst over rounding 1e-15


def _jacobian_determinants(directions: np.ndarray, coefficients: tuple[float, ...]) -> np.ndarray:
    plane, h = directions[:, :2] / directions[:, 2:], 1e-6
    columns = [
        (lenses.distort(plane + h * e, coefficients) - lenses.distort(plane - h * e, coefficients)) / (2 * h)
        for e in np.eye(2)
    ]
    return columns[0][:, 0] * columns[1][:, 1] - columns[0][:, 1] * columns[1][:, 0]


@pytest.mark.parametrize("lens", [name for name in LENSES if len(LENSES[name][1]) <= 4])
def test_project_equals_colmap(lens):
    pycolmap = pytest.importorskip("pycolmap", reason="pycolmap is the independent oracle")
    camera = _camera(lens)
    names = {"pinhole": "PINHOLE", "opencv": "OPENCV", "opencv_fisheye": "OPENCV_FISHEYE"}
    other = pycolmap.Camera(
        model=names[camera.model],
        width=camera.width,
        height=camera.height,
        params=[camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion],
    )
    local = np.random.default_rng(1).uniform((-0.6, -0.6, 1.0), (0.6, 0.6, 2.0), size=(40, 3))
    opengl = local * (1, -1, -1)
    positions, depth = camera.project(opengl @ camera.c2w[:3, :3].T + camera.origin)
    np.testing.assert_allclose(positions, other.img_from_cam(local), atol=1e-9)
    np.testing.assert_allclose(depth, local[:, 2], atol=1e-12)


def test_all_six_opencv_coefficients_in_closed_form():
    k1, k2, p1, p2, k3, k4 = coefficients = (0.1, 0.2, 0.03, 0.04, 0.5, 0.6)
    x, y, s = 0.5, -0.25, 0.3125
    g = 1 + k1 * s + k2 * s**2 + k3 * s**3 + k4 * s**4
    expected = (g * x + 2 * p1 * x * y + p2 * (s + 2 * x * x), g * y + p1 * (s + 2 * y * y) + 2 * p2 * x * y)
    image = lenses.project(np.array([[1.0, -0.5, 2.0]]), "opencv", coefficients)
    np.testing.assert_allclose(image[0], expected, rtol=1e-14)
    np.testing.assert_allclose(
        lenses.project(np.array([[1.0, -0.5, 2.0]]), "opencv", coefficients[:4])[0],
        lenses.project(np.array([[1.0, -0.5, 2.0]]), "opencv", (*coefficients[:4], 0.0, 0.0))[0],
    )


def test_newtons_jacobian_is_the_derivative():
    coefficients, h = (0.1, 0.2, 0.03, 0.04, 0.5, 0.6), 1e-6
    plane = np.random.default_rng(4).uniform(-0.7, 0.7, (30, 2))
    dx, dy = (
        (lenses.distort(plane + h * e, coefficients) - lenses.distort(plane - h * e, coefficients)) / (2 * h)
        for e in np.eye(2)
    )
    a, b, d = lenses.distort_jacobian(plane, coefficients)
    # central differences: h^2 times third derivatives of order 100, and rounding 1e-16 / h
    np.testing.assert_allclose(np.stack([a, b, b, d]), np.stack([*dx.T, *dy.T]), atol=1e-8)


def test_points_without_an_image_are_nan():
    camera = _camera("pinhole")
    behind = camera.origin - camera.forward
    positions, depth = camera.project(np.stack([behind, camera.origin + camera.forward]))
    assert np.isnan(positions[0]).all() and depth[0] == pytest.approx(-1)
    np.testing.assert_allclose(positions[1], (camera.cx, camera.cy), atol=1e-12)
    # r (1 - 0.3 r^2) folds at r = 1 / sqrt(0.9) = 1.054
    barrel = ("opencv", (-0.3, 0.0, 0.0, 0.0))
    image = lenses.project(np.array([[1.05, 0, 1], [1.06, 0, 1]]), *barrel)
    np.testing.assert_allclose(image[0], [1.05 * (1 - 0.3 * 1.05**2), 0])
    assert np.isnan(image[1]).all()
    # a fisheye sees behind itself
    image = lenses.project(np.array([[1.0, 0, -1]]), "opencv_fisheye", (0.0, 0.0, 0.0, 0.0))
    np.testing.assert_allclose(image, [[0.75 * np.pi, 0]])
    # t (1 - 0.3 t^2) folds at 1.054 rad
    angles = np.array([1.05, 1.06])
    rim = np.stack([np.sin(angles), 0 * angles, np.cos(angles)], axis=1)
    image = lenses.project(rim, "opencv_fisheye", (-0.3, 0.0, 0.0, 0.0))
    assert image[0, 0] == pytest.approx(1.05 * (1 - 0.3 * 1.05**2)) and np.isnan(image[1]).all()


def test_pixels_outside_the_lens_warn_or_raise():
    edge = {
        "model": "opencv",
        "distortion": (-0.3, 0.0, 0.0, 0.0),
    }  # largest image radius 2/3 * 1.054 = 0.703
    with pytest.warns(UserWarning, match=r"\d+ of 3072 pixels lie outside the field of the lens"):
        directions = Camera(np.eye(4), 64, 48, 54.0, 54.0, 32.0, 24.0, **edge).local_directions()
    corner = directions[0]
    assert np.hypot(corner[0], corner[1]) / -corner[2] == pytest.approx(1 / math.sqrt(0.9), rel=1e-6)
    with pytest.raises(
        CameraError, match="check that focal length, image size and coefficients belong together"
    ):
        Camera(np.eye(4), 64, 48, 30.0, 30.0, 32.0, 24.0, **edge).local_directions()


@pytest.mark.parametrize("lens", ["pinhole", "strong"])
def test_rays_of_chosen_pixels(lens):
    camera = _camera(lens)
    pixels = np.array([[0, 0], [63, 47], [5, 11]])
    origins, directions = camera.rays(pixels)
    np.testing.assert_array_equal(origins, np.tile(camera.origin.astype(np.float32), (3, 1)))
    everything = camera.rays()[1]
    np.testing.assert_allclose(directions, everything[pixels[:, 1] * 64 + pixels[:, 0]], atol=1e-7)
    with pytest.raises(CameraError, match=r"pixels\[1\] = \(64, 0\) is outside the image of 64x48"):
        camera.rays([[0, 0], [64, 0]])
    with pytest.raises(CameraError, match="pixels must be integers"):
        camera.rays([[0.5, 0.5]])


@pytest.mark.parametrize("lens", LENSES)
def test_downscaled_pixels_are_boxes(lens):
    camera = _camera(lens, width=66, height=50)
    small = camera.downscaled(4)
    assert (small.width, small.height) == (16, 12)
    # the point seen at the middle of 4 x 4 pixels is seen at the middle of the one that replaces them
    origins, directions = small.rays()
    large, _ = camera.project(origins + 3 * directions)
    np.testing.assert_allclose(
        large, 4 * _centers(small), atol=1e-3
    )  # 4 times the float32 error of test above


def test_resized_scales_each_side():
    camera = _camera("phone").resized(32, 96)
    assert (camera.width, camera.height) == (32, 96)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (20.0, 86.0, 15.25, 50.5)
    with pytest.raises(CameraError, match="factor must be a whole number from 1 to 48"):
        _camera("phone").downscaled(49)


def test_look_at_has_the_target_in_the_middle_and_up_upwards():
    camera = Camera.look_at((1, -2, 3), (0.5, 0.25, 1), width=40, height=30, fov_x=1.0)
    positions, depth = camera.project(np.array([[0.5, 0.25, 1.0], [0.5, 0.25, 1.1]]))
    np.testing.assert_allclose(positions[0], (20, 15), atol=1e-12)
    assert depth[0] == pytest.approx(math.dist((1, -2, 3), (0.5, 0.25, 1)))
    assert positions[1, 0] == pytest.approx(20) and positions[1, 1] < 15  # +z is upwards: a smaller row
    edge = camera.rays([[0, 14]])[1][0] @ camera.forward
    assert math.acos(edge) == pytest.approx(0.5, abs=0.03)  # the outer pixel's center, half a pixel inside
    with pytest.raises(CameraError, match="parallel to the direction of view; choose another up"):
        Camera.look_at((0, 0, 3), (0, 0, 0), width=40, height=30, fov_x=1.0)
    with pytest.raises(CameraError, match="target must differ from eye"):
        Camera.look_at((0, 0, 3), (0, 0, 3), width=40, height=30, fov_x=1.0)


@pytest.mark.parametrize("up", [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0.2, -0.3, 2.0)])
def test_turntable_is_a_circle(up):
    center = np.array([0.1, 0.2, 0.3])
    cameras = turntable(center, 2.0, 8, elevation=0.4, up=up, width=40, height=30, fov_x=1.0)
    axis = np.array(up) / np.linalg.norm(up)
    offsets = np.array([c.origin - center for c in cameras])
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=1), 2.0)
    np.testing.assert_allclose(offsets @ axis, 2.0 * math.sin(0.4))
    flat = offsets - (offsets @ axis)[:, None] * axis
    turns = np.einsum("ni,ni->n", np.cross(flat, np.roll(flat, -1, axis=0)), np.tile(axis, (8, 1)))
    np.testing.assert_allclose(turns, (2 * math.cos(0.4)) ** 2 * math.sin(math.pi / 4))  # counter-clockwise
    for camera in cameras:
        np.testing.assert_allclose(camera.project(center[None])[0], [[20, 15]], atol=1e-9)


def test_turntable_starts_in_front():
    first = turntable((0, 0, 0), 1.0, 4, elevation=0.0, width=4, height=4, fov_x=1.0)[0]
    np.testing.assert_allclose(first.origin, (0, -1, 0), atol=1e-15)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n": 0}, "n must be at least 1, got 0"),
        ({"radius": 0.0}, "radius must be positive"),
        ({"elevation": 1.6}, "elevation must lie between"),
        ({"up": (0, 0, 0)}, "up must not be zero"),
        ({"fov_x": 60.0}, "fov_x must lie between 0 and pi radians, got 60.0; convert degrees"),
    ],
)
def test_turntable_rejects(changes, message):
    values = {
        "center": (0, 0, 0),
        "radius": 1.0,
        "n": 2,
        "elevation": 0.0,
        "width": 4,
        "height": 4,
        "fov_x": 1.0,
    }
    with pytest.raises(CameraError, match=message):
        turntable(**{**values, **changes})


def test_dictionary_round_trip_is_exact():
    camera = _camera("strong")
    again = Camera.from_dict(json.loads(json.dumps(camera.to_dict())))
    assert again == camera and hash(again) == hash(camera)
    assert again != camera.with_c2w(_pose(1)) and again != camera.resized(32, 24)
    with pytest.raises(CameraError, match="unknown camera key 'focal'; known keys: c2w, width"):
        Camera.from_dict({**camera.to_dict(), "focal": 3})
    with pytest.raises(CameraError, match="lacks the key 'fx'"):
        Camera.from_dict({key: value for key, value in camera.to_dict().items() if key != "fx"})
    with pytest.raises(CameraError, match="distortion must be a list of numbers"):
        Camera.from_dict({**camera.to_dict(), "distortion": 0.1})


def _bad_pose(change) -> np.ndarray:
    pose = _pose()
    change(pose)
    return pose


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"c2w": np.eye(3)}, r"c2w must have the shape \[4,4\], got \[3, 3\]"),
        ({"c2w": [[1, 2], [3]]}, r"c2w must be a matrix \[4,4\] of numbers"),
        (
            {"c2w": _bad_pose(lambda m: m.__setitem__((1, 2), np.nan))},
            r"c2w\[1\]\[2\] is nan; every entry must",
        ),
        ({"c2w": _bad_pose(lambda m: m.__imul__(2.0))}, "last row of c2w must be 0 0 0 1"),
        ({"c2w": _pose().T}, "is it transposed"),
        (
            {"c2w": np.diag([1.01, 1.01, 1.01, 1])},
            "not a rigid motion: its 3x3 part deviates from a rotation by 0.02",
        ),
        ({"c2w": np.diag([1.0, 1.0, -1.0, 1])}, "it mirrors"),
        ({"width": 0}, "width must be a whole number of pixels, at least 1, got 0"),
        ({"height": 4.5}, "height must be a whole number of pixels"),
        ({"width": "64"}, "width must be a finite number, got '64'"),
        ({"fx": 0.0}, "fx must be a positive focal length in pixels, got 0.0"),
        ({"fy": -3.0}, "fy must be a positive focal length"),
        ({"cx": math.inf}, "cx must be a finite number, got inf"),
        ({"model": "rational"}, "model must be one of pinhole, opencv, opencv_fisheye, got 'rational'"),
        ({"distortion": (0.1,)}, "'pinhole' takes 0 distortion coefficients, got 1"),
        (
            {"model": "opencv", "distortion": (0.1,)},
            "'opencv' takes 4 or 5 or 6 distortion coefficients, got 1",
        ),
        (
            {"model": "opencv", "distortion": (0.1, 0, 0, math.nan)},
            "distortion must be a finite number, got nan",
        ),
    ],
)
def test_camera_rejects(changes, message):
    values = {"c2w": _pose(), "width": 64, "height": 48, "fx": 40.0, "fy": 40.0, "cx": 32.0, "cy": 24.0}
    Camera(**values)
    with pytest.raises(CameraError, match=message):
        Camera(**{**values, **changes})


def test_poses_printed_with_three_decimals_are_accepted_and_stay_consistent():
    camera = _camera("phone").with_c2w(np.round(_pose(), 3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        origins, directions = camera.rays()
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=2e-7)
    positions, _ = camera.project(origins + 2 * directions.astype(np.float64))
    np.testing.assert_allclose(positions, _centers(camera), atol=2e-4)


def test_camera_cannot_be_changed():
    camera = _camera("pinhole")
    with pytest.raises(ValueError, match="read-only"):
        camera.c2w[0, 0] = 3
    with pytest.raises(AttributeError):
        camera.fx = 3.0
    with pytest.raises(CameraError, match=r"points must have the shape \[N,3\]"):
        camera.project(np.zeros(3))
