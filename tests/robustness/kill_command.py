"""Parts of a command that is killed, and parts that several of them share."""

from __future__ import annotations

import contextlib
import io
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from kill_checks import Check
from kill_points import Say

from cagefield import Scene
from cagefield.files.stale_files import displaced_folders
from scenes import ball_scene
from splat_scenes import ball_of_splats

Make = Callable[[Path], None]

EDITS = """edits:
  - name: moved
    adjustment: discrete
    inner: {center: [0, 0, 0], size: 1}
    operations: [{translate: [1, 0, 0]}]
"""


FREE_FORM_EDITS = """edits:
  - name: lattice
    inner: {center: [0, 0, 0], size: 0.8, lattice: {points: [3, 3, 3]}}
    outer: {margin: 0.4}
    operations: [{twist: {axis: z, degrees: 20}}]
  - name: points
    inner: {points: [[0, 0, 0.3], [0.3, 0, 0]], radius: 0.4}
    operations: [{move_point: {point: 0, by: [0, 0, 0.1]}}]
  - name: mesh
    inner: {mesh: {file: cube.obj}}
    outer: {margin: 0.4}
    operations: [{move_point: {point: 7, by: [0.05, 0, 0]}}]
"""


@dataclass(frozen=True)
class Command:
    """Command that is killed: `work` runs in a folder that `make` has filled; `check` says faults afterwards.

    `work` says numbers of what it has promised; `check` is given the last one. A user then does the same once
    more, after which `check` must pass too, and nothing hidden be left.
    """

    make: Make
    work: Callable[[Path, Say], None]
    check: Check


def cli(*arguments: object) -> None:
    from cagefield.cli import main

    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        code = main([str(argument) for argument in arguments])
    if code != 0:
        raise RuntimeError(f"exit code {code}: {said.getvalue().splitlines()[-1:]}")


def put_scene(folder: Path) -> None:
    ball_scene().save(folder / "scene")
    (folder / "scene" / "notes.txt").write_text("mine")
    (folder / "e.yaml").write_text(EDITS)


def put_free_form(folder: Path) -> None:
    """A scene, an edit file with a lattice, control points and a mesh, and the file of that mesh."""
    from cagefield.geometry.cage import Cage
    from cagefield.geometry.mesh_cage import MeshCage

    put_scene(folder)
    cube = MeshCage.of_box(Cage.box((0, 0, 0), 0.6))
    lines = [f"v {x} {y} {z}" for x, y, z in cube.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in cube.triangles.tolist()]
    (folder / "cube.obj").write_text("\n".join(lines) + "\n")
    (folder / "e.yaml").write_text(FREE_FORM_EDITS)


def put_splats(folder: Path) -> None:
    from cagefield.formats.splats.splat_files import write_splats

    put_scene(folder)
    shutil.rmtree(folder / "scene")
    Scene(ball_of_splats(50), cameras=ball_scene().cameras).save(folder / "scene")
    (folder / "scene" / "notes.txt").write_text("mine")
    write_splats(ball_of_splats(50), folder / "x.ply")


def renamed(command: Command, target: str | None = None) -> Command:
    """The command where names cannot be exchanged.

    The content of `target` may then be aside until the next run, which brings it back.
    """

    def work(folder: Path, say: Say) -> None:
        from cagefield.files import atomic

        atomic.exchange_names = lambda one, other: False
        command.work(folder, say)

    def problem(folder: Path, said: int) -> str | None:
        if target is not None and said < 1 and not (folder / target).exists():
            return None if displaced_folders(folder / target) else "lost: the folder"
        return command.check(folder, said)

    return replace(command, work=work, check=problem)
