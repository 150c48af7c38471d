"""Poses of photos alone: structure from motion of rendered photos whose cameras are known, and of videos."""

from __future__ import annotations

import json
import shutil
import signal
import threading
import time

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

from cagefield.cameras.camera import Camera
from cagefield.cli import main
from cagefield.cli import poses as poses_command
from cagefield.datasets import load_dataset
from cagefield.datasets.dataset_loader import has_photos_alone
from cagefield.datasets.raw_photos import (
    RawPhoto,
    extract_video_frames,
    find_raw_photos,
    sharpest_frames,
    sharpness,
    write_upright,
)
from cagefield.datasets.sfm import (
    features,
    pose_verification,
    registration_report,
    sfm_workspace,
    structure_from_motion,
)
from cagefield.datasets.sfm.ambiguity_check import Fold
from cagefield.datasets.sfm.pose_verification import Verification
from cagefield.datasets.sfm.sfm_workspace import work_folder
from cagefield.datasets.sfm.structure_from_motion import PosesReport, is_built_from, make_poses
from cagefield.errors import DatasetError
from commands import refused
from posed_photos import distance_to_textures, photo_of_textures, ring, save

pytest.importorskip("pycolmap", reason="poses are found by pycolmap")

N, WIDTH, HEIGHT = 9, 400, 300
TURNED, GREY, BROKEN = "03 turned.jpg", "zz/no texture.png", "zz/later.heic"


def _camera(index: int) -> Camera:
    pose = ring(N, radius=3.2, sweep=1.5)[index]
    return Camera(pose, WIDTH, HEIGHT, 1.1 * WIDTH, 1.1 * WIDTH, WIDTH / 2, HEIGHT / 2)


def _name(index: int) -> str:
    return TURNED if index == 3 else f"{index:02}.png"


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    """Nine photos, one lying on its side with an EXIF orientation, and two that no pose can be found of."""
    folder = tmp_path_factory.mktemp("photos")
    for index in range(N):
        picture = Image.fromarray(photo_of_textures(_camera(index)))
        if index == 3:
            exif = Image.Exif()
            exif[0x0112] = 6  # to be shown after a quarter turn clockwise
            picture.transpose(Image.Transpose.ROTATE_90).save(
                folder / TURNED, quality=98, subsampling=0, exif=exif
            )
        else:
            picture.save(folder / _name(index))
    save(folder / GREY, np.full((HEIGHT, WIDTH, 3), 120, np.uint8))
    (folder / BROKEN).write_bytes(b"\0\0\0\x18ftypheic")
    return folder


@pytest.fixture(scope="module")
def made(photos, tmp_path_factory):
    """(data set, report, shares and notes of the progress)."""
    target = tmp_path_factory.mktemp("made") / "data"
    seen = []
    report = make_poses(photos, target, on_progress=lambda done, note: seen.append((done, note)))
    return target, report, seen


