"""The edit benchmark on a cluster: a task for each scene's training, then one for each case.

The work folder is one that all machines share; workers import the benchmarks from their own checkout.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.common.cases import Case, chosen
from benchmarks.common.workbench import Settings, Workbench
from benchmarks.edits.edit_quality import measure
from benchmarks.edits.edits_table import Score
from cagefield.cluster.connection import TlsFiles
from cagefield.cluster.tasks import Task, run_tasks
from cagefield.errors import CagefieldError


def measure_on(
    cluster: int | str,
    cases: Sequence[Case],
    bench: Workbench,
    *,
    taught: bool = False,
    device: str = "auto",
    tls: TlsFiles | None = None,
) -> Iterator[Score]:
    """The scores of `edit_quality.measure`, in the order of the cases.

    Raises CagefieldError as `run_tasks`, and for a work folder that a worker does not see.
    """
    bench.folder.mkdir(parents=True, exist_ok=True)
    scenes = dict.fromkeys(case.scene for case in cases)
    trainings = {
        f"training {name}": Task(train_scene, (bench.settings, bench.folder.absolute(), name, bench.retrain))
        for name in scenes
    }
    for name, _ in run_tasks(cluster, trainings, device=device, tls=tls):
        print(f"{name}: done", flush=True)
    arguments = bench.settings, bench.folder.absolute()
    tasks = {
        f"{case.scene}, {case.name}": Task(measure_case, (*arguments, case.scene, case.name, taught))
        for case in cases
    }
    known = dict(zip(tasks, cases, strict=True))
    waiting, found = list(tasks), {}
    for name, score in run_tasks(cluster, tasks, device=device, tls=tls):
        found[name] = dataclasses.replace(score, case=known[name])
        while waiting and waiting[0] in found:
            yield found.pop(waiting.pop(0))


def train_scene(settings: Settings, folder: Path, name: str, retrain: bool) -> None:
    """Trains a scene into the work folder."""
    _workbench(settings, folder, retrain).scene(name)


def measure_case(settings: Settings, folder: Path, scene: str, name: str, taught: bool) -> Score:
    """The score of a case, which it names without its truth: functions do not travel."""
    (case,) = chosen([scene], [name])
    (score,) = measure([case], _workbench(settings, folder, False), taught=taught)
    return dataclasses.replace(score, case=Case(scene, name))


def _workbench(settings: Settings, folder: Path, retrain: bool) -> Workbench:
    if not folder.is_dir():
        raise CagefieldError(f"a worker does not see the folder {folder}; give --workdir on a shared disk")
    return Workbench(settings, folder, retrain=retrain)
