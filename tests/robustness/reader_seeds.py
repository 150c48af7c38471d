"""Parts that the attacked readers share: their form, and edits and keyframes to begin with."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit, EditStack
from cagefield.edits.operations import MoveCorner, Rotate, Scale, Translate
from cagefield.geometry.cage import Cage
from scenes import ball_cameras

Read = Callable[[Path], Any]


@dataclass(frozen=True)
class Reader:
    """`make` writes an honest seed into a folder, `read` reads it; `damaged`: its files and their kinds."""

    make: Callable[[Path], None]
    read: Read
    damaged: Mapping[str, str]


def example_edits() -> EditStack:
    inner = Cage.box((0.0, 0.0, 0.0), (0.5, 0.5, 0.5), (0.0, 0.1, 0.2))
    moved = Edit.continuous(
        inner,
        inner.grown((0.4, 0.4, 0.4)),
        lattice=16,
        operations=(
            Translate((0.1, 0.0, 0.0)),
            Rotate((0.0, 0.0, 10.0)),
            Scale((1.1, 1.0, 1.0)),
            MoveCorner(3, (0.02, 0.0, 0.0)),
        ),
        name="arm up",
    )
    other = Edit.copy(Cage.box((0.3, 0.3, 0.0), (0.2, 0.2, 0.2)), operations=(Translate((0.0, 0.3, 0.0)),))
    gone = Edit.delete(Cage.box((-0.3, 0.3, 0.0), (0.2, 0.2, 0.2)))
    return EditStack([moved, other, gone])


def many_edits(count: int, operations: int) -> EditStack:
    """`count` edits of so many operations each."""
    _, other, _ = example_edits()
    steps = tuple(Translate((0.001 * n, 0.0, 0.1)) for n in range(operations))
    return EditStack([other.replace(operations=steps, name=f"edit {n}") for n in range(count)])


def example_keys(count: int = 3) -> tuple[Keyframe, ...]:
    cameras = ball_cameras(count)
    return tuple(
        Keyframe(tuple(camera.c2w.reshape(-1).tolist()), 40.0, 0.3, {1: 0.5, 2: 1.0}) for camera in cameras
    )


def written(name: str, write: Callable[[Path], Any]) -> Callable[[Path], None]:
    return lambda folder: write(folder / name)
