"""Benchmarks: committed edits against the motions they stand for, figures, truths, tables, commands."""

from __future__ import annotations

import csv
import io
import json
import shlex
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks.captures import frame_times, training_curves
from benchmarks.commands.bench_edits import BenchEdits
from benchmarks.commands.bench_training import BenchSpeed, BenchTraining
from benchmarks.commands.command_lines import command_line
from benchmarks.common.cases import CASES, Case, chosen
from benchmarks.common.figures import Figures, changed_pixels, compare, mean_psnr, supersampled
from benchmarks.common.machine import Machine, device_name
from benchmarks.common.tables import Table, number
from benchmarks.common.timing import interleaved
from benchmarks.common.workbench import Workbench, digest
from benchmarks.edits.compare_shells import seen
from benchmarks.edits.edit_quality import measure, write_picture
from benchmarks.edits.edits_table import Revealed, Score, table
from benchmarks.edits.mapped_photographs import MappedScene

from benchmark_settings import TINY
from cagefield.cameras.camera import Camera
from cagefield.cli import main, parse
from cagefield.cli.options import TrainingOptions
from cagefield.cli.photo_options import PhotoOptions
from cagefield.edits import Copy, Edit, EditStack
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.images.image_files import read_image
from cagefield.procedural import SCENES, ProceduralScene, procedural_scene
from cagefield.scene.scene import Scene
from cagefield.training.voxels.train_voxels import train_voxel
from commands import refused
from scenes import ball_scene, files_of

DISCRETE = [case for case in CASES if case.moved is not None]
DELETED = {"digger": "bucket", "chair": "back", "microphone": "base", "plant": "flower"}


def named(case: Case) -> str:
    return f"{case.scene}-{case.name}"


def case(scene: str, name: str) -> Case:
    (found,) = chosen([scene], [name])
    return found


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Workbench:
    """A workbench with tiny photos and short trainings."""
    return Workbench(TINY, tmp_path_factory.mktemp("bench"))


# -- the committed cases -----------------------------------------------------------------------------------


def test_every_scene_has_every_kind_of_edit() -> None:
    kinds = {name: {one.kind for one in chosen([name])} for name in SCENES}
    assert kinds == {name: {"continuous", "move", "copy", "delete"} for name in SCENES}


@pytest.mark.parametrize("one", CASES, ids=named)
def test_edit_files_can_be_evaluated(one: Case) -> None:
    one.edits.check()
    assert len(one.edits.active) == len(one.edits) >= 1
    assert (one.moved is None) == (one.kind == "continuous")


def motion_of(one: Case) -> tuple[str, np.ndarray | None]:
    """Name of the part that a case moves in truth and the matrix [4,4] of its motion, None if it is gone."""
    assert one.moved is not None
    before = procedural_scene(one.scene)
    after = one.moved(before)
    gone = set(before.part_names) - set(after.part_names)
    if gone:
        assert gone == {DELETED[one.scene]}
        return gone.pop(), None
    (changed,) = [part for part in after.parts if not np.array_equal(part.motion, np.eye(4))]
    return changed.name.removesuffix(" copy"), changed.motion


@pytest.mark.parametrize("one", DISCRETE, ids=named)
def test_edit_files_move_as_the_part_really_moves(one: Case) -> None:
    _, motion = motion_of(one)
    assert motion is None or len(one.edits) == 1
    low, high = held_box(one)
    p = low + np.random.default_rng(0).random((500, 3)) * (high - low)
    p = p[held_by(one, p)]
    there = one.edits.to_deformed(p)
    if motion is None:
        assert there.hidden.all()
    else:
        # float64, coordinates below 2: rounding is far below 1e-9
        np.testing.assert_allclose(there.points, p @ motion[:3, :3].T + motion[:3, 3], atol=1e-9)


@pytest.mark.parametrize("one", DISCRETE, ids=named)
def test_cages_hold_one_part_and_it_lands_where_nothing_is(one: Case) -> None:
    part, motion = motion_of(one)
    scene = procedural_scene(one.scene)
    low, high = scene.part_bounds(part)
    inside = solids(scene, np.stack([low, high]))[part]
    # The rest of a part is out of sight, sunk in its neighbor or, of the cushion, the side it lies on.
    assert held_by(one, inside).mean() > 0.92
    held = {name: int(held_by(one, p).sum()) for name, p in solids(scene, held_box(one)).items()}
    assert sum(held.values()) - held[part] < 0.02 * held[part]
    if motion is not None:
        (edit,) = one.edits
        for name, p in solids(scene, edit.deformed.aabb).items():
            assert not edit.deformed.contains(p).any() or (name == part and not isinstance(edit, Copy))


