"""Lenses that no camera has: photos undistorted at load, panoramas as six pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cagefield.datasets import load_dataset
from cagefield.datasets.colmap.colmap_lenses import PANORAMA_FACES, PARAMETERS, lens_views
from cagefield.datasets.undistortion import EQUIRECTANGULAR, IDENTITY, SourceLens
from cagefield.datasets.views import PhotoMask, View
from cagefield.errors import DatasetError
from posed_photos import HEIGHT, POINT, WIDTH, assert_spot_is_where_the_camera_says, ring, save, spot

pycolmap = pytest.importorskip("pycolmap", reason="lenses of COLMAP's are pycolmap's")

F, C = (90.0, 94.0), (46.0, 33.5)
PARAMS = {
    "SIMPLE_PINHOLE": (90.0, *C),
    "PINHOLE": (*F, *C),
    "SIMPLE_RADIAL": (90.0, *C, 0.1),
    "RADIAL": (90.0, *C, 0.1, -0.05),
    "OPENCV": (*F, *C, 0.1, -0.05, 0.004, -0.003),
    "OPENCV_FISHEYE": (*F, *C, 0.06, -0.02, 0.004, -0.001),
    "FULL_OPENCV": (*F, *C, 0.1, -0.05, 0.004, -0.003, 0.01, 0.12, -0.03, 0.02),
    "FOV": (*F, *C, 0.6),
    "SIMPLE_RADIAL_FISHEYE": (90.0, *C, 0.06),
    "RADIAL_FISHEYE": (90.0, *C, 0.06, -0.02),
    "THIN_PRISM_FISHEYE": (*F, *C, 0.06, -0.02, 0.004, -0.003, 0.002, 0.001, 0.005, -0.004),
    "RAD_TAN_THIN_PRISM_FISHEYE": (
        *F,
        *C,
        0.05,
        -0.02,
        0.0,
        0.0,
        0.0,
        0.0,
        0.004,
        -0.003,
        0.005,
        0,
        -0.004,
        0,
    ),
    "SIMPLE_DIVISION": (90.0, *C, -0.1),
    "DIVISION": (*F, *C, -0.1),
    "SIMPLE_FISHEYE": (90.0, *C),
    "FISHEYE": (*F, *C),
    "EUCM": (*F, *C, 0.55, 1.1),
}
EXACT = {
    "SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE",
    "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "SIMPLE_FISHEYE", "FISHEYE",
}  # fmt: skip


def _full_opencv(x, y, k1, k2, p1, p2, k3, k4, k5, k6):
    s = x * x + y * y
    g = (1 + k1 * s + k2 * s**2 + k3 * s**3) / (1 + k4 * s + k5 * s**2 + k6 * s**3)
    return g * x + 2 * p1 * x * y + p2 * (s + 2 * x * x), g * y + p1 * (s + 2 * y * y) + 2 * p2 * x * y


def _fov(x, y, omega):
    r = np.hypot(x, y)
    scale = np.arctan(2 * r * np.tan(omega / 2)) / (omega * r)
    return scale * x, scale * y


def _thin_prism_fisheye(x, y, k1, k2, p1, p2, k3, k4, sx1, sy1):
    r = np.hypot(x, y)
    u, v = np.arctan(r) * x / r, np.arctan(r) * y / r
    s = u * u + v * v
    radial = 1 + k1 * s + k2 * s**2 + k3 * s**3 + k4 * s**4
    return (
        u * radial + 2 * p1 * u * v + p2 * (s + 2 * u * u) + sx1 * s,
        v * radial + 2 * p2 * u * v + p1 * (s + 2 * v * v) + sy1 * s,
    )


BY_HAND = {"FULL_OPENCV": _full_opencv, "FOV": _fov, "THIN_PRISM_FISHEYE": _thin_prism_fisheye}


def _position(model: str, pose: np.ndarray) -> np.ndarray:
    """Where POINT is in the photo: written out where BY_HAND has the model, else as COLMAP says."""
    local = np.linalg.inv(pose)[:3] @ (*POINT, 1.0) * (1, -1, -1)
    if model in BY_HAND:
        u, v = BY_HAND[model](*(local[:2] / local[2]), *PARAMS[model][4:])
        return np.array([F[0] * u + C[0], F[1] * v + C[1]])
    camera = pycolmap.Camera(model=model, width=WIDTH, height=HEIGHT, params=PARAMS[model])
    return np.asarray(camera.img_from_cam(local[None]))[0]


def _capture(folder: Path, model: str, n: int = 3, text: bool = False) -> Path:
    reconstruction = pycolmap.Reconstruction()
    camera = pycolmap.Camera(model=model, width=WIDTH, height=HEIGHT, params=PARAMS[model], camera_id=1)
    reconstruction.add_camera_with_trivial_rig(camera)
    for index, pose in enumerate(ring(n)):
        save(folder / f"images/{index}.png", spot(_position(model, pose), radius=2.0))
        axes = pose[:3, :3] * (1, -1, -1)
        rigid = pycolmap.Rigid3d(pycolmap.Rotation3d(axes.T), -axes.T @ pose[:3, 3])
        image = pycolmap.Image(name=f"{index}.png", camera_id=1, image_id=index + 1)
        reconstruction.add_image_with_trivial_frame(image, rigid)
    (folder / "sparse/0").mkdir(parents=True)
    (reconstruction.write_text if text else reconstruction.write_binary)(folder / "sparse/0")
    return folder


def test_every_camera_model_of_colmap_is_known():
    known = {name for name in pycolmap.CameraModelId.__members__ if name != "INVALID"}
    assert set(PARAMETERS) == known == {*PARAMS, EQUIRECTANGULAR}
    for number, (name, count) in enumerate(PARAMETERS.items()):
        assert int(getattr(pycolmap.CameraModelId, name)) == number
        assert len(pycolmap.Camera.create_from_model_name(1, name, 90.0, 96, 64).params) == count


@pytest.mark.filterwarnings("ignore:.*are undistorted at load")
@pytest.mark.parametrize("text", [False, True], ids=["binary", "text"])
@pytest.mark.parametrize("model", PARAMS)
def test_the_point_is_where_the_camera_says(tmp_path, model, text):
    data = load_dataset(_capture(tmp_path, model, text=text))
    point = data.source_to_world[:3, :3] @ POINT
    for view in (*data.train, *data.test):
        assert (view.source is None) == (model in EXACT)
        assert (view.camera.width, view.camera.height) == (WIDTH, HEIGHT)
        assert_spot_is_where_the_camera_says(view, point)


def test_undistortion_is_said_once(tmp_path):
    with pytest.warns(
        UserWarning, match=r"3 photos of camera model FOV are undistorted .*pinhole; \d+%"
    ) as said:
        load_dataset(_capture(tmp_path, "FOV"))
    assert len(said) == 1


@pytest.mark.parametrize("downscale", [1, 2])
def test_pixels_are_those_of_the_photo_at_the_lens_position(tmp_path, downscale):
    """Against colors painted as a smooth function of the photo's position: exact but for interpolation."""
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    photo = np.stack([2.5 * x, 3.5 * y, 100 + 0 * x], axis=2)
    save(tmp_path / "a.png", np.rint(photo).astype(np.uint8))
    (lens,) = lens_views("FULL_OPENCV", PARAMS["FULL_OPENCV"], WIDTH, HEIGHT)
    view = View("a", lens.camera, tmp_path / "a.png", source=lens.source).downscaled(downscale)
    local = view.camera.local_directions() * (1, -1, -1)
    u, v = _full_opencv(*(local[:, :2] / local[:, 2:]).T, *PARAMS["FULL_OPENCV"][4:])
    at = np.stack([F[0] * u + C[0], F[1] * v + C[1]], axis=1).reshape(
        view.camera.height, view.camera.width, 2
    )
    inside = ((at >= 0) & (at <= (WIDTH, HEIGHT))).all(axis=2)
    away = ((at >= 2) & (at <= (WIDTH - 2, HEIGHT - 2))).all(
        axis=2
    )  # from the edge, where colors are repeated
    got = view.load().astype(float)
    assert away.mean() > 0.8
    np.testing.assert_allclose(got[away, :2], (at * (2.5, 3.5))[away], atol=1.6)  # twice rounded
    valid = view.valid_pixels()
    np.testing.assert_array_equal(inside if valid is None else valid, inside)


