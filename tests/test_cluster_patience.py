"""Clusters that lose all workers or their scheduler: a notice, and an end with its cure."""

from __future__ import annotations

import asyncio
import importlib.util
import re
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cagefield.cluster import patience
from cagefield.cluster.connection import connect
from cagefield.cluster.patience import LostClusterError, Patience
from cagefield.cluster.tasks import Task, run_tasks
from cluster_functions import cubed, killed_twice, slept
from dask_processes import add_worker, farm, wait_for_workers

needs_dask = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None,
    reason="dask.distributed is not installed (extra cluster)",
)


class Scheduler:
    """A scheduler's replies: numbers of workers, None for a reply that never comes; the last stays."""

    address = "tcp://farm:8786"

    def __init__(self, *replies: int | None) -> None:
        self.replies = list(replies)

    async def ncores(self) -> dict[str, int]:
        count = self.replies.pop(0) if len(self.replies) > 1 else self.replies[0]
        if count is None:
            await asyncio.Event().wait()
        return {str(n): 1 for n in range(count or 0)}


@pytest.fixture
def client_of() -> Iterator[Callable[..., Any]]:
    """Makes a client of a `Scheduler`'s replies."""
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever, daemon=True)
    thread.start()

    def make(*replies: int | None, cluster: object = None) -> Any:
        scheduler = Scheduler(*replies)
        looped = SimpleNamespace(asyncio_loop=loop)
        return SimpleNamespace(scheduler=scheduler, cluster=cluster, loop=looped, status="running")

    yield make
    loop.call_soon_threadsafe(loop.stop)
    thread.join()
    for task in asyncio.all_tasks(loop):
        task.cancel()
    loop.run_until_complete(asyncio.sleep(0))
    loop.close()


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patience, "NOTICE_SECONDS", 0.1)
    monkeypatch.setattr(patience, "WORKER_SECONDS", 0.3)
    monkeypatch.setattr(patience, "LOCAL_WORKER_SECONDS", 0.3)
    monkeypatch.setattr(patience, "_ASK_SECONDS", 0.02)


@pytest.mark.parametrize(
    ("replies", "cluster", "notice", "end"),
    [
        ((0,), None, "cluster tcp://farm:8786 has no workers; 0 s are waited at most for one; start some",
         "has had no workers for 0 s; start some with `dask worker`, and go on with --keep or --resume"),
        ((2, 0), None, "has no workers", "has had no workers"),
        ((0,), object(), "the local cluster has no workers; .*; they are started again", "use fewer"),
        ((2, None), None, "scheduler of cluster tcp://farm:8786 does not reply", "has not replied for 0 s"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("impatient")
def test_a_notice_and_an_end(
    client_of: Callable[..., Any], replies: tuple[int | None, ...], cluster: object, notice: str, end: str
) -> None:
    watch = Patience(client_of(*replies, cluster=cluster))
    with warnings.catch_warnings(record=True) as caught, pytest.raises(LostClusterError, match=end):
        warnings.simplefilter("always")
        begun = time.monotonic()
        while time.monotonic() < begun + 30:
            watch.check()
            time.sleep(0.005)
    assert len(caught) == 1 and re.search(notice, str(caught[0].message))


@pytest.mark.usefixtures("impatient")
def test_a_worker_in_time_begins_the_patience_anew(client_of: Callable[..., Any]) -> None:
    watch = Patience(client_of(0, 0, 1, 0, 0, 3))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        watch.wait_for_worker()
        assert watch.workers == 1
        while watch.workers != 3:
            watch.check()
            time.sleep(0.005)


@pytest.mark.usefixtures("impatient")
def test_time_that_the_caller_spends_elsewhere_is_not_the_clusters(client_of: Callable[..., Any]) -> None:
    watch = Patience(client_of(1))
    watch.wait_for_worker()
    time.sleep(0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        watch.check()


def test_a_closed_connection_ends_at_once(client_of: Callable[..., Any]) -> None:
    client = client_of(1)
    watch = Patience(client)
    client.status = "connecting"
    with pytest.raises(LostClusterError, match="connection to the cluster is lost; go on with --keep"):
        watch.check()


@pytest.mark.nightly
@needs_dask
def test_a_scheduler_without_workers_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(patience, "NOTICE_SECONDS", 3.0)
    monkeypatch.setattr(patience, "WORKER_SECONDS", 6.0)
    with (
        farm(tmp_path, 0) as (address, _, _),
        pytest.warns(UserWarning, match=f"{address} has no workers; 6 s are waited at most for one"),
        pytest.raises(LostClusterError, match="has had no workers for 6 s; start some with `dask worker`"),
        connect(address),
    ):
        pass


@pytest.mark.nightly
@needs_dask
@pytest.mark.parametrize("late", [False, True], ids=["none", "late"])
def test_workers_that_all_vanish_are_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, late: bool
) -> None:
    """Two workers, each ended by SIGKILL; a third one that comes late takes the tasks."""
    marks = tmp_path / "marks"
    marks.mkdir()
    tasks = {"killer": Task(killed_twice, (marks,))}
    with farm(tmp_path, 2) as (address, _, opened), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        wait_for_workers(address, 2)
        monkeypatch.setattr(patience, "NOTICE_SECONDS", 1.0)
        if late:
            warn = patience.Patience._notice

            def noticed(watch: Patience) -> str:
                add_worker(opened, address)
                return warn(watch)

            monkeypatch.setattr(patience.Patience, "_notice", noticed)
            assert dict(run_tasks(address, tasks, device="cpu")) == {"killer": b"\0\1"}
        else:
            monkeypatch.setattr(patience, "WORKER_SECONDS", 3.0)
            with pytest.raises(LostClusterError, match=f"{address} has had no workers for 3 s; start some"):
                dict(run_tasks(address, tasks, device="cpu"))
    messages = [str(one.message) for one in caught]
    assert any(f"cluster {address} has no workers; " in message for message in messages)
    assert any(message.startswith("2 workers were lost") for message in messages)
    assert late == any("others took their tasks" in message for message in messages)


@pytest.mark.nightly
@needs_dask
@pytest.mark.parametrize(
    ("number", "message"),
    [(signal.SIGKILL, "the connection to the cluster is lost"), (signal.SIGSTOP, "has not replied for 3 s")],
)
def test_a_scheduler_that_dies_or_falls_silent_in_the_middle(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    number: signal.Signals,
    message: str,
) -> None:
    """One line and none of dask's own, though the scheduler cannot be told that the client leaves."""
    tasks = {"first": Task(cubed, (2,)), "second": Task(slept, (600.0,))}
    with farm(tmp_path, 1) as (address, scheduler, _), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        wait_for_workers(address, 1)
        monkeypatch.setattr(patience, "NOTICE_SECONDS", 1.0)
        monkeypatch.setattr(patience, "WORKER_SECONDS", 3.0)
        results = run_tasks(address, tasks, device="cpu")
        assert next(results) == ("first", 8)
        scheduler.send_signal(number)
        with pytest.raises(LostClusterError, match=message):
            next(results)
    assert capfd.readouterr().err == ""