def held_by(one: Case, p: np.ndarray) -> np.ndarray:
    """True for points [N,3] in one of the case's inner cages."""
    return np.any([edit.inner.contains(p) for edit in one.edits], axis=0)


def held_box(one: Case) -> np.ndarray:
    """Corners [2,3] of the box around the case's inner cages."""
    boxes = np.stack([edit.inner.aabb for edit in one.edits])
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])


def solids(scene: ProceduralScene, box: np.ndarray) -> dict[str, np.ndarray]:
    """Points inside each part, of 20,000 spread over a box."""
    p = box[0] + np.random.default_rng(1).random((20_000, 3)) * (box[1] - box[0])
    field = scene.field(0.001)
    distance, owner, _ = field.distance(p.astype(np.float32))
    names = np.array([item.part.name for item in field.placed])[owner]
    return {name: p[(distance < 0) & (names == name)] for name in scene.part_names}


def test_chosen_refuses_unknown_names() -> None:
    assert [one.scene for one in chosen(["chair"])] == ["chair"] * 6
    with pytest.raises(CagefieldError, match="no scene 'castle' to measure; choose from digger, chair"):
        chosen(["castle"])
    with pytest.raises(CagefieldError, match="no edit 'move_cone' to measure; choose from lower_wider"):
        chosen(["chair"], ["move_cone"])


# -- figures -----------------------------------------------------------------------------------------------


def test_figures_in_closed_form() -> None:
    before = np.full((2, 40, 40, 3), 0.5, np.float32)
    after = before.copy()
    after[:, 10:20, 10:20] = 0.9
    figures = compare(before + np.float32(0.01), after + np.float32(0.1), before, after)
    # constant errors e: PSNR -20 log10 e; in float32 to 1e-4 dB
    assert figures.unedited == pytest.approx(40.0, abs=1e-3)
    assert figures.edited == pytest.approx(20.0, abs=1e-3)
    assert figures.lost == pytest.approx(20.0, abs=2e-3)
    assert figures.changed == 12 * 12 / 1600  # the patch and one pixel around it
    assert figures.there_lost == pytest.approx(20.0, abs=2e-3)
    patch = (44 * 0.01**2 + 100 * 0.39**2) / 144
    assert figures.there_if_left == pytest.approx(-10 * np.log10(patch), abs=1e-3)


def test_views_that_are_right_do_not_make_the_mean_infinite() -> None:
    truth = np.zeros((2, 4, 4, 3), np.uint8)
    close = truth.copy()
    close[0] = 51
    assert mean_psnr(truth, truth) == np.inf
    assert mean_psnr(close, truth) < 50.0


@pytest.mark.nightly
def test_an_edit_of_nothing_loses_nothing(bench: Workbench) -> None:
    scene = bench.scene("microphone")
    cameras = scene.cameras["test"]
    still = Edit.continuous(Cage.box((0, 0, 0), 1.0), Cage.box((0, 0, 0), 2.0))
    truth = bench.modeled("microphone", cameras)
    shown, edited = (seen(scene.with_edits(EditStack(e)), cameras) for e in ([], [still]))
    figures = compare(shown, edited, truth, truth)
    assert figures.lost == 0.0 and figures.changed == 0.0
    assert np.isnan(figures.there_lost)


# -- truths ------------------------------------------------------------------------------------------------


def test_the_truth_of_a_delete_has_the_part_gone(bench: Workbench) -> None:
    one = case("microphone", "delete_base")
    cameras = bench.photos("microphone").test
    before = bench.modeled("microphone", [view.camera for view in cameras])
    after = bench.moved(one, [view.camera for view in cameras])
    for view, was, now in zip(cameras, before, after, strict=True):
        # Behind most of the base's rim, far from the pole, there is nothing.
        turns = 2 * np.pi * np.arange(16) / 16
        rim = np.stack([-0.3 + 0.5 * np.cos(turns), 0.5 * np.sin(turns), np.full(16, -0.9)], axis=1)
        i, j = view.camera.project(rim)[0].astype(int).T
        cleared = (now[j, i] == 255).all(axis=1)
        assert (was[j, i] < 200).any(axis=1).all() and cleared.mean() > 0.6
        assert (now == 255).all(axis=-1).sum() > (was == 255).all(axis=-1).sum()


