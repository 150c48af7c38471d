"""Proof that the correction of a lattice shell is one to one, with its cost, over random lattices.

    python -m benchmarks.correction_proof --edits 20 --out benchmarks/results/correction_proof.md

The shell's map around a lattice is Phi(R(X)), see `LatticeShell`. Phi and the spline inside are proven to be
one to one; R(X) = X + rho(X) r(clamp X) is sampled by the product. Here det dR/dX > 0 is proven: R is the
identity on the outer cage and one to one on the inner one, so then it is one to one between them.

On a patch of a face, an edge or a corner of the canonical cage, r and its slopes along it are enclosed, one
step of the flow Phi^-1 after the other. The slopes of a step lie in the range of the velocity's differences
over a box that holds the midpoints (`slope_range`, with all kinks between cells); norms bound the error of
the product of the steps (`flow_bound`). Beyond a patch, in boxes that are halved, rho and its gradient are
intervals (`fade_range`), and 1 + d(rho r)/dX is regular where its middle's least singular value exceeds the
error. A patch that is open is halved, down to `--least` of the outer cage's half-width.

Where patches are left open, the determinant is sampled beyond them: folds that the product's samples miss.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, write_text
from benchmarks.edits.random_edits.lattices import random_lattice_edit
from cagefield.geometry import bspline_lattice
from cagefield.typing import Array
from cagefield.warps.lattice_shell import LatticeShell, Surroundings

PATCHES = 4
"""Patches along an axis of a face, at least; a whole number for each of the lattice's cells."""

MOST_LEFT = 5000


@dataclass(frozen=True)
class Proof:
    """Patches evaluated and left open, rows [n,7] of the first of those; see `correction_patches.prove`."""

    evaluated: int
    open: int
    left: Array


