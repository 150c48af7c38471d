"""Promises of continuous edits of every kind over random ones: the worst of each, as a table.

    python -m benchmarks.edits.random_promises --edits 10000 --out benchmarks/results/random_promises.md

Kinds take turns: boxes, lattices (linear and B-spline), meshes, control points (plain and connected), each in
an outer box or hexahedron, drawn by `benchmarks.edits.random_edits` and, boxes, `benchmarks.flow_random`. The
maps are the exact ones in float64, `Edit.exact_warp`, that of boxes the flow shell's kernel compiled in
float64 (`benchmarks.flow_random`). An edit that is impossible is drawn again, and counted.
Every row is written to a log as soon as it is measured (--log); a run goes on where the log ends.

Per edit, at about `--points` points of each sort:

- least det d(canonical)/d(deformed), at points all over the outer cage and near the inner one: above 0;
- points around the outer cage: where they are, within 1e-6;
- the flow on the outer cage's faces: the identity, within 1e-6;
- continuity at the inner cage's surface (of control points, at the end of their reach): points a share of
  1e-10 apart on both sides stay within 1e-6 of each other; of boxes, the flow agrees with the trilinear map
  within 1e-3, the error of its integration;
- to_deformed(to_canonical(p)) and to_canonical(to_deformed(q)): p and q, within 1e-4.

Distances are shares of the outer cage's size.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, write_text
from benchmarks.edits.random_edits import control_points, lattices, meshes
from cagefield.edits import Continuous, Edit, EditStack
from cagefield.errors import CagefieldError
from cagefield.geometry import ControlPoints, MeshCage, bspline_lattice, hexahedron
from cagefield.geometry.cage import Cage, LatticeCage
from cagefield.typing import Array

MAX_DRAWS = 100
"""Impossible draws for one edit, at most."""

OUTSIDE_TOLERANCE, TRIP_TOLERANCE = 1e-6, 1e-4

JUMP_TOLERANCE, BOX_JUMP_TOLERANCE = 1e-6, 1e-3
"""6e-4 is the worst of 10,000 boxes in `results/flow_random.md`."""


@dataclass(frozen=True)
class Promises:
    """Promises of one edit; distances as shares of the outer cage's size. See the module.

    `refused` counts the impossible draws before it; `seed` is the one that it was drawn from.
    """

    kind: str
    number: int
    seed: int
    refused: int
    least_det: float
    outside: float
    rim: float
    trip: float
    jump: float

    @property
    def failures(self) -> tuple[str, ...]:
        """Names of the promises that are broken."""
        broken = {
            "least det J": not self.least_det > 0.0,
            "outside": not self.outside <= OUTSIDE_TOLERANCE,
            "outer faces": not self.rim <= OUTSIDE_TOLERANCE,
            "round trip": not self.trip <= TRIP_TOLERANCE,
            "continuity": not self.jump <= (BOX_JUMP_TOLERANCE if self.kind == "box" else JUMP_TOLERANCE),
        }
        return tuple(name for name, is_broken in broken.items() if is_broken)


def _box(seed: int) -> Edit:
    from benchmarks.flow_random import random_edit

    return random_edit(np.random.default_rng(seed))


KINDS: dict[str, Callable[[int], Edit]] = {
    "box": _box,
    "lattice, linear": lambda seed: lattices.random_lattice_edit(seed, "linear"),
    "lattice, bspline": lambda seed: lattices.random_lattice_edit(seed, "bspline"),
    "mesh": meshes.random_mesh_edit,
    "points": control_points.random_edit,
    "points, connected": control_points.connected_edit,
}
"""Random edit of a seed, by kind."""


def possible_edit(kind: str, number: int) -> tuple[Continuous, int, int]:
    """(edit, seed, impossible draws before it) of a kind's edit of a number. Raises `CagefieldError`."""
    for draw in range(MAX_DRAWS):
        seed = number + 1_000_000 * draw
        try:
            edit = KINDS[kind](seed)
            edit.check()
        except CagefieldError:
            continue
        if isinstance(edit, Continuous) and edit.changes_anything:
            return edit, seed, draw
    raise CagefieldError(f"{kind} {number}: {MAX_DRAWS} draws gave no possible edit")


