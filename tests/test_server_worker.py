"""The rendering process itself."""

import multiprocessing
import os
import queue
import signal
from pathlib import Path

import pytest

from cagefield.server.render_worker.process import Worker, serve
from cagefield.server.render_worker.tasks import Answered, Ready, Result, WarmStage, WarmTask
from scenes import ball_scene

PATIENCE = 120.0


@pytest.mark.nightly
def test_it_ends_by_itself_and_keeps_the_kernels_that_it_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    ball_scene().save(tmp_path / "ball")
    results: queue.Queue[Result] = queue.Queue()
    worker = Worker(str(tmp_path / "ball"), "cpu", results.put, lambda: None)
    worker.start()
    try:
        assert results.get(timeout=PATIENCE) == Ready()
        worker.send(WarmTask(1, WarmStage.EXACT_EDIT))
        assert results.get(timeout=PATIENCE) == Answered(1)
    finally:
        worker.close()
    assert worker.process.exitcode == 0
    assert list((tmp_path / "cache").rglob("*.qdc"))


@pytest.mark.nightly
def test_a_process_whose_server_has_gone_before_it_is_ready_ends_quietly(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    ball_scene().save(tmp_path / "ball")
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(
        target=serve, args=(there, context.RawValue("L", 0), str(tmp_path / "ball"), "cpu"), daemon=True
    )
    process.start()
    there.close()
    here.close()
    process.join(PATIENCE)
    assert process.exitcode == 0
    assert capfd.readouterr().err == ""


def test_a_process_that_has_no_scene_yet_is_not_waited_for(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    ball_scene().save(tmp_path / "ball")
    worker = Worker(str(tmp_path / "ball"), "cpu", lambda _: None, lambda: None)
    worker.start()
    worker.close()
    assert worker.process.exitcode == -signal.SIGTERM
    assert capfd.readouterr().err == ""


def test_a_process_that_dies_while_it_is_started_is_lost_and_nothing_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def dies(_: object) -> None:
        raise BrokenPipeError(32, "Broken pipe")

    lost: queue.Queue[bool] = queue.Queue()
    worker = Worker("ball", "cpu", lambda _: None, lambda: lost.put(True))
    monkeypatch.setattr(multiprocessing.get_context("spawn").Process, "start", dies)
    worker.start()
    assert lost.get(timeout=PATIENCE)
    worker.send(WarmTask(1, WarmStage.COARSE_EDIT))
    worker.close()
    assert lost.empty()


def test_a_process_that_is_killed_is_lost_once_and_may_be_sent_to_and_closed(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    ball_scene().save(tmp_path / "ball")
    results: queue.Queue[Result | None] = queue.Queue()
    worker = Worker(str(tmp_path / "ball"), "cpu", results.put, lambda: results.put(None))
    worker.start()
    assert worker.pid is not None
    os.kill(worker.pid, signal.SIGKILL)
    assert results.get(timeout=PATIENCE) is None
    for number in range(3):
        worker.send(WarmTask(number, WarmStage.COARSE_EDIT))
    worker.close()
    assert results.empty() and capfd.readouterr().err == ""
