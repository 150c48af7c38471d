"""Drags to their limit and beyond: results found from those of earlier moves against those found anew."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cagefield.cameras.camera import Camera
from cagefield.edits import Edit
from cagefield.edits import operations as ops
from cagefield.edits.operation_sequence import cage_after, cages_along
from cagefield.edits.operation_shares import share_of
from cagefield.edits.operations import Operation
from cagefield.edits.safe_fraction import SHARE_TOLERANCE, Search, largest_of, largest_safe
from cagefield.edits.shell_safety import ShellSafety
from cagefield.geometry import hexahedron_determinant
from cagefield.geometry.cage import Cage
from cagefield.geometry.cage_checks import _is_nearly_a_box, _orientation, are_valid
from cagefield.server.editor.document import Document, Entry
from cagefield.server.editor.drag_solver import move
from cagefield.server.editor.session import Session
from cagefield.server.editor.validity import problem
from cagefield.server.protocol import client_messages
from cagefield.server.protocol.operation_messages import TranslateBy
from cagefield.server.render_queue.damage import WHOLE, Rect, Showing, screen_bounds, union
from cagefield.server.web.handlers import MessageHandlers
from cagefield.warps.cage_motion import Motion
from random_cages import cages, edits, examples, random_operation, seeds

BOX = Cage.box((0, 0, 0), 0.5)
HAND = 0.5, 0.8, 1.0, 1.3, 0.9, 0.4, 1.1
"""Lengths of the moves of a hand along one way."""

LINES: list[Operation] = [
    ops.Translate((0.1, -0.2, 0.3)),
    ops.Rotate((0.0, 80.0, 0.0)),
    ops.Scale((1.5, 0.7, 2.0)),
    ops.MoveCorner(3, (0.1, 0.0, 0.2)),
    ops.MoveFace("+x", (0.1, 0.0, 0.2)),
    ops.MovePoints((1, 2), (0.1, 0.0, 0.2), radius=0.3),
    ops.Bend("x", 40.0),
    ops.Twist("z", -30.0),
    ops.Taper("y", 0.5),
]


@pytest.mark.parametrize("operation", LINES, ids=lambda operation: operation.noun)
def test_shares_of_operations_that_go_the_same_way(operation: Operation) -> None:
    for r in (0.3, 1.0):
        assert share_of(operation, operation.part(r)) == pytest.approx(r, rel=1e-12)
        assert share_of(operation.part(r), operation) == pytest.approx(1.0 / r, rel=1e-12)
    assert share_of(operation, ops.Shear(xy=0.1)) is None and share_of(ops.Shear(xy=0.1), operation) is None
    assert (
        share_of(operation, operation.part(0.0)) is None and share_of(operation.part(0.0), operation) is None
    )


def test_operations_that_go_another_way_have_no_share() -> None:
    assert share_of(ops.Translate((1, 0, 0)), ops.Translate((-0.5, 0, 0))) is None
    assert share_of(ops.Translate((1, 0, 0)), ops.Translate((0.5, 1e-6, 0))) is None
    assert share_of(ops.MoveCorner(3, (1, 0, 0)), ops.MoveCorner(4, (0.5, 0, 0))) is None
    assert share_of(ops.Scale((2, 2, 2)), ops.Scale((2, 2, 2), axes="cage")) is None
    assert share_of(ops.Rotate((10, 20, 0)), ops.Rotate((5, 10, 0))) is None
    assert share_of(ops.Rotate((200, 0, 0)), ops.Rotate((100, 0, 0))) is None


@examples(10)
@given(edits(shell="flow"), st.integers(0, 6), seeds)
def test_limits_of_a_drag_are_those_found_anew(edit: Edit, kind: int, seed: int) -> None:
    operation = random_operation(np.random.default_rng(seed), kind, 1.5)
    entry, limit = Entry(1, edit, ""), None
    for length in HAND:
        moved = move(entry, "field", operation.part(length), limit)
        limit = moved.limit
        anew = move(entry, "field", operation.part(length))
        assert problem(moved.edit) is None and moved.why == anew.why
        if abs(moved.part - anew.part) > 1.001 * SHARE_TOLERANCE:
            # An operation that is unsafe for little of its way may be cut off there by one of them.
            beyond = operation.part(length).part(moved.part + 1.001 * SHARE_TOLERANCE)
            assert move(entry, "field", beyond).part < 1.0


def test_moves_beyond_a_known_limit_check_two_shells(monkeypatch: pytest.MonkeyPatch) -> None:
    checks, plain = [0], ShellSafety.is_safe

    def counted(self: ShellSafety, deformed: Cage) -> bool:
        checks[0] += 1
        return plain(self, deformed)

    monkeypatch.setattr(ShellSafety, "is_safe", counted)
    entry, limit, counts = Entry(1, Edit.continuous(BOX, BOX.grown(0.25)), ""), None, []
    for z in (0.1, 0.3, 0.35, 0.5, 0.2, 0.4):
        checks[0] = 0
        moved = move(entry, "field", ops.Translate((0.0, 0.0, z)), limit)
        limit = moved.limit
        assert moved.part * z == pytest.approx(min(z, 0.25 - 0.001), abs=1.1e-3 * max(z, 0.5))
        counts.append(checks[0])
    assert counts[2:] == [2, 2, 1, 2]


@pytest.mark.parametrize("limit", [0.0, 0.031, 0.5, 0.9999, 1.0])
def test_searches_end_at_the_limit_with_and_without_knowledge(limit: float) -> None:
    def safe(t: float) -> bool:
        return t <= limit

    for found in (
        largest_of(lambda t: t <= limit),
        largest_safe(safe),
        largest_safe(safe, Search(safe=max(0.0, limit - 0.2), unsafe=limit + 0.3)),
        largest_safe(safe, Search(safe=max(0.0, limit - 1e-4), unsafe=limit + 5e-4)),
        largest_safe(safe, Search(safe=min(1.0, limit + 0.01), unsafe=1.5)),  # wrong
    ):
        assert limit - SHARE_TOLERANCE <= found <= limit


@examples(10)
@given(cages(), seeds)
def test_cages_remembered_before_a_last_operation_are_those_of_all(cage: Cage, seed: int) -> None:
    rng = np.random.default_rng(seed)
    some = tuple(random_operation(rng, kind, 0.01).part(0.1) for kind in (0, 1, 2))
    for operations in (some, some[:2], (*some, ops.Translate((0.1, 0, 0))), (*some, ops.Rotate((1, 0, 0)))):
        *_, expected = (operation for operation in cages_along(cage, operations))
        for _ in range(2):
            found = cage_after(cage, operations)
            assert np.array_equal(found.corners, expected.corners)
            assert np.array_equal(found.pivot, expected.pivot)
    assert cage_after(cage, ()) is cage


@examples(40)
@given(cages(), st.floats(0.0, 3.0), seeds)
def test_cages_accepted_at_once_have_a_positive_determinant(cage: Cage, reach: float, seed: int) -> None:
    corners = cage.corners + np.random.default_rng(seed).uniform(-reach, reach, (8, 3))
    assert _is_nearly_a_box(BOX.corners)
    for tried in (cage.corners, corners, corners[[1, 0, 3, 2, 5, 4, 7, 6]]):
        if _is_nearly_a_box(tried):
            bernstein, lengths = _orientation(tried[None])
            assert (bernstein > 1e-9 * lengths.prod()).all() and are_valid(tried[None])[0]
    assert not _is_nearly_a_box(BOX.corners[[1, 0, 3, 2, 5, 4, 7, 6]])
    assert not _is_nearly_a_box(np.full((8, 3), 1e300))
    assert hexahedron_determinant.is_positive(_orientation(cage.corners[None])[0])


@pytest.mark.parametrize("by", [(0.1, 0.0, 0.0), (0.2, -0.24, 0.1), (0.2489, 0.0, 0.0)])
def test_a_cage_that_only_moves_is_not_shrunk(by: ops.Triple, monkeypatch: pytest.MonkeyPatch) -> None:
    outer = BOX.grown(0.25).rotate((0.0, 0.2, 0.3))
    bent = BOX.move_corner(7, (0.05, 0.02, -0.1))
    for cage in (BOX.scale(0.6), bent.scale(0.6)):
        assert Motion(cage, cage.translate(by), outer)._keeps_its_shape
        known = Motion(cage, cage.translate(by), outer).shrink
        with monkeypatch.context() as patch:
            patch.setattr(Motion, "_keeps_its_shape", False)
            assert Motion(cage, cage.translate(by), outer).shrink == known == 0.0
    assert not Motion(BOX, BOX.rotate((0.0, 0.0, 0.1)), outer)._keeps_its_shape


def plain_bounds(camera: Camera, boxes: np.ndarray[Any, Any]) -> Rect | None:
    """`screen_bounds` corner by corner."""
    found: Rect | None = None
    for low, high in boxes:
        seen = []
        for bits in np.ndindex(2, 2, 2):
            x, y, z = (np.where(bits, high, low) - camera.origin) @ camera.c2w[:3, :3]
            seen.append((x, y, -z))
        depths = [depth for _, _, depth in seen]
        if max(depths) <= 0.0:
            continue
        if min(depths) <= 1e-6 * np.abs(seen).max():
            return WHOLE
        xs = [(camera.cx + camera.fx * x / depth) / camera.width for x, _, depth in seen]
        ys = [(camera.cy - camera.fy * y / depth) / camera.height for _, y, depth in seen]
        if min(xs) < 1.0 and max(xs) > 0.0 and min(ys) < 1.0 and max(ys) > 0.0:
            found = union(found, (max(min(xs), 0.0), max(min(ys), 0.0), min(max(xs), 1.0), min(max(ys), 1.0)))
    return found


def test_bounds_of_boxes_on_the_screen_are_those_of_their_corners() -> None:
    rng = np.random.default_rng(0)
    camera = Camera.look_at((0, -3, 0.5), (0, 0, 0), width=80, height=60, fov_x=0.8)
    kinds = set()
    for count in (0, 1, 2, 3) * 30:
        low = rng.uniform(-4.0, 4.0, (count, 3))
        boxes = np.stack([low, low + rng.uniform(0.0, 0.8, (count, 3))], axis=1)
        found, expected = screen_bounds(camera, boxes), plain_bounds(camera, boxes)
        kinds.add(expected if expected in (None, WHOLE) else "part")
        assert (found is None) == (expected is None)
        if found is not None and expected is not None:
            np.testing.assert_allclose(found, expected, atol=1e-12)
    assert kinds == {None, WHOLE, "part"}


def test_differences_of_a_base_are_asked_for_once() -> None:
    asked: list[tuple[int, int]] = []

    def differing(page: int, one: int, another: int) -> Rect | None:
        asked.append((one, another))
        return 0.1 * one, 0.1, 0.2, 0.01 * another

    showing = Showing()
    showing.drawn("view", 1, WHOLE, whole=True, all_wanting=True, exact=True)
    assert showing.wanting(1, "view", 2, differing) == (0.1, 0.1, 0.2, 0.02)
    showing.drawn("view", 2, (0.1, 0.1, 0.2, 0.02), whole=False, all_wanting=False, exact=False)
    assert showing.wanting(1, "view", 3, differing) == (0.1, 0.1, 0.2, 0.03)
    assert asked == [(1, 2), (1, 3)]
    showing.drawn("view", 3, WHOLE, whole=True, all_wanting=True, exact=True)
    showing.wanting(1, "view", 2, differing)
    assert asked[2:] == [(3, 2)]


def test_a_picture_of_a_drag_is_asked_for_before_the_answer_and_the_rest() -> None:
    session = Session(Document.from_edits([Edit.move(BOX, name="a")]), np.array([[-1.0] * 3, [1.0] * 3]), 0.1)
    events: list[str] = []
    queue = SimpleNamespace(put=lambda message: events.append(type(message).__name__))
    page: Any = SimpleNamespace(number=1, drag=0, seq=0, lost_drag=0, send_queue=queue)
    coordinator: Any = SimpleNamespace(
        session=session,
        show=lambda: events.append(f"picture {page.seq}"),
        publish=lambda but: events.append("rest"),
        changed=lambda but=None: events.append("begun" if but is None else "begun, and others told"),
    )
    handlers = MessageHandlers(coordinator, page)
    handlers.handle(client_messages.DragBegin(drag=1, edit=1, target="field"))
    operation = TranslateBy(by=(0.1, 0.0, 0.0))
    handlers.handle(client_messages.DragMove(drag=1, seq=1, operation=operation))
    # The edit was selected: a state would tell its own page nothing.
    assert events == ["begun, and others told", "picture 1", "Dragged", "rest"]
    session.selected = None
    handlers.handle(client_messages.DragBegin(drag=2, edit=1, target="field"))
    assert events[-1] == "begun"