def measure(edit: Continuous, n: int, seed: int) -> tuple[float, float, float, float, float]:
    """(least det, outside, rim, trip, jump) of an edit at about n points of each sort; see `Promises`."""
    rng = np.random.default_rng(seed)
    warp, outer = edit.exact_warp, edit.outer
    size = float(np.ptp(outer.corners, axis=0).max())
    p, q = (_points(edit, handles, n, rng) for handles in (edit.deformed.handles, edit.inner.handles))
    back, there = warp.to_canonical(p), warp.to_deformed(q)
    dets = np.concatenate([np.linalg.det(back.jacobian), 1.0 / np.linalg.det(there.jacobian)])
    trips = [warp.to_deformed(back.points).points - p, warp.to_canonical(there.points).points - q]
    u = rng.uniform(-1.0, 1.0, (n, 3))
    u /= np.abs(u).max(axis=1, keepdims=True)
    on_faces = hexahedron.points(outer.corners, 0.5 + 0.5 * u)
    low, high = outer.aabb
    around = 0.5 * (low + high) + 0.5 * (high - low) * u * rng.uniform(1.001, 2.0, (n, 1))
    moved = EditStack([edit]).to_canonical(around).points - around
    rim = warp.shell.to_canonical(on_faces)[0] - on_faces
    surface = surface_points(edit.deformed, n, rng)
    across = 1e-10 * size * rng.normal(size=surface.shape)
    sides = [warp.to_canonical(surface + sign * across).points for sign in (-1.0, 1.0)]
    return (
        float(dets.min()),
        float(np.abs(moved).max() / size),
        float(np.abs(rim).max() / size),
        float(max(np.linalg.norm(trip, axis=1).max() for trip in trips) / size),
        float(np.linalg.norm(sides[1] - sides[0], axis=1).max() / size),
    )