def test_photos_of_the_data_set_are_the_unedited_truth(bench: Workbench) -> None:
    views = bench.photos("microphone").test
    truth = bench.modeled("microphone", [view.camera for view in views])
    for view, picture in zip(views, truth, strict=True):
        photo = view.load().astype(float)
        white = photo[..., :3] * photo[..., 3:] / 255 + 255 - photo[..., 3:]
        assert np.abs(white - picture).max() <= 1.0  # color and alpha are rounded to 8 bits


@pytest.mark.nightly
def test_the_exact_map_of_a_whole_scene_is_its_motion(bench: Workbench) -> None:
    """The chair's inner cage holds all its parts: the map shows what scaling them shows, but for light."""
    one = case("chair", "lower_wider")
    model = procedural_scene("chair")
    (edit,) = one.edits
    moved = model.move(
        model.part_names, scale=(1, 1.35, 0.75), translate=(0, 0, -0.2475), pivot=edit.inner.center
    ).with_modeled_light()
    camera = bench.photos("chair").test[0].camera.resized(64, 64)
    (mapped,) = bench.mapped("chair", one.edits, [camera])
    truth = moved.photograph(camera, background="white").rgb8()
    still = model.photograph(camera, background="white").rgb8()
    # single subsamples at edges; the unmoved chair is 11 dB
    assert mean_psnr(mapped[None], truth[None]) > 40.0 > 14.0 > mean_psnr(still[None], truth[None])


def test_old_shadows_stay_where_the_true_ones_go(bench: Workbench) -> None:
    """The foot of the pole was dark beside the base that is removed; in truth it no longer is."""
    one = case("microphone", "delete_base")
    cameras = [view.camera.resized(64, 64) for view in bench.photos("microphone").test]
    true, old = bench.moved(one, cameras), bench.moved(one, cameras, old_shadows=True)
    before = bench.modeled("microphone", cameras)
    differ = changed_pixels(true, old)
    assert 0 < differ.mean() < 0.05
    assert (true.astype(int) - old)[differ].sum() > 0
    assert not (differ & ~changed_pixels(before, true)).any()


def test_exact_maps_of_no_edit_and_of_parts_that_do_not_move(bench: Workbench) -> None:
    camera = bench.photos("chair").test[0].camera.resized(24, 24)
    np.testing.assert_array_equal(bench.mapped("chair", None, [camera]), bench.modeled("chair", [camera]))
    with pytest.raises(CagefieldError, match="no part of chair is moved by lower_wider"):
        bench.moved(case("chair", "lower_wider"), [])


# -- the benchmark -----------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_scores_table_and_second_run(bench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    cases = [case("microphone", "move_weight"), case("microphone", "bigger_head")]
    scores = list(measure(cases, bench))
    assert [score.truth for score in scores] == ["photos", "exact map"]
    assert [(score.views, score.size) for score in scores] == [(3, 32), (2, 24)]
    for score in scores:
        figures = score.figures
        assert figures.unedited > 15 and figures.edited > 15 and 0 < figures.changed < 0.6
        assert score.frame_ratio > 0
    first, second = scores
    assert second.revealed is None and first.revealed is not None
    assert 0 < first.revealed.uncovered < 0.2 and first.revealed.uncovered_taught is None

    def never(*_: object, **__: object) -> None:
        raise AssertionError("made again")

    for name in ("train_voxel", "make_scene", "unseen_pixels", "uncovered_pixels"):
        monkeypatch.setattr(f"benchmarks.common.workbench.{name}", never)
    monkeypatch.setattr(ProceduralScene, "photograph", never)
    monkeypatch.setattr(MappedScene, "photograph", never)
    again = list(measure(cases, Workbench(TINY, bench.folder)))
    assert [score.figures for score in again] == [score.figures for score in scores]
    with pytest.raises(AssertionError, match="made again"):
        Workbench(TINY, bench.folder, retrain=True).scene("microphone")

    text = table(scores, TINY, ("Machine: a test",)).markdown()
    rows = [line for line in text.splitlines() if line.startswith("| microphone")]
    assert len(rows) == 2 and rows[0].count("|") == 28
    figures = scores[0].figures
    assert f"| {figures.unedited:.2f} | {figures.edited:.2f} | {number(figures.lost)} |" in rows[0]
    assert (
        "move weight | move | photos | 3 |" in rows[0] and "bigger head | continuous | exact map" in rows[1]
    )
    assert text.endswith("- Machine: a test\n") and "60 steps at 24 voxels" in text


