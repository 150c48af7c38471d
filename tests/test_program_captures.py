"""Capture programs' folders, written from their formats' descriptions, read back: poses, lenses, photos."""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import program_folders as write
from cagefield.datasets import Dataset, View, load_dataset
from cagefield.datasets.dataset_loader import has_photos_alone
from cagefield.errors import DatasetError
from program_folders import HEIGHT, WIDTH, Y_UP, Shot, shots

POINTS = np.array([[0.1, -0.2, 0.3], [0.5, 0.4, -0.3], [-0.6, 0.2, 0.1], [0.0, 0.0, 0.0]])


def views_of(dataset: Dataset) -> list[View]:
    return sorted((*dataset.train, *dataset.test), key=lambda view: view.name)


def read(path: Path) -> Dataset:
    """The data set, of which nothing is said."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return load_dataset(path)


def projected(shot: Shot, points: np.ndarray) -> np.ndarray:
    """Pixels [N,2] of world points by OpenCV's formula of Brown's model."""
    w2c = write.world_to_camera(shot.pose)
    x, y, z = w2c[:3, :3] @ points.T + w2c[:3, 3:]
    x, y = x / z, y / z
    s = x * x + y * y
    k, (p1, p2) = shot.radial, shot.tangential
    g = 1 + k[0] * s + k[1] * s**2 + k[2] * s**3 + k[3] * s**4
    u = g * x + 2 * p1 * x * y + p2 * (s + 2 * x * x)
    v = g * y + p1 * (s + 2 * y * y) + 2 * p2 * x * y
    return np.stack([shot.focal[0] * u + shot.center[0], shot.focal[1] * v + shot.center[1]], axis=1)


def assert_read_back(
    dataset: Dataset, found: list[Shot], world: np.ndarray | None = None, up: tuple[float, ...] | None = None
) -> None:
    """Poses to 1e-6, intrinsics, photos and pixels; `world` [4,4] is the program's of the shots'.

    `up` is what the program says is up, in its world.
    """
    motion = dataset.source_to_world @ (np.eye(4) if world is None else world)
    np.testing.assert_allclose(motion[:3, :3] @ motion[:3, :3].T, np.eye(3), atol=1e-9)
    if up is not None:
        np.testing.assert_allclose(dataset.source_to_world[:3, :3] @ up, (0, 0, 1), atol=1e-9)
    views = views_of(dataset)
    assert len(views) == len(found) and dataset.unbounded
    for number, (view, shot) in enumerate(zip(views, found, strict=True)):
        camera = view.camera
        np.testing.assert_allclose(camera.c2w, motion @ shot.pose, atol=1e-6)
        np.testing.assert_allclose((camera.fx, camera.fy), shot.focal, rtol=1e-9)
        np.testing.assert_allclose((camera.cx, camera.cy), shot.center, rtol=1e-9)
        assert (camera.width, camera.height) == shot.size
        moved = POINTS @ motion[:3, :3].T + motion[:3, 3]
        pixels, depth = camera.project(moved)
        assert (depth > 0).all()
        np.testing.assert_allclose(pixels, projected(shot, POINTS), atol=1e-6)
        np.testing.assert_allclose(view.load()[0, 0], (10 + number, 200 - number, 90), atol=3)


# ---- Polycam ----


@pytest.mark.parametrize("corrected", [True, False])
@pytest.mark.parametrize("named", ["", "keyframes", "file"])
def test_polycam(tmp_path, corrected, named):
    found = shots(distorted=False, focal=(41.0, 40.0))
    write.polycam(tmp_path, found, corrected)
    folder = "corrected_cameras" if corrected else "cameras"
    place = {"": tmp_path, "keyframes": tmp_path / "keyframes"}
    file = tmp_path / "keyframes" / folder / "10000.json"
    dataset = read(place.get(named, file))
    assert_read_back(dataset, found, Y_UP, (0, 1, 0))
    assert dataset.path == tmp_path and not has_photos_alone(tmp_path)


def test_polycam_prefers_corrected_cameras_and_names_what_it_leaves(tmp_path):
    found = shots(distorted=False)
    other = [replace(shot, focal=(90.0, 90.0)) for shot in found]
    write.polycam(tmp_path, other, corrected=False)
    write.polycam(tmp_path, found)
    write.save_photo(tmp_path / "keyframes" / "depth" / "10000.png", 0)
    (tmp_path / "raw.glb").write_bytes(b"")
    write.save_photo(tmp_path / "keyframes" / "corrected_images" / "99.jpg", 0)
    (tmp_path / "keyframes" / "corrected_images" / "10037.jpg").unlink()
    with pytest.warns(UserWarning) as said:
        dataset = load_dataset(tmp_path)
    lines = [str(one.message).removeprefix(f"{tmp_path}/keyframes") for one in said]
    assert lines == [
        ": not used: depth (1 files), raw.glb",
        "/corrected_cameras: 1 of 6 frames are left out, their photos are missing: 10037",
        "/corrected_cameras: 1 photos beside those it names have no camera in it and are left out: 99.jpg",
    ]
    assert all(view.camera.fx == 40.0 for view in views_of(dataset)) and len(views_of(dataset)) == 5


# ---- Record3D ----


@pytest.mark.parametrize("each", [False, True])
def test_record3d_sorts_by_number(tmp_path, each):
    found = shots(12, distorted=False, focal=(40.0, 41.0))
    if each:
        found = [replace(shot, focal=(40.0 + n, 42.0 + n)) for n, shot in enumerate(found)]
    write.record3d(tmp_path, found, each)
    for path in (tmp_path, tmp_path / "metadata.json"):
        dataset = read(path)
        order = sorted(range(12), key=lambda n: f"{n}.jpg")  # views are sorted by name
        expected = {f"{n}.jpg": found[n] for n in order}
        motion = dataset.source_to_world @ Y_UP
        for view in views_of(dataset):
            shot = expected[view.name]
            np.testing.assert_allclose(view.camera.c2w, motion @ shot.pose, atol=1e-6)
            np.testing.assert_allclose((view.camera.fx, view.camera.fy), shot.focal)
            np.testing.assert_allclose((view.camera.cx, view.camera.cy), shot.center)
            np.testing.assert_allclose(view.load()[0, 0, 0], 10 + int(view.name[:-4]), atol=3)
        np.testing.assert_allclose(dataset.source_to_world[:3, :3] @ (0, 1, 0), (0, 0, 1), atol=1e-9)


def test_record3d_without_some_photos_and_poses(tmp_path):
    found = shots(distorted=False)
    write.record3d(tmp_path, found)
    (tmp_path / "rgb" / "2.jpg").unlink()
    values = json.loads((tmp_path / "metadata.json").read_text())
    values["poses"][4][:4] = [0, 0, 0, 0]
    (tmp_path / "metadata.json").write_text(json.dumps(values))
    (tmp_path / "depth").mkdir()
    with pytest.warns(UserWarning) as said:
        dataset = load_dataset(tmp_path)
    assert [str(one.message).removeprefix(f"{tmp_path}/metadata.json: ") for one in said] == [
        "not used: depth",
        "1 of 6 photos are left out, they have no finite pose: 4.jpg",
        "1 of 5 frames are left out, their photos are missing: 2.jpg",
    ]
    assert [view.name for view in views_of(dataset)] == ["0.jpg", "1.jpg", "3.jpg", "5.jpg"]


def test_record3d_photos_beyond_its_poses_are_refused(tmp_path):
    write.record3d(tmp_path, shots(distorted=False))
    write.save_photo(tmp_path / "rgb" / "40.jpg", 0)
    with pytest.raises(DatasetError, match=r"metadata\.json: has 6 poses, .*rgb has a photo 40\.jpg"):
        load_dataset(tmp_path)


# ---- Metashape ----


@pytest.mark.parametrize("outer", ["none", "component", "chunk", "both", "twice"])
def test_metashape(tmp_path, outer):
    one, other = write.similarity(), (0.5, write.rotation_y(0.3), np.array([1.0, 2.0, 3.0]))
    transforms = {
        "none": {}, "component": {"component": one}, "chunk": {"chunk": one},
        "both": {"component": one, "chunk": other},
    }  # fmt: skip
    found = shots(focal=(40.5, 40.0))
    write.metashape(tmp_path, found, **transforms.get(outer, {"component": one}))
    if outer == "twice":
        file = tmp_path / "cameras.xml"
        text = file.read_text()
        inner = text[text.index('label="Component 1">') + 20 : text.index("</component>")]
        file.write_text(text.replace("</cameras>", f"</cameras>{inner}"))
    for path in (tmp_path, tmp_path / "cameras.xml"):
        dataset = read(path)
        assert_read_back(dataset, found)
        assert views_of(dataset)[0].camera.distortion == (0.05, -0.02, 0.002, -0.003, 0.004, 0.001)


def test_metashape_names_cameras_without_a_place(tmp_path):
    found = shots(8)
    write.metashape(
        tmp_path,
        found[:6],
        extra='<group id="0" label="g"><camera id="6" sensor_id="0" label="IMG_0006"/>'
        '<camera id="7" sensor_id="0" enabled="0" label="IMG_0007">'
        "<transform>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</transform></camera></group>",
    )
    write.save_photos(tmp_path / "images", found)
    with pytest.warns(UserWarning) as said:
        dataset = load_dataset(tmp_path)
    assert [str(one.message).removeprefix(f"{tmp_path}/cameras.xml: ") for one in said] == [
        "1 of 8 photos are left out, they are not aligned: IMG_0006",
        "1 of 8 photos are left out, they are disabled: IMG_0007",
    ]
    assert_read_back(dataset, found[:6])


def test_metashape_fisheye(tmp_path):
    found = shots(radial=(0.02, -0.004, 0.001, 0.0), tangential=(0.0, 0.0))
    write.metashape(tmp_path, found, kind="fisheye")
    camera = views_of(read(tmp_path))[0].camera
    assert camera.model == "opencv_fisheye" and camera.distortion == (0.02, -0.004, 0.001, 0.0)


def test_a_fisheye_with_tangential_distortion_is_undistorted(tmp_path):
    """The photo of a bright dot, rendered by Metashape's formula, has it where the camera says."""
    found = [replace(s, size=(192, 128), focal=(110.0, 110.0), center=(99.0, 62.0)) for s in shots(4)]
    write.metashape(tmp_path, found, kind="fisheye")
    from posed_photos import assert_spot_is_where_the_camera_says, save, spot

    point = np.array([0.25, -0.15, 0.2])
    for shot in found:
        w2c = write.world_to_camera(shot.pose)
        x, y, z = w2c[:3, :3] @ point + w2c[:3, 3]
        r = math.hypot(x, y)
        x, y = x / r * math.atan2(r, z), y / r * math.atan2(r, z)
        s, (k1, k2, k3, k4), (p2, p1) = x * x + y * y, shot.radial, shot.tangential
        g = 1 + k1 * s + k2 * s**2 + k3 * s**3 + k4 * s**4
        u = g * x + p1 * (s + 2 * x * x) + 2 * p2 * x * y
        v = g * y + p2 * (s + 2 * y * y) + 2 * p1 * x * y
        place = (110 * u + 99, 110 * v + 62)
        save(tmp_path / "images" / shot.name, spot(place, 192, 128))
    with pytest.warns(
        UserWarning, match="4 photos of camera model THIN_PRISM_FISHEYE are undistorted at load"
    ):
        dataset = load_dataset(tmp_path)
    for view in views_of(dataset):
        moved = dataset.source_to_world[:3, :3] @ point + dataset.source_to_world[:3, 3]
        assert_spot_is_where_the_camera_says(view, moved)


