"""The captures' benchmark, held against fields whose depth errors and fog are known."""

from __future__ import annotations

import dataclasses
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from benchmarks.captures import captures
from benchmarks.captures.captures import CaptureScore, DepthFigures, for_training, sighted_points, table
from benchmarks.captures.train_captures import Budget, Learnt, Show, learn, sampled_opacity
from benchmarks.common.cases import ROOM_CASES, Case
from benchmarks.edits import room_edits
from PIL import Image

from cagefield.cameras.camera import Camera
from cagefield.datasets import load_dataset
from cagefield.datasets.views import PhotoMask, SparsePoints
from cagefield.edits import EditStack
from cagefield.errors import CagefieldError
from cagefield.images.image_files import read_image
from cagefield.images.render_result import RenderResult
from cagefield.procedural import capture, make_capture
from cagefield.procedural.hand_held import render_image
from cagefield.training.evaluation import Evaluation, ViewMetrics
from commands import printed, refused


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    return make_capture("room-digger", tmp_path_factory.mktemp("captures") / "room", views=16, size=160)


@pytest.fixture(scope="module")
def short_room(tmp_path_factory):
    """Seven photos to train with, and two to test."""
    return make_capture("room-digger", tmp_path_factory.mktemp("captures") / "room", views=9, size=160)


