"""Free-form cages in the editor's session: two pages at once, replay, and camera paths through every kind."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cagefield.edits import (
    Bend,
    Edit,
    MovePoint,
    MovePoints,
    Rotate,
    Taper,
    Translate,
    Twist,
    dump_edits,
    parse_edits,
)
from cagefield.edits.operations import Operation
from cagefield.edits.partial_edit import partial_edit
from cagefield.errors import CagefieldError, EditError
from cagefield.geometry import MeshCage
from cagefield.geometry.cage import Cage
from cagefield.server.editor.document import Document
from cagefield.server.editor.session import Session

BOUNDS = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
BOX, OUTER = Cage.box((0, 0, 0), (0.3, 0.3, 0.6)), Cage.box((0, 0, 0), 1.6)
LATTICE = Edit.continuous(BOX.subdivided((1, 1, 3)), OUTER, name="lattice")
LINEAR = Edit.continuous(BOX.subdivided((2, 1, 2), "linear"), OUTER, name="linear")
MESH = Edit.continuous(MeshCage.of_box(BOX), OUTER, name="mesh")
POINTS = Edit.points([[0, 0, 0.2], [0.2, 0, 0]], radius=0.3, name="points")

TAPER = Taper("z", 0.8)
UP, ASIDE = (0.0, 0.0, 0.04), (0.05, 0.0, 0.0)

GESTURES: dict[str, tuple[Edit, tuple[Operation, ...]]] = {
    "lattice": (
        LATTICE,
        (
            MovePoint(3, UP),
            MovePoints((4, 5), ASIDE, 0.3),
            Bend("z", 40.0),
            Twist("z", 90.0),
            Taper("z", 0.8),
        ),
    ),
    "linear lattice": (LINEAR, (MovePoints((0, 1, 2), ASIDE), Twist("z", 40.0), Rotate((0, 0, 20)))),
    "mesh": (MESH, (MovePoint(7, UP), Bend("z", 30.0), Twist("z", 60.0), Translate(ASIDE))),
    "points": (POINTS, (MovePoint(1, UP), Translate(ASIDE), Rotate((0, 30, 0)))),
}
"""An edit of each kind, and gestures of it in the order in which they are made."""


def session(*edits: Edit) -> Session:
    return Session(Document.from_edits(edits), BOUNDS, 0.01)


@pytest.mark.parametrize("edit", [LATTICE, MESH, POINTS], ids=lambda edit: edit.name)
def test_two_pages_drag_points_of_one_cage_and_both_drags_are_kept(edit: Edit) -> None:
    s = session(edit)
    s.drag_begin(1, 1, 1, "field")
    s.drag_begin(2, 1, 1, "field")
    for share in (0.5, 1.0):
        s.drag(1, 1, MovePoint(0, tuple(share * x for x in UP)))
        s.drag(2, 1, MovePoint(1, tuple(share * x for x in ASIDE)))
    s.drag_end(1, 1, MovePoint(0, UP))
    s.drag_end(2, 1, MovePoint(1, ASIDE))
    done = s.document.entry(1).edit
    assert done.operations == (MovePoint(0, UP), MovePoint(1, ASIDE))
    moved = done.deformed.handles - edit.deformed.handles
    np.testing.assert_allclose(moved[:2], [UP, ASIDE], atol=1e-12)
    assert s.problem(done) is None and not s.drags
    s.undo()
    assert s.document.entry(1).edit.operations == (MovePoint(0, UP),)


def test_a_point_that_another_page_takes_away_ends_its_drag() -> None:
    """One subdivides and drags a new point; the other undoes the subdivision meanwhile."""
    s = session(Edit.continuous(BOX, OUTER, name="box"))
    s.subdivide(1, (1, 1, 3), "bspline")
    s.drag_begin(1, 1, 1, "field")
    s.drag(1, 1, MovePoint(12, UP))
    s.undo()
    with pytest.raises(CagefieldError):
        s.drag_end(1, 1, MovePoint(12, UP))
    assert s.document.entry(1).edit.operations == () and s.document.entry(1).edit.inner == BOX
    assert not s.drags


def test_a_cage_that_another_page_subdivides_keeps_its_number_of_points_to_the_drag() -> None:
    s = session(Edit.continuous(BOX, OUTER, name="box"))
    s.drag_begin(1, 1, 1, "field")
    s.drag(1, 1, Translate(ASIDE))
    s.subdivide(1, (1, 1, 3), "bspline")
    s.drag_end(1, 1, Translate(ASIDE))
    done = s.document.entry(1).edit
    assert done.operations == (Translate(ASIDE),) and done.inner == LATTICE.inner


def test_a_mesh_that_another_page_removes_ends_its_drag() -> None:
    s = session(MESH, LATTICE)
    s.drag_begin(1, 1, 1, "field")
    s.drag(1, 1, MovePoint(7, UP))
    s.remove(1)
    with pytest.raises(EditError, match="this drag is over"):
        s.drag_end(1, 1, MovePoint(7, UP))
    assert [entry.edit.name for entry in s.document.entries] == ["lattice"] and not s.drags


def test_a_reach_that_another_page_changes_is_kept_with_the_drag() -> None:
    s = session(POINTS)
    s.drag_begin(1, 1, 1, "field")
    s.drag(1, 1, MovePoint(0, UP))
    s.point_reach(1, 0.5, "sharp")
    s.drag_end(1, 1, MovePoint(0, UP))
    done: Any = s.document.entry(1).edit
    assert (done.inner.radius, done.inner.falloff) == (0.5, "sharp")
    assert done.operations == (MovePoint(0, UP),)


@pytest.mark.parametrize("kind", list(GESTURES))
def test_every_gesture_is_undone_replayed_and_saved(kind: str) -> None:
    edit, gestures = GESTURES[kind]
    s = session(edit)
    states = [s.document]
    for gesture in gestures:
        s.apply(1, "field", gesture)
        states.append(s.document)
        again = parse_edits(dump_edits(s.document.stack))
        assert list(again) == list(s.document.stack), "the file says the same"
    assert len({id(state) for state in states}) == len(gestures) + 1
    for state in reversed(states[:-1]):
        s.undo()
        assert s.document == state
    for state in states[1:]:
        s.redo()
        assert s.document == state
    replayed = session(edit)
    for operation in s.document.entry(1).edit.operations:
        replayed.apply(1, "field", operation)
    assert replayed.document.entry(1).edit == s.document.entry(1).edit


@pytest.mark.parametrize("kind", list(GESTURES))
def test_a_camera_path_goes_through_possible_edits_of_every_kind(kind: str) -> None:
    """From nothing to all of it, evenly: no fold and no jump on the way."""
    edit, gestures = GESTURES[kind]
    for gesture in gestures:
        edit = edit.then(gesture)
    size = float(np.linalg.norm(edit.deformed.handles - edit.inner.handles, axis=1).max())
    assert size > 0.05
    before = edit.inner.handles
    for share in np.linspace(0.0, 1.0, 11):
        there = partial_edit(edit, float(share))
        assert there is not None
        there.check()
        step = np.linalg.norm(there.deformed.handles - before, axis=1).max()
        assert step <= (1e-9 if share == 0.0 else 0.3 * size)
        before = there.deformed.handles
    np.testing.assert_allclose(before, edit.deformed.handles, atol=1e-12)