def test_metashape_skew_is_named_in_pixels(tmp_path):
    write.metashape(tmp_path, shots(), b2=0.5)
    # y at the border is 16 / 40, times b2
    with pytest.warns(
        UserWarning, match=r"sensor 0: the skew b2 of its lens, up to 0\.2 pixels, is not used$"
    ):
        load_dataset(tmp_path)


def test_metashape_panoramas_become_six_views(tmp_path):
    found = [replace(shot, size=(64, 32)) for shot in shots(4, distorted=False)]
    write.metashape(tmp_path, found, kind="spherical")
    with pytest.warns(UserWarning, match="4 panoramas are shown as 6 pictures each"):
        dataset = load_dataset(tmp_path)
    views = views_of(dataset)
    assert len(views) == 24
    front = next(view for view in views if view.name == "IMG_0000.front")
    np.testing.assert_allclose(front.camera.c2w, dataset.source_to_world @ found[0].pose, atol=1e-6)


def test_geographic_coordinates_are_moved_to_the_origin(tmp_path):
    far = np.array([4_100_000.0, 600_000.0, 4_800_000.0])
    found = shots()
    moved = [replace(shot, pose=shot.pose + np.pad(far[:, None], ((0, 1), (3, 0)))) for shot in found]
    write.metashape(tmp_path, moved, component=(1.0, write.rotation_z(0.3), far))
    with pytest.warns(UserWarning, match="far from the origin"):
        dataset = load_dataset(tmp_path)
    np.testing.assert_allclose(dataset.source_to_world[:3, 3], -np.array(dataset.offset), atol=1e-6)
    for view, shot in zip(views_of(dataset), moved, strict=True):
        np.testing.assert_allclose(view.camera.c2w, dataset.source_to_world @ shot.pose, atol=1e-6)
        assert np.linalg.norm(view.camera.origin) < 20


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<document", "<!DOCTYPE d [<!ENTITY a 'b'>]><document", r"has a document type"),
        ("</chunk></document>", "", r"not valid XML"),
        ('sensor_id="0"', 'sensor_id="5"', r"camera IMG_0000: there is no sensor '5'"),
        ("<f>40.0</f>", "<f>-40.0</f>", r"sensor 0: f[xy] must be a positive focal length"),
        ("<f>40.0</f>", "<f>nan</f>", r"sensor 0: f must be a finite number"),
        ("<document", "<document><chunk/></document><document", r"not valid XML"),
    ],
)
def test_damaged_metashape_files(tmp_path, old, new, message):
    write.metashape(tmp_path, shots())
    file = tmp_path / "cameras.xml"
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new))
    with pytest.raises(DatasetError, match=rf"cameras\.xml: .*{message}") as caught:
        load_dataset(file)
    assert "\n" not in str(caught.value)


