"""Random edits of lattices."""

from __future__ import annotations

import numpy as np

from cagefield.edits import Continuous, Edit
from cagefield.edits import operations as ops
from cagefield.errors import CagefieldError
from cagefield.geometry.cage import Cage
from cagefield.geometry.point_deformers import FALLOFF_CURVES, FIXED

KINDS = ("point", "points", "bend", "twist", "taper", "translate", "rotate", "scale", "corner")
PLACES = tuple(map(str, FIXED))


def random_operation(rng: np.random.Generator, points: int) -> ops.Operation:
    """An operation of a random kind on a lattice with so many points, in a cage of about unit size."""
    kind, axis, fixed = str(rng.choice(KINDS)), str(rng.choice(list("xyz"))), str(rng.choice(PLACES))
    by = ops.displacement(0.2 * rng.normal(size=3), "by")
    if kind == "point":
        return ops.MovePoint(int(rng.integers(points)), by)
    if kind == "points":
        chosen = rng.choice(points, min(points, int(rng.integers(1, 6))), replace=False)
        radius, falloff = float(rng.uniform(0.0, 0.6)), str(rng.choice(FALLOFF_CURVES))
        return ops.MovePoints(tuple(int(n) for n in chosen), by, radius, falloff)
    if kind == "bend":
        return ops.Bend(axis, float(rng.uniform(-200, 200)), "", fixed)
    if kind == "twist":
        return ops.Twist(axis, float(rng.uniform(-250, 250)), fixed)
    if kind == "taper":
        return ops.Taper(axis, float(rng.uniform(0.4, 2.0)), fixed)
    if kind == "translate":
        return ops.Translate(by)
    if kind == "rotate":
        return ops.Rotate(ops.displacement(rng.uniform(-90, 90, 3), "by"))
    if kind == "scale":
        return ops.Scale(ops.displacement(rng.uniform(0.6, 1.5, 3), "by"))
    return ops.MoveCorner(int(rng.integers(8)), by)


def random_lattice_edit(seed: int, interpolation: str | None = None) -> Continuous:
    """A possible edit: a lattice in a box, one to three operations, each as far as it goes.

    Without `interpolation` seven of ten lattices are B-splines.
    """
    rng = np.random.default_rng(seed)
    cells = rng.integers(1, rng.choice([3, 5, 8]), 3)
    turn = rng.uniform(-0.5, 0.5, 3) * (rng.random() < 0.5)
    box = Cage.box(rng.uniform(-0.1, 0.1, 3), rng.uniform(0.3, 1.0, 3), turn)
    drawn = "bspline" if rng.random() < 0.7 else "linear"
    inner = box.subdivided([int(n) for n in cells], interpolation or drawn)
    outer = inner.grown(rng.uniform(0.15, 0.8))
    if rng.random() < 0.4:
        outer = Cage.box((0, 0, 0), rng.uniform(2.2, 3.0, 3))
    edit = Edit.continuous(inner, outer)
    for _ in range(rng.integers(1, 4)):
        operation = random_operation(rng, len(inner.points))
        for share in 0.6 ** np.arange(10):
            try:
                tried = edit.then(operation.part(float(share)))
            except CagefieldError:
                continue
            if outer.contains(tried.deformed.handles).all() and tried.is_possible:
                edit = tried
                break
    return edit
