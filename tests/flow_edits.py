"""Continuous edits with a flow shell, and points in their shells."""

from __future__ import annotations

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from cagefield.edits import Edit, Flow
from cagefield.errors import CageError, EditError
from cagefield.geometry.cage import Cage
from cagefield.typing import Array
from cagefield.warps import Falloff, FlowShell
from cagefield.warps.extended_coordinates import Extended
from random_cages import can_be_evaluated, dragged, random_operation, seeds

INNER, OUTER = Cage.box((0, 0, 0), 0.6), Cage.box((0, 0, 0), 1.6)


BENT = Cage.box((0.1, 0, 0), 0.6, (0.05, 0.1, 0.1)).move_corner(2, (-0.15, 0.15, -0.1))


BENT_OUTER = OUTER.move_corner(3, (0.3, 0.2, -0.1)).move_corner(4, (-0.2, 0.1, -0.3))


ROD, SLOT = Cage.box((0, 0, 0), (1.2, 0.3, 0.3)), Cage.box((0, 0, 0), (1.6, 0.8, 0.8))


EDITS = {
    "turn of 90": Edit.continuous(INNER, OUTER).rotate((0, 0, np.pi / 2)),
    "turn of 180": Edit.continuous(INNER, OUTER).rotate((0, 0, np.pi)),
    "translation by 90% of the gap": Edit.continuous(INNER, OUTER).translate((0.45, 0, 0)),
    "scale 0.3": Edit.continuous(INNER, OUTER).scale(0.3),
    "scale 2.4": Edit.continuous(INNER, OUTER).scale(2.4),
    "shear": Edit.continuous(INNER, OUTER).shear(xy=0.6, zx=-0.4),
    "corner after rotation": Edit.continuous(INNER, OUTER)
    .rotate((0.5, 0.2, 1.5))
    .move_corner(7, (0.1, -0.2, 0.1)),
    "scale of a turned cage": Edit.continuous(INNER, OUTER).rotate((0.5, 0.2, 0.5)).scale((0.6, 1.5, 1.1)),
    "bent cages": Edit.continuous(BENT, BENT_OUTER).rotate((1.0, 0.5, 1.0)).scale((0.9, 0.8, 1.0)),
    "bent far": Edit.continuous(INNER, OUTER.grown(1.0)).move_corner(7, (-0.31, -0.42, 0.36)),
    "turn in a slot": Edit.continuous(ROD, SLOT).rotate((0, 0, np.pi)),
    "linear, half": Edit.continuous(INNER, OUTER, shell=Flow(falloff="linear", width=0.5))
    .rotate((0, 0, 1))
    .translate((0.1, 0, 0)),
}


def shell_of(edit: Edit, strain: float = 0.125) -> FlowShell:
    assert edit.outer is not None
    return FlowShell(
        edit.inner, edit.deformed, edit.outer, Falloff(edit.shell.falloff, edit.shell.width), strain
    )


def shell_points(shell: FlowShell, n: int, seed: int = 0) -> Array:
    """Random deformed points between the cages, a third of them close to the inner one."""
    rng = np.random.default_rng(seed)
    origin, frame = shell.outer.frame
    near = rng.uniform(-1.0, 1.0, (n // 3, 3))
    near *= rng.uniform(1.0, 1.2, (n // 3, 1)) / np.abs(near).max(axis=1, keepdims=True)
    p = np.concatenate(
        [origin + rng.random((n, 3)) @ frame.T, Extended.from_cage(shell.deformed).points(near)]
    )
    p = p[shell.outer.contains(p)]
    return p[~shell.deformed.contains(p)]


@st.composite
def flow_edits(draw: st.DrawFn) -> Edit:
    """Edits by one to ten operations in deformed cages, rotations up to 180 degrees, scales from .3."""
    rng = np.random.default_rng(draw(seeds))
    bent = draw(st.sampled_from([0.0, 0.4]))
    outer = Cage.box(rng.uniform(-1, 1, 3), rng.uniform(1, 3, 3), rng.uniform(-3, 3, 3))
    A, b = outer.affine
    inner = Cage.box(b + A @ rng.uniform(0.35, 0.65, 3), rng.uniform(0.2, 0.8, 3), rng.uniform(-3, 3, 3))
    inner = dragged(inner, rng.uniform(-1, 1, (8, 3)) @ inner.affine[0].T, bent)
    outer = dragged(outer, rng.uniform(-0.3, 0.3, (8, 3)) @ A.T, bent)
    edit = Edit.continuous(inner, outer)
    assume(can_be_evaluated(edit))
    for _ in range(draw(st.sampled_from([1, 2, 3, 10]))):
        kind = draw(st.integers(0, 8))
        try:
            if kind == 7:
                axis = rng.normal(size=3)
                edit = edit.rotate(np.pi * axis / np.linalg.norm(axis))
            elif kind == 8:
                edit = edit.scale(draw(st.sampled_from([0.3, 2.0])))
            else:
                edit = edit.then(random_operation(rng, kind, 0.4))
        except (CageError, EditError):
            assume(False)
        edit = edit.replace(
            operations=(*edit.operations[:-1], edit.operations[-1].part(0.98 * edit.safe_fraction()))
        )
    assume(can_be_evaluated(edit))
    return edit