# ---- RealityCapture ----


@pytest.mark.parametrize(
    "header",
    ["", "#name,x,y,alt,yaw,pitch,roll,f_35mm,px_norm,py_norm,k1,k2,k3,k4,t1,t2"],
    ids=["old", "new"],
)
@pytest.mark.parametrize("size", [(48, 32), (32, 48)])
def test_reality_capture(tmp_path, header, size):
    found = shots(size=size, center=(size[0] / 2 + 1.0, size[1] / 2 - 0.5))
    write.reality_capture(tmp_path, found, header, comment=not header)
    for path in (tmp_path, tmp_path / "cameras.csv"):
        assert_read_back(read(path), found, up=(0, 0, 1))


def test_reality_capture_looks_north_and_level():
    """Heading 0 and pitch 90: an aircraft's camera that looks down at pitch 0 looks ahead, to the north."""
    pose = np.eye(4)
    pose[:3, :3] = write.rotation_x(math.radians(90))
    np.testing.assert_allclose(-pose[:3, 2], (0, 1, 0), atol=1e-12)
    np.testing.assert_allclose(write.heading_pitch_roll(pose[:3, :3])[1], 90)


def test_the_opencv_csv_of_reality_scan(tmp_path):
    found = shots()
    write.opencv_csv(tmp_path, found)
    assert_read_back(read(tmp_path), found, up=(0, 0, 1))


