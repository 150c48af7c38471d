"""Prints the worst of the flow shell's promises over many random edits, and writes them as a table.

    python -m benchmarks.flow_random --edits 10000 --out benchmarks/results/flow_random.md

Each of the cages is bent in six of ten edits, by corners moved to up to 95% of what keeps it valid; then come
one to three operations: turns to 180 degrees, scales from 0.3 to what fits, shears, moves, drags of corners,
edges and faces; what would go too far is done to 98% of what is safe. An edit whose first cages, or
operations, are impossible is drawn again, and counted. Points of the shell are random, a third of them close
to the inner cage. The map is the renderer's kernel, compiled in float64 (--float32: as the renderer has it),
whose difference from the numpy reference is measured on every 100th edit. It ends Newton's method where
float32 does, which a shell that is squeezed by thousands multiplies: a round trip that it does not close is
taken with the reference, which is what `to_deformed` is. Errors are shares of the outer cage's size.
"""

import argparse
import multiprocessing
import time
from collections.abc import Callable
from dataclasses import astuple, dataclass
from pathlib import Path

import numpy as np
import quadrants as qd
from scipy.spatial.transform import Rotation

from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, write_text
from cagefield.compute import devices
from cagefield.edits import Edit, EditStack
from cagefield.edits.operations import (
    MoveCorner,
    MoveEdge,
    MoveFace,
    Operation,
    Rotate,
    Scale,
    Shear,
    Translate,
)
from cagefield.edits.safe_fraction import largest_of
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.geometry.cage_checks import are_valid
from cagefield.typing import Array, Mask
from cagefield.warps import FlowShell, flow_table
from cagefield.warps.extended_coordinates import Extended
from cagefield.warps.kernels import flow_shell
from cagefield.warps.newton_inverse import inverted

vec3 = qd.math.vec3
Points = qd.types.ndarray(dtype=vec3, ndim=1)

COMPARED = 100
"""Every so many edits are compared with the numpy reference."""

CLOSED = 1e-6
"""Round trips of the kernel that leave more are taken with the numpy reference."""


@dataclass(frozen=True)
class Promises:
    """Guarantees kept by one edit; errors as shares of the outer cage's size.

    least: least det of d(deformed)/d(canonical) over the shell's points, -1 where one is not positive; moved:
    of points outside the outer cage, through the stack; inside: of points in the inner cage, against the
    trilinear map; face: of the flow on the inner cage's faces, against the same; still: of the flow on the
    outer cage's faces; trip: of to_canonical(to_deformed(p)) against p; open_trip: the same with the kernel;
    steps: of Runge-Kutta; reference: against numpy, NaN where not compared.
    """

    least: float
    moved: float
    inside: float
    face: float
    still: float
    trip: float
    open_trip: float
    steps: float
    reference: float


@qd.kernel
def _map(points: Points, out: Points, table: Points):
    """Writes the image of each point, and the three columns of its Jacobian."""
    for n in range(points.shape[0]):
        for a in range(3):
            d = vec3(0.0, 0.0, 0.0)
            d[a] = 1.0
            q, v = flow_shell.flow_sample(points[n], d, table, 0)
            out[4 * n] = q
            out[4 * n + 1 + a] = v


@dataclass(frozen=True)
class Compiled:
    """The flow through a table, as a function of points [N,3]: (points [N,3], Jacobians [N,3,3])."""

    table: Array

    def __call__(self, points: Array) -> tuple[Array, Array]:
        kind = self.table.dtype
        out = np.zeros((4 * len(points), 3), kind)
        _map(np.ascontiguousarray(points, kind), out, self.table)
        rows = out.reshape(-1, 4, 3).astype(np.float64)
        return rows[:, 0], rows[:, 1:].transpose(0, 2, 1)


def random_edit(rng: np.random.Generator) -> Edit:
    """An edit that passes `check`. Raises `CagefieldError` where the draw makes an impossible one."""
    outer = Cage.box(rng.uniform(-1, 1, 3), rng.uniform(1, 3, 3), rng.uniform(-3, 3, 3))
    A, b = outer.affine
    inner = Cage.box(b + A @ rng.uniform(0.3, 0.7, 3), rng.uniform(0.2, 0.9, 3), rng.uniform(-3, 3, 3))
    inner, outer = bent(inner, rng), bent(outer, rng)
    edit = Edit.continuous(inner, outer)
    edit.check()
    for _ in range(rng.integers(1, 4)):
        operation = random_operation(rng)
        part = edit.safe_fraction(operation)
        edit = edit.then(operation.part(1.0 if part == 1.0 else 0.98 * part))
    edit.check()
    return edit