@pytest.mark.nightly
def test_what_photos_of_the_truth_teach(bench: Workbench) -> None:
    """The figures are those of a second field, that saw the microphone without its base."""
    one = case("microphone", "delete_base")
    (plain,) = measure([one], bench)
    (score,) = measure([one], bench, taught=True)
    found = score.revealed
    assert found is not None and plain.revealed is not None
    assert found.uncovered_edited == plain.revealed.uncovered_edited
    assert plain.revealed.uncovered_taught is None and plain.revealed.unseen_taught is None
    taught = bench.taught(one)
    assert taught.cameras["test"][0].to_dict() == bench.scene("microphone").cameras["test"][0].to_dict()
    cameras = taught.cameras["test"]
    there, truth = bench.uncovered_pixels(one, cameras), bench.moved(one, cameras) / 255.0
    error = ((seen(taught, cameras) - truth)[there] ** 2).mean()
    assert found.uncovered_taught == pytest.approx(-10 * np.log10(error), abs=1e-3)
    text = table([score], TINY).markdown()
    assert "| uncovered taught | unseen taught |" in text and "- Taught: the same pixels" in text
    assert f"| {number(found.uncovered_taught)} |" in text and "Uncovered, below taught: mean" in text


def test_means_and_the_most_that_is_lost() -> None:
    figures = compare(*[np.zeros((1, 16, 16, 3), np.float32)] * 4)

    def score(one: Case, there: float, old: float, hidden: float) -> Score:
        def lost(value: float) -> Figures:
            return replace(
                figures, unedited=30.0, edited=30.0 - value / 10, there_unedited=value, there_edited=0
            )

        found = Revealed(lost(old), 0.1, hidden, 0.0, 0.0, float("nan"), 0.5)
        return Score(one, "photos", 1, 16, lost(there), 1.0, revealed=found)

    scores = [
        score(case("digger", "move_cone"), 4.0, 2.0, float("nan")),
        score(case("plant", "delete_flower"), 1.0, 3.0, 7.0),
        replace(score(case("plant", "taller"), 0.5, 0.0, 0.0), revealed=None),
    ]
    notes = table(scores, TINY).notes
    for line in (
        "PSNR lost, continuous edits: mean 0.05 dB over 1 edit, at most 0.05 (plant taller).",
        "PSNR lost, discrete edits: mean 0.25 dB over 2 edits, at most 0.40 (digger move cone).",
        "There lost, discrete edits: mean 2.50 dB over 2 edits, at most 4.00 (digger move cone).",
        "There lost, discrete edits, old shadows: mean 2.50 dB over 2 edits, at most 3.00 "
        "(plant delete flower).",
        "Uncovered lost: mean 7.00 dB over 1 edit, at most 7.00 (plant delete flower).",
    ):
        assert line in notes
    assert not any("below taught" in line for line in notes)


def test_a_pixel_is_the_mean_of_its_rays() -> None:
    camera = Camera.look_at((3, 0, 0), (0, 0, 0), width=4, height=2, fov_x=0.5)

    def columns(finer: Camera) -> np.ndarray:
        return np.tile(np.arange(finer.width)[None, :, None] / 6.0, (finer.height, 1, 3))

    np.testing.assert_allclose(supersampled(columns, camera, 1)[0, :, 0], np.arange(4) / 6, atol=1e-7)
    # the last column's rays are 6/6 and 7/6, of which no more than 1 counts
    np.testing.assert_allclose(
        supersampled(columns, camera, 2)[1, :, 2], np.array([0.5, 2.5, 4.5, 6.0]) / 6, atol=1e-6
    )


@pytest.mark.nightly
def test_pictures(bench: Workbench, tmp_path: Path) -> None:
    one = case("microphone", "delete_base")
    path = write_picture(one, bench, tmp_path, 24)
    assert path == tmp_path / "microphone_delete_base.png"
    assert read_image(path).shape == (24, 3 * 24 + 2 * 4, 3)
    write_picture(one, bench, tmp_path, 24, error=True)
    assert read_image(path).shape == (24, 4 * 24 + 3 * 4, 3)


