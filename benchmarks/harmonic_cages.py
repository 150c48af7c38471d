"""Mean value against harmonic coordinates for the inside of a mesh cage: errors on bends with a closed form.

    python -m benchmarks.harmonic_cages --out benchmarks/results/harmonic_cages.md

A cage's vertices go where a closed form takes them, and points inside are compared with it. Cages: those of
the examples `digger_bend_arm.yaml` and `plant_twist_stem.yaml` as triangles, by the example's angle and by
more; a cable that is bent into a half circle and made straight, a concave cage. Methods:

- coordinates as weights: x = sum lambda_j v_j', the usual way;
- coordinates as a velocity: dx/dt = sum lambda_j(x, t) dv_j/dt on the closed form's way, in midpoint steps;
- the product's map, `MeshShell`: the harmonic velocity without the affine part, on the flow's grid.

Harmonic coordinates by linear finite elements on tetrahedra, the cage's own triangles at the boundary; the
tetrahedra go along with a flow.

Source: Joshi et al., "Harmonic Coordinates for Character Articulation" (2007); Ju et al., "Mean value
coordinates for closed triangular meshes" (2005).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from benchmarks.common.machine import Machine
from benchmarks.common.tables import Table, write_text
from cagefield.geometry import MeshCage, bspline_lattice
from cagefield.geometry.cage import Cage
from cagefield.geometry.mean_value import mean_value_coordinates
from cagefield.procedural.deformations import ArcBend
from cagefield.typing import Array
from cagefield.warps.cage_maps import flow_between
from cagefield.warps.falloff import Falloff

Way = Callable[[Array, float], Array]
"""(canonical points [N,3], share of the way) -> points [N,3]."""

STEPS = 8


@dataclass(frozen=True)
class Case:
    """A box as cage with cells along its axes, and its way; `back`: from the way's end to the box."""

    low: tuple[float, float, float]
    size: tuple[float, float, float]
    cells: tuple[int, int, int]
    way: Way
    back: bool = False

    @property
    def fine(self) -> tuple[int, int, int]:
        """Cells of tetrahedra in each cell of the cage's faces, along x, y, z."""
        return (4, 4, 2) if self.cells[0] == 1 else (2, 2, 2)

    def at(self, points: Array, share: float) -> Array:
        """Points [N,3] of the box on the way."""
        return self.way(points, 1.0 - share if self.back else share)


def bend(low: tuple[float, ...], size: tuple[float, ...], degrees: float) -> Way:
    """The box bent along z from its lower end, towards x, about its middle line."""
    start = (low[0] + 0.5 * size[0], low[1] + 0.5 * size[1], low[2])

    def way(points: Array, share: float) -> Array:
        if share == 0.0:
            return points
        arc = ArcBend(start, (0, 0, 1), (1, 0, 0), size[2], float(np.radians(degrees)) * share)
        return np.asarray(arc.forward(points.T)).T

    return way


def twist(low: tuple[float, ...], size: tuple[float, ...], degrees: float) -> Way:
    """The box twisted about its middle line, its lower end fixed."""
    middle = np.array(low[:2]) + 0.5 * np.array(size[:2])

    def way(points: Array, share: float) -> Array:
        angle = share * np.radians(degrees) * (points[:, 2] - low[2]) / size[2]
        (x, y), c, s = (points[:, :2] - middle).T, np.cos(angle), np.sin(angle)
        return np.stack([middle[0] + c * x - s * y, middle[1] + s * x + c * y, points[:, 2]], axis=1)

    return way


ARM = ((0.47, -0.32, -0.36), (0.44, 0.42, 0.94))
STEM = ((-0.7, -0.38, 0.01), (1.0, 1.0, 0.96))
CABLE = ((-0.1, -0.1, 0.0), (0.2, 0.2, 1.0))
CASES: dict[str, Case] = {
    "arm bent by 40°": Case(*ARM, (1, 1, 7), bend(*ARM, 40)),
    "arm bent by 120°": Case(*ARM, (1, 1, 7), bend(*ARM, 120)),
    "stem twisted by 90°": Case(*STEM, (1, 1, 7), twist(*STEM, 90)),
    "stem twisted by 90°, 3x3 cells": Case(*STEM, (3, 3, 7), twist(*STEM, 90)),
    "cable of 180° made straight": Case(*CABLE, (1, 1, 10), bend(*CABLE, 180), back=True),
}