def bent(box: Cage, rng: np.random.Generator) -> Cage:
    """The box, or one with some or all corners moved by up to 95% of what keeps it valid."""
    corners = rng.choice([0, 1, 2, 8], p=[0.4, 0.2, 0.2, 0.2])
    by = np.zeros((8, 3))
    by[rng.choice(8, corners, replace=False)] = rng.uniform(-1, 1, (corners, 3))
    by = by @ box.affine[0].T

    def valid(t: Array) -> Mask:
        return are_valid(box.corners + t[:, None, None] * by)

    return Cage(box.corners + rng.uniform(0.0, 0.95) * largest_of(valid) * by)


def random_operation(rng: np.random.Generator) -> Operation:
    """One of the seven kinds."""
    x, y, z = rng.uniform(-0.6, 0.6, 3).tolist()
    kind = rng.integers(7)
    if kind == 0:
        return Translate((x, y, z))
    if kind == 1:
        axis = rng.normal(size=3)
        turn = rng.choice([1.0, rng.random()]) * np.pi * axis / np.linalg.norm(axis)
        return Rotate.from_rotation(Rotation.from_rotvec(turn).as_euler("XYZ"))
    if kind == 2:
        return Scale.from_factors(rng.choice([0.3, 3.0, float(np.exp(x))], 3 if rng.random() < 0.5 else None))
    if kind == 3:
        return Shear(xy=x, zx=y)
    if kind == 4:
        return MoveCorner(int(rng.integers(8)), (x, y, z))
    if kind == 5:
        return MoveEdge((2, 6), (x, y, z))
    return MoveFace(str(rng.choice(["+x", "-y", "+z"])), (x, y, z))