@cache
def taken(case: Case | None, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """The digger's room, edited by hand, from a camera: (rgb, distance)."""
    scene = capture("room-digger").scene
    return render_image(scene if case is None or case.moved is None else case.moved(scene), camera)


def exact(further: float = 1.0, veil: float = 0.0, gain: float = 1.0) -> Learnt:
    """The room itself as a field: `further` times as far, behind a veil half way, in another exposure."""

    def show(camera: Camera, case: Case | None = None) -> RenderResult:
        rgb, depth = taken(case, camera)
        return RenderResult(np.minimum(rgb, 1) * gain, np.ones_like(depth), depth * np.float32(further))

    def before(camera: Camera, pixels: np.ndarray, distances: np.ndarray) -> np.ndarray:
        depth = taken(None, camera)[1][pixels[:, 1], pixels[:, 0]]
        assert (np.abs(distances / depth - captures.NEARER) < 0.5).all()
        return np.full(len(pixels), veil)

    def edited(edits: EditStack) -> Show:
        (case,) = (case for case in ROOM_CASES if case.edits == edits)
        return lambda camera: show(camera, case)

    return Learnt("exact", 7, 1.0, 1, show, before, edited)


@pytest.mark.nightly
def test_the_scene_itself_has_no_depth_error_and_no_fog(room):
    data = load_dataset(room)
    points = sighted_points(data)
    assert points is not None
    score = captures.measure(data, exact(), points)
    assert (score.photos, score.held_out, score.size) == (14, 2, (90, 160))
    # noise of about 42 dB, exposures of some percent; these are fitted
    assert 24 < score.test.psnr < score.test.corrected and 33 < score.test.corrected < 48
    assert 33 < score.train.corrected < 48 and score.test.ssim > 0.9
    assert score.left_out == 0 and score.pose_error is None
    # the true depth is the photo's own; points are as far off as .7 pixels make them
    assert score.truth == DepthFigures(score.truth.rays, 0.0, 0.0, 0.0)
    assert 1000 < score.truth.rays <= 2 * captures.TRUE_RAYS
    assert score.points.rays >= 10 and score.points.median < 0.02 and score.points.fog == 0.0


@pytest.mark.nightly
def test_depth_errors_fog_and_exposures_are_what_they_are_made(room):
    data = load_dataset(room)
    points = sighted_points(data)
    score = captures.measure(data, exact(1.25, veil=0.11, gain=0.5), points)
    assert score.truth.median == pytest.approx(0.25, abs=1e-5)
    assert score.truth.high == pytest.approx(0.25, abs=1e-5)
    assert score.points.median == pytest.approx(0.25, abs=0.03)
    assert (score.truth.fog, score.points.fog) == (1.0, 1.0)
    plain = captures.measure(data, exact(), points)
    # an affine map of each channel takes the halved exposure out; white is saturated in one alone
    assert score.test.corrected == pytest.approx(plain.test.corrected, abs=0.5) and score.test.psnr < 15
    assert captures.measure(data, exact(veil=0.09), points).points.fog == 0.0
    assert captures.measure(data, exact(), None).points.rays == 0


def test_points_that_held_out_photos_alone_see_are_not_trained_with(short_room):
    data = load_dataset(short_room)
    train, test = [v.name for v in data.train], [v.name for v in data.test]
    sets = (frozenset(test), frozenset([*test, train[0]]), frozenset(train[:2]), frozenset([*train, *test]))
    points = SparsePoints(np.arange(12.0).reshape(4, 3), np.zeros((4, 3), np.uint8), sets)
    kept = for_training(data, points).points
    assert kept is not None and kept.positions[:, 0].tolist() == [6.0, 9.0]
    assert for_training(data, points.take(np.array([0]))).points is None
    assert for_training(data, None) is data


def test_sightings_of_the_colmap_model_beside_a_transforms_file_are_found(short_room):
    pytest.importorskip("pycolmap")
    data = load_dataset(short_room)
    assert data.points is not None and not data.points.seen_by
    points = sighted_points(data)
    assert points is not None
    np.testing.assert_allclose(points.positions, data.points.positions, atol=1e-5)
    names = {view.name for view in (*data.train, *data.test)}
    assert all(len(those) >= 3 and those <= names for those in points.seen_by)
    model = load_dataset(short_room / "colmap/sparse/0/cameras.txt")
    assert sighted_points(model) is model.points


def test_the_true_depth_follows_the_photo_when_it_is_shrunk(short_room):
    whole, half = load_dataset(short_room), load_dataset(short_room, downscale=2)
    large, small = (captures.true_depth(data, data.test[0]) for data in (whole, half))
    assert large is not None and small is not None and small.shape == (80, 45)
    np.testing.assert_array_equal(small, large[1::2, 1::2])
    assert captures.true_depth(whole, whole.train[0]) is None
    other = dataclasses.replace(half.test[0], downscale=4)
    with pytest.raises(CagefieldError, match="its photo shrunk by 4 is 45x80"):
        captures.true_depth(whole, other)


def test_sampled_opacity_is_beers_law():
    def field(positions: np.ndarray, viewdirs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.where(positions[:, 1] < 0, 0.5, 0.0).astype(np.float32), np.zeros((len(positions), 3))

    camera = Camera.look_at((0, -4, 0), (0, 0, 0), width=9, height=9, fov_x=0.3)
    pixels = np.array([[4, 4], [0, 4]])
    _, directions = camera.rays(pixels)
    found = sampled_opacity(field, camera, pixels, np.array([3.0, 6.0]))
    # the fog ends at y = 0; half a sample of 6 / 256 is left at its edge
    expected = 1 - np.exp(-0.5 * np.minimum([3.0, 6.0], 4 / directions[:, 1]))
    np.testing.assert_allclose(found, expected, atol=0.5 * 6 / 256)
    many = sampled_opacity(field, camera, np.tile(pixels, (3000, 1)), np.tile([3.0, 6.0], 3000))
    np.testing.assert_allclose(many.reshape(-1, 2), np.tile(found, (3000, 1)), atol=1e-12)


def test_unknown_fields_and_captures_without_held_out_photos_are_refused(short_room):
    data = load_dataset(short_room)
    with pytest.raises(CagefieldError, match="fields of captures are splat, voxel, not 'mesh'"):
        learn(data, "mesh", Budget(), print)
    with pytest.raises(CagefieldError, match="no held-out photos"):
        captures.measure(dataclasses.replace(data, test=()), exact())


def test_the_table_has_a_row_for_each_score_and_dashes_for_what_is_not_known():
    figures = DepthFigures(120, 0.0123, 0.2, 0.031)
    score = CaptureScore(
        "beer", "splat", 62, 9, (360, 640), 300.4, 20000, Evaluation((ViewMetrics("x", 29.0, 30.0, 0.9),)),
        Evaluation((ViewMetrics("b/y.jpg", 26.5, 27.5, 0.8), ViewMetrics("b/z.jpg", 24.5, 25.5, 0.9))),
        figures, DepthFigures(), 3, (4.125, 0.5), 3.21,
    )  # fmt: skip
    text = table([score], ["Machine: mine"]).markdown()
    row = next(line for line in text.splitlines() if line.startswith("| beer"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells == [
        "beer", "splat", "62", "9", "3", "360x640", "300", "20000", "29.00", "30.00", "25.50", "26.50",
        "0.8500", "24.50 (z.jpg)", "4.12 -> 0.50", "120", "1.2%", "20.0%", "3.1%", "-", "-", "-", "3.2 GiB",
    ]  # fmt: skip
    assert "- Machine: mine" in text
    unknown = dataclasses.replace(score, test=Evaluation(), pose_error=None)
    cells = [cell.strip() for cell in table([unknown]).markdown().splitlines()[4].strip("|").split("|")]
    assert cells[10:15] == ["-"] * 5


def test_photos_that_are_in_no_split_are_counted(short_room, tmp_path):
    for view in load_dataset(short_room).train[:3]:
        shutil.copy(view.image_path, tmp_path)
    views = [
        dataclasses.replace(view, image_path=tmp_path / Path(view.name).name)
        for view in load_dataset(short_room).train[:2]
    ]
    data = dataclasses.replace(load_dataset(short_room), train=(views[0],), test=(views[1],), val=())
    assert captures.left_out_photos(data) == 1
    for name in ("r_0_depth_0001.png", "dynamic_mask_0.png", ".hidden.jpg", "notes.txt", "hidden-part.png"):
        (tmp_path / name).write_bytes(b"")
    hidden = dataclasses.replace(views[0], mask=PhotoMask(tmp_path / "hidden-part.png"))
    data = dataclasses.replace(data, train=(hidden,))
    assert captures.left_out_photos(data) == 1
    (tmp_path / "frame_00099.JPG").write_bytes(b"")
    assert captures.left_out_photos(data) == 2


@pytest.mark.nightly
def test_figures_leave_out_what_a_mask_excludes(short_room, tmp_path):
    """A square of each test photo is painted black and masked: figures are those of the other pixels."""
    data = load_dataset(short_room)
    data = dataclasses.replace(data, train=data.train[:2])
    tests = []
    for view in data.test:
        photo = view.load()
        mask = np.full(photo.shape[:2], 255, np.uint8)
        photo[40:80, 20:60], mask[40:80, 20:60] = 0, 0
        paths = tmp_path / f"{Path(view.name).stem}.png", tmp_path / f"{Path(view.name).stem}_mask.png"
        Image.fromarray(photo).save(paths[0])
        Image.fromarray(mask).save(paths[1])
        tests.append(dataclasses.replace(view, image_path=paths[0], mask=PhotoMask(paths[1])))
    painted = dataclasses.replace(data, test=tuple(tests))
    unmasked = dataclasses.replace(data, test=tuple(dataclasses.replace(v, mask=None) for v in tests))
    plain, masked, black = (captures.measure(d, exact()).test for d in (data, painted, unmasked))
    assert black.psnr < plain.psnr - 5
    assert masked.psnr == pytest.approx(plain.psnr, abs=1.5) and masked.ssim > plain.ssim - 0.02
    nothing = np.zeros_like(mask)
    Image.fromarray(nothing).save(tmp_path / "none.png")
    hidden = dataclasses.replace(tests[0], mask=PhotoMask(tmp_path / "none.png"))
    with pytest.warns(UserWarning, match="1 of 2 photos are left out of the figures"):
        one = captures.measure(dataclasses.replace(painted, test=(hidden, tests[1])), exact()).test
    assert [view.name for view in one.views] == [tests[1].name]
    assert one.worst is not None and one.worst.psnr == one.psnr


def test_memory_is_that_of_this_process():
    captures.forget_memory()
    before = captures.peak_memory()
    block = np.ones(1 << 25)
    assert before + 0.2 < captures.peak_memory() < before + 2
    assert block[0] == 1


@pytest.mark.nightly
def test_the_command_measures_rooms_and_folders(room, tmp_path, capsys):
    """Voxels, 20 steps: their figures are poor, and they are there; the room's photos are made once."""
    out, pictures = tmp_path / "table.md", tmp_path / "pictures"
    argv = ["bench", "captures", room, "room-chair", "--fields", "voxel", "--steps", 20, "--resolution", 16,
            "--room-size", 64, "--room-views", 9, "--workdir", tmp_path / "work", "-o", out,
            "--pictures", pictures, "--picture-views", 1]  # fmt: skip
    text = printed(capsys, *argv)
    assert "room, voxel: PSNR " in text and "room-chair, voxel: PSNR " in text
    lines = out.read_text().splitlines()
    assert [line.split("|")[1].strip() for line in lines if "| voxel" in line] == ["room", "room-chair"]
    command = next(line for line in lines if line.startswith("- Command"))
    assert (
        "--steps 20 --resolution 16 --room-size 64 --room-views 9`" in command and "table.md" not in command
    )
    assert "`cagefield bench captures ROOM room-chair " in command
    (made,) = (tmp_path / "work").glob("photos-*/room-chair")
    stamp = (made / "transforms.json").stat().st_mtime_ns
    shown = read_image(pictures / "room_voxel_frame_00001.png")
    # photo, picture, difference, depth, true depth: five of 90 pixels with gaps of 4
    assert shown.shape == (160, 5 * 90 + 4 * 4, 3)
    photo = read_image(room / "images/frame_00001.jpg")
    np.testing.assert_array_equal(shown[:, :90], photo)
    assert "exists already" in refused(capsys, *argv)
    printed(capsys, *(word for word in argv if word is not room), "--overwrite")
    assert (made / "transforms.json").stat().st_mtime_ns == stamp


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "no capture to measure"),
        (("room-chair", "--holdout", 0), "--holdout 0 keeps no photo to measure on"),
        (("room-chair", "--picture-views", 0), "--picture-views is 0; it must be at least 1"),
        (("no-such-folder",), "no-such-folder does not exist"),
    ],
)
def test_impossible_commands_are_refused(tmp_path, capsys, options, message):
    out = Path(tmp_path) / "table.md"
    assert message in refused(capsys, "bench", "captures", *options, "-o", out)
    assert not out.exists()


@pytest.mark.nightly
def test_an_edit_that_is_right_loses_nothing_and_one_that_does_nothing_is_seen(room, monkeypatch):
    monkeypatch.setattr(room_edits, "_ROUNDS", 1)
    data = load_dataset(room)
    right = room_edits.measure(data, exact(gain=0.7), ROOM_CASES)
    assert [score.case.name for score in right] == ["taller", "move_cone"]
    learnt = exact()
    left = room_edits.measure(data, dataclasses.replace(learnt, edited=lambda edits: learnt.show), ROOM_CASES)
    for good, bad in zip(right, left, strict=True):
        assert good.figures.edited > 55 and bad.figures.edited < 40
        assert bad.figures.there_edited == pytest.approx(bad.figures.there_if_left)
        assert 0.001 < good.figures.changed < 0.5
        assert good.frame_ratio > 0
    assert right[0].figures.changed > 3 * right[1].figures.changed
    text = room_edits.table(right).markdown()
    assert "| room-digger | taller | exact | 2 |" in text and "| room-digger | move cone |" in text


def test_the_edits_of_rooms_are_what_their_cases_say():
    """Inside the inner cage the edit's map is the parts' motion; the cage holds those parts and no others."""
    scene = capture("room-digger").scene
    rng = np.random.default_rng(0)
    for case in ROOM_CASES:
        (edit,) = case.edits
        moved = case.moved(scene)
        names = [a.name for a, b in zip(scene.parts, moved.parts, strict=True) if a.motion is not b.motion]
        low, high = scene.part_bounds(names)
        points = rng.uniform(edit.inner.corners.min(0), edit.inner.corners.max(0), (2000, 3))
        motion = next(part.motion for part in moved.parts if part.name in names)
        after = points @ motion[:3, :3].T + motion[:3, 3]
        np.testing.assert_allclose(edit.exact_warp.to_deformed(points).points, after, atol=1e-9)
        # the tracks' lugs are sunk a little into the plate
        assert (edit.inner.corners.min(0) < low + 0.01).all() and (edit.inner.corners.max(0) > high).all()
        others = scene.remove(names).field(eps=1e-3).distance(points.astype(np.float32))[0]
        assert (others > 0).all()


@pytest.mark.nightly
def test_pictures_of_a_rooms_edit_are_as_trained_edited_and_the_truth(tmp_path):
    case = ROOM_CASES[1]
    path = room_edits.write_picture(exact(gain=0.8), case, tmp_path, 120)
    assert path.name == "room_digger_move_cone.png"
    shown = read_image(path).astype(int)
    before, after, truth = shown[:, :90], shown[:, 94:184], shown[:, 188:]
    # the exposure of .8 is taken back, but where the room was brighter than white
    assert np.abs(after - truth).max() <= 2 and np.abs(before - truth).max() > 50
    with pytest.raises(CagefieldError, match=r"room_digger_move_cone\.yaml has no truth"):
        room_edits.write_picture(exact(), dataclasses.replace(case, moved=None), tmp_path, 40)