def grid(case: Case, fine: tuple[int, int, int]) -> tuple[Array, tuple[int, int, int]]:
    """(points [n,3] of an even grid over the box, its shape), x fastest."""
    shape = tuple(n * f + 1 for n, f in zip(case.cells, fine, strict=True))
    u = bspline_lattice.grid(shape)  # type: ignore[arg-type]
    return np.array(case.low) + u * np.array(case.size), shape  # type: ignore[return-value]


def tetrahedra(shape: tuple[int, int, int]) -> NDArray[np.int64]:
    """Six tetrahedra [6 n,4] in each cell of a grid (Kuhn), all positive."""
    steps = np.array([1, shape[0], shape[0] * shape[1]])
    i, j, k = (g.ravel() for g in np.meshgrid(*(np.arange(n - 1) for n in shape), indexing="ij"))
    first = i + j * steps[1] + k * steps[2]
    found = []
    for order in permutations(range(3)):
        ways = np.concatenate([[0], np.cumsum(steps[list(order)])])
        even = np.linalg.det(np.eye(3)[list(order)]) > 0.0
        found.append(first[:, None] + (ways if even else ways[[0, 2, 1, 3]]))
    return np.concatenate(found)


def cage_of(case: Case) -> tuple[Array, NDArray[np.int64]]:
    """(points [V,3] in the box, triangles [F,3]) of the cage: the boundary of a grid of one point a cell."""
    points, shape = grid(case, (1, 1, 1))
    tets = tetrahedra(shape)
    faces = np.concatenate([tets[:, [1, 2, 3]], tets[:, [0, 3, 2]], tets[:, [0, 1, 3]], tets[:, [0, 2, 1]]])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    triangles = faces[first[count == 1]]
    used, at = np.unique(triangles, return_inverse=True)
    return points[used], at.reshape(-1, 3)


def on_triangles(points: Array, vertices: Array, triangles: NDArray[np.int64]) -> Array:
    """Linear coordinates [N,V] of points [N,3] on the surface of a cage."""
    found = np.zeros((len(points), len(vertices)))
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    e, f = b - a, c - a
    normal = np.cross(e, f)
    square = (normal**2).sum(axis=1)
    for n, p in enumerate(points):
        d = p - a
        v = (np.cross(d, f) * normal).sum(axis=1) / square
        w = (np.cross(e, d) * normal).sum(axis=1) / square
        off = np.abs((d * normal).sum(axis=1)) / square**0.75
        outside = np.maximum(np.maximum(-v, -w), v + w - 1.0)
        k = int(np.argmin(np.maximum(outside, 0.0) + off))
        found[n, triangles[k]] = 1.0 - v[k] - w[k], v[k], w[k]
    return found


def stiffness(points: Array, tets: NDArray[np.int64]) -> sparse.csr_matrix:
    """Laplace's stiffness matrix [n,n] of linear elements."""
    x = points[tets]
    edges = np.transpose(x[:, 1:] - x[:, :1], (0, 2, 1))  # columns
    volume = np.linalg.det(edges) / 6.0
    slopes = np.linalg.inv(edges)
    slopes = np.concatenate([-slopes.sum(axis=1, keepdims=True), slopes], axis=1)  # [T,4,3]
    local = np.abs(volume)[:, None, None] * (slopes @ np.transpose(slopes, (0, 2, 1)))
    rows, columns = np.repeat(tets, 4, axis=1).ravel(), np.tile(tets, (1, 4)).ravel()
    return sparse.coo_matrix((local.ravel(), (rows, columns)), shape=2 * (len(points),)).tocsr()


def harmonic(points: Array, tets: NDArray[np.int64], edge: NDArray[np.int64], values: Array) -> Array:
    """Harmonic values [n,C] at a mesh's points, with values [E,C] at points `edge` [E]."""
    free = np.setdiff1d(np.arange(len(points)), edge)
    K = stiffness(points, tets)
    found = np.empty((len(points), values.shape[1]))
    found[edge] = values
    found[free] = splu(K[free][:, free].tocsc()).solve(-(K[free][:, edge] @ values))
    return found