def test_settings_are_checked() -> None:
    with pytest.raises(CagefieldError, match="exact_size is 8; it must be at least 16"):
        replace(TINY, exact_size=8)
    with pytest.raises(CagefieldError, match="views is 0; it must be at least 1"):
        replace(TINY, views=0)
    with pytest.raises(CagefieldError, match="discrete_views is 0; it must be at least 1"):
        replace(TINY, discrete_views=0)


def test_digests_follow_content_and_sources() -> None:
    assert digest([1, "a"]) == digest([1, "a"]) != digest([1, "b"])
    assert len({digest([]), digest([], ["geometry/cage.py"]), digest([], ["warps"])}) == 3


def test_what_is_measured_has_the_light_of_its_truth() -> None:
    for case in CASES:
        lit = {edit.relight != "none" for edit in case.edits}
        assert lit == {case.moved is not None}, case.name
        assert [edit.inner for edit in case.edits] == [edit.inner for edit in case.given]


# -- tables and machine ------------------------------------------------------------------------------------


def test_tables(capsys: pytest.CaptureFixture[str]) -> None:
    small = Table("T", ("name", "a|b", "c"), (("x", "1", "2"),), ("a note",), shown=("name", "c"))
    assert small.markdown() == (
        "# T\n\n| name | a\\|b | c |\n| --- | ---: | ---: |\n| x | 1 | 2 |\n\n- a note\n"
    )
    small.show()
    shown = capsys.readouterr().out
    assert "name" in shown and "a note" in shown and "a|b" not in shown
    with pytest.raises(CagefieldError, match="row 1 of the table 'T' has 1 cells; it must have 2"):
        Table("T", ("a", "b"), (("1",),))


def test_numbers() -> None:
    assert [number(v, d) for v, d in ((1.005, 1), (-0.0, 2), (float("nan"), 2), (float("inf"), 2))] == [
        "1.0", "0.00", "-", "inf",
    ]  # fmt: skip


def test_machine_is_named() -> None:
    machine = Machine.here()
    assert machine.cpu and machine.cores >= 1
    assert machine.device.partition(" (")[0] in ("cpu", "cuda", "metal", "vulkan")
    assert f"{machine.cores} cores, device {machine.device}" in str(machine)


def test_a_gpu_is_named_where_its_driver_tells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tool = tmp_path / "nvidia-smi"
    tool.write_text("#!/bin/sh\necho 'NVIDIA Example 9000'\n")
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert device_name("cuda") == "cuda (NVIDIA Example 9000)"
    assert device_name("cpu") == "cpu"
    tool.unlink()
    assert device_name("cuda") == "cuda"


# -- frame times -------------------------------------------------------------------------------------------


def test_interleaved_takes_turns() -> None:
    calls: list[str] = []

    def slow() -> None:
        calls.append("b")
        time.sleep(0.01)

    seconds = interleaved([lambda: calls.append("a"), slow], 3)
    assert calls == ["a", "b"] * 4  # one round is not counted
    assert seconds.shape == (3, 2) and (seconds[:, 1] >= 0.01).all() and (seconds[:, 0] < 0.01).all()
    with pytest.raises(CagefieldError, match="rounds is 0; it must be at least 1"):
        interleaved([], 0)


def test_default_edit_covers_a_quarter_of_the_picture() -> None:
    scene = ball_scene()
    cameras = [camera.resized(128, 128) for camera in scene.cameras["test"]]
    edit = frame_times.default_edit(scene, cameras)
    edit.check()
    # coverage is counted on 32 x 32 rays; a box's outline moves by a row of them at a time
    assert frame_times.covered(edit.boxes, cameras) == pytest.approx(frame_times.COVERED, abs=0.04)
    assert frame_times.covered(np.array([[[-9.0] * 3, [9.0] * 3]]), cameras) == 1.0
    assert frame_times.covered(np.array([[[50.0] * 3, [51.0] * 3]]), cameras) == 0.0