def surface_points(cage: Cage, n: int, rng: np.random.Generator) -> Array:
    """Random points [n,3] of a cage's surface; of control points, of the ends of their reach."""
    if isinstance(cage, MeshCage):
        corners = cage.vertices[cage.triangles[rng.integers(0, len(cage.triangles), n)]]
        return np.einsum("nk,nkc->nc", rng.dirichlet(np.ones(3), n), corners)
    if isinstance(cage, ControlPoints):
        directions = rng.normal(size=(n, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        centers = cage.points[rng.integers(0, len(cage.points), n)]
        return np.asarray(centers + cage.radius * directions @ cage.linear.T)
    u = rng.uniform(-1.0, 1.0, (n, 3))
    u = 0.5 + 0.5 * u / np.abs(u).max(axis=1, keepdims=True)
    if isinstance(cage, LatticeCage):
        return bspline_lattice.evaluate(cage.control_points, cage.shape, cage.interpolation, u)[0]
    return hexahedron.points(cage.corners, u)


def _points(edit: Continuous, handles: Array, n: int, rng: np.random.Generator) -> Array:
    """Points in the outer cage, half of them around handles."""
    origin, frame = edit.outer.frame
    spread = origin + rng.random((n - n // 2, 3)) @ frame.T
    scale = 0.15 * np.ptp(edit.inner.corners, axis=0)
    near = handles[rng.integers(0, len(handles), n // 2)] + scale * rng.normal(size=(n // 2, 3))
    points = np.concatenate([spread, near])
    return points[edit.outer.contains(points)]


def run(task: tuple[str, int, int]) -> Promises:
    """Promises of a kind's edit of a number, at so many points."""
    kind, number, points = task
    edit, seed, refused = possible_edit(kind, number)
    return Promises(kind, number, seed, refused, *measure(edit, points, number))


def run_compiled(task: tuple[str, int, int]) -> Promises:
    """`run`, boxes by the flow shell's kernel in float64: in numpy one takes seconds."""
    from benchmarks import flow_random
    from cagefield.compute import devices

    kind, number, points = task
    if kind != "box":
        return run(task)
    devices.start("cpu", double=True)
    edit, seed, refused = possible_edit(kind, number)
    found = flow_random.measure(edit, np.random.default_rng(number), points, np.float64, False)
    measured = (found.least, found.moved, found.still, found.trip, found.face)
    return Promises(kind, number, seed, refused, *measured)


def tasks(
    edits: int,
    points: int,
    done: Iterable[Promises],
    kinds: Collection[str] = tuple(KINDS),
    last_first: bool = False,
) -> Iterator[tuple[str, int, int]]:
    """The tasks of so many edits whose kinds take turns, of these kinds; those that are done are left out."""
    known = {(each.kind, each.number) for each in done}
    for n in reversed(range(edits)) if last_first else range(edits):
        kind, number = list(KINDS)[n % len(KINDS)], n // len(KINDS)
        if kind in kinds and (kind, number) not in known:
            yield kind, number, points


def table(rows: Iterable[Promises], points: int, command: str) -> Table:
    """The worst of each promise by kind, with the number of edits that break one."""
    rows = list(rows)
    cells = []
    for kind in KINDS:
        mine = [row for row in rows if row.kind == kind]
        if not mine:
            continue
        least = [row.least_det for row in mine]
        worst = (
            f"{max(getattr(row, name) for row in mine):.1e}" for name in ("outside", "rim", "trip", "jump")
        )
        refused = sum(row.refused for row in mine)
        cells.append(
            (
                kind,
                str(len(mine)),
                f"{refused / (refused + len(mine)):.1%}",
                f"{min(least):.1e}",
                f"{np.median(least):.2f}",
                *worst,
                str(sum(bool(row.failures) for row in mine)),
            )
        )
    broken = Counter(name for row in rows for name in row.failures)
    named = ", ".join(f"{name} {count}" for name, count in broken.items()) or "none"
    notes = (
        f"{len(rows)} random edits, {points} points of each sort per edit; exact maps in float64.",
        "Asked: det J > 0, identity outside and on the outer faces within 1e-6, round trips within 1e-4,"
        " jumps at the inner surface within 1e-6, of boxes 1e-3.",
        "Distances are shares of the outer cage's size; det J is that of the map to canonical space, of boxes"
        " to deformed space.",
        f"Broken promises: {named}.",
        f"Machine: {Machine.here()}",
        f"Command: `{command}`",
    )
    columns = (
        "inner cage", "edits", "draws refused", "least det J", "median of it",
        "outside", "outer faces", "round trip", "jump", "edits that fail",
    )  # fmt: skip
    return Table("Promises of continuous edits over random ones of every kind", columns, tuple(cells), notes)


def read_log(log: Path) -> list[Promises]:
    """Rows of a log; none where it is not there yet. Lines that a kill has cut off are left out."""
    lines = log.read_text(encoding="utf-8").splitlines() if log.is_file() else []
    return [Promises(**json.loads(line)) for line in lines if line.endswith("}")]


def append(log: Path, row: Promises) -> None:
    """One more row at the end of a log; on a line of its own after one that a kill has cut off."""
    with log.open("a+", encoding="utf-8") as file:
        file.seek(0)
        start = "" if not (before := file.read()) or before.endswith("\n") else "\n"
        file.write(start + json.dumps(asdict(row)) + "\n")


def main() -> None:
    """Measure, print the edits that fail and the table, and write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--edits", type=int, default=10_000, help="number of random edits")
    parser.add_argument("--points", type=int, default=24, help="points of each sort per edit")
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--last-first", action="store_true", help="begin with the last edits")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--log", type=Path, help="file of finished edits, from which a run goes on")
    parser.add_argument("--out", type=Path, help="Markdown file for the table")
    options = parser.parse_args()
    rows = [] if options.log is None else read_log(options.log)
    todo = list(tasks(options.edits, options.points, rows, options.kinds, options.last_first))
    with multiprocessing.get_context("spawn").Pool(options.processes) as pool:
        for row in pool.imap_unordered(run_compiled, todo):
            rows.append(row)
            if options.log is not None:
                append(options.log, row)
            if row.failures:
                print(f"{', '.join(row.failures)}: {row}", flush=True)
    command = f"python -m benchmarks.edits.random_promises --edits {options.edits} --points {options.points}"
    result = table(rows, options.points, command)
    result.show()
    if options.out is not None:
        write_text(options.out, result.markdown())


if __name__ == "__main__":
    main()
