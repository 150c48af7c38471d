"""COLMAP's text models as other programs write them: the same views as of the plain model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.camera import Camera
from cagefield.datasets import Dataset, load_dataset
from cagefield.errors import DatasetError
from posed_photos import ring, save

N, WIDTH, HEIGHT = 9, 24, 16
LENS = "OPENCV 24 16 30 31 12.5 8.25 0.04 -0.02 0.001 0.002"


def _write(
    folder: Path,
    *,
    name=lambda i: f"{i:02}.png",
    photo=None,
    images="images",
    points: str | None = "full",
    second: str = "full",
    ending: str = "\n",
    mark: bool = False,
    cameras: tuple[str, ...] = (f"1 {LENS}",),
    where: str = "sparse/0",
    extra: tuple[str, ...] = (),
) -> Path:
    from scipy.spatial.transform import Rotation

    model = folder / where
    model.mkdir(parents=True, exist_ok=True)
    lines = ["# Image list", f"# Number of images: {N}, mean observations per image: 2"]
    for i, pose in enumerate(ring(N)):
        save(
            folder / images / (photo or name)(i).replace("\\", "/"),
            np.full((HEIGHT, WIDTH, 3), 20 * i, np.uint8),
        )
        axes = (pose[:3, :3] * (1, -1, -1)).T
        x, y, z, w = Rotation.from_matrix(axes).as_quat()
        values = (w, x, y, z, *(-axes @ pose[:3, 3]))
        lines.append(" ".join([str(i + 1), *(repr(float(v)) for v in values), "1", name(i)]))
        if second == "full":
            lines.append(f"3.5 4.5 1 7.25 8 {-1 if i else 2}")
        elif second == "empty" or (second == "some" and i % 2):
            lines.append("")
    texts = {"cameras": ["# Cameras", *cameras, *extra], "images": lines}
    if points is not None:
        texts["points3D"] = ["# Points"]
        if points == "full":
            texts["points3D"] += [
                f"{k + 1} {0.1 * k} 0.2 {-0.05 * k} {k} 20 30 0.5 " + " ".join(f"{i + 1} 0" for i in range(N))
                for k in range(20)
            ]
    for stem, rows in texts.items():
        content = ("\ufeff" if mark else "") + ending.join(rows) + ending
        (model / f"{stem}.txt").write_bytes(content.encode())
    return folder


def _assert_right(data: Dataset, points: bool = True) -> None:
    views = sorted((*data.train, *data.test), key=lambda view: view.load()[0, 0, 0])
    assert len(data.test) == 2 and len(views) == N
    for i, (view, pose) in enumerate(zip(views, ring(N), strict=True)):
        assert (view.load() == 20 * i).all()
        world = np.linalg.inv(data.source_to_world) @ view.camera.c2w
        np.testing.assert_allclose(world, pose, atol=1e-12)
        expected = Camera(pose, WIDTH, HEIGHT, 30, 31, 12.5, 8.25, "opencv", (0.04, -0.02, 0.001, 0.002))
        assert view.camera.with_c2w(pose) == expected
    if not points:
        assert data.points is None
        return
    back = data.points.positions @ data.source_to_world[:3, :3]
    np.testing.assert_allclose(back, [(0.1 * k, 0.2, -0.05 * k) for k in range(20)], atol=1e-12)
    assert data.points.rgb[7].tolist() == [7, 20, 30] and data.points.errors[3] == 0.5
    assert data.points.seen_by[0] == {view.name for view in views}


def test_plain(tmp_path):
    _assert_right(load_dataset(_write(tmp_path)))


@pytest.mark.parametrize(
    "changes",
    [
        {"name": lambda i: f"A-DJI wp-2 ({i + 1}).png"},
        {"name": lambda i: f" two  spaces {i} .png".strip()},
        {"name": lambda i: f"фото_é_{i}.png"},
        {"name": lambda i: f"cam{i % 2}\\{i}.png"},
        {"name": lambda i: f"{i:04}", "photo": lambda i: f"{i:04}.png"},
        {"photo": lambda i: f"{i:02}.PNG"},
        {"name": lambda i: f"{i:02}.JPG"[:2] + ".JPG", "photo": lambda i: f"{i:02}.png"},
        {"name": lambda i: f"/mnt/data/capture/images/{i:02}.png", "photo": lambda i: f"{i:02}.png"},
        {"ending": "\r\n"},
        {"mark": True},
        {"second": "none"},
        {"second": "empty"},
        {"second": "some"},
        {"images": "input"},
        {"images": "photos"},
        {"images": "rgb"},
        {"images": "color"},
        {"images": "image"},
        {"images": "."},
        {"images": "sparse/0"},
        {"where": ".", "images": "."},
        {"where": "colmap"},
        {"extra": ("77 FULL_OPENCV 640 480 500 500 320 240 0 0 0 0 0 0 0 0",)},
        {"extra": ("78 NEWEST 640 480 500",)},
    ],
    ids=lambda changes: "-".join(changes),
)
@pytest.mark.filterwarnings("ignore:.*not where it says")
def test_variants_are_read_alike(tmp_path, changes):
    _assert_right(load_dataset(_write(tmp_path, **changes)))


@pytest.mark.parametrize("points", [None, "empty"])
@pytest.mark.parametrize("second", ["full", "none"])
def test_models_without_points(tmp_path, points, second):
    _assert_right(load_dataset(_write(tmp_path, points=points, second=second)), points=False)


def test_photos_in_the_shrunk_folder_alone(tmp_path):
    _write(tmp_path, cameras=("1 PINHOLE 48 32 60 62 25 16.5",), images="images_2")
    data = load_dataset(tmp_path)
    camera = data.train[0].camera
    assert len(data.train) == 7 and (camera.width, camera.fx, camera.cy) == (WIDTH, 30, 8.25)


def test_hidden_files_beside_the_photos(tmp_path):
    _write(tmp_path)
    for i in range(N):
        (tmp_path / f"images/._{i:02}.png").write_bytes(b"Mac OS X")
    (tmp_path / "images/.DS_Store").write_bytes(b"x")
    (tmp_path / "images/Thumbs.db").write_bytes(b"x")
    _assert_right(load_dataset(tmp_path))


def test_photos_without_finite_pose_are_left_out_and_named(tmp_path):
    _write(tmp_path)
    file = tmp_path / "sparse/0/images.txt"
    rows = file.read_text().splitlines()
    rows[2] = "1 nan 0 0 0 0 0 0 1 00.png"
    rows[4] = "2 1 0 0 0 inf 0 0 1 01.png"
    rows[6] = "3 0 0 0 0 0 0 0 1 02.png"
    file.write_text("\n".join(rows))
    with pytest.warns(
        UserWarning, match="3 of 9 frames are left out, they have no finite pose: 00.png, 01.png, 02"
    ):
        data = load_dataset(tmp_path)
    assert len(data.train) + len(data.test) == N - 3


def test_a_list_that_is_cut_off_is_said(tmp_path):
    _write(tmp_path)
    file = tmp_path / "sparse/0/images.txt"
    file.write_text("\n".join(file.read_text().splitlines()[:-4]) + "\n")
    with pytest.warns(UserWarning, match="images.txt: it says 9 images and has 7; where it is cut off"):
        assert len(load_dataset(tmp_path).train) == 6


@pytest.mark.parametrize(
    ("file", "row", "message"),
    [
        (
            "cameras",
            "1 PINHOLE 24",
            r"cameras.txt, line 1: must be CAMERA_ID MODEL .*got '1 PINHOLE 24'; export",
        ),
        ("cameras", "1 PINHOLE 24 16 30 x 12 8", "cameras.txt, line 1: must have a number at place 6"),
        ("cameras", "1 PINHOLE 2.5 16 30 30 12 8", "line 1: must have a whole number at place 3"),
        ("cameras", "1 PINHOLE 24 16 30 30 12", "camera 1: camera model PINHOLE has 4 parameters, got 3"),
        ("cameras", "1 PANTHER 24 16 30 30 12", "camera 1: COLMAP has no camera model 'PANTHER'"),
        ("cameras", "1 FOV 24 16 30 nan 12 8 0.5", "camera 1: "),
        ("images", "1 1 0 0 0 0 0 0 5 a.png", "image a.png has the camera 5, which cameras.txt lacks"),
        ("images", "1 1 0 0 0 0 0 0 1", "images.txt, line 1: must be IMAGE_ID QW"),
        ("points3D", "1 0 0 zero 1 2 3 0.5", "points3D.txt, line 1: must have a number at place 4"),
    ],
)
def test_damaged_rows_are_named(tmp_path, file, row, message):
    _write(tmp_path)
    (tmp_path / f"sparse/0/{file}.txt").write_text(row + "\n")
    with pytest.raises(DatasetError, match=message) as error:
        load_dataset(tmp_path)
    assert "\n" not in str(error.value)


def test_binary_models_without_points_and_with_unused_cameras(tmp_path):
    pycolmap = pytest.importorskip("pycolmap", reason="binary models are read by pycolmap")
    unused = ("77 FULL_OPENCV 640 480 500 500 320 240 0 0 0 0 0 0 0 0",)
    _write(tmp_path, second="empty", points="empty", extra=unused)
    pycolmap.Reconstruction(tmp_path / "sparse/0").write_binary(tmp_path / "sparse/0")
    for text in (tmp_path / "sparse/0").glob("*.txt"):
        text.unlink()
    (tmp_path / "sparse/0/points3D.bin").unlink()
    _assert_right(load_dataset(tmp_path), points=False)
