"""Tasks on local workers: results of functions called here, lost workers, errors with their cure."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import time
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


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform != "linux", reason="ended by a signal of Linux's")
def test_a_worker_amid_a_kernel_ends_with_its_killed_command(tmp_path: Path) -> None:
    """The kernel here holds the interpreter for ten minutes: no thread of the worker has its turn."""
    mark = tmp_path / "worker"
    code = f"""
from pathlib import Path
from cluster_functions import held_interpreter
from cagefield.cluster.tasks import Task, run_tasks
if __name__ == "__main__":
    list(run_tasks(1, {{"kernel": Task(held_interpreter, (Path({str(mark)!r}),))}}, device="cpu"))
"""
    script = tmp_path / "command.py"
    script.write_text(code, encoding="utf-8")
    paths = [str(Path(__file__).parent), *sys.path]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    with subprocess.Popen([sys.executable, script], env=environment) as command:
        while not mark.exists():
            assert command.poll() is None
            time.sleep(0.1)
        worker = Path("/proc") / mark.read_text(encoding="ascii")
        assert worker.exists()
        command.kill()
    begun = time.monotonic()
    while worker.exists() and worker.joinpath("stat").read_text().rpartition(")")[2].split()[0] != "Z":
        assert time.monotonic() - begun < 300.0
        time.sleep(0.1)