def test_pixels_without_a_source_are_excluded(tmp_path):
    """A lens that squeezes the picture: beyond its edge the pinhole of the same size has nothing."""
    params = (
        60.0,
        60.0,
        48.0,
        32.0,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        -0.2,
        0.0,
        0.0,
    )  # 1 / (1 - .2 r^2): grows outwards
    (lens,) = lens_views("FULL_OPENCV", params, WIDTH, HEIGHT)
    save(tmp_path / "a.png", np.full((HEIGHT, WIDTH, 3), 200, np.uint8))
    view = View("a", lens.camera, tmp_path / "a.png", source=lens.source)
    valid, pixels = view.valid_pixels(), view.load()
    radius = np.hypot((np.arange(WIDTH) + 0.5 - 48) / 60, 0.5 / 60)
    expected = (60 * radius / (1 - 0.2 * radius**2) <= 48.3) & (radius < 1.2)
    np.testing.assert_array_equal(valid[32], expected)
    assert not valid.all() and valid[20:44, 30:66].all()
    assert (pixels[valid] == 200).all() and (pixels[~valid] == 0).all()


def test_a_mask_is_undistorted_with_its_photo(tmp_path):
    photo, mask = np.zeros((HEIGHT, WIDTH, 3), np.uint8), np.full((HEIGHT, WIDTH), 255, np.uint8)
    photo[10:30, 20:50] = 255
    mask[10:30, 20:50] = 0
    save(tmp_path / "a.png", photo)
    save(tmp_path / "m.png", mask)
    (lens,) = lens_views("FOV", PARAMS["FOV"], WIDTH, HEIGHT)
    view = View("a", lens.camera, tmp_path / "a.png", mask=PhotoMask(tmp_path / "m.png"), source=lens.source)
    valid, white = view.valid_pixels(), view.load()[..., 0]
    # The nearest pixel decides: at a corner a quarter of the linear mean may be on its side.
    assert (white[~valid & lens.source.resample_mask(None, lens.camera)] >= 63).all()
    assert (white[valid] <= 192).all() and (white > 200).sum() > 300