def test_reality_capture_xmp_files(tmp_path):
    found = shots()
    write.xmp(tmp_path, found)
    (tmp_path / "_common.xmp").write_text("<a/>")
    for path in (tmp_path, tmp_path / "IMG_0000.xmp"):
        assert_read_back(read(path), found, up=(0, 0, 1))
    assert not has_photos_alone(tmp_path)


def test_xmp_files_without_a_pose_are_named(tmp_path):
    found = shots()
    write.xmp(tmp_path, found)
    file = tmp_path / "IMG_0000.xmp"
    text = file.read_text()
    file.write_text(text[: text.index("<xcr:Rotation>")] + text[text.index("<xcr:Position>") :])
    with pytest.warns(
        UserWarning, match="1 of 6 photos are left out, they have no pose in their XMP files: IMG_0000"
    ):
        dataset = load_dataset(tmp_path)
    assert [view.name for view in views_of(dataset)] == [f"IMG_{n:04}" for n in range(1, 6)]


def test_the_division_model_is_fitted(tmp_path):
    k1 = 0.09
    found = shots(distorted=False)
    write.xmp(tmp_path, found, "division", f"{k1} 0 0 0 0 0")
    camera = views_of(read(tmp_path))[0].camera
    x = np.array([0.1, 0.3, 0.5])  # of half the width over the focal length, 0.6
    points = np.stack([x, np.zeros(3), -np.ones(3)], axis=1) @ camera.c2w[:3, :3].T + camera.origin
    pixels, _ = camera.project(points)
    np.testing.assert_allclose(pixels[:, 0], 40 * x / (1 + k1 * x**2) + 25.0, atol=0.01)


