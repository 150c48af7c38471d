"""Tasks on local workers: results of functions called here, lost workers, errors with their cure."""

from __future__ import annotations

import importlib.util
import urllib.error
import urllib.request
import warnings
from pathlib import Path

import pytest

from cagefield.cluster.connection import connect
from cagefield.cluster.tasks import Task, run_tasks
from cagefield.errors import CagefieldError
from cluster_functions import cubed, killed_twice, refusing

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("distributed") is None,
    reason="dask.distributed is not installed (extra cluster)",
)


@pytest.mark.nightly
def test_two_kills_among_three_workers_lose_no_task(tmp_path: Path) -> None:
    tasks = {str(n): Task(cubed, (n,)) for n in range(8)} | {"killer": Task(killed_twice, (tmp_path,))}
    with pytest.warns(UserWarning, match="2 workers were lost; others took their tasks"):
        found = dict(run_tasks(3, tasks, device="cpu"))
    assert found == {str(n): cubed(n) for n in range(8)} | {"killer": b"\0\1"}


@pytest.mark.nightly
def test_a_worker_that_starts_again_late_is_not_given_up(tmp_path: Path) -> None:
    """dask closes a local worker that is not back after a time, 15 s by default: the only one, for good."""
    import dask

    late = {"distributed.deploy.lost-worker-timeout": "1 ms"}
    with dask.config.set(late), connect(1) as client:
        assert client.submit(killed_twice, tmp_path).result(timeout=3600) == b"\0\1"


@pytest.mark.nightly
def test_local_clusters_serve_no_pages_and_run_side_by_side() -> None:
    with warnings.catch_warnings(), connect(1) as client:
        warnings.simplefilter("error")  # dask's servers would share the port 8787
        with connect(1) as other:
            assert other.submit(cubed, 2).result() == client.submit(cubed, 2).result() == 8
        info = client.scheduler_info()
        ports = [info["services"]["dashboard"]]
        ports += [worker["services"]["dashboard"] for worker in info["workers"].values()]
        assert len(ports) == 2 and 8787 not in ports
        for port in ports:
            for page in ("status", "health", "info/main/workers.html", "json/identity.json"):
                with pytest.raises(urllib.error.HTTPError, match="404"):
                    urllib.request.urlopen(f"http://127.0.0.1:{port}/{page}")


def test_an_error_of_a_task_has_its_name() -> None:
    with pytest.raises(CagefieldError, match="block 2: no photo is left; take some"):
        dict(run_tasks(1, {"block 2": Task(refusing)}, device="cpu"))
