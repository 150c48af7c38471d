"""Prints CPU and wall milliseconds of a refresh of free-form edits: build, check, 64^3 nodes of a new shape.

python -m benchmarks.free_form_refresh [--steps 8] [--resolution 64]

Each edit is dragged a little further from step to step, as in the editor; the first step (caches of the cage
at rest, compilation) is apart. CPU time is that of all threads, so that other programs do not count; on wall
time they do, so the load of the machine is printed with it.
"""

from __future__ import annotations

import os
import time
from dataclasses import dataclass

import numpy as np
import tyro

from cagefield.edits import Continuous, Edit
from cagefield.geometry import MeshCage
from cagefield.geometry.cage import Cage
from cagefield.typing import Array


@dataclass(frozen=True)
class Arguments:
    """Refreshes of each edit; the node lattice's resolution."""

    steps: int = 8
    resolution: int = 64


def ball(rings: int, around: int) -> MeshCage:
    """A ball of radius 0.5 of 2 `around` (`rings` - 1) triangles."""
    a = np.pi * np.arange(1, rings) / rings
    b = 2.0 * np.pi * np.arange(around) / around
    rows = [[np.sin(p) * np.cos(q), np.sin(p) * np.sin(q), np.cos(p)] for p in a for q in b]
    v: Array = 0.5 * np.array([[0.0, 0.0, 1.0], *rows, [0.0, 0.0, -1.0]])
    last, triangles = len(v) - 1, []
    for q in range(around):
        n = (q + 1) % around
        triangles += [(0, 1 + q, 1 + n), (last, last - around + n, last - around + q)]
        for p in range(rings - 2):
            i, j = 1 + p * around + q, 1 + p * around + n
            triangles += [(i, i + around, j), (j, i + around, j + around)]
    return MeshCage(v, triangles)


def edits() -> dict[str, tuple[Continuous, object]]:
    """Name -> (edit, function that drags it by a share)."""
    lattice = Edit.continuous(Cage.box((0, 0, 0), 0.5).subdivided((3, 3, 3)), Cage.box((0, 0, 0), 1.0))
    mesh = Edit.continuous(ball(13, 21), Cage.box((0, 0, 0), 2.0))  # 504 triangles
    coarse = Edit.continuous(ball(9, 20), Cage.box((0, 0, 0), 2.0))  # 320 triangles
    top = int(np.argmax(mesh.inner.handles[:, 2]))
    near = np.flatnonzero(np.linalg.norm(mesh.inner.handles - mesh.inner.handles[top], axis=1) < 0.35)
    return {
        "4x4x4 lattice, 4 points": (lattice, lambda e, t: e.move_points((5, 6, 9, 10), (0, 0, 0.15 * t))),
        "4x4x4 lattice, a face": (lattice, lambda e, t: e.move_points(range(48, 64), (0.1 * t, 0, 0.2 * t))),
        "4x4x4 lattice, bend": (lattice, lambda e, t: e.bend("z", 0.6 * t)),
        "504 triangles, one vertex": (mesh, lambda e, t: e.move_points([top], (0, 0, 0.2 * t))),
        "504 triangles, a cap": (mesh, lambda e, t: e.move_points(near, (0.1 * t, 0, 0.2 * t))),
        "504 triangles, twist": (mesh, lambda e, t: e.twist("z", 0.8 * t)),
        "320 triangles, one vertex": (coarse, lambda e, t: e.move_points([0], (0, 0, 0.2 * t))),
    }


def refresh(edit: Continuous, resolution: int) -> tuple[float, float, float, str]:
    """(CPU ms of build and check, of the nodes, wall ms of both, the steps and cells of its flow)."""
    started, wall = time.process_time(), time.perf_counter()
    shell = edit.shell.build(edit.inner, edit.deformed, edit.outer)
    problem = shell.problem()
    assert problem is None, problem
    checked = time.process_time()
    shell.sample(resolution)
    done, wall = time.process_time(), time.perf_counter() - wall
    flow = shell.flow if hasattr(shell, "flow") else shell.around.flow
    size = f"{len(flow.steps)} steps, {flow.cells} cells"
    return 1e3 * (checked - started), 1e3 * (done - checked), 1e3 * wall, size


def main() -> None:
    """Print a line for each edit."""
    arguments = tyro.cli(Arguments)
    for name, (edit, drag) in edits().items():
        shares = np.linspace(0.5, 1.0, arguments.steps + 1)
        rows = [refresh(drag(edit, t), arguments.resolution) for t in shares]
        build, nodes, wall = (float(np.median([row[k] for row in rows[1:]])) for k in range(3))
        print(
            f"{name}: build and check {build:.0f}, nodes {nodes:.0f}, together {build + nodes:.0f}"
            f" (first {rows[0][0] + rows[0][1]:.0f}), wall {wall:.0f}; {rows[-1][3]}",
            flush=True,
        )
    print(f"load of {os.cpu_count()} cores: {os.getloadavg()[0]:.1f} in the last minute")


if __name__ == "__main__":
    main()
