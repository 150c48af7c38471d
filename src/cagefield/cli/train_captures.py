"""`cagefield train A B C`: several captures, each into a scene folder of its own, here or on a cluster."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, TypeVar

from cagefield.errors import CagefieldError, line_of
from cagefield.files.safe_open import real_path

if TYPE_CHECKING:
    from cagefield.cli.options import Device
    from cagefield.cli.photo_options import Captures


class Training(Protocol):
    """A training of one capture, or of several in turn, as the command line describes it."""

    __dataclass_fields__: ClassVar[dict[str, Any]]

    @property
    def photos(self) -> Captures: ...
    @property
    def out(self) -> Path: ...
    @property
    def resume(self) -> bool: ...
    @property
    def cluster(self) -> str | None: ...
    @property
    def cluster_tls(self) -> tuple[Path, Path, Path] | None: ...
    @property
    def device(self) -> Device: ...

    def run(self) -> None:
        """Train and save."""

    def checkpoint(self) -> Path:
        """File of an interrupted training."""

    def check_target(self) -> Path:
        """Folder of the scene, once nothing is in its way."""


AnyTraining = TypeVar("AnyTraining", bound=Training)


class Outcome(NamedTuple):
    """Figures of a capture's training with its warnings, or the line of its failure."""

    figures: str
    warnings: tuple[str, ...] = ()
    error: str = ""


def train_captures(command: Training) -> None:
    """Trains each capture of `command` into a folder of `command.out`; failures are named at the end.

    Raises:
        CagefieldError: two captures of one name, a scene that is there, captures that failed.
    """
    trainings = plan_captures(command)
    out = real_path(command.out)
    out.mkdir(parents=True, exist_ok=True)
    failures: dict[str, str] = {}
    for name, outcome in _outcomes(command, trainings, failures):
        for text in outcome.warnings:
            warnings.warn(f"{name}: {text}", stacklevel=2)
        if outcome.error:
            failures[name] = outcome.error
            print(f"{name}: failed, the others go on: {outcome.error}", file=sys.stderr)
        else:
            print(f"{name}: {outcome.figures}", flush=True)
    if failures:
        named = "; ".join(f"{name}: {error}" for name, error in failures.items())
        total = len(trainings)
        raise CagefieldError(
            f"{len(failures)} of the {total} captures failed; the same command with --resume trains them"
            f" ({named})"
        )


def plan_captures(command: AnyTraining) -> dict[str, AnyTraining]:
    """The training of each capture by its name; with --resume, of those that are not finished.

    Raises:
        CagefieldError: two captures of one name, a scene or an interrupted training that is there.
    """
    from cagefield.scene.scene_files import is_scene

    out = real_path(command.out)
    if is_scene(out):
        raise CagefieldError(f"{command.out} is a scene; give a folder for the scenes of several captures")
    trainings: dict[str, AnyTraining] = {}
    for data in (command.photos.data, *command.photos.more):
        name = capture_name(data)
        if name in trainings:
            raise CagefieldError(
                f"two captures are named {name}; rename one, their scenes are written to {out / name}"
            )
        photos = dataclasses.replace(command.photos, data=data.expanduser().absolute(), more=())
        trainings[name] = dataclasses.replace(
            command, photos=photos, out=out / name, cluster=None, cluster_tls=None
        )
    if command.resume:
        trainings = {
            name: dataclasses.replace(training, resume=training.checkpoint().exists())
            for name, training in trainings.items()
            if training.checkpoint().exists() or not training.out.exists()
        }
    for training in trainings.values():
        training.check_target()
    return trainings


def capture_name(data: Path) -> str:
    """Name of a capture's scene: the folder's, or a video's without its ending."""
    path = data.expanduser().absolute()
    if path.suffix.lower() in (".json", ".npy"):
        return path.parent.name
    return path.stem if path.is_file() else path.name


def train_capture(training: Training) -> Outcome:
    """One training, run to its end; its lines on standard output are its figures."""
    printed = io.StringIO()
    with warnings.catch_warnings(record=True) as caught, contextlib.redirect_stdout(printed):
        warnings.simplefilter("default")
        try:
            training.run()
            error = ""
        except CagefieldError as failure:
            error = str(failure)
        except OSError as failure:
            error = line_of(failure)
    texts = tuple(dict.fromkeys(str(one.message) for one in caught))
    return Outcome(printed.getvalue().strip().replace("\n", "; "), texts, error)


def _outcomes(
    command: Training, trainings: dict[str, AnyTraining], failures: dict[str, str]
) -> Iterator[tuple[str, Outcome]]:
    """Name and outcome of each training; trainings whose workers were lost are put into `failures`."""
    if command.cluster is None:
        for name, training in trainings.items():
            print(f"Training {name}", file=sys.stderr)
            yield name, train_capture(training)
        return
    from cagefield.cluster.connection import TlsFiles, parse_cluster
    from cagefield.cluster.tasks import Task, run_tasks

    yield from run_tasks(
        parse_cluster(command.cluster),
        {name: Task(train_capture, (training,)) for name, training in trainings.items()},
        device=command.device,
        tls=TlsFiles(*command.cluster_tls) if command.cluster_tls else None,
        failures=failures,
    )
