"""The editor's session: commands, drags, history; no web, no rendering."""

from __future__ import annotations

import numpy as np
import pytest

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import (
    Copy,
    Delete,
    Edit,
    EditStack,
    Flow,
    Grade,
    Mirror,
    MoveCorner,
    Rotate,
    Scale,
    Translate,
    Trilinear,
    dump_edits,
)
from cagefield.edits import operations as ops
from cagefield.edits.operations import Operation
from cagefield.errors import CageError, EditError
from cagefield.geometry.cage import Cage
from cagefield.server.editor import validity
from cagefield.server.editor.document import Document
from cagefield.server.editor.drag_solver import Target, move_corners
from cagefield.server.editor.history import MAX_ENTRIES, History
from cagefield.server.editor.session import Session
from cagefield.server.protocol.conversion import edit_state

BOUNDS = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
INNER = Cage.box((0, 0, 0), 0.4)
ARM = Edit.continuous(INNER, INNER.grown(0.3), lattice=16, name="arm")
CUP = Edit.move(Cage.box((0.6, 0, 0), 0.2), name="cup")


def session(*edits: Edit) -> Session:
    return Session(Document.from_edits(edits), BOUNDS, 0.01)


def test_a_new_session_is_saved_and_at_the_beginning_of_its_history() -> None:
    s = session(ARM, CUP)
    assert [entry.id for entry in s.document.entries] == [1, 2]
    assert s.saved and s.history.names == ("Open",) and s.selected == 2


def test_a_drag_shows_every_step_and_is_one_entry_of_the_history() -> None:
    s = session(ARM)
    s.drag_begin(7, 1, 1, "field")
    for x in (0.05, 0.1, 0.15):
        assert s.drag(7, 1, Translate((x, 0.0, 0.0))).part == 1.0
    np.testing.assert_allclose(s.shown.entry(1).edit.deformed.pivot, (0.15, 0, 0))
    assert not s.document.entry(1).edit.operations and s.saved
    s.drag_end(7, 1, Translate((0.2, 0.0, 0.0)))
    assert s.document.entry(1).edit.operations == (Translate((0.2, 0.0, 0.0)),)
    assert s.history.names == ("Open", "Move of arm") and not s.saved and not s.drags


def test_a_cancelled_drag_leaves_everything_as_it_was() -> None:
    s = session(ARM)
    s.drag_begin(1, 4, 1, "field")
    s.drag(1, 4, Translate((0.1, 0, 0)))
    s.drag_cancel(1)
    assert s.shown == s.document == Document.from_edits([ARM])
    assert s.history.names == ("Open",)


def test_the_outer_cage_stops_a_drag_and_says_why() -> None:
    s = session(ARM)
    s.drag_begin(1, 1, 1, "field")
    moved = s.drag(1, 1, Translate((0.6, 0.0, 0.0)))
    # The gap is 0.3 of the 0.6 asked for; safe_fraction is good to 1e-3 and never beyond the limit.
    assert 0.49 < moved.part <= 0.5
    assert moved.why is not None and "must stay inside the outer cage; enlarge" in moved.why
    assert moved.edit.outer is not None and moved.edit.outer.contains(moved.edit.deformed.corners).all()
    s.drag_end(1, 1, Translate((0.6, 0.0, 0.0)))
    assert s.problem(s.document.entry(1).edit) is None


def test_a_drag_that_is_over_says_so() -> None:
    s = session(ARM)
    with pytest.raises(EditError, match="this drag is over"):
        s.drag(1, 1, Translate((0.1, 0, 0)))
    s.drag_begin(1, 1, 1, "field")
    s.undo()
    with pytest.raises(EditError, match="this drag is over"):
        s.drag_end(1, 1, Translate((0.1, 0, 0)))


def test_drags_end_with_the_removal_of_their_edit_and_no_other() -> None:
    s = session(ARM, CUP)
    s.drag_begin(1, 1, 1, "field")
    s.drag_begin(2, 4, 2, "field")
    s.remove(1)
    assert not s.drags.goes_on(1, 1) and s.drags.goes_on(2, 4) and not s.drags.goes_on(2, 3)
    s.undo()
    assert not s.drags.goes_on(2, 4) and not s.moving


