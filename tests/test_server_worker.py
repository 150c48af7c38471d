"""The rendering process itself."""

import queue
from pathlib import Path

import pytest

from cagefield.server.tasks import Answered, Ready, Result, WarmTask
from cagefield.server.worker import Worker
from scenes import ball_scene

PATIENCE = 120.0


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
        worker.send(WarmTask(1, 2))
        assert results.get(timeout=PATIENCE) == Answered(1)
    finally:
        worker.close()
    assert worker._process.exitcode == 0
    assert list((tmp_path / "cache").rglob("*.qdc"))
