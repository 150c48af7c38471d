"""transforms.json in its three dialects: tiny captures written here, and the real ones where present."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from cagefield.datasets import load_dataset
from cagefield.errors import DatasetError
from posed_photos import (
    HEIGHT,
    POINT,
    WIDTH,
    assert_spot_is_where_the_camera_says,
    project,
    ring,
    save,
    save_cut_out,
    spot,
)

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
FOCAL, AXIS = (90.0, 94.0), (46.0, 33.5)
K, P = (0.11, -0.06), (0.004, -0.003)
FISHEYE = (0.06, -0.02, 0.004, -0.001)


def _write(path: Path, values: dict) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(values))
    return path


def _ngp(folder: Path, n: int = 9, **changes) -> Path:
    """An Instant-NGP capture with an OPENCV lens, whose file names have no extension."""
    frames = []
    for index, pose in enumerate(ring(n)):
        save(folder / f"images/{index:04}.png", spot(project(pose, POINT, FOCAL, AXIS, K, P)))
        frames.append(
            {
                "file_path": f"./images/{index:04}",
                "sharpness": 30.0 + index,
                "transform_matrix": pose.tolist(),
            }
        )
    values = {
        "camera_angle_x": 0.1, "fl_x": FOCAL[0], "fl_y": FOCAL[1], "cx": AXIS[0], "cy": AXIS[1],
        "k1": K[0], "k2": K[1], "p1": P[0], "p2": P[1],
        "w": float(WIDTH), "h": float(HEIGHT), "aabb_scale": 4, "frames": frames,
    }  # fmt: skip
    return _write(folder / "transforms.json", {**values, **changes})


def _synthetic(folder: Path, splits=(("train", 5), ("test", 3), ("val", 2)), cut_out=True) -> None:
    for split, n in splits:
        frames = []
        for index, pose in enumerate(ring(n)):
            photo = folder / split / f"r_{index}.png"
            if cut_out:
                save_cut_out(photo)
            else:
                save(photo, spot(project(pose, POINT, (80.0, 80.0), (WIDTH / 2, HEIGHT / 2))))
            frames.append({"file_path": f"./{split}/r_{index}", "transform_matrix": pose.tolist()})
        _write(
            folder / f"transforms_{split}.json",
            {"camera_angle_x": 2 * math.atan(0.5 * WIDTH / 80.0), "frames": frames},
        )


def _cut_outs(folder: Path, **changes) -> Path:
    """RGBA photos taken from a ring of radius 10, in one transforms.json."""
    frames = []
    for index, pose in enumerate(ring(8, radius=10.0)):
        save_cut_out(folder / f"{index}.png")
        frames.append({"file_path": f"{index}.png", "transform_matrix": pose.tolist()})
    return _write(folder / "transforms.json", {"fl_x": 80.0, "frames": frames, **changes})


def _nerfstudio(folder: Path, n: int = 6, fisheye: bool = False, **changes) -> Path:
    """A nerfstudio capture with intrinsics in every frame."""
    frames = []
    for index, pose in enumerate(ring(n)):
        focal = (FOCAL[0] + index, FOCAL[1] - index)
        keys, values = (
            (("k1", "k2", "k3", "k4"), FISHEYE) if fisheye else (("k1", "k2", "p1", "p2"), (*K, *P))
        )
        lens = dict(zip(keys, values, strict=True))
        position = project(pose, POINT, focal, AXIS, K, P, FISHEYE if fisheye else None)
        save(folder / f"images/frame_{index:05}.png", spot(position))
        frames.append(
            {
                "file_path": f"images/frame_{index:05}.png",
                "transform_matrix": pose.tolist(),
                "fl_x": focal[0],
                "fl_y": focal[1],
                "cx": AXIS[0],
                "cy": AXIS[1],
                "w": WIDTH,
                "h": HEIGHT,
                "colmap_im_id": index,
                **lens,
            }
        )
    values = {
        "camera_model": "OPENCV_FISHEYE" if fisheye else "OPENCV",
        "frames": frames,
        "applied_transform": [[0, 1, 0, 0.5], [1, 0, 0, 0], [0, 0, -1, 0]],
        "ply_file_path": "sparse_pc.ply",
    }
    header = "ply\nformat ascii 1.0\nelement vertex 1\n"
    header += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    (folder / "sparse_pc.ply").write_text(header + "{} {} {}\n".format(*POINT))
    return _write(folder / "transforms.json", {**values, **changes})


def test_synthetic_splits_focal_length_and_box(tmp_path):
    _synthetic(tmp_path)
    data = load_dataset(tmp_path)
    assert [len(views) for views in (data.train, data.test, data.val)] == [5, 3, 2]
    assert data.train[1].name == "train/r_1" and data.train[1].image_path == tmp_path / "train/r_1.png"
    camera = data.train[1].camera
    assert (camera.width, camera.height, camera.model) == (WIDTH, HEIGHT, "pinhole")
    assert (camera.fx, camera.fy) == pytest.approx((80, 80)) and (camera.cx, camera.cy) == (48, 32)
    np.testing.assert_array_equal(camera.c2w, ring(5)[1])
    assert not data.unbounded and data.white_background
    np.testing.assert_array_equal(data.bounds, [[-1.5] * 3, [1.5] * 3])
    assert data.train[0].load().shape == (HEIGHT, WIDTH, 4)
    np.testing.assert_array_equal(data.source_to_world, np.eye(4))


def test_synthetic_layout_without_alpha_is_a_real_capture(tmp_path):
    _synthetic(tmp_path, cut_out=False)
    data = load_dataset(tmp_path, downscale=2)
    assert data.unbounded and not data.white_background
    for view in (*data.train, *data.test, *data.val):
        assert_spot_is_where_the_camera_says(view)


def test_validation_views_stand_in_for_missing_test_views(tmp_path):
    _synthetic(tmp_path, splits=(("train", 4), ("val", 2)))
    data = load_dataset(tmp_path)
    assert [v.name for v in data.test] == [v.name for v in data.val] == ["val/r_0", "val/r_1"]
    assert len(data.train) == 4


def test_training_file_alone_holds_out_every_eighth(tmp_path):
    _synthetic(tmp_path, splits=(("train", 17),))
    data = load_dataset(tmp_path / "transforms_train.json")
    # by name: r_0 r_1 r_10 r_11 r_12 r_13 r_14 r_15 r_16 r_2 ...
    assert [v.name for v in data.test] == ["train/r_0", "train/r_16", "train/r_9"]
    assert len(data.train) == 14 and data.val == ()
    assert len(load_dataset(tmp_path, holdout=0).test) == 0
    assert len(load_dataset(tmp_path, holdout=2).test) == 9


def test_ngp_lens_axis_and_missing_extension(tmp_path):
    _ngp(tmp_path)
    data = load_dataset(tmp_path)
    assert [v.name for v in data.test] == ["images/0000", "images/0008"] and len(data.train) == 7
    camera = data.train[0].camera
    assert camera.model == "opencv" and camera.distortion[:4] == (*K, *P)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (*FOCAL, *AXIS)
    for view in (*data.train, *data.test):
        assert_spot_is_where_the_camera_says(view)


@pytest.mark.parametrize("factor", [2, 3, 5])
def test_downscaled_photo_and_camera_agree(tmp_path, factor):
    _ngp(tmp_path, n=3)
    data = load_dataset(tmp_path, downscale=factor)
    for view in (*data.train, *data.test):
        assert view.load().shape == (HEIGHT // factor, WIDTH // factor, 3) and view.downscale == factor
        assert_spot_is_where_the_camera_says(view)


def test_ngp_fisheye(tmp_path):
    frames = []
    for index, pose in enumerate(ring(4)):
        save(tmp_path / f"{index}.jpg", spot(project(pose, POINT, FOCAL, AXIS, fisheye=(*FISHEYE[:2], 0, 0))))
        frames.append({"file_path": f"{index}.jpg", "transform_matrix": pose.tolist()})
    lens = {"is_fisheye": True, "k1": FISHEYE[0], "k2": FISHEYE[1]}
    values = {"fl_x": FOCAL[0], "fl_y": FOCAL[1], "cx": AXIS[0], "cy": AXIS[1], **lens, "frames": frames}
    _write(tmp_path / "transforms.json", values)
    for view in load_dataset(tmp_path).train:
        assert view.camera.model == "opencv_fisheye"
        assert_spot_is_where_the_camera_says(view)


@pytest.mark.parametrize(
    ("keys", "fx", "fy"),
    [
        ({"camera_angle_x": math.radians(60)}, WIDTH / 2 / math.tan(math.radians(30)), None),
        (
            {"camera_angle_x": 1.0, "camera_angle_y": 0.8},
            WIDTH / 2 / math.tan(0.5),
            HEIGHT / 2 / math.tan(0.4),
        ),
        ({"x_fov": 60.0}, WIDTH / 2 / math.tan(math.radians(30)), None),
        ({"fl_y": 70.0}, 70.0, 70.0),
        ({"fl_x": 70.0, "camera_angle_x": 1.0}, 70.0, None),
    ],
)
def test_focal_length_in_every_spelling(tmp_path, keys, fx, fy):
    file = _ngp(tmp_path, n=2)
    values = json.loads(file.read_text())
    for key in ("fl_x", "fl_y", "camera_angle_x", "cx", "cy", "w", "h"):
        del values[key]
    _write(file, {**values, **keys})
    camera = load_dataset(tmp_path).train[0].camera
    assert (camera.fx, camera.fy) == pytest.approx((fx, fx if fy is None else fy))
    assert (camera.cx, camera.cy) == (WIDTH / 2, HEIGHT / 2)


def test_aabb_scale_decides_what_is_unbounded(tmp_path):
    assert load_dataset(_ngp(tmp_path, aabb_scale=4)).unbounded
    data = load_dataset(_ngp(tmp_path, aabb_scale=1))
    assert not data.unbounded
    # Instant-NGP maps x to 0.33 x + 0.5 and keeps the unit cube
    np.testing.assert_allclose(data.bounds, [[-0.5 / 0.33] * 3, [0.5 / 0.33] * 3])
    data = load_dataset(_cut_outs(tmp_path / "cut out", aabb_scale=4))
    assert data.unbounded and data.white_background
    data = load_dataset(_ngp(tmp_path, aabb_scale=1, scale=0.5, offset=[0.5, 0.25, 0.0]))
    np.testing.assert_allclose(data.bounds, [[-1, -0.5, 0], [1, 1.5, 2]])


def test_cut_outs_without_aabb_scale_are_bounded_by_the_cube_of_interest(tmp_path):
    data = load_dataset(_cut_outs(tmp_path))
    half = 0.7 * 10 * math.sqrt(1.25)  # all cameras are that far from the point they look at, the origin
    assert not data.unbounded and data.white_background
    np.testing.assert_allclose(data.bounds, [[-half] * 3, [half] * 3], atol=1e-6)


@pytest.mark.parametrize("fisheye", [False, True])
def test_nerfstudio_frames_have_their_own_intrinsics(tmp_path, fisheye):
    _nerfstudio(tmp_path, fisheye=fisheye, cx=1.0, k1=0.5, fl_x=7.0)  # the frames' own win over the file's
    data = load_dataset(tmp_path)
    assert data.unbounded
    assert len({view.camera.fx for view in data.train}) == 5
    for view in (*data.train, *data.test):
        assert view.camera.model == ("opencv_fisheye" if fisheye else "opencv")
        assert_spot_is_where_the_camera_says(view)
    applied = [[0, 1, 0, 0.5], [1, 0, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]
    np.testing.assert_array_equal(data.source_to_world, applied)


def test_nerfstudio_splits(tmp_path):
    names = [f"images/frame_{index:05}.png" for index in range(6)]
    lists = {"train_filenames": names[:3], "val_filenames": names[3:4], "test_filenames": names[4:5]}
    data = load_dataset(_nerfstudio(tmp_path, **lists))
    assert [v.name for v in data.train] == names[:3]  # the sixth is in no list
    assert [v.name for v in data.val] == names[3:4] and [v.name for v in data.test] == names[4:5]
    data = load_dataset(_nerfstudio(tmp_path, test_filenames=["./" + names[0]]))
    assert [v.name for v in data.train] == names[1:] and [v.name for v in data.test] == names[:1]


def test_pinhole_model_without_coefficients(tmp_path):
    file = _nerfstudio(tmp_path, n=2, camera_model="PINHOLE")
    values = json.loads(file.read_text())
    for frame in values["frames"]:
        for key in ("k1", "k2", "p1", "p2"):
            frame[key] = 0.0
    _write(file, values)
    assert load_dataset(tmp_path).train[0].camera.model == "pinhole"


def test_missing_photos_make_one_warning(tmp_path):
    _synthetic(tmp_path)
    (tmp_path / "train/r_3.png").unlink()
    (tmp_path / "test/r_0.png").unlink()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        data = load_dataset(tmp_path)
    assert len(caught) == 1 and caught[0].filename == __file__
    assert "2 of 10 frames are left out, their photos are missing: train/r_3, test/r_0" in str(
        caught[0].message
    )
    assert [len(views) for views in (data.train, data.test, data.val)] == [4, 2, 2]


def test_no_photo_left_is_an_error(tmp_path):
    _ngp(tmp_path)
    for photo in (tmp_path / "images").iterdir():
        photo.unlink()
    with pytest.raises(DatasetError, match="none of the photos of its 9 frames is there; put them where"):
        load_dataset(tmp_path)


def _change(file: Path, change) -> None:
    values = json.loads(file.read_text())
    change(values)
    file.write_text(json.dumps(values))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: v.pop("frames"), r"transforms.json: key 'frames' must be a list with at least one frame"),
        (lambda v: v.update(frames=[]), "key 'frames' must be a list with at least one frame"),
        (lambda v: v["frames"].insert(1, 3), r"frames\[1\] must be an object"),
        (
            lambda v: v["frames"][2].update(file_path="images/" + 300 * "x"),
            r"frames\[2\]: key 'file_path' must name the photo, got 'images/x{72}$",
        ),
        (
            lambda v: v["frames"][1]["transform_matrix"].pop(),
            None,  # three rows are enough
        ),
        (
            lambda v: v["frames"][1].update(transform_matrix=[[1, 0], [0, 1]]),
            r"frames\[1\] \(images/0001\): key 'transform_matrix' must be 4 rows \(or 3\) of 4 numbers",
        ),
        (
            lambda v: v["frames"][0]["transform_matrix"][0].__setitem__(0, 7.0),
            r"frames\[0\] \(images/0000\): transform_matrix is not a rigid motion",
        ),
        (lambda v: v.update(w=1080), r"key 'w' is 1080, but .*0000.png is 96x64; use the photos that"),
        (lambda v: v.update(fl_x="ninety"), "key 'fl_x' must be a finite number, got 'ninety'"),
        (lambda v: v.update(k1=float("inf")), "key 'k1' must be a finite number, got inf"),
        (lambda v: v.update(fl_x=0), "fx must be a positive focal length in pixels, got 0.0"),
        (lambda v: (v.pop("fl_x"), v.pop("fl_y"), v.pop("camera_angle_x")), "no focal length; give fl_x"),
        (
            lambda v: (v.pop("fl_x"), v.pop("fl_y"), v.update(camera_angle_x=60)),
            r"field of view along x is 3437.75 degrees; it must lie between 0 and 180 \(radians in",
        ),
        (
            lambda v: v.update(camera_model="ORTHOPHOTO"),
            "camera_model 'ORTHOPHOTO' cannot be read, only",
        ),
        (lambda v: v.update(ftheta_p0=0.2), "the lens of key 'ftheta_p0' cannot be read; undistort"),
        (lambda v: v.update(aabb_scale=-1), "key 'aabb_scale' must be positive, got -1"),
        (lambda v: v.update(aabb_scale=1, scale=0), "'scale' must be positive"),
        (lambda v: v.update(aabb_scale=1, offset="x"), "'offset' 3 finite numbers"),
        (lambda v: v.update(train_filenames="a"), "key 'train_filenames' must be a list of file names"),
        (lambda v: v.update(train_filenames=["nowhere.png"]), "none of the training views' photos is there"),
        (lambda v: v.update(applied_transform=[1, 2]), "key 'applied_transform' must be 4 rows"),
    ],
)
def test_bad_values_name_file_key_and_cure(tmp_path, change, message):
    file = _ngp(tmp_path, n=3)
    load_dataset(tmp_path)
    _change(file, change)
    if message is None:
        load_dataset(tmp_path)
        return
    with pytest.raises(DatasetError, match=message) as error:
        load_dataset(tmp_path)
    assert str(file) in str(error.value) and "\n" not in str(error.value)


def test_truncated_json(tmp_path):
    file = _ngp(tmp_path, n=3)
    file.write_text(file.read_text()[:400])
    with pytest.raises(
        DatasetError, match=r"transforms.json: not valid JSON at line 1, column \d+ .*copy it again"
    ):
        load_dataset(tmp_path)
    file.write_bytes(b"\xff\x00\x00")
    with pytest.raises(DatasetError, match=r"transforms.json: cannot be read \('utf-8'"):
        load_dataset(tmp_path)
    file.write_text("[1]")
    with pytest.raises(DatasetError, match="must be a JSON object"):
        load_dataset(tmp_path)


def test_wrong_paths(tmp_path):
    with pytest.raises(DatasetError, match="nowhere does not exist; give the folder"):
        load_dataset(tmp_path / "nowhere")
    with pytest.raises(
        DatasetError, match=r"no camera file; looked for transforms.json.*there are no photos either"
    ):
        load_dataset(tmp_path)
    (tmp_path / "notes.txt").write_text("")
    with pytest.raises(DatasetError, match=r"notes.txt is no camera file; give transforms.json"):
        load_dataset(tmp_path / "notes.txt")
    _synthetic(tmp_path, splits=(("test", 2),))
    with pytest.raises(DatasetError, match=r"transforms_train.json is missing"):
        load_dataset(tmp_path / "transforms_test.json")


def test_unreadable_photos(tmp_path):
    _ngp(tmp_path, n=3)
    photo = tmp_path / "images/0001.png"
    whole = photo.read_bytes()
    photo.write_bytes(b"not a picture")
    with pytest.raises(
        DatasetError, match=r"0001.png: not a readable image .*replace the file or remove its frame"
    ):
        load_dataset(tmp_path)
    photo.write_bytes(whole[: len(whole) // 2])
    view = next(v for v in load_dataset(tmp_path).train if v.name == "images/0001")
    with pytest.raises(DatasetError, match=r"0001.png: the image cannot be decoded"):
        view.load()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"downscale": 0}, "downscale must be a whole number from 1 to 96, got 0"),
        ({"downscale": 1.5}, "downscale must be a whole number"),
        ({"downscale": 70}, "factor must be a whole number from 1 to 64"),
        ({"holdout": 1}, "holdout must be 0 .* or a whole number from 2, got 1"),
        ({"holdout": -8}, "holdout must be 0"),
    ],
)
def test_bad_options(tmp_path, options, message):
    _ngp(tmp_path, n=3)
    with pytest.raises(ValueError, match=message):
        load_dataset(tmp_path, **options)


def test_bad_holdout_of_a_capture_with_a_test_split(tmp_path):
    _synthetic(tmp_path)
    with pytest.raises(DatasetError, match=r"holdout must be 0 .* or a whole number from 2, got 1"):
        load_dataset(tmp_path, holdout=1)
    assert len(load_dataset(tmp_path, holdout=2).test) == 3  # the split's own views


@pytest.fixture(scope="module")
def fox():
    if not (DATA / "fox").is_dir():
        pytest.skip("../shared/data/fox is not there")
    with pytest.warns(
        UserWarning, match=r"17 of 67 frames are left out, .* images/0005.jpg, images/0016.jpg"
    ):
        return load_dataset(DATA / "fox")


def test_fox_is_an_unbounded_capture_of_43_and_7_views(fox):
    assert (len(fox.train), len(fox.test), fox.unbounded, fox.white_background) == (43, 7, True, False)
    camera = fox.train[0].camera
    assert (camera.width, camera.height, camera.model) == (270, 480, "opencv")
    assert camera.fx == pytest.approx(1375.52 / 4) and camera.cy == pytest.approx(965.268 / 4)
    assert camera.distortion[:4] == (0.0578421, -0.0805099, -0.000980296, 0.00015575)
    assert fox.train[0].load().shape == (480, 270, 3)
    # the capture's tool centered the world on the point the cameras look at
    np.testing.assert_allclose(fox.bounds.mean(axis=0), 0, atol=0.3)


def test_fox_rays_come_back_to_their_pixels(fox):
    view = fox.train[0]
    camera = view.camera.resized(view.camera.width * view.downscale, view.camera.height * view.downscale)
    rng = np.random.default_rng(0)
    pixels = np.stack([rng.integers(0, camera.width, 500), rng.integers(0, camera.height, 500)], axis=1)
    pixels[:4] = [[0, 0], [1079, 0], [0, 1919], [1079, 1919]]
    small = camera.downscaled(2)
    origins, directions = small.rays(pixels // 2)
    positions, _ = small.project(origins + 5 * directions.astype(np.float64))
    np.testing.assert_allclose(
        positions, pixels // 2 + 0.5, atol=5e-4
    )  # float32 directions, 690 px focal length


def test_chair_is_a_bounded_cut_out_with_its_own_test_views():
    if not (DATA / "chair").is_dir():
        pytest.skip("../shared/data/chair is not there")
    chair = load_dataset(DATA / "chair")
    assert (len(chair.train), len(chair.test), len(chair.val)) == (100, 50, 0)
    assert (chair.unbounded, chair.white_background) == (False, True)
    camera = chair.train[0].camera
    assert (camera.width, camera.height) == (400, 400)
    assert camera.fx == pytest.approx(200 / math.tan(0.5 * 0.6911112070083618))
    # every camera sees the middle of the chair's box in the middle of its photo's opaque pixels, roughly
    for view in chair.test[::10]:
        opaque = np.argwhere(view.load()[..., 3] > 128)[:, ::-1]
        positions, _ = view.camera.project(np.zeros((1, 3)))
        assert np.abs(opaque.mean(axis=0) - positions[0]).max() < 40  # the chair is 200 px across


def test_photos_that_were_all_scaled_down_take_their_intrinsics_with_them(tmp_path):
    _ngp(tmp_path, 4)
    for photo in (tmp_path / "images").iterdir():
        with Image.open(photo) as pixels:
            small = pixels.reduce(2)
        small.save(photo)
    with pytest.warns(
        UserWarning, match="96x64 pixels, all photos have 48x32: the intrinsics are scaled by 0.5"
    ):
        data = load_dataset(tmp_path)
    assert data.train[0].camera.fx == FOCAL[0] / 2 and data.train[0].camera.cx == AXIS[0] / 2
    for view in data.train:
        assert_spot_is_where_the_camera_says(view)
    save(tmp_path / "images/0002.png", np.zeros((HEIGHT, WIDTH, 3), dtype=np.uint8))
    with pytest.raises(
        DatasetError, match=r"images/0000: key 'w' is 96, but .*0000.png is 48x32; use the photos"
    ):
        load_dataset(tmp_path)