def test_two_pages_drag_at_once_and_both_drags_are_shown_and_kept() -> None:
    s = session(ARM, CUP)
    s.drag_begin(1, 1, 1, "field")
    s.drag_begin(2, 1, 2, "field")
    s.drag(1, 1, Translate((0.1, 0, 0)))
    s.drag(2, 1, Translate((0, 0.2, 0)))
    pivots = [entry.edit.deformed.pivot for entry in s.shown.entries]
    np.testing.assert_allclose(pivots, [(0.1, 0, 0), (0.6, 0.2, 0)])
    s.drag_end(1, 1, Translate((0.1, 0, 0)))
    s.drag_end(2, 1, Translate((0, 0.2, 0)))
    assert s.history.names == ("Open", "Move of arm", "Move of cup")


def test_a_drag_of_an_edit_that_another_page_removed_is_an_error_and_changes_nothing() -> None:
    s = session(ARM, CUP)
    s.drag_begin(1, 1, 2, "field")
    s.drag(1, 1, Translate((0.1, 0, 0)))
    s.remove(2)
    assert [entry.edit.name for entry in s.shown.entries] == ["arm"]
    with pytest.raises(EditError, match="this drag is over"):
        s.drag_end(1, 1, Translate((0.1, 0, 0)))
    assert s.history.names[-1] == "Remove of cup" and not s.drags


def test_set_mode_moves_cages_and_leaves_the_operations() -> None:
    s = session(ARM.translate((0.1, 0, 0)))
    s.apply(1, "both", Translate((0.2, 0.0, 0.0)))
    edit = s.document.entry(1).edit
    np.testing.assert_allclose(edit.inner.pivot, (0.2, 0, 0))
    assert edit.outer is not None
    np.testing.assert_allclose(edit.outer.center, (0.2, 0, 0), atol=1e-12)
    np.testing.assert_allclose(edit.deformed.pivot, (0.3, 0, 0))
    assert edit.operations == (Translate((0.1, 0, 0)),)


def test_set_mode_turns_both_cages_about_the_inner_ones_pivot() -> None:
    outer = Cage.box((0.1, 0.1, 0), 1.4)
    s = session(Edit.continuous(INNER, outer, name="a"))
    s.apply(1, "both", Rotate((0, 0, 90)))
    edit = s.document.entry(1).edit
    assert edit.outer is not None
    np.testing.assert_allclose(edit.outer.center, (-0.1, 0.1, 0), atol=1e-12)


def test_in_set_mode_the_outer_cage_stops_at_the_inner_one() -> None:
    s = session(ARM)
    s.drag_begin(1, 1, 1, "outer")
    moved = s.drag(1, 1, Scale((0.1, 0.1, 0.1)))
    assert 0.0 < moved.part < 1.0 and moved.why is not None
    assert moved.edit.outer is not None and moved.edit.outer.contains(INNER.corners).all()
    assert moved.edit.inner == INNER


@pytest.mark.parametrize(
    ("edit", "target", "operation", "why"),
    [
        (ARM, "field", Translate((2.0, 0, 0)), validity.OUTSIDE_MESSAGE),
        (ARM.replace(shell=Trilinear()), "field", Rotate((0, 0, 80)), validity.FOLDED),
        (ARM, "field", Translate((0.299999, 0, 0)), validity.CLOSE),
        (ARM, "field", MoveCorner(0, (2.0, 2.0, 2.0)), validity.INSIDE_OUT),
        (ARM, "outer", Translate((2.0, 0, 0)), "the inner cage must stay inside the outer cage"),
        (ARM, "inner", MoveCorner(0, (2.0, 2.0, 2.0)), validity.INSIDE_OUT),
    ],
)
def test_why_a_drag_stops_is_said_in_the_editors_words(
    edit: Edit, target: Target, operation: Operation, why: str
) -> None:
    s = session(edit)
    s.drag_begin(1, 1, 1, target)
    moved = s.drag(1, 1, operation)
    assert moved.part < 1.0 and moved.why == why


def test_an_operation_from_numbers_is_done_whole_or_not_at_all() -> None:
    s = session(ARM)
    with pytest.raises(EditError, match=r"must stay inside the outer cage.*% of it is possible"):
        s.apply(1, "field", Translate((0.6, 0, 0)))
    assert s.document == Document.from_edits([ARM])


