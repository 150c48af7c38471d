"""Shared parts of the benchmarks' commands: the command line that a table names, and a folder to work in."""

from __future__ import annotations

import dataclasses
import shlex
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cagefield.files.safe_open import real_path
from cagefield.files.temporary_folders import TemporaryFolder

if TYPE_CHECKING:
    pass

_SILENT = (
    "workdir", "out", "pictures", "picture_size", "picture_views", "edit_pictures", "error_panel",
    "overwrite", "scene_out", "cluster", "cluster_tls",
)  # fmt: skip


def command_line(name: str, options: Any, silent: Collection[str] = _SILENT) -> str:
    """The command that repeats a benchmark: what differs from the defaults, without the files' places."""
    return shlex.join(["cagefield", *name.split(), *_words(options, silent)])


def _words(options: Any, silent: Collection[str]) -> Iterator[str]:
    for option in dataclasses.fields(options):
        value = getattr(options, option.name)
        if option.name in silent or value == option.default or value is None:
            continue
        if dataclasses.is_dataclass(value):
            yield from _words(value, silent)
            continue
        if option.default is dataclasses.MISSING:
            yield from map(_placeless, value if isinstance(value, tuple) else (value,))
            continue
        yield "--" + option.name.replace("_", "-")
        if isinstance(value, tuple):
            yield from map(str, value)
        elif not isinstance(value, bool):
            yield str(value)


def _placeless(value: object) -> str:
    """The value; of a file or folder the name alone, in capitals: a place that is left open."""
    path = Path(str(value))
    return path.resolve().name.upper() if path.exists() else str(value)


@contextmanager
def work_folder(path: Path | None) -> Iterator[Path]:
    """The folder, or one that is removed afterwards."""
    if path is not None:
        yield real_path(path)
        return
    with TemporaryFolder("bench") as folder:
        yield folder