def errors(case: Case, steps: int = STEPS) -> dict[str, Array]:
    """Distances [n] from the closed form of the points inside, as shares of the longest edge, by method."""
    box, shape = grid(case, case.fine)
    tets = tetrahedra(shape)
    rest, triangles = cage_of(case)
    low, size = np.array(case.low), np.array(case.size)
    u = (box - low) / size
    edge = np.flatnonzero((np.abs(u - 0.5) > 0.5 - 1e-9).any(axis=1))
    inside = np.setdiff1d(np.arange(len(box)), edge)
    surface = on_triangles(box[edge], rest, triangles)  # of the box: the cage's triangles go along
    start, end = case.at(box, 0.0), case.at(box, 1.0)
    # The tetrahedra's boundary is the cage's: flat between its vertices.
    start[edge] = surface @ case.at(rest, 0.0)
    found = {}

    def mean_value(vertices: Array, x: Array, values: Array) -> Array:
        return mean_value_coordinates(vertices, triangles, x[inside]) @ values

    def harmonic_blend(vertices: Array, x: Array, values: Array) -> Array:
        return harmonic(x, tets, edge, surface @ values)[inside]

    for name, blend in (("mean value", mean_value), ("harmonic", harmonic_blend)):
        found[f"{name}, weights"] = blend(case.at(rest, 0.0), start, case.at(rest, 1.0))
        x = start.copy()
        for n in range(steps):
            v0, v1 = case.at(rest, n / steps), case.at(rest, (n + 1) / steps)
            middle = x.copy()
            middle[inside] += 0.5 * blend(v0, x, v1 - v0)
            middle[edge] = surface @ (0.5 * (v0 + v1))
            x[inside] += blend(0.5 * (v0 + v1), middle, v1 - v0)
            x[edge] = surface @ v1
        found[f"{name}, velocity"] = x[inside]
    found["product"] = product(case, rest, triangles, start[inside])
    scale = max(case.size)
    return {name: np.linalg.norm(x - end[inside], axis=1) / scale for name, x in found.items()}


def product(case: Case, rest: Array, triangles: NDArray[np.int64], points: Array) -> Array:
    """The mesh shell's map of canonical points [n,3], along the closed form's way, in a wide outer box."""
    inner = MeshCage(case.at(rest, 0.0), triangles)
    states = tuple(case.at(rest, s) for s in np.linspace(0.0, 1.0, 5)[1:-1])
    deformed = MeshCage(case.at(rest, 1.0), triangles, way=states)
    both = np.concatenate([case.at(rest, s) for s in np.linspace(0.0, 1.0, 9)])
    low, high = both.min(axis=0), both.max(axis=0)
    outer = Cage.box(0.5 * (low + high), high - low + 0.8 * max(case.size))
    shell = flow_between(inner, deformed, outer, Falloff())
    problem = shell.problem()
    assert problem is None, problem
    return np.asarray(shell.to_deformed(points)[0])


def main() -> None:
    """Print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--out", type=Path, help="Markdown file for the table")
    options = parser.parse_args()
    rows, names = [], ()
    for name, case in CASES.items():
        found = errors(case)
        names = tuple(found)
        cells = (f"{1e3 * np.sqrt((e**2).mean()):.1f} ({1e3 * e.max():.0f})" for e in found.values())
        rows.append((name, str(len(cage_of(case)[1])), *cells))
        print(*rows[-1], flush=True)
    notes = (
        "Distance of points inside from the closed form, in thousandths of the cage's longest edge: root of"
        " the mean square (largest).",
        f"{STEPS} midpoint steps; finite elements with 4 x 4 x 2 cells in a cell of the cage, 2 of 3 x 3.",
        f"Machine: {Machine.here()}",
        "Command: `python -m benchmarks.harmonic_cages`",
    )
    table = Table("Inside of mesh cages: mean value and harmonic coordinates", ("case", "triangles", *names),
                  tuple(rows), notes)  # fmt: skip
    table.show()
    if options.out is not None:
        write_text(options.out, table.markdown())


if __name__ == "__main__":
    main()