def test_moves_one_after_the_other_become_one_operation_others_do_not() -> None:
    s = session(ARM)
    s.apply(1, "field", Translate((0.1, 0, 0)))
    s.apply(1, "field", Translate((0.0, 0.05, 0)))
    s.apply(1, "field", move_corners((3,), (0.01, 0, 0)))
    s.apply(1, "field", move_corners((3,), (0.01, 0, 0)))
    s.apply(1, "field", move_corners((2,), (0.01, 0, 0)))
    s.apply(1, "field", Rotate((0, 0, 5)))
    s.apply(1, "field", Rotate((0, 0, 5)))
    assert s.document.entry(1).edit.operations == (
        Translate((0.1, 0.05, 0.0)),
        ops.MoveCorner(3, (0.02, 0, 0)),
        ops.MoveCorner(2, (0.01, 0, 0)),
        Rotate((0, 0, 5)),
        Rotate((0, 0, 5)),
    )
    assert len(s.history.names) == 8


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ((5,), ops.MoveCorner(5, (1, 0, 0))),
        ((1, 0), ops.MoveEdge((0, 1), (1, 0, 0))),
        ((7, 1, 3, 5), ops.MoveFace("+x", (1, 0, 0))),
        ((0, 7), ops.MoveCorners((0, 7), (1, 0, 0))),
    ],
)
def test_corners_that_are_an_edge_or_a_face_move_as_one(
    corners: tuple[int, ...], expected: ops.Operation
) -> None:
    assert move_corners(corners, (1, 0, 0)) == expected


def test_moved_corners_keep_the_pivot_and_move_no_others() -> None:
    cage = ops.MoveCorners((0, 7), (0.05, 0, 0)).apply(INNER)
    shift = np.zeros((8, 3))
    shift[[0, 7], 0] = 0.05
    np.testing.assert_array_equal(cage.corners, INNER.corners + shift)
    np.testing.assert_array_equal(cage.pivot, INNER.pivot)
    with pytest.raises(CageError, match="each once"):
        INNER.move_corners((1, 1), (0, 0, 0))


def test_undo_and_redo_of_everything() -> None:
    s = session(ARM)
    states = [s.document]

    def did() -> None:
        assert s.document != states[-1]
        states.append(s.document)

    s.apply(1, "field", Translate((0.1, 0, 0)))
    did()
    s.change(1, kind="copy")
    did()
    s.change(1, name="leg")
    did()
    s.duplicate(1)
    did()
    s.mirror(2, 0)
    did()
    s.reorder(1, 2)
    did()
    s.remove(2)
    did()
    s.preserve_opacity(False)
    did()
    s.set_scale(0.25)
    did()
    s.set_path((Keyframe(tuple(np.eye(4).reshape(-1)), 40.0),), True)
    did()
    s.place(np.array([0.5, 0.0, 0.0]), 1.0)
    did()
    for state in reversed(states[:-1]):
        s.undo()
        assert s.document == state
    s.undo()
    assert s.document == states[0] and s.saved
    for state in states[1:]:
        s.redo()
        assert s.document == state
    s.go_to(3)
    assert s.document == states[3]
    s.apply(1, "field", Translate((0, 0.1, 0)))
    assert s.history.names[4:] == ("Move of leg",)


def test_history_never_leaves_its_ends() -> None:
    history = History.begin("a").push("more", "b")
    assert history.redo().state == "b" and history.undo().undo().state == "a"
    assert history.undo().push("other", "c").names == ("Open", "other")


def test_a_long_history_keeps_its_beginning_and_the_newest() -> None:
    history = History.begin(0)
    for number in range(1, MAX_ENTRIES + 20):
        history = history.push(str(number), number)
        assert history.state == number and len(history.names) == len(history.states) <= MAX_ENTRIES
    assert history.states == (0, *range(21, MAX_ENTRIES + 20)) and history.names[:2] == ("Open", "21")
    assert history.undo().push("other", -1).states[-2:] == (MAX_ENTRIES + 18, -1)
    assert history.go_to(0).state == 0


def test_saved_follows_the_document_through_undo() -> None:
    s = session(ARM)
    s.apply(1, "field", Translate((0.1, 0, 0)))
    s.mark_saved()
    assert s.saved
    s.undo()
    assert not s.saved
    s.redo()
    assert s.saved