def first_patches(shape: tuple[int, int, int], least: int = PATCHES) -> Array:
    """Patches [n,7] of a lattice's 6 faces, 12 edges and 8 corners; see `correction_patches.prove`."""
    rows: list[tuple[float, ...]] = []
    for axis in range(3):
        counts = (-(-least // (shape[k] - 1)) * (shape[k] - 1) for k in ((axis + 1) % 3, (axis + 2) % 3))
        b, c = (np.linspace(0.0, 1.0, n + 1) for n in counts)
        for side in (0, 1):
            rows += [(axis, side, 0, *bs, *cs) for bs in pairwise(b) for cs in pairwise(c)]
            for end in (0, 1):
                rows += [(axis, side, 1, end, end, *cs) for cs in pairwise(c)]
                if axis == 0:
                    rows += [(axis, side, 2, end, end, last, last) for last in (0, 1)]
    return np.array(rows, dtype=np.float64)


def proof(around: Surroundings, least: float, most: int, patches: Array | None = None) -> Proof:
    """Proof of a correction in a box as outer cage: patches not shorter than `least`, `most` evaluations."""
    from benchmarks.correction_patches import prove

    confines = around.flow.confines
    assert confines.is_affine, "the proof is made for outer cages with parallel faces"
    A, b = around.inner.affine
    net = (around.deformed.control_points - confines.center) @ confines.inverse.T
    left = np.empty((MOST_LEFT, 7))
    evaluated, count = prove(
        bspline_lattice.padded(net, around.deformed.shape),
        around.deformed.interpolation == "linear",
        around.flow.velocities,
        around.flow.steps,
        (b - confines.center) @ confines.inverse.T,
        np.ascontiguousarray(confines.inverse @ A),
        np.ascontiguousarray(A),
        confines.heights,
        first_patches(around.deformed.shape) if patches is None else patches,
        least,
        most,
        left,
    )
    return Proof(evaluated, count, left[: min(count, MOST_LEFT)])


def beyond(around: Surroundings, rows: Array, n: int, rng: np.random.Generator) -> Array:
    """Canonical points [len(rows) * n,3] around the cage, beyond patches [m,7]: more of them near it."""
    A, b = around.inner.affine
    kinds = rows[:, 2].astype(int).repeat(n)
    axes = (rows[:, 0].astype(int).repeat(n)[:, None] + np.arange(3)) % 3
    places = np.concatenate([rows[:, 1:2], rows[:, 3::2]], axis=1).repeat(n, axis=0)
    sizes = np.concatenate([0.0 * rows[:, :1], rows[:, 4::2] - rows[:, 3::2]], axis=1).repeat(n, axis=0)
    local = places + sizes * rng.random(places.shape)
    ways = np.where(places > 0.5, 1.0, -1.0) * (np.arange(3) <= kinds[:, None]) * rng.random(places.shape)
    at = np.arange(len(axes))[:, None]
    u, out = np.empty_like(local), np.empty_like(local)
    u[at, axes], out[at, axes] = local, ways
    confines = around.flow.confines
    z, dz = (b + u @ A.T - confines.center) @ confines.inverse.T, out @ A.T @ confines.inverse.T
    room = ((1.0 - z * np.sign(dz)) / np.maximum(np.abs(dz), 1e-9)).min(axis=1, keepdims=True)
    return np.asarray(b + (u + 0.99 * out * room * rng.random((len(u), 1)) ** 2) @ A.T)


def least_det(around: Surroundings, rows: Array, seed: int = 0) -> float:
    """Least det dR/dX at 64 points beyond each of 200 of the patches: a sample. NaN without patches."""
    rng = np.random.default_rng(seed)
    rows = rows[rng.permutation(len(rows))[:200]]
    if len(rows) == 0:
        return float("nan")
    points = beyond(around, rows, 64, rng)
    return float(np.linalg.det(np.eye(3) + around.correction(points)[1]).min())


def main() -> None:
    """Print a row for each edit, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--edits", type=int, default=20, help="random lattices, linear and B-spline in turns")
    parser.add_argument("--least", type=float, default=0.01, help="shortest patch, of the half-width")
    parser.add_argument("--most", type=int, default=4000, help="patches evaluated for an edit, at most")
    parser.add_argument("--out", type=Path, help="Markdown file for the table")
    options = parser.parse_args()
    cells, ready = [], False
    for n in range(options.edits):
        interpolation = ("bspline", "linear")[n % 2]
        edit = random_lattice_edit(n // 2, interpolation)
        shell = edit.exact_warp.shell
        assert isinstance(shell, LatticeShell)
        if edit.deformed.has_shape_of(edit.inner):
            continue
        around = shell.around
        if not ready:
            proof(around, options.least, 1)  # compilation
            ready = True
        started = time.process_time()
        found = proof(around, options.least, options.most)
        spent = 1e3 * (time.process_time() - started)
        row = (
            f"{interpolation} {n // 2}",
            f"{len(around.flow.steps)}, {around.flow.cells}",
            f"{around.slope:.2f}",
            f"{around.least_edge_det:.2f}",
            str(found.evaluated),
            str(found.open),
            f"{spent:.0f}",
            f"{least_det(around, found.left):.2f}" if found.open else "",
        )
        print(*row, flush=True)
        cells.append(row)
    proven = sum(row[5] == "0" for row in cells)
    notes = (
        f"{proven} of {len(cells)} proven; patches not shorter than {options.least:g} of the outer cage's"
        f" half-width, {options.most} evaluations at most.",
        "Sampled slope and determinant: `Surroundings.slope` and `Surroundings.least_edge_det`, which decide"
        " in the product. Last column: least det dR/dX at points beyond the patches left open, a sample.",
        f"Machine: {Machine.here()}",
        f"Command: `python -m benchmarks.correction_proof --edits {options.edits} --least {options.least:g}"
        f" --most {options.most}`",
    )
    columns = (
        "lattice", "steps, cells", "sampled slope", "sampled det", "patches evaluated", "left open",
        "CPU ms", "least det beyond those",
    )  # fmt: skip
    table = Table("Proof of lattice shells' corrections by subdivision", columns, tuple(cells), notes)
    table.show()
    if options.out is not None:
        write_text(options.out, table.markdown())


if __name__ == "__main__":
    main()
