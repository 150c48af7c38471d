"""Tasks on local workers: results of functions called here, lost workers, errors with their cure."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

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


def test_an_error_of_a_task_has_its_name() -> None:
    with pytest.raises(CagefieldError, match="block 2: no photo is left; take some"):
        dict(run_tasks(1, {"block 2": Task(refusing)}, device="cpu"))