def _fit(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """`source` [N,3] moved by the similarity that brings it closest to `target` (Umeyama)."""
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    left, values, right = np.linalg.svd(b.T @ a)
    signs = np.array([1.0, 1.0, np.linalg.det(left @ right)])
    return (values * signs).sum() / (a**2).sum() * a @ (left @ np.diag(signs) @ right).T + target.mean(axis=0)


def test_cameras_stand_where_the_photos_were_taken(made):
    target, report, _ = made
    data = load_dataset(target, holdout=0)
    assert report.placed == N and report.total == N + 2 and report.error < 1.0
    assert len(data.train) == N
    index = {_name(i) + (".jpg" if i == 3 else ""): i for i in range(N)}
    order = [index[view.name] for view in data.train]
    found = np.stack([view.camera.origin for view in data.train])
    truth = np.stack([_camera(i).origin for i in order])
    # half a pixel of 440 focal pixels is 0.004 at a distance of 3.6
    assert np.linalg.norm(_fit(found, truth) - truth, axis=1).max() < 0.05
    assert np.median([view.camera.fx for view in data.train]) == pytest.approx(1.1 * WIDTH, rel=0.03)


def test_points_are_part_of_the_data_set_and_on_the_surfaces(made):
    target, report, _ = made
    data = load_dataset(target, holdout=0)
    assert len(data.points) == report.points > 200
    order = [int(view.name[:2]) for view in data.train]
    found = np.stack([view.camera.origin for view in data.train])
    truth = np.stack([_camera(i).origin for i in order])
    everything = np.concatenate([found, data.points.positions])
    a = found - found.mean(axis=0)
    b = truth - truth.mean(axis=0)
    left, _, right = np.linalg.svd(b.T @ a)
    rotation = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    scale = np.linalg.norm(b) / np.linalg.norm(a)
    moved = scale * (everything - found.mean(axis=0)) @ rotation.T + truth.mean(axis=0)
    assert np.median(distance_to_textures(moved[len(found) :])) < 0.04


def test_a_photo_lying_on_its_side_is_turned_upright(photos, made):
    target, _, _ = made
    view = next(v for v in load_dataset(target, holdout=0).train if v.name.startswith("03"))
    expected = photo_of_textures(_camera(3)).astype(float)
    assert view.load().shape == expected.shape
    assert np.abs(view.load() - expected).mean() < 4  # JPEG, twice
    assert (target / "images" / "00.png").read_bytes() == (photos / "00.png").read_bytes()  # not written anew


def test_photos_left_out_are_named_with_what_was_wrong(made):
    target, report, _ = made
    assert set(report.left_out) == {GREY, BROKEN}
    assert report.left_out[GREY].startswith("blurred (0% of the sharpness")
    assert report.left_out[BROKEN] == "cannot be read as a photo; convert it to JPEG"
    kept = json.loads((target / "poses.json").read_text())
    assert kept["placed"] == N and kept["left_out"] == report.left_out
    assert not (target / "images" / GREY).exists()


def test_progress_grows_to_one_and_the_work_folder_goes(made):
    target, _, seen = made
    shares = [done for done, _ in seen]
    assert shares == sorted(shares) and shares[-1] == 1.0
    notes = " ".join(note for _, note in seen)
    assert "photos read" in notes and "features of" in notes and "matches of" in notes and "placed" in notes
    assert not work_folder(target).exists()


class _StopError(Exception):
    pass


@pytest.mark.nightly
def test_an_interrupted_run_goes_on(photos, tmp_path, monkeypatch, capfd):
    source = tmp_path / "photos"
    source.mkdir()
    for index in (0, 1, 2, 4):
        shutil.copy(photos / _name(index), source)
    target = tmp_path / "data"

    def stop(done, note):
        if "matches of" in note:
            raise _StopError

    with pytest.raises(_StopError):
        make_poses(source, target, on_progress=stop)
    assert work_folder(target).is_dir() and not target.exists()
    notes = []
    monkeypatch.setattr(sfm_workspace, "write_upright", None)  # no photo is read again
    report = make_poses(source, target, on_progress=lambda done, note: notes.append(note))
    assert report.placed == 4 and not any("read" in note for note in notes)
    assert capfd.readouterr() == ("", "")  # COLMAP's log stays silent
    assert is_built_from(target, source)
    (source / "00.png").touch()
    assert not is_built_from(target, source)


def test_ctrl_c_ends_a_call_of_pycolmap_s_and_waits_for_its_end():
    order = []

    def endless(cancellation_token):
        while not cancellation_token.is_cancelled:
            time.sleep(0.01)
        time.sleep(0.3)
        order.append("ended")

    # A process that was started in the background ignores Ctrl-C unless it is told otherwise.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        threading.Timer(0.5, signal.raise_signal, [signal.SIGINT]).start()
        with pytest.raises(KeyboardInterrupt):
            features.call_cancellable(endless)
    finally:
        signal.signal(signal.SIGINT, before)
    assert order == ["ended"]
    assert features.import_pycolmap().logging.minloglevel == 0


def test_a_failure_of_colmap_s_is_one_line(tmp_path):
    def fails(cancellation_token):
        raise RuntimeError("[file.cc:12] Check failed:\n  a == b")

    with pytest.raises(DatasetError, match=r"COLMAP stopped at fails: \[file.cc:12\] Check failed: a == b"):
        features.call_cancellable(fails)


def test_the_work_of_other_photos_is_not_used(photos, tmp_path):
    target = tmp_path / "data"
    work = work_folder(target)
    work.mkdir()
    (work / "made_of.json").write_text("{}")
    (work / "database.db").write_text("of others")
    save(tmp_path / "few/a.png", np.zeros((40, 40, 3), np.uint8))
    with pytest.raises(DatasetError, match="1 photos can be read, at least 3 are needed"):
        make_poses(tmp_path / "few", target)
    assert not (work / "database.db").exists()
    shutil.rmtree(work)
    (work / "mine").mkdir(parents=True)
    with pytest.raises(DatasetError, match=r"data.work is in the way and holds something else; move it away"):
        make_poses(tmp_path / "few", target)
    assert (work / "mine").is_dir()


def test_photos_that_have_nothing_in_common_are_refused(tmp_path):
    rng = np.random.default_rng(0)
    for index in range(4):
        noise = gaussian_filter(rng.normal(size=(120, 160)), 2)
        pixels = np.rint(128 + 300 * noise).clip(0, 255).astype(np.uint8)
        save(tmp_path / f"photos/{index}.png", np.repeat(pixels[..., None], 3, axis=2))
    with pytest.raises(
        DatasetError, match=r"no two of the 4 photos have enough in common \(at most \d+ matches\)"
    ):
        make_poses(tmp_path / "photos", tmp_path / "data")
    assert not (tmp_path / "data").exists()


def test_sources_that_are_none(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("")
    for source, message in (
        ("nowhere", "does not exist; give a folder of photos or a video"),
        ("empty", "no photos in it; give a folder of photos or a video"),
        ("notes.txt", "is no video that is known by its name"),
    ):
        with pytest.raises(DatasetError, match=message):
            make_poses(tmp_path / source, tmp_path / "data")


def test_reasons_why_photos_found_no_place():
    raw = [RawPhoto(f"{i}", None, 9, 9, None, s, False) for i, s in
           enumerate([1.0, 1.0, 0.1, 1.2, 0.9, 1.0, 1.0])]  # fmt: skip
    counts = np.zeros((7, 7), dtype=int)
    counts[3, 0], counts[4, 1], counts[5, 1], counts[6, 0] = 12, 100, 90, 80
    flat = np.zeros((7, 7), dtype=bool)
    flat[4, 1] = True

    class Other:
        def num_reg_images(self):
            return 3

        def reg_image_ids(self):
            return [7]

    found = registration_report.explain_unregistered(
        raw, {0, 1}, [Other()], registration_report.Matches(counts, flat)
    )
    assert found == {
        "2": "blurred (10% of the sharpness of the others)",
        "3": "too few matches (at most 12 with a photo that found its place)",
        "4": "no parallax (taken from where another was taken)",
        "5": "its 90 matches fit no place",
        "6": "not connected: one of 3 photos that fit each other, not the rest",
    }


def test_photos_of_one_size_and_focal_length_share_a_camera(tmp_path):
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 26
    for index in range(3):
        Image.new("RGB", (400, 300), (index, 9, 9)).save(tmp_path / f"{index}.jpg", exif=exif)
    Image.new("RGB", (400, 300)).save(tmp_path / "3.png")
    Image.new("RGB", (300, 400)).save(tmp_path / "4.png")
    raw = [write_upright(file, file.name, tmp_path / "out") for file in find_raw_photos(tmp_path)]
    cameras, numbers = structure_from_motion.guess_cameras(raw)
    assert numbers == [0, 0, 0, 1, 2]
    # 26 mm on film of 36 x 24 mm, whose diagonal is 43.27 mm, on a photo whose diagonal is 500 pixels
    assert cameras[0].params[0] == pytest.approx(26 * 500 / 43.267) and cameras[0].has_prior_focal_length
    assert cameras[1].params[0] == pytest.approx(1.2 * 400) and not cameras[1].has_prior_focal_length
    assert {camera.model.name for camera in cameras} == {"SIMPLE_RADIAL"}
    many, _ = structure_from_motion.guess_cameras(raw[:3] * 4)
    assert many[0].model.name == "RADIAL"  # one focal length: the pixels are square


@pytest.mark.nightly
def test_many_photos_are_matched_with_neighbors_and_with_those_alike(photos, tmp_path):
    names = sorted(file.name for file in photos.glob("0*.png"))  # eight of them, in the order of the ring
    camera = features.import_pycolmap().Camera(
        model="SIMPLE_PINHOLE", width=WIDTH, height=HEIGHT, params=[440, 200, 150]
    )
    database = tmp_path / "database.db"
    shuffled = [names[i] for i in (0, 4, 1, 5, 2, 6, 3, 7)]
    features.create_database(database, [camera], [features.Photo(name, 0) for name in shuffled])
    features.extract(database, photos, shuffled, features=1000, longer_side=1000)
    pairs = features.select_likely_pairs(database, 8, neighbors=1, similar=2)
    assert {(i, i + 1) for i in range(7)} <= set(pairs)
    place = [names.index(name) for name in shuffled]
    similar = [abs(place[i] - place[j]) for i, j in pairs if j - i > 1]
    assert similar and np.mean(similar) < 2.0  # chance would give 3
    assert all(i < j for i, j in pairs) and len(pairs) < 21


def test_sharpness_tells_blurred_photos():
    pixels = photo_of_textures(_camera(0))[..., 0]
    blurred = np.rint(gaussian_filter(pixels.astype(float), 3)).astype(np.uint8)
    assert sharpness(Image.fromarray(blurred)) < 0.3 * sharpness(Image.fromarray(pixels))
    darker = np.rint(0.5 * pixels).astype(np.uint8)
    assert sharpness(Image.fromarray(darker)) == pytest.approx(sharpness(Image.fromarray(pixels)), rel=0.1)


def test_the_sharpest_frame_of_each_stretch():
    values = np.zeros(40)
    values[[4, 19, 23, 38]] = 1.0  # 19 and 38 lie outside the middle of their stretches of ten
    assert sharpest_frames(values, 4) == [4, 12, 23, 32]
    assert sharpest_frames(values[:3], 10) == [0, 1, 2]


def test_frames_of_a_video(tmp_path):
    import imageio_ffmpeg

    frames, sharp = [], (3, 10, 17)
    for index in range(21):
        stripes = np.where(np.arange(96) // 6 % 2, 40.0, 0.0)
        stripes = stripes if index in sharp else gaussian_filter(stripes, 3)
        pixels = 8 * index + 20 + np.repeat(stripes[:, None], 128, axis=1)
        frames.append(np.repeat(np.rint(pixels).astype(np.uint8)[..., None], 3, axis=2))
    video = tmp_path / "walk.mp4"
    writer = imageio_ffmpeg.write_frames(str(video), (128, 96), fps=10, quality=9)
    writer.send(None)
    for frame in frames:
        writer.send(np.ascontiguousarray(frame))
    writer.close()
    found = extract_video_frames(video, 3, tmp_path / "frames")
    assert len(found) == 3
    for file, index in zip(found, sharp, strict=True):
        with Image.open(file) as image:
            assert image.size == (128, 96)
            assert np.asarray(image).mean() == pytest.approx(8 * index + 40, abs=3)
    (tmp_path / "cut.mp4").write_bytes(video.read_bytes()[:200])
    with pytest.raises(DatasetError, match=r"cut.mp4: holds 0 frames that can be read"):
        extract_video_frames(tmp_path / "cut.mp4", 3, tmp_path / "none")
    assert has_photos_alone(video)


def test_the_command_makes_a_data_set_and_says_what_is_next(photos, made, tmp_path, capsys, monkeypatch):
    real, _, _ = made
    fold = Fold(5, 9, ("a.jpg", "c.jpg"))

    def fake(source, target, *, frames, masks, on_progress):
        shutil.copytree(real, target)
        on_progress(1.0, "done")
        return PosesReport(target, 9, 7, 1234, 0.613, {"b.jpg": "blurred", "a.heic": "unreadable"})

    monkeypatch.setattr(structure_from_motion, "make_poses", fake)
    given = {}

    def verified(dataset, *, correct, cache, on_stage):
        given["correct"] = correct
        return Verification(dataset, None, None, fold, "unmeasured")

    monkeypatch.setattr(pose_verification, "verify_poses", verified)
    out = tmp_path / "data"
    assert main(["poses", str(photos), "-o", str(out)]) == 0
    text = capsys.readouterr().out
    assert given == {"correct": False}  # the poses are cagefield's own
    assert "poses are folded: 5 of 9 photos" in text and "(a.jpg and c.jpg)" in text
    assert "7 of 9 photos found their place" in text and "1234 points" in text and "0.61 pixels" in text
    assert text.index("left out: a.heic: unreadable") < text.index("left out: b.jpg: blurred")
    assert f"next: cagefield train {out} -o SCENE" in text
    assert "exists already" in refused(capsys, "poses", photos, "-o", out)
    assert "--frames is 2" in refused(capsys, "poses", photos, "-o", tmp_path / "new", "--frames", 2)
    save(tmp_path / "mine/a.png", np.zeros((9, 9, 3), np.uint8))
    refusal = refused(capsys, "poses", photos, "-o", tmp_path / "mine", "--overwrite")
    assert "holds no poses.json and is left as it is" in refusal


def test_training_on_photos_alone_finds_poses_first(photos, made, tmp_path, capsys, monkeypatch):
    target, _, _ = made
    copy = tmp_path / "scene.poses"
    calls = []

    def copied(source, to, *, frames, on_progress, masks=None):
        calls.append(source)
        shutil.copytree(target, to)
        return PosesReport(to, 11, 9, 500, 0.5)

    monkeypatch.setattr(structure_from_motion, "make_poses", copied)
    assert poses_command.posed(photos, copy) == copy and calls == [photos]
    assert f"{photos} has no poses; finding them first, into {copy}" in capsys.readouterr().out
    assert poses_command.posed(photos, copy) == copy and len(calls) == 1
    assert "were found before" in capsys.readouterr().out
    assert poses_command.posed(target, copy) == target  # a data set is taken as it is
    assert capsys.readouterr().out == ""


def test_loading_photos_alone_names_the_command(photos, tmp_path):
    with pytest.raises(
        DatasetError, match=rf"photos without poses; find them with: cagefield poses {photos}"
    ):
        load_dataset(photos)
    (tmp_path / "walk.mov").write_bytes(b"")
    with pytest.raises(DatasetError, match=r"a video has no poses; find them with: cagefield poses"):
        load_dataset(tmp_path / "walk.mov")
    assert not has_photos_alone(tmp_path)