def measure(edit: Edit, rng: np.random.Generator, n: int, kind: type, compared: bool) -> Promises:
    """Guarantees kept by the edit, at about n points of each kind."""
    assert edit.outer is not None
    shell = FlowShell(edit.inner, edit.deformed, edit.outer)
    knots = shell.knots
    there, back = (Compiled(flow_table.table_along(shell, k).astype(kind)) for k in (knots, knots[::-1]))
    size = float(np.ptp(edit.outer.corners, axis=0).max())
    p = _shell_points(edit.outer, edit.deformed, rng, n)
    q, J = back(p)
    det = np.linalg.det(J)
    reference = float("nan")
    if compared:
        reference = float(np.abs(shell.to_canonical(p)[0] - q).max(initial=0.0) / size)
    face = on_cube(rng, n // 3)
    on_face = back(Extended.from_cage(edit.deformed).points(face))[0] - Extended.from_cage(edit.inner).points(
        face
    )
    rim = Extended.from_cage(edit.outer).points(on_cube(rng, n // 3))
    moved, inside = _moved(edit, rng, n), _inside(edit, rng, n)
    canonical = _shell_points(edit.outer, edit.inner, rng, n)
    open_trip = trip = _round_trip(back, canonical, there(canonical)[0], size)
    if trip > CLOSED:
        trip = _round_trip(shell.to_canonical, canonical, shell.to_deformed(canonical)[0], size)
    return Promises(
        least=float(1.0 / det.max()) if (det > 0.0).all() else -1.0,
        moved=moved / size,
        inside=inside / size,
        face=float(np.abs(on_face).max() / size),
        still=float(np.abs(back(rim)[0] - rim).max() / size),
        trip=trip,
        open_trip=open_trip,
        steps=float(len(knots) - 1),
        reference=reference,
    )


def _shell_points(outer: Cage, inner: Cage, rng: np.random.Generator, n: int) -> Array:
    """Points between the cages, a third of them near the inner one."""
    origin, frame = outer.frame
    near = on_cube(rng, n // 3) * rng.uniform(1.0, 1.2, (n // 3, 1))
    p = np.concatenate([origin + rng.random((n, 3)) @ frame.T, Extended.from_cage(inner).points(near)])
    return p[outer.contains(p) & ~inner.contains(p)]


def _moved(edit: Edit, rng: np.random.Generator, n: int) -> float:
    """How far the stack moves points around the outer cage."""
    assert edit.outer is not None
    p = Extended.from_cage(edit.outer).points(on_cube(rng, n) * rng.uniform(1.001, 2.0, (n, 1)))
    p = p[~edit.outer.contains(p)]
    return float(np.abs(EditStack([edit]).to_canonical(p).points - p).max(initial=0.0))


def _inside(edit: Edit, rng: np.random.Generator, n: int) -> float:
    """How far the stack's map of points in the inner cage is from the trilinear one."""
    xi = rng.uniform(-0.999, 0.999, (n, 3))
    q = EditStack([edit]).to_canonical(Extended.from_cage(edit.deformed).points(xi)).points
    return float(np.abs(q - Extended.from_cage(edit.inner).points(xi)).max())


def _round_trip(back: Callable[[Array], tuple[Array, Array]], q: Array, start: Array, size: float) -> float:
    """How far, as a share of the size, `back` leaves points from q, that it is inverted at from a start."""
    p, _ = inverted(back, q, start, size)
    return float(np.linalg.norm(back(p)[0] - q, axis=1).max(initial=0.0) / size)


def on_cube(rng: np.random.Generator, n: int) -> Array:
    """Random xi [N,3] on the faces of [-1,1]^3."""
    xi = rng.uniform(-1.0, 1.0, (n, 3))
    return xi / np.abs(xi).max(axis=1, keepdims=True)


def run(task: tuple[int, int, int, bool]) -> tuple[list[tuple[float, ...]], Array]:
    """(promises of a number of edits, draws refused [2]: all, because a cage is bent too far) from a seed."""
    seed, edits, points, double = task
    devices.start("cpu", double=double)
    kind = np.float64 if double else np.float32
    rng = np.random.default_rng(seed)
    rows: list[tuple[float, ...]] = []
    refused = np.zeros(2)
    while len(rows) < edits:
        try:
            edit = random_edit(rng)
        except CagefieldError as error:
            refused += 1, "bent too far" in str(error)
            continue
        if edit.changes_anything:
            compared = (seed * edits + len(rows)) % COMPARED == 0
            rows.append(astuple(measure(edit, rng, points, kind, compared)))
    return rows, refused


def table(rows: Array, refused: Array, points: int, command: str) -> Table:
    """The worst, the middle and the number of failures of each promise."""
    least, moved, inside, face, still, trip, open_trip, steps, reference = rows.T
    asked = (
        ("moved outside the outer cage", moved, 0.0),
        ("trilinear map inside the inner cage", inside, 1e-6),
        ("flow on the inner cage's faces", face, None),
        ("flow on the outer cage's faces", still, None),
        ("round trip", trip, 1e-4),
    )
    folded = str(int((least <= 0.0).sum()))
    cells = [("least det J", f"{least.min():.1e}", f"{np.median(least):.2f}", "> 0", folded)]
    for name, values, limit in asked:
        over = "-" if limit is None else str(int((values > limit).sum()))
        at_most = "-" if limit is None else f"{limit:g}"
        cells.append((name, f"{values.max():.1e}", f"{np.median(values):.1e}", at_most, over))
    compared = reference[~np.isnan(reference)]
    notes = (
        f"{len(rows)} random edits, about {points} points of each kind per edit. Of the draws"
        " {:.1%} are refused, {:.2%} because a cage is bent too far.".format(
            *refused / (len(rows) + refused[0])
        ),
        "Errors are shares of the outer cage's size.",
        f"Runge-Kutta steps: median {int(np.median(steps))}, most {int(steps.max())}.",
        f"Kernel against the numpy reference, {len(compared)} edits: worst {compared.max(initial=0.0):.1e}.",
        f"Round trips that the kernel leaves open by more than {CLOSED:g}, and the reference closes:"
        f" {int((open_trip > CLOSED).sum())}.",
        f"Machine: {Machine.here()}",
        f"Command: `{command}`",
    )
    columns = ("promise", "worst", "median", "asked", "edits that fail")
    return Table("Promises of the flow shell over random edits", columns, tuple(cells), notes)


def main() -> None:
    """Print the table, and write it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--edits", type=int, default=10_000, help="number of random edits")
    parser.add_argument("--points", type=int, default=24, help="points of each kind per edit")
    parser.add_argument("--float32", action="store_true", help="the kernel as the renderer has it")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, help="Markdown file for the table")
    options = parser.parse_args()
    share = min(50, options.edits)
    parts = -(-options.edits // share)
    tasks = [(options.seed + n, share, options.points, not options.float32) for n in range(parts)]
    rows: list[tuple[float, ...]] = []
    refused, start = np.zeros(2), time.monotonic()
    with multiprocessing.get_context("spawn").Pool(options.processes) as pool:
        for done, more in pool.imap_unordered(run, tasks):
            rows += done
            refused += more
            worst = min(row[0] for row in rows)
            print(
                f"{time.monotonic() - start:6.0f} s: {len(rows)} edits, least det J {worst:.1e}", flush=True
            )
    kind = " --float32" if options.float32 else ""
    command = f"python -m benchmarks.flow_random --edits {options.edits} --points {options.points}{kind}"
    result = table(np.array(rows), refused, options.points, command)
    result.show()
    if options.out is not None:
        write_text(options.out, result.markdown())


if __name__ == "__main__":
    main()
