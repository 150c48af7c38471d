"""Schedulers and workers of dask in processes of their own, which nobody starts again."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from cagefield.cluster.connection import connect
from cagefield.cluster.tasks import Task, run_tasks
from cluster_functions import cubed


@contextmanager
def process(*words: str, first: Path | None = None) -> Iterator[subprocess.Popen[bytes]]:
    """A process of dask that finds the tests' modules, those in the folder `first` before; ended with the
    context."""
    paths = os.pathsep.join([*([str(first)] if first else []), *(path for path in sys.path if path)])
    started = subprocess.Popen(
        [sys.executable, "-m", "distributed.cli." + words[0], *words[1:], "--no-dashboard"],
        env={**os.environ, "PYTHONPATH": paths},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield started
    finally:
        started.kill()
        started.wait()


@contextmanager
def farm(
    folder: Path, workers: int, *, scheduler: Path | None = None, worker: Path | None = None
) -> Iterator[tuple[str, subprocess.Popen[bytes], ExitStack]]:
    """Address and process of a scheduler with workers; each kind finds modules of a folder first."""
    file = folder / "scheduler.json"
    with ExitStack() as opened:
        words = ("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file))
        started = opened.enter_context(process(*words, first=scheduler))
        while not file.exists() or not file.read_text().endswith("}"):
            assert started.poll() is None
            time.sleep(0.05)
        address = json.loads(file.read_text())["address"]
        for _ in range(workers):
            add_worker(opened, address, worker)
        yield address, started, opened


def add_worker(opened: ExitStack, address: str, first: Path | None = None) -> None:
    """A further worker of a farm."""
    opened.enter_context(process("dask_worker", address, "--no-nanny", "--nthreads", "1", first=first))


def wait_for_workers(address: str, count: int) -> None:
    """Returns once so many have joined, and scheduler and workers have imported what tasks need.

    On a busy machine both take longer than the patience of a test.
    """
    with connect(address) as client:
        client.wait_for_workers(count, timeout=600)
    assert dict(run_tasks(address, {"first": Task(cubed, (2,))}, device="cpu")) == {"first": 8}


def hidden_package(folder: Path, name: str) -> Path:
    """A folder in which a package of that name cannot be imported."""
    package = folder / name
    package.mkdir(parents=True)
    message = f"raise ModuleNotFoundError({f'No module named {name!r}'!r}, name={name!r})\n"
    (package / "__init__.py").write_text(message, encoding="utf-8")
    return folder