def test_a_division_model_that_is_too_strong_is_refused(tmp_path):
    write.xmp(tmp_path, shots(distorted=False, focal=(15.0, 15.0)), "division", "0.19 0 0 0 0 0")
    with pytest.raises(
        DatasetError, match=r"IMG_0000\.xmp: its division model \(k1 = 0\.19\) cannot be read"
    ):
        load_dataset(tmp_path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text[: len(text) - 40], r"line 7 has \d+ values of 16; it may be cut off"),
        (lambda text: text.replace("pitch", "tilt"), r"no columns name, x, y, alt, heading"),
        (
            lambda text: text.replace(",28.7", ",abc", 1).replace(",30.0", ",abc"),
            r"line \d: column 'f' must be",
        ),
    ],
)
def test_damaged_csv_files(tmp_path, change, message):
    write.reality_capture(tmp_path, shots())
    file = tmp_path / "cameras.csv"
    file.write_text(change(file.read_text()))
    with pytest.raises(DatasetError, match=message):
        load_dataset(file)


# ---- Meshroom ----


@pytest.mark.parametrize("version", [(1, 0, 0), (1, 2, 0), (1, 2, 1), (1, 2, 4), (1, 2, 6), (1, 2, 8)])
def test_meshroom(tmp_path, version):
    focal = (40.0, 40.0) if version < (1, 2, 0) else (40.0, 42.0)
    found = shots(focal=focal, radial=(0.05, -0.02, 0.004, 0.0))
    write.meshroom(tmp_path, found, version)
    for path in (tmp_path, tmp_path / "cameras.sfm"):
        with pytest.warns(UserWarning, match=r"6 of 6 photos are not where it says"):
            dataset = load_dataset(path)
        assert_read_back(dataset, found)


@pytest.mark.parametrize(
    ("kind", "params", "distortion"),
    [
        ("pinhole", (), ()),
        ("radial1", (0.05,), (0.05, 0, 0, 0, 0, 0)),
        ("radial3", (0.05, -0.02, 0.01), (0.05, -0.02, 0, 0, 0.01, 0)),
        ("radial3", (0.0, 0.0, 0.0), ()),
        ("fisheye4", (0.05, -0.02, 0.01, 0.002), (0.05, -0.02, 0.01, 0.002)),
    ],
)
def test_meshroom_lenses(tmp_path, kind, params, distortion):
    write.meshroom(tmp_path, shots(), (1, 2, 6), kind, params, name="sfm.json")
    with pytest.warns(UserWarning, match="not where it says"):
        dataset = load_dataset(tmp_path)
    assert views_of(dataset)[0].camera.distortion == distortion


