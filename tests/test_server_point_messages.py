"""Messages about lattices and control points: checked numbers, operations, the state, and undo."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from pydantic import ValidationError

from cagefield.edits import Bend, Edit, MovePoint, MovePoints, Taper, Translate, Trilinear, Twist
from cagefield.edits.operations import Operation
from cagefield.errors import CagefieldError, EditError
from cagefield.geometry.bspline_lattice import INTERPOLATIONS
from cagefield.geometry.cage import Cage, LatticeCage
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.point_deformers import FALLOFF_CURVES
from cagefield.server.editor.document import Document
from cagefield.server.editor.drag_solver import appended
from cagefield.server.editor.session import Session
from cagefield.server.protocol.client_messages import page_messages
from cagefield.server.protocol.common import CurveName, InterpolationName
from cagefield.server.protocol.conversion import dragged_of, edit_state, operation_of

BOUNDS = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
INNER, OUTER = Cage.box((0, 0, 0), (0.3, 0.3, 0.6)), Cage.box((0, 0, 0), 1.6)
BOX = Edit.continuous(INNER, OUTER, name="box", lattice=32)
ARM = Edit.continuous(INNER.subdivided((1, 1, 2)), OUTER, name="arm", lattice=32)
FACE = Edit.points([[0, 0, 0], [0.2, 0, 0]], radius=0.3, name="face")


def session(*edits: Edit) -> Session:
    return Session(Document.from_edits(edits), BOUNDS, 0.01)


def stated(operation: dict[str, Any]) -> Operation:
    """The operation of a message as a page sends it."""
    message = page_messages.validate_python(
        {"type": "apply", "edit": 1, "target": "field", "operation": operation}
    )
    return operation_of(message.operation)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("message", "operation"),
    [
        ({"kind": "move_point", "point": 3, "by": [0, 0.1, 0]}, MovePoint(3, (0.0, 0.1, 0.0))),
        (
            {"kind": "move_points", "points": [1, 2], "by": [1, 0, 0], "radius": 0.5, "falloff": "sharp"},
            MovePoints((1, 2), (1.0, 0.0, 0.0), 0.5, "sharp"),
        ),
        ({"kind": "bend", "axis": "z", "degrees": 30, "towards": "y"}, Bend("z", 30.0, "y")),
        ({"kind": "twist", "axis": "x", "degrees": -90, "fixed": "end"}, Twist("x", -90.0, "end")),
        ({"kind": "taper", "axis": "y", "factor": 0.5}, Taper("y", 0.5)),
    ],
)
def test_messages_state_operations(message: dict[str, Any], operation: Operation) -> None:
    assert stated(message) == operation


@pytest.mark.parametrize(
    "message",
    [
        {"kind": "move_point", "point": -1, "by": [0, 0, 0]},
        {"kind": "move_point", "point": 512, "by": [0, 0, 0]},
        {"kind": "move_point", "point": 0, "by": [0, float("nan"), 0]},
        {"kind": "move_points", "points": [], "by": [0, 0, 0]},
        {"kind": "move_points", "points": [0], "by": [0, 0, 0], "radius": float("inf")},
        {"kind": "move_points", "points": [0], "by": [0, 0, 0], "radius": -1},
        {"kind": "move_points", "points": [0], "by": [0, 0, 0], "falloff": "random"},
        {"kind": "bend", "axis": "w", "degrees": 10},
        {"kind": "bend", "axis": "z", "degrees": float("nan")},
        {"kind": "twist", "axis": "z", "degrees": 1e9},
        {"kind": "taper", "axis": "z", "factor": 0},
    ],
)
def test_impossible_numbers_are_refused(message: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        stated(message)


@pytest.mark.parametrize("cells", [[0, 1, 1], [1, 8, 1], [1, 1], [1, 1, 1.5]])
def test_impossible_cells_are_refused(cells: list[float]) -> None:
    with pytest.raises(ValidationError):
        page_messages.validate_python({"type": "subdivide", "edit": 1, "cells": cells})


def test_names_are_those_of_the_geometry() -> None:
    assert get_args(CurveName) == FALLOFF_CURVES
    assert set(get_args(InterpolationName)) == set(INTERPOLATIONS)


def test_pages_are_told_of_control_points() -> None:
    s = session(BOX, ARM.translate((0.1, 0, 0)), FACE.move_point(1, (0, 0.1, 0)))
    box, arm, face = (edit_state(entry, None, None) for entry in s.document.entries)
    assert (box.cage, box.points, box.outer_follows) == ("box", None, False)
    assert arm.cage == "lattice" and arm.points is not None and not arm.outer_follows
    assert (arm.points.shape, arm.points.interpolation, arm.points.radius) == ((2, 2, 3), "bspline", None)
    np.testing.assert_allclose(np.subtract(arm.points.deformed, arm.points.canonical), [[0.1, 0, 0]] * 12)
    assert face.cage == "points" and face.points is not None and face.outer_follows
    assert (face.points.shape, face.points.radius, face.points.falloff) == (None, 0.3, "smooth")
    np.testing.assert_allclose(face.points.deformed, [[0, 0, 0], [0.2, 0.1, 0]])


def test_a_drag_tells_where_the_points_are() -> None:
    s = session(ARM)
    s.drag_begin(7, 1, 1, "field")
    dragged = dragged_of(1, 1, s.drag(7, 1, MovePoints((4, 5, 6, 7), (0.1, 0, 0))))
    by = np.subtract(dragged.deformed_points, dragged.points)
    np.testing.assert_allclose(by[4:8], [[0.1, 0, 0]] * 4)
    np.testing.assert_allclose(np.delete(by, range(4, 8), axis=0), 0.0)
    s.drag_end(7, 1, MovePoints((4, 5, 6, 7), (0.1, 0, 0)))
    s.undo()
    assert s.document.entry(1).edit == ARM


@pytest.mark.parametrize(
    ("edit", "operation", "words"),
    [
        (ARM, MovePoint(12, (0, 0, 0)), "point 12 is not a point of this cage: its points are 0 to 11"),
        (ARM, MovePoints((1, 1), (0, 0, 0)), "each once"),
        (FACE, MovePoint(2, (0, 0, 0)), "its points are 0 to 1"),
        (BOX, Bend("z", 10.0), "a bend needs a lattice; subdivide the cage first"),
        (FACE, Twist("z", 10.0), "a twist needs a lattice"),
        (ARM, Bend("z", 10.0, "z"), "towards another axis"),
    ],
)
def test_operations_that_a_cage_has_not_are_named(edit: Edit, operation: Operation, words: str) -> None:
    s = session(edit)
    with pytest.raises(CagefieldError, match=words):
        s.apply(1, "field", operation)
    assert s.document.entry(1).edit == edit and s.saved


def test_a_cage_is_subdivided_with_its_operations() -> None:
    moved = BOX.translate((0.1, 0, 0)).move_corner(7, (0, 0.05, 0))
    s = session(moved)
    s.subdivide(1, (1, 2, 3), "linear")
    edit = s.document.entry(1).edit
    assert isinstance(edit.inner, LatticeCage) and edit.inner.shape == (2, 3, 4)
    assert edit.inner.interpolation == "linear" and edit.operations == moved.operations
    np.testing.assert_allclose(edit.deformed.corners, moved.deformed.corners, atol=1e-12)
    s.apply(1, "field", Twist("z", 20.0))
    s.subdivide(1, (1, 1, 1), "bspline")  # its points were moved by operations of the whole cage only
    s.apply(1, "field", MovePoint(0, (0.01, 0, 0)))
    with pytest.raises(EditError, match="reset its operations first"):
        s.subdivide(1, (1, 1, 4), "bspline")
    for _ in range(4):
        s.undo()
    assert s.document.entry(1).edit == moved


def test_edits_without_cells_are_refused() -> None:
    trilinear = Edit.continuous(INNER, OUTER, shell=Trilinear())
    s = session(FACE, Edit.move(INNER), trilinear)
    for number, words in ((1, "no cells"), (2, "only a continuous edit"), (3, "choose the flow shell")):
        with pytest.raises(EditError, match=words):
            s.subdivide(number, (1, 1, 4), "bspline")
    assert s.saved


def test_a_control_point_is_placed_and_its_reach_changed() -> None:
    s = session()
    number = s.place_point(np.array([0.1, 0.2, 0.3]), 1.0)
    edit = s.document.entry(number).edit
    assert isinstance(edit.inner, ControlPoints) and s.selected == number
    np.testing.assert_allclose(edit.inner.points, [[0.1, 0.2, 0.3]])
    assert edit.inner.radius == pytest.approx(0.11)
    s.apply(number, "field", Translate((0.05, 0, 0)))
    s.point_reach(number, 0.4, None)
    s.point_reach(number, None, "sharp")
    inner = s.document.entry(number).edit.inner
    assert isinstance(inner, ControlPoints) and (inner.radius, inner.falloff) == (0.4, "sharp")
    assert s.history.names[-3:] == ("Move of points", "Reach of points", "Reach of points")
    before = s.document
    s.point_reach(number, None, None, True)
    state = edit_state(s.document.entry(number), None, None)
    assert state.points is not None and state.points.connected and state.points.radius == 0.4
    s.undo()
    assert s.document == before
    s.redo()
    s.point_reach(number, None, None, True)
    assert s.history.names[-1] == "Reach of points" and s.history.names[-2] == "Reach of points"
    s.point_reach(number, None, None, False)
    assert s.document.entry(number) == before.entry(number)
    other = session(ARM)
    with pytest.raises(EditError, match="only control points have a radius"):
        other.point_reach(1, 0.2, None)


def test_moves_with_a_falloff_stay_apart() -> None:
    move = MovePoints((0,), (0.1, 0.0, 0.0), 0.5)
    assert appended((move,), move) == (move, move)
    alone = MovePoints((0,), (0.1, 0.0, 0.0))
    assert appended((alone,), alone) == (MovePoints((0,), (0.2, 0.0, 0.0)),)