def test_kinds_keep_what_the_other_kinds_cannot_have() -> None:
    s = session(ARM.replace(shell=Flow("linear", 0.5)).translate((0.1, 0, 0)))
    s.change(1, kind="delete")
    edit = s.document.entry(1).edit
    assert isinstance(edit, Delete) and not edit.operations and edit.shell_settings.shell == Flow()
    s.change(1, kind="copy")
    edit = s.document.entry(1).edit
    assert isinstance(edit, Copy) and edit.operations == (Translate((0.1, 0, 0)),)
    s.change(1, kind="continuous")
    edit = s.document.entry(1).edit
    assert (edit.shell, edit.operations) == (Flow("linear", 0.5), (Translate((0.1, 0, 0)),))


def test_fill_and_shadows_are_switched_undone_and_kept_through_kinds() -> None:
    s = session(CUP.translate((0, 0.1, 0)))
    assert (CUP.fill, CUP.relight) == ("surroundings", "occlusion")
    s.change(1, fill="none")
    s.change(1, relight="none")
    assert s.history.names == ("Open", "Fill of cup", "Shadows of cup") and not s.saved
    state = edit_state(s.document.entry(1), None, None)
    assert (state.fill, state.relight) == ("none", "none")
    for kind in ("continuous", "copy", "delete", "move"):
        s.change(1, kind=kind)  # type: ignore[arg-type]
        edit = s.document.entry(1).edit
        assert (edit.fill, edit.relight) == ("none", "none") and s.problem(edit) is None
    for _ in range(5):
        s.undo()
    edit = s.document.entry(1).edit
    assert (edit.fill, edit.relight) == ("none", "occlusion")
    s.undo()
    assert s.document.entry(1).edit.fill == "surroundings" and s.saved
    s.redo()
    assert s.document.entry(1).edit.fill == "none"
    s.change(1, locked=True)
    with pytest.raises(EditError, match="locked"):
        s.change(1, fill="surroundings")


def test_a_discrete_edit_that_becomes_continuous_gets_an_outer_cage_it_fits() -> None:
    s = session(CUP.translate((0, 0.5, 0)))
    s.change(1, kind="continuous")
    edit = s.document.entry(1).edit
    assert s.problem(edit) is None and s.drawn() == (edit,)


def test_a_shell_without_falloff_loses_it_and_gets_it_back() -> None:
    s = session(ARM.replace(shell=Flow(width=0.5)))
    s.change(1, shell="trilinear")
    assert s.document.entry(1).edit.shell == Trilinear()
    s.change(1, shell="flow")
    assert s.document.entry(1).edit.shell == Flow(width=0.5)


def test_an_edit_that_is_impossible_is_left_out_and_says_why() -> None:
    s = session(ARM, CUP.translate((0, 0.1, 0)))
    s.set_cage(1, "outer", Cage.box((0, 0, 0), 0.3))
    edit = s.document.entry(1).edit
    assert "must stay inside the outer cage" in (s.problem(edit.translate((0.01, 0, 0))) or "")
    s.apply(1, "field", Translate((0.01, 0, 0)))
    assert [drawn.name for drawn in s.drawn()] == ["cup"]


def test_locked_edits_stay_as_they_are() -> None:
    s = session(ARM)
    s.change(1, locked=True)
    for act in (
        lambda: s.apply(1, "field", Translate((0.1, 0, 0))),
        lambda: s.drag_begin(1, 1, 1, "inner"),
        lambda: s.change(1, name="leg"),
        lambda: s.remove(1),
        lambda: s.set_cage(1, "inner", INNER),
        lambda: s.outer_margin(1, 0.1),
    ):
        with pytest.raises(EditError, match=r'"arm" is locked; unlock it'):
            act()
    s.change(1, enabled=False)
    s.change(1, locked=False)
    s.remove(1)
    assert not s.document.entries and s.selected is None


def test_a_deleted_edit_cannot_move() -> None:
    s = session(Edit.delete(INNER, name="gone"))
    with pytest.raises(EditError, match="choose move or copy"):
        s.apply(1, "field", Translate((0.1, 0, 0)))


def test_names_stay_apart() -> None:
    s = session(ARM)
    s.duplicate(1)
    s.duplicate(2)
    s.place(np.zeros(3), 1.0)
    s.place(np.zeros(3), 1.0)
    names = [entry.edit.name for entry in s.document.entries]
    assert names == ["arm", "arm 2", "arm 3", "edit 1", "edit 2"]