def _panorama(rotation: np.ndarray, width: int = 256, height: int = 128) -> np.ndarray:
    """uint8 [H,W,3]: world directions as colors, the camera's axes (OpenGL) turned by `rotation` [3,3]."""
    longitude = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    latitude = (0.5 - (np.arange(height)[:, None] + 0.5) / height) * np.pi
    local = np.stack(
        [
            np.sin(longitude) * np.cos(latitude),
            np.sin(latitude) + 0 * longitude,
            -np.cos(longitude) * np.cos(latitude),
        ],
        axis=2,
    )
    return np.rint(127.5 + 127.5 * (local @ rotation.T)).astype(np.uint8)


@pytest.mark.parametrize("downscale", [1, 2])
def test_faces_of_a_panorama_show_what_their_rays_meet(tmp_path, downscale):
    import json

    frames = []
    for index, pose in enumerate(ring(9)):
        save(tmp_path / f"pano {index}.png", _panorama(pose[:3, :3]))
        frames.append({"file_path": f"pano {index}.png", "transform_matrix": pose.tolist()})
    (tmp_path / "transforms.json").write_text(
        json.dumps({"camera_model": "EQUIRECTANGULAR", "frames": frames})
    )
    with pytest.warns(
        UserWarning, match="9 panoramas are shown as 6 pictures each, front, right, back, left, up"
    ):
        data = load_dataset(tmp_path, downscale=downscale)
    assert [len(data.train), len(data.test)] == [7 * 6, 2 * 6]
    assert {view.name for view in data.test} == {
        f"pano {i}.{face}.png" for i in (0, 8) for face in PANORAMA_FACES
    }
    assert {view.image_path for view in data.test}.isdisjoint(view.image_path for view in data.train)
    for view in (*data.train[:6], *data.test[:6]):
        assert view.camera.model == "pinhole" and view.camera.width == view.camera.height
        _, rays = view.camera.rays()
        expected = (127.5 + 127.5 * rays).reshape(view.camera.height, view.camera.width, 3)
        np.testing.assert_allclose(
            view.load(), expected, atol=1.0 + downscale
        )  # rounding, curvature in a pixel
        assert view.valid_pixels() is None


def test_panoramas_have_colmaps_axes():
    directions = np.random.default_rng(0).normal(size=(50, 3))
    camera = pycolmap.Camera(model=EQUIRECTANGULAR, width=400, height=200, params=[400, 200])
    source = SourceLens(EQUIRECTANGULAR, (), 400, 200)
    np.testing.assert_allclose(
        source.project(directions) * (400, 200), camera.img_from_cam(directions), atol=1e-9
    )


def test_faces_cover_all_directions_once():
    directions = np.random.default_rng(1).normal(size=(500, 3))
    seen = np.zeros(len(directions), int)
    for lens in lens_views(EQUIRECTANGULAR, (), 400, 200):
        camera = lens.camera.with_c2w(lens.pose(np.eye(4)))
        pixels, depth = camera.project(directions)
        with np.errstate(invalid="ignore"):
            seen += (depth > 0) & ((pixels >= 0) & (pixels <= camera.width)).all(axis=1)
    assert (seen == 1).all() and PANORAMA_FACES["front"] == IDENTITY


def test_whole_view_has_the_pixels_of_the_file(tmp_path):
    photo = np.random.default_rng(0).integers(0, 256, (HEIGHT + 1, WIDTH + 1, 3)).astype(np.uint8)
    save(tmp_path / "a.png", photo)
    (lens,) = lens_views("OPENCV", PARAMS["OPENCV"], WIDTH + 1, HEIGHT + 1)
    view = View("a", lens.camera, tmp_path / "a.png")
    whole = view.downscaled(2).downscaled(2).whole()
    assert whole.downscale == 1 and (whole.camera.width, whole.camera.height) == (WIDTH + 1, HEIGHT + 1)
    np.testing.assert_allclose([whole.camera.fx, whole.camera.cy], [view.camera.fx, view.camera.cy])
    np.testing.assert_array_equal(whole.load(), photo)


def test_wrong_parameters_are_named():
    with pytest.raises(DatasetError, match="camera model FOV has 5 parameters, got 3; export it again"):
        lens_views("FOV", (1.0, 2.0, 3.0), 10, 10)
    with pytest.raises(DatasetError, match="COLMAP has no camera model 'PANTHER'; undistort"):
        lens_views("PANTHER", (), 10, 10)
