"""Schedulers and workers without cagefield, or with another version of it: a line with its cure at once."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import cagefield
from cagefield.cluster.tasks import Task, run_tasks
from cagefield.cluster.versions import check_versions, version
from cagefield.errors import CagefieldError
from cluster_functions import cubed
from commands import refused
from dask_processes import farm, hidden_package
from scenes import ball_scene

needs_dask = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None,
    reason="dask.distributed is not installed (extra cluster)",
)
HERE = cagefield.__version__


def client_of(scheduler: object, *workers: object) -> Any:
    """Client whose scheduler and workers reply so; errors of the scheduler are raised."""

    def on_scheduler(function: object) -> object:
        assert function is version
        if isinstance(scheduler, Exception):
            raise scheduler
        return scheduler

    def on_workers(function: object, on_error: str) -> dict[str, object]:
        assert (function, on_error) == (version, "return")
        return {f"tcp://worker:{index}": reply for index, reply in enumerate(workers)}

    address = SimpleNamespace(address="tcp://farm:8786")
    return SimpleNamespace(run_on_scheduler=on_scheduler, run=on_workers, scheduler=address)


@pytest.mark.parametrize(
    ("replies", "message"),
    [
        ((ImportError("none"), HERE), r"the scheduler tcp://farm:8786 has no cagefield .*; pip install"),
        (("0.0.1", HERE), "the scheduler tcp://farm:8786 has cagefield 0.0.1, this is .*; install the same"),
        ((HERE, HERE, AttributeError("none")), r"worker tcp://worker:1 has no cagefield .*; pip install"),
        ((HERE, Exception("ImportError('none')")), "worker tcp://worker:0 has no cagefield with clusters"),
        ((HERE, "9.9", HERE), "worker tcp://worker:0 has cagefield 9.9, this is .*; install the same"),
    ],
)
def test_machines_without_this_version_are_named(replies: tuple[object, ...], message: str) -> None:
    with pytest.raises(CagefieldError, match=message):
        check_versions(client_of(*replies))


@pytest.mark.parametrize("replies", [(HERE, HERE), (HERE, OSError("lost"), HERE), (TimeoutError(), HERE)])
def test_lost_machines_are_passed_over(replies: tuple[object, ...]) -> None:
    check_versions(client_of(*replies))


@pytest.mark.nightly
@needs_dask
@pytest.mark.parametrize("end", ["scheduler", "worker"])
def test_a_machine_without_cagefield_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], end: str
) -> None:
    """Both commands that run on a cluster: frames, and tasks such as trainings."""
    scene = tmp_path / "scene"
    ball_scene().save(scene)
    without = {end: hidden_package(tmp_path / "hidden", "cagefield")}
    with farm(tmp_path, 1, **without) as (address, _, _):
        words = (
            "render",
            scene,
            "-o",
            tmp_path / "out",
            "--size",
            "8x8",
            "--turntable",
            2,
            "--cluster",
            address,
        )
        assert f"{end} tcp://" in refused(capsys, *words)
        with pytest.raises(CagefieldError, match=f"{end} tcp://.* has no cagefield with clusters"):
            dict(run_tasks(address, {"one": Task(cubed, (2,))}, device="cpu"))