@pytest.mark.nightly
def test_frame_times() -> None:
    scene = ball_scene()
    report = frame_times.measure(scene, scene.cameras["test"], rounds=2, lattices=(None, 8))
    assert [row.variant for row in report.rows] == [
        "unedited", "continuous, exact", "continuous, lattice 8", "discrete",
    ]  # fmt: skip
    first = report.rows[0]
    assert first.ratio == first.least_ratio == 1.0
    assert first.rays_per_second == pytest.approx(24 * 16 / (first.median_ms / 1e3))
    assert all(row.least_ms <= row.median_ms for row in report.rows)
    document = report.document(Machine("c", 2, "cpu"), "cagefield bench speed s")
    assert json.loads(json.dumps(document))["machine"] == {"cpu": "c", "cores": 2, "device": "cpu"}
    assert "| unedited |" in report.table(Machine("c", 2, "cpu"), "x").markdown()
    gone = EditStack([Edit.delete(Cage.box((0, 0, 0), 0.5))])
    rows = frame_times.measure(scene, scene.cameras["test"], gone, rounds=1).rows
    assert [row.variant for row in rows] == ["unedited", "discrete"]
    with pytest.raises(CagefieldError, match="at least one camera"):
        frame_times.measure(scene, [])
    with pytest.raises(CagefieldError, match="edits change nothing"):
        frame_times.measure(scene, scene.cameras["test"], EditStack([]))


# -- training curves ---------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_curve_is_taken_on_the_way_to_the_same_field(bench: Workbench) -> None:
    dataset = bench.photos("microphone")
    curve = training_curves.measure(dataset, TINY.config, views=2, shares=(0.2, 0.6))
    assert [point.step for point in curve.points] == [12, 36, 60]
    assert [point.views for point in curve.points] == [2, 2, 3]
    assert np.all(np.diff([point.seconds for point in curve.points]) > 0)
    through = train_voxel(dataset, TINY.config, evaluate=False).field
    assert np.array_equal(curve.result.field.vertices, through.vertices)
    assert curve.points[-1].test_psnr > curve.points[0].test_psnr

    rows = list(csv.DictReader(io.StringIO(curve.csv())))
    assert [int(row["step"]) for row in rows] == [12, 36, 60]
    assert float(rows[2]["test_psnr"]) == pytest.approx(curve.points[2].test_psnr, abs=1e-4)
    assert "| 60 |" in curve.table("m").markdown()


def test_curves_refuse_what_they_cannot_measure(bench: Workbench) -> None:
    dataset = bench.photos("microphone")
    with pytest.raises(CagefieldError, match="no test views; choose another --holdout"):
        training_curves.measure(replace(dataset, test=()), TINY.config)
    with pytest.raises(CagefieldError, match=r"shares must grow and lie between 0 and 1, got \[0.5, 0.2\]"):
        training_curves.measure(dataset, TINY.config, shares=(0.5, 0.2))
    with pytest.raises(CagefieldError, match="views is 0"):
        training_curves.measure(dataset, TINY.config, views=0)


# -- commands ----------------------------------------------------------------------------------------------


