"""Blocks and several captures trained on a cluster of local workers: the scenes of one process.

The oracle is the command without a cluster; trainings of given steps on a CPU are deterministic.
"""

from __future__ import annotations

import importlib.util
import shutil
import signal
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest
from benchmarks.captures.street import write_street

from cagefield import Scene
from cagefield.cli import main
from cagefield.cli.train import Train
from cagefield.cli.train_captures import capture_name, train_capture
from cagefield.errors import CagefieldError
from cagefield.fields.splat_field import SplatField
from cluster_functions import KILL_STEP, training_amid_kills
from commands import given_up, refused
from splat_scenes import assert_same_splats

needs_dask = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None,
    reason="dask.distributed is not installed (extra cluster)",
)
STEPS = ("--field", "splat", "--splats", 600, "--keep-poses", "--device", "cpu")


@pytest.fixture(scope="module")
def street(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve photos along a street, with points for two blocks."""
    return write_street(tmp_path_factory.mktemp("street") / "street", 12, 96, 5.0)


def train(capture: Path, out: Path, *options: object, steps: int = 60) -> int:
    return main([str(arg) for arg in ("train", capture, "-o", out, *STEPS, "--steps", steps, *options)])


def field_of(scene: Path) -> SplatField:
    field = Scene.open(scene).field
    assert isinstance(field, SplatField)
    return field


@pytest.mark.nightly
@needs_dask
def test_blocks_of_a_cluster_are_those_of_one_process(
    street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Workers are killed amid a block and amid a refinement; others go on from their checkpoints."""
    from cagefield.training.splats import train_blocks

    options = ("--blocks", 2)
    assert train(street, tmp_path / "one", *options, steps=200) == 0
    marks, names = tmp_path / "marks", ("block 1", "block 2, refinement")
    marks.mkdir()
    monkeypatch.setattr(train_blocks, "train_block", partial(training_amid_kills, marks, names))
    assert train(street, tmp_path / "many", *options, "--cluster", 2, steps=200) == 0
    assert {path.name: path.read_text() for path in marks.iterdir()} == dict.fromkeys(names, str(KILL_STEP))
    assert "1 worker was lost" in capsys.readouterr().err
    assert_same_splats(field_of(tmp_path / "many"), field_of(tmp_path / "one"))
    assert not (tmp_path / "many.blocks").exists()


@pytest.mark.nightly
@pytest.mark.train
def test_a_cluster_goes_on_with_the_blocks_of_an_interrupted_training(
    street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Ctrl-C amid block 2 here; with --resume neither scaffold nor block 1 is trained again on a cluster."""
    from cagefield.training.splats.splat_run import SplatRun

    assert train(street, tmp_path / "whole", "--blocks", 2) == 0
    advance, begun = SplatRun.advance, []

    def pressed(run: SplatRun) -> None:
        if run.step == 0:
            begun.append(run)
        advance(run)
        if len(begun) == 3 and run.step == 10:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(SplatRun, "advance", pressed)
    assert train(street, tmp_path / "scene", "--blocks", 2) == 130
    blocks = tmp_path / "scene.blocks"
    assert sorted(path.name for path in blocks.iterdir()) == [
        "block-0001.json", "block-0001.safetensors", "block-0002.training",
        "scaffold.json", "scaffold.safetensors",
    ]  # fmt: skip
    first = (blocks / "block-0001.safetensors").stat().st_mtime_ns
    monkeypatch.setattr(SplatRun, "advance", advance)
    trained: list[str] = []

    def here(cluster: object, tasks: dict[str, object], **_: object) -> Iterator[tuple[str, object]]:
        """The tasks of `run_tasks` in this process."""
        assert cluster == 3
        for name, task in tasks.items():
            trained.append(name)
            assert (blocks / "block-0001.safetensors").stat().st_mtime_ns == first
            yield name, task.function(*task.arguments)  # type: ignore[attr-defined]

    monkeypatch.setattr("cagefield.cluster.tasks.run_tasks", here)
    monkeypatch.setattr("cagefield.cluster.connection.check_installed", lambda: None)
    assert train(street, tmp_path / "scene", "--blocks", 2, "--cluster", 3, "--resume") == 0
    assert trained == ["block 2", "block 1, refinement", "block 2, refinement"]
    assert_same_splats(field_of(tmp_path / "scene"), field_of(tmp_path / "whole"))
    assert "block 2: done" in capsys.readouterr().err


@pytest.mark.nightly
@pytest.mark.train
def test_several_captures_are_trained_into_scenes_of_their_own(
    street: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """One without photos fails, is named, and is trained once its photos are there."""
    late = tmp_path / "captures/late"
    late.mkdir(parents=True)
    argv = ["train", late, street, "-o", tmp_path / "scenes", *STEPS, "--steps", 40]
    error = given_up(capsys, *argv)
    assert "1 of the 2 captures failed; the same command with --resume trains them (late: " in error
    assert train(street, tmp_path / "alone", steps=40) == 0
    assert_same_splats(field_of(tmp_path / "scenes/street"), field_of(tmp_path / "alone"))
    assert [path.name for path in (tmp_path / "scenes").iterdir()] == ["street"]
    assert "exists already" in refused(capsys, *argv)
    shutil.copytree(street, late, dirs_exist_ok=True)
    before = (tmp_path / "scenes/street/field.safetensors").stat().st_mtime_ns
    capsys.readouterr()
    assert main([str(arg) for arg in (*argv, "--resume")]) == 0
    out = capsys.readouterr().out
    assert out.startswith("late: trained ") and "street" not in out.replace(str(tmp_path), "")
    assert_same_splats(field_of(tmp_path / "scenes/late"), field_of(tmp_path / "alone"))
    assert (tmp_path / "scenes/street/field.safetensors").stat().st_mtime_ns == before


@pytest.mark.nightly
@needs_dask
def test_several_captures_on_a_cluster(
    street: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = write_street(tmp_path / "captures/corner", 8, 96, 3.0, seed=4)
    late = tmp_path / "captures/late"
    late.mkdir()
    argv = ["train", late, street, other, "-o", tmp_path / "scenes", *STEPS, "--steps", 40]
    error = given_up(capsys, *argv, "--cluster", 2)
    assert "1 of the 3 captures failed" in error and "(late: " in error
    for name, data in (("street", street), ("corner", other)):
        assert train(data, tmp_path / name, steps=40) == 0
        assert_same_splats(field_of(tmp_path / "scenes" / name), field_of(tmp_path / name))


def test_names_of_captures(tmp_path: Path) -> None:
    (tmp_path / "walk.mp4").touch()
    assert capture_name(tmp_path / "walk.mp4") == "walk"
    assert capture_name(tmp_path / "house.v2") == "house.v2"
    assert capture_name(tmp_path / "room/transforms.json") == "room"


def test_options_that_are_refused(street: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    for argv, message in (
        ((street, "--cluster", 2), "--cluster trains blocks or several captures; give --blocks too"),
        ((street, "--cluster-tls", "a", "b", "c"), "--cluster-tls belongs to --cluster"),
        ((street, street), "two captures are named street; rename one"),
        ((street, tmp_path / "b", "--masks", tmp_path), "--masks is of one capture"),
    ):
        assert message in refused(capsys, "train", "-o", out, *STEPS, *argv)
    assert not out.exists()


def test_warnings_and_failures_of_a_capture_come_back(
    street: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import warnings

    from cagefield.cli.photo_options import CaptureOptions

    def run(self: Train) -> None:
        print("a line\nanother")
        warnings.warn("two photos are missing", stacklevel=2)
        raise self.failure  # type: ignore[attr-defined]

    monkeypatch.setattr(Train, "run", run)
    training = Train(CaptureOptions(street), tmp_path / "scene")
    for failure, line in (
        (CagefieldError("no photo is left"), "no photo is left"),
        (OSError(28, "No space left on device", "a.png"), "a.png: No space left on device"),
    ):
        monkeypatch.setattr(Train, "failure", failure, raising=False)
        outcome = train_capture(training)
        assert outcome == ("a line; another", ("two photos are missing",), line)