def test_placed_cages_are_of_a_sensible_size_and_fit_together() -> None:
    s = session()
    number = s.place(np.array([0.3, 0.2, 0.1]), view_height=1.5)
    edit = s.document.entry(number).edit
    size = np.diff(edit.inner.aabb, axis=0)[0]
    np.testing.assert_allclose(size, 0.33)  # 22 % of the view's height
    edit.check()
    s.place(np.zeros(3), view_height=100.0)
    far = s.document.entries[-1].edit
    np.testing.assert_allclose(np.diff(far.inner.aabb, axis=0)[0], 2.0 / 3.0)  # a third of the field
    s.place(np.zeros(3), view_height=1e-3)
    near = s.document.entries[-1].edit
    np.testing.assert_allclose(np.diff(near.inner.aabb, axis=0)[0], 0.08)  # 8 voxels


def test_the_outer_margin_holds_the_inner_cage_before_and_after() -> None:
    s = session(ARM.translate((0.2, 0, 0)))
    s.outer_margin(1, 0.1)
    outer = s.document.entry(1).edit.outer
    assert outer is not None
    np.testing.assert_allclose(outer.aabb, [[-0.3, -0.3, -0.3], [0.5, 0.3, 0.3]])


def test_colors_stay_with_the_order_of_the_edits() -> None:
    s = session(ARM, CUP)
    first = [entry.color for entry in s.document.entries]
    assert len(set(first)) == 2
    s.duplicate(1)
    assert len({entry.color for entry in s.document.entries}) == 3
    for _ in range(2):
        s.load_edits(dump_edits(EditStack([ARM, CUP])), append=False)
        assert [entry.color for entry in s.document.entries] == first
    s.remove(s.document.entries[0].id)
    s.load_edits(dump_edits(EditStack([ARM])), append=True)
    assert sorted(entry.color for entry in s.document.entries) == sorted(first)


def test_edit_texts_go_out_and_come_in() -> None:
    s = session(ARM.translate((0.1, 0, 0)), CUP)
    text = dump_edits(EditStack([s.document.entry(1).edit]))
    assert s.load_edits(text, append=True) == 1
    moved = ARM.translate((0.1, 0, 0))
    assert [entry.edit for entry in s.document.entries] == [moved, CUP, moved]
    s.load_edits("edits: []", append=False)
    assert not s.document.entries
    with pytest.raises(EditError, match=r"the text, line 1.*unknown key"):
        s.load_edits("edit: []", append=False)


def test_the_space_below_an_edit_is_that_of_the_shown_edits_before_it() -> None:
    s = session(ARM.translate((0.1, 0, 0)), CUP.replace(enabled=False), CUP)
    assert s.below(3) == (s.document.entry(1).edit,)
    assert s.below(1) == ()


def test_a_grade_is_set_undone_and_kept_through_kinds() -> None:
    s = session(CUP.translate((0, 0.1, 0)))
    s.change(1, grade={"exposure": 0.5, "saturation": 1.2})
    assert s.history.names == ("Open", "Color of cup")
    assert s.document.entry(1).edit.grading == Grade(exposure=0.5, saturation=1.2)
    assert edit_state(s.document.entry(1), None, None).grade.saturation == 1.2
    for kind in ("continuous", "copy", "delete"):
        s.change(1, kind=kind)  # type: ignore[arg-type]
    assert not s.document.entry(1).edit.is_graded
    s.change(1, kind="move")
    assert s.document.entry(1).edit.grading == Grade(exposure=0.5, saturation=1.2)
    for _ in range(5):
        s.undo()
    assert not s.document.entry(1).edit.is_graded
    assert s.saved


def test_a_mirror_is_an_operation_of_cut_out_parts() -> None:
    s = session(CUP.translate((0, 0.1, 0)))
    s.apply(1, "field", Mirror("x"))
    assert s.document.entry(1).edit.operations[-1] == Mirror("x")
    assert s.history.names[-1] == "Mirroring of cup"
    with pytest.raises(EditError, match="make the edit a move or a copy"):
        s.change(1, kind="continuous")
    s.undo()
    assert s.document.entry(1).edit.operations == (Translate((0, 0.1, 0)),)