@pytest.mark.nightly
def test_bench_speed_writes_json_and_markdown(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    ball_scene().save(tmp_path / "scene")
    argv = ["bench", "speed", str(tmp_path / "scene"), "--size", "24x16", "--rounds", "1", "--cameras", "1"]
    assert main([*argv, "-o", str(tmp_path / "speed.json")]) == 0
    capsys.readouterr()
    document = json.loads((tmp_path / "speed.json").read_text())
    assert document["width"], document["height"] == (24, 16)
    assert document["cameras"] == 1 and document["command"].endswith("--size 24x16 --cameras 1 --rounds 1")
    assert (tmp_path / "speed.md").read_text().startswith("# Frame times at 24x16")
    before = files_of(tmp_path)
    assert "speed.json exists already" in refused(
        capsys, "bench", "speed", tmp_path / "scene", "-o", tmp_path / "speed.json"
    )
    assert "must end in .json" in refused(
        capsys, "bench", "speed", tmp_path / "scene", "-o", tmp_path / "speed.txt"
    )
    assert "--cameras is 0" in refused(capsys, "bench", "speed", tmp_path / "scene", "--cameras", 0)
    assert files_of(tmp_path) == before


def test_bench_edits_refuses_before_it_works(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (tmp_path / "edits.md").write_text("mine")
    (tmp_path / "digger_move_cone.png").write_text("mine")
    before = files_of(tmp_path)
    assert "edits.md exists already" in refused(capsys, "bench", "edits", "-o", tmp_path / "edits.md")
    new = ["bench", "edits", "-o", tmp_path / "new.md"]
    assert "move_cone.png exists already" in refused(capsys, *new, "--pictures", tmp_path)
    assert "no scene 'castle'" in refused(capsys, *new, "--scenes", "castle")
    assert "no method 'green'" in refused(capsys, *new, "--methods", "green")
    assert "compared_size is 4" in refused(capsys, *new, "--compared-size", 4)
    assert "minutes is 0.0" in refused(capsys, *new, "--minutes", 0)
    assert "size is 4; it must be at least 16" in refused(capsys, *new, "--size", 4)
    assert "--picture-size is 0" in refused(capsys, *new, "--picture-size", 0)
    assert "give --pictures FOLDER" in refused(capsys, *new, "--only-pictures")
    assert "belongs to --cluster" in refused(capsys, *new, "--cluster-tls", "a", "b", "c")
    assert "give --no-methods with --cluster" in refused(capsys, *new, "--cluster", 2)
    assert "'0' is no cluster" in refused(capsys, *new, "--cluster", 0, "--no-methods")
    drawn = ["--pictures", tmp_path / "p", "--only-pictures", "--no-methods"]
    assert "draws on one machine" in refused(capsys, *new, *drawn, "--cluster", 2)
    assert files_of(tmp_path) == before


@pytest.mark.nightly
def test_bench_edits_writes_table_and_pictures(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bench: Workbench
) -> None:
    argv = [
        "bench", "edits", "--scenes", "microphone", "--edits", "delete_base", "--views", "8", "--size", "32",
        "--test-views", "3", "--steps", "60", "--resolution", "24", "--workdir", str(bench.folder),
        "--pictures", str(tmp_path / "pictures"), "--picture-size", "24", "-o", str(tmp_path / "edits.md"),
    ]  # fmt: skip
    assert main(argv) == 0
    out = capsys.readouterr().out
    assert "microphone, delete_base: PSNR" in out and "dB lost" in out
    text = (tmp_path / "edits.md").read_text()
    assert "| microphone | delete base | delete | photos | 3 |" in text
    assert "Command: `cagefield bench edits --scenes microphone --edits delete_base --views 8" in text
    assert str(tmp_path) not in text
    assert [path.name for path in (tmp_path / "pictures").iterdir()] == ["microphone_delete_base.png"]


def test_bench_training_refuses(capsys: pytest.CaptureFixture[str], tmp_path: Path, bench: Workbench) -> None:
    data = bench.photos("microphone").path
    assert "must end in .csv" in refused(capsys, "bench", "training", data, "-o", tmp_path / "curve.md")
    (tmp_path / "curve.md").write_text("mine")
    assert "curve.md exists already" in refused(
        capsys, "bench", "training", data, "-o", tmp_path / "curve.csv"
    )
    assert files_of(tmp_path) == {"curve.md": b"mine"}


@pytest.mark.nightly
def test_bench_training_writes_curve_and_scene(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, bench: Workbench
) -> None:
    argv = ["bench", "training", str(bench.photos("microphone").path), "--steps", "30", "--resolution", "24"]
    argv += ["-o", str(tmp_path / "curve.csv"), "--scene-out", str(tmp_path / "scene")]
    assert main(argv) == 0
    assert "test PSNR" in capsys.readouterr().out
    assert len((tmp_path / "curve.csv").read_text().splitlines()) == 2 + len(training_curves.SHARES)
    assert (tmp_path / "curve.md").read_text().startswith("# Test PSNR against training time: photos-")
    assert len(Scene.open(tmp_path / "scene").cameras["test"]) == 3


def test_command_lines() -> None:
    short = TrainingOptions(steps=5)
    options = BenchEdits(scenes=("chair",), training=short, retrain=True, workdir=Path("w"), overwrite=True)
    repeated = command_line("bench edits", options)
    assert repeated == "cagefield bench edits --scenes chair --steps 5 --retrain"
    assert parse(shlex.split(repeated)[1:]).what.training == short
    curve = BenchTraining(PhotoOptions(Path("d"), holdout=4), Path("c.csv"), TrainingOptions(sh_degree=2))
    assert command_line("bench training", curve) == "cagefield bench training d --holdout 4 --sh-degree 2"
    assert command_line("bench speed", BenchSpeed(Path("my scene"))) == "cagefield bench speed 'my scene'"


def test_score_is_plain_data() -> None:
    figures = compare(*[np.zeros((1, 16, 16, 3), np.float32)] * 4)
    assert Score(CASES[0], "photos", 1, 16, figures, 1.0).figures.changed == 0.0
