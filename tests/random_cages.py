"""Random cages and edits for property tests, and an independent trilinear map to compare with."""

from __future__ import annotations

import os

import numpy as np
from hypothesis import HealthCheck, assume, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cagefield.edits import shell_kind
from cagefield.edits.edit import Edit
from cagefield.edits.operations import (
    MoveCorner,
    MoveEdge,
    MoveFace,
    Operation,
    Rotate,
    Scale,
    Shear,
    Translate,
    displacement,
)
from cagefield.edits.safe_fraction import is_valid, largest_safe
from cagefield.errors import CageError, EditError
from cagefield.geometry.cage import Cage

Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1)


def examples(count: int) -> settings:
    """Settings for a property test: always the same examples, times CAGEFIELD_EXAMPLES if that is set.

    How fast they are made is the machine's affair: no deadline, no complaint about slow generation.
    """
    times = int(os.environ.get("CAGEFIELD_EXAMPLES", "1"))
    return settings(
        max_examples=count * times,
        deadline=None,
        derandomize=True,
        suppress_health_check=[HealthCheck.too_slow],
    )


@st.composite
def cages(draw: st.DrawFn) -> Cage:
    """Boxes of any orientation and aspect to 100, their corners moved by 0 to 0.999 of what is possible."""
    rng = np.random.default_rng(draw(seeds))
    nearness = draw(st.sampled_from([0.0, 0.3, 0.7, 0.95, 0.999]))
    aspect = draw(st.sampled_from([1.0, 3.0, 100.0]))
    size = rng.uniform(0.5, 1.0, 3) / aspect ** rng.random(3)
    box = Cage.box(rng.uniform(-2.0, 2.0, 3), size, rng.uniform(-3.0, 3.0, 3))
    return dragged(box, rng.uniform(-1.0, 1.0, (8, 3)) @ box.affine[0].T, nearness)


@st.composite
def edits(draw: st.DrawFn, fold_free: float = 0.95, shell: str = "trilinear") -> Edit:
    """Continuous edits whose operations go to at most a share `fold_free` of what is safe."""
    rng = np.random.default_rng(draw(seeds))
    bend = draw(st.sampled_from([0.0, 0.3]))
    outer = Cage.box(rng.uniform(-1.0, 1.0, 3), rng.uniform(1.0, 3.0, 3), rng.uniform(-3.0, 3.0, 3))
    A, b = outer.affine
    inner = Cage(b + (0.5 + (np.asarray(Cage.box(0.0 * b, 1.0).corners)) * rng.uniform(0.2, 0.6, 3)) @ A.T)
    inner = dragged(inner, rng.uniform(-1.0, 1.0, (8, 3)) @ inner.affine[0].T, bend)
    outer = dragged(outer, rng.uniform(-0.3, 0.3, (8, 3)) @ A.T, bend)
    edit = Edit.continuous(inner, outer, shell=shell_kind(shell))
    assume(can_be_evaluated(edit))
    gap = np.linalg.norm(A, axis=0).min() * 0.25
    for kind in draw(st.lists(st.integers(0, 6), min_size=1, max_size=3)):
        operation = random_operation(rng, kind, gap)
        if is_valid(operation, 1.0, edit.deformed):
            edit = edit.then(operation.part(fold_free * edit.safe_fraction(operation)))
    return edit


def random_operation(rng: np.random.Generator, kind: int, reach: float) -> Operation:
    """An operation of one of the seven kinds, with moves of at most `reach` along each axis."""
    by = rng.uniform(-reach, reach, 3)
    little = displacement(0.3 * by, "by")
    choices: list[Operation] = [
        Translate(displacement(by, "by")),
        Rotate.from_rotation(rng.uniform(-1.0, 1.0, 3)),
        Scale.from_factors(np.exp(rng.uniform(-0.7, 0.7, 3))),
        Shear(xy=rng.uniform(-0.5, 0.5), zx=rng.uniform(-0.5, 0.5)),
        MoveCorner(int(rng.integers(8)), little),
        MoveEdge((2, 6), little),
        MoveFace("-y", little),
    ]
    return choices[kind]


def can_be_evaluated(edit: Edit) -> bool:
    """True where `check` finds nothing wrong."""
    try:
        edit.check()
    except EditError:
        return False
    return True


def dragged(cage: Cage, by: Array, nearness: float) -> Cage:
    """The cage with its corners moved by a share of the most of `by` [8,3] that keeps it valid."""

    def valid(t: float) -> bool:
        try:
            Cage(cage.corners + t * by)
        except CageError:
            return False
        return True

    return Cage(cage.corners + nearness * largest_safe(valid) * by)


def trilinear(corners: Array, u: Array) -> Array:
    """x(u) [3] by nested linear interpolation: along x, then y, then z."""
    along_x = corners[0::2] * (1.0 - u[0]) + corners[1::2] * u[0]
    along_y = along_x[0::2] * (1.0 - u[1]) + along_x[1::2] * u[1]
    return np.asarray(along_y[0] * (1.0 - u[2]) + along_y[1] * u[2])


def unit_vectors(rng: np.random.Generator, n: int) -> Array:
    """Random directions [N,3]."""
    d = rng.normal(size=(n, 3))
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))