def test_meshroom_views_without_a_pose_and_points(tmp_path):
    found = shots(radial=(0.05, -0.02, 0.004, 0.0))
    points = [(POINTS[0], (0, 1)), (POINTS[1], (1, 2, 5)), (np.full(3, np.nan), (1,))]
    write.meshroom(tmp_path, found, points=points, name="sfm.json")
    file = tmp_path / "sfm.json"
    values = json.loads(file.read_text())
    del values["poses"][5]
    file.write_text(json.dumps(values))
    with pytest.warns(UserWarning) as said:
        dataset = load_dataset(file)
    lines = [str(one.message).removeprefix(f"{file}: ") for one in said]
    assert lines[:2] == [
        "1 of 3 points are left out, they are not finite",
        "1 of 6 photos are left out, they have no pose: /home/someone/project/images/IMG_0005.png",
    ]
    assert dataset.points is not None and len(dataset.points) == 2
    motion = dataset.source_to_world
    np.testing.assert_allclose(
        dataset.points.positions, POINTS[:2] @ motion[:3, :3].T + motion[:3, 3], atol=1e-9
    )
    names = [view.name for view in views_of(dataset)]
    assert dataset.points.seen_by == (frozenset(names[0:2]), frozenset(names[1:3]))
    np.testing.assert_array_equal(dataset.points.rgb, [[10, 20, 30]] * 2)


def test_meshroom_lenses_that_are_not_known(tmp_path):
    write.meshroom(tmp_path, shots(), kind="3deanamorphic4", params=[0.1] * 14)
    with pytest.raises(
        DatasetError, match=r"intrinsic 77: camera type '3deanamorphic4' with 14 distortionParams"
    ):
        load_dataset(tmp_path)


# ---- what all share ----

WRITERS = {
    "polycam": write.polycam, "record3d": write.record3d, "metashape": write.metashape,
    "reality_capture": write.reality_capture, "meshroom": write.meshroom, "xmp": write.xmp,
}  # fmt: skip


@pytest.mark.parametrize("program", WRITERS)
def test_photos_that_were_shrunk_since(tmp_path, program):
    found = shots(distorted=False)
    WRITERS[program](tmp_path, found)
    photos = [path for path in tmp_path.rglob("*") if path.suffix in (".png", ".jpg")]
    for number, photo in enumerate(sorted(photos)):
        write.save_photo(photo, number, (WIDTH // 2, HEIGHT // 2))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        dataset = load_dataset(tmp_path)
    by_size = program in ("reality_capture", "xmp")  # whose intrinsics are of any size
    expected = "6 photos are of 48x32 pixels, the photos have 24x16: the intrinsics are scaled by 0.5"
    assert any(expected in str(one.message) for one in said) is not by_size
    camera = views_of(dataset)[0].camera
    np.testing.assert_allclose((camera.fx, camera.cx, camera.cy), (20.0, 12.5, 7.75))


@pytest.mark.parametrize("program", ["polycam", "metashape", "meshroom"])
def test_photos_that_were_turned_since_are_refused(tmp_path, program):
    WRITERS[program](tmp_path, shots(distorted=False))
    photo = next(path for path in sorted(tmp_path.rglob("*")) if path.suffix in (".png", ".jpg"))
    write.save_photo(photo, 0, (HEIGHT, WIDTH))
    with pytest.raises(DatasetError, match=r"is 32x48, the intrinsics are of 48x32; .*not turned since"):
        load_dataset(tmp_path)


@pytest.mark.parametrize("program", WRITERS)
def test_every_photo_missing_is_one_error(tmp_path, program):
    WRITERS[program](tmp_path, shots(distorted=False))
    file = {"xmp": tmp_path / "IMG_0000.xmp"}.get(program, tmp_path)
    for photo in [path for path in tmp_path.rglob("*") if path.suffix in (".png", ".jpg")]:
        photo.unlink()
    with pytest.raises(DatasetError) as caught:
        load_dataset(file)
    assert "\n" not in str(caught.value) and "photo" in str(caught.value)


@pytest.mark.parametrize("program", ["metashape", "reality_capture", "meshroom"])
def test_masks_beside_the_photos_are_found(tmp_path, program):
    WRITERS[program](tmp_path, shots(distorted=False))
    mask = np.full((HEIGHT, WIDTH), 255, np.uint8)
    mask[:10] = 0
    (tmp_path / "masks").mkdir()
    for number in range(6):
        Image.fromarray(mask).save(tmp_path / "masks" / f"IMG_{number:04}.png")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        dataset = load_dataset(tmp_path)
    for view in views_of(dataset):
        np.testing.assert_array_equal(view.valid_pixels(), mask > 0)
