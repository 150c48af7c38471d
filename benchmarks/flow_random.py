"""Prints the worst of the flow shell's promises over many random edits.

    python benchmarks/flow_random.py --edits 10000

Both cages are deformed in half of the edits; each has one to three operations: turns to 180 degrees,
scales from 0.3 to what fits, shears, moves, drags of corners, edges and faces, to 98% of what is safe.
Points of the shell are random, a third of them close to the inner cage. Errors are shares of the outer cage's
size. An edit whose first cages, or operations, are impossible is drawn again, and counted.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy.spatial.transform import Rotation

from cagefield.cages import Cage
from cagefield.edits import Edit
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
from cagefield.errors import CagefieldError
from cagefield.hexahedron import Array
from cagefield.warps import FlowShell
from cagefield.warps.flow_motion import Extended


def random_edit(rng: np.random.Generator) -> Edit:
    """An edit that passes `check`. Raises `CagefieldError` where the draw makes an impossible one."""
    bend = 0.15 * rng.integers(2)
    outer = Cage.box(rng.uniform(-1, 1, 3), rng.uniform(1, 3, 3), rng.uniform(-3, 3, 3))
    A, b = outer.affine
    inner = Cage.box(b + A @ rng.uniform(0.3, 0.7, 3), rng.uniform(0.2, 0.9, 3), rng.uniform(-3, 3, 3))
    inner = Cage(inner.corners + bend * rng.uniform(-1, 1, (8, 3)) @ inner.affine[0].T)
    outer = Cage(outer.corners + 0.7 * bend * rng.uniform(-1, 1, (8, 3)) @ A.T)
    edit = Edit(inner, outer)
    edit.check()
    for _ in range(rng.integers(1, 4)):
        operation = random_operation(rng)
        part = edit.safe_fraction(operation)
        edit = edit.then(operation.part(1.0 if part == 1.0 else 0.98 * part))
    edit.check()
    return edit


def random_operation(rng: np.random.Generator) -> Operation:
    """One of the seven kinds."""
    x, y, z = rng.uniform(-0.6, 0.6, 3).tolist()
    kind = rng.integers(7)
    if kind == 0:
        return Translate((x, y, z))
    if kind == 1:
        axis = rng.normal(size=3)
        turn = rng.choice([1.0, rng.random()]) * np.pi * axis / np.linalg.norm(axis)
        return Rotate.from_radians(Rotation.from_rotvec(turn).as_euler("XYZ"))
    if kind == 2:
        return Scale.of(rng.choice([0.3, 3.0, float(np.exp(x))], 3 if rng.random() < 0.5 else None))
    if kind == 3:
        return Shear(xy=x, zx=y)
    if kind == 4:
        return MoveCorner(int(rng.integers(8)), (x, y, z))
    if kind == 5:
        return MoveEdge((2, 6), (x, y, z))
    return MoveFace(str(rng.choice(["+x", "-y", "+z"])), (x, y, z))


def measure(edit: Edit, rng: np.random.Generator, n: int) -> tuple[float, float, float, float, float]:
    """(least det, identity error, inner face's error, round trip's error, steps)."""
    assert edit.outer is not None
    shell = FlowShell(edit.inner, edit.deformed, edit.outer)
    size = float(np.ptp(edit.outer.corners, axis=0).max())
    origin, frame = edit.outer.frame
    place = Extended.of(edit.deformed)
    near = on_cube(rng, n // 3) * rng.uniform(1.0, 1.2, (n // 3, 1))
    p = np.concatenate([origin + rng.random((n, 3)) @ frame.T, place.points(near)])
    p = p[edit.outer.contains(p)]
    p = p[~edit.deformed.contains(p)]
    face = on_cube(rng, 8)
    still = Extended.of(edit.outer).points(on_cube(rng, 8))
    q, J = shell.to_canonical(np.concatenate([p, place.points(face), still]))
    k = len(p)
    inside = np.abs(q[k : k + 8] - Extended.of(edit.inner).points(face)).max()
    back = shell.to_deformed(q[:k])[0]
    return (
        float(1.0 / np.linalg.det(J[:k]).max()) if (np.linalg.det(J[:k]) > 0.0).all() else -1.0,
        float(np.abs(q[k + 8 :] - still).max() / size),
        float(inside / size),
        float(np.abs(back - p).max() / size),
        float(len(shell.knots) - 1),
    )


def on_cube(rng: np.random.Generator, n: int) -> Array:
    """Random xi [N,3] on the faces of [-1,1]^3."""
    xi = rng.uniform(-1.0, 1.0, (n, 3))
    return xi / np.abs(xi).max(axis=1, keepdims=True)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--edits", type=int, default=10_000, help="number of random edits")
    parser.add_argument("--points", type=int, default=24, help="points per edit")
    parser.add_argument("--minutes", type=float, default=1e9, help="stop after this long")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    start, rows, refused = time.monotonic(), [], 0
    while len(rows) < options.edits and time.monotonic() - start < 60.0 * options.minutes:
        try:
            edit = random_edit(rng)
        except CagefieldError:
            refused += 1
            continue
        if edit.changes_anything:
            rows.append(measure(edit, rng, options.points))
    det, identity, inside, trip, steps = np.array(rows).T
    print(f"{len(rows)} edits ({refused} draws refused), {options.points} points each")
    print(
        f"least det J {det.min():.2e}, median {np.median(det):.2f};"
        f" not positive in {int((det <= 0.0).sum())} edits"
    )
    print(f"identity on the outer cage: worst {identity.max():.1e}")
    print(f"phi on the inner cage: worst {inside.max():.1e}, median {np.median(inside):.1e}")
    print(f"round trip: worst {trip.max():.1e}, median {np.median(trip):.1e}")
    print(f"steps: median {int(np.median(steps))}, most {int(steps.max())}")


if __name__ == "__main__":
    main()
