"""Parents of edits in the editor's session: chosen, renamed, removed, dragged, drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit, EditStack, Translate, dump_edits
from cagefield.errors import EditError
from cagefield.geometry.cage import Cage
from cagefield.server.editor.document import Document
from cagefield.server.editor.path_edits import edits_at_time
from cagefield.server.editor.session import Session
from cagefield.server.protocol.conversion import dragged_of, state_of

BOUNDS = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
ARM_CAGE = Cage.box((0, 0, 0), (0.8, 0.3, 0.3))
ARM = Edit.continuous(ARM_CAGE, ARM_CAGE.grown(0.6), lattice=16, name="arm").rotate((0, 0, np.pi / 2))
LEG = Edit.move(Cage.box((0, 0, -0.5), 0.2), name="leg")
FINGER_CAGE = Cage.box((0.3, 0, 0), 0.1)
FINGER = Edit.continuous(FINGER_CAGE, FINGER_CAGE.grown(0.1), lattice=16, name="finger").translate(
    (0, 0, 0.02)
)


def session(*edits: Edit) -> Session:
    return Session(Document.from_edits(edits), BOUNDS, 0.01)


def names(edits: tuple[Edit, ...]) -> list[str]:
    return [edit.name for edit in edits]


def test_a_chosen_parent_orders_the_picture_and_is_undone() -> None:
    s = session(ARM, FINGER)
    assert names(s.drawn()) == ["arm", "finger"]
    s.change(2, parent=1)
    assert s.document.entry(2).edit.parent == "arm" and s.history.names[-1] == "Parent of finger"
    assert names(s.drawn()) == ["finger", "arm"] and not any(edit.parent for edit in s.drawn())
    assert names(s.below(1)) == ["finger"] and s.below(2) == ()
    assert s.drawn()[0] is s.drawn()[0] is s.document.entry(2).edit.without_parent  # renderers keep its map
    s.undo()
    assert not s.document.entry(2).edit.parent and names(s.drawn()) == ["arm", "finger"]
    s.redo()
    s.change(2, parent=0)
    assert not s.document.entry(2).edit.parent


def test_impossible_parents_change_nothing() -> None:
    s = session(ARM, FINGER, Edit.paste("x", FINGER_CAGE, name="hat"), ARM.replace(name=""))
    s.change(2, parent=1)
    for number, parent, message in (
        (1, 2, "in a circle"),
        (1, 1, "in a circle"),
        (1, 3, "is a paste, which carries no edits"),
        (1, 4, "its parent has no name; double-click it"),
        (1, 9, "edit 9 is not there any more"),
    ):
        before = s.document
        with pytest.raises(EditError, match=message):
            s.change(number, parent=parent)
        assert s.document is before
    s.change(2, locked=True)
    with pytest.raises(EditError, match="locked"):
        s.change(2, parent=0)


def test_children_follow_a_rename_and_go_to_the_grandparent() -> None:
    s = session(ARM, FINGER.replace(name="hand", parent="arm"), FINGER.replace(parent="hand"))
    s.change(2, name="palm")
    assert s.document.entry(3).edit.parent == "palm"
    with pytest.raises(EditError, match='"palm" carries other edits'):
        s.change(2, name="")
    with pytest.raises(EditError, match='"arm" is the name of 2 edits; rename all but one'):
        s.change(3, name="arm")
    s.remove(2)
    assert s.document.entry(3).edit.parent == "arm"
    s.remove(1)
    assert s.document.entry(3).edit.parent == ""
    s.undo()
    s.undo()
    assert [entry.edit.parent for entry in s.document.entries] == ["", "arm", "palm"]


def test_a_chain_that_is_appended_has_names_of_its_own() -> None:
    s = session(ARM, FINGER.replace(parent="arm"))
    assert s.load_edits(dump_edits(EditStack([ARM, FINGER.replace(parent="arm")])), append=True) == 2
    assert [(e.edit.name, e.edit.parent) for e in s.document.entries[2:]] == [
        ("arm 2", ""),
        ("finger", "arm 2"),
    ]
    # A child alone joins the parent that is there, and is refused where there is none.
    s.load_edits(dump_edits(EditStack([FINGER.replace(parent="arm")])), append=True)
    with pytest.raises(EditError, match='its parent "leg" is not in the stack'):
        s.load_edits(dump_edits(EditStack([FINGER.replace(parent="leg")])), append=True)


def test_carriers_are_where_the_parent_takes_the_cages_and_follow_its_drag() -> None:
    s = session(ARM, FINGER.replace(parent="arm"))

    def carrier() -> np.ndarray:
        value = state_of(s, "", 1, {}).edits[1].carrier
        return np.eye(3, 4) if value is None else np.array(value).reshape(3, 4)

    quarter = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0]])
    np.testing.assert_allclose(carrier(), quarter, atol=1e-9)
    assert state_of(s, "", 1, {}).edits[1].parent == 1 and state_of(s, "", 1, {}).edits[0].carrier is None
    s.drag_begin(7, 1, 1, "field")
    s.drag(7, 1, Translate((0.0, 0.1, 0.0)))
    np.testing.assert_allclose(
        carrier(), quarter + np.array([[0.0] * 4, [0, 0, 0, 0.1], [0.0] * 4]), atol=1e-9
    )
    s.drag_cancel(7)
    np.testing.assert_allclose(carrier(), quarter, atol=1e-9)
    s.change(1, enabled=False)
    np.testing.assert_array_equal(carrier(), np.eye(3, 4))


def test_a_drag_tells_where_it_carries_children_of_children_and_nobody_else() -> None:
    s = session(ARM, FINGER.replace(parent="arm"), FINGER.replace(name="nail", parent="finger"), LEG)
    s.drag_begin(7, 1, 1, "field")
    moved = s.drag(7, 1, Translate((0.0, 0.1, 0.0)))
    carriers = s.carriers_of(7)
    assert list(carriers) == [2, 3] and s.carriers_of(8) == {}
    message = dragged_of(1, 1, moved, carriers)
    for carried, edit in zip(message.carried, state_of(s, "", 1, {}).edits[1:], strict=False):
        assert carried.carrier is not None and carried.carrier == edit.carrier
    s.drag_cancel(7)
    s.drag_begin(7, 2, 4, "field")
    s.drag(7, 2, Translate((0.0, 0.1, 0.0)))
    assert s.carriers_of(7) == {}


def test_a_camera_path_shows_the_chain_at_its_parts() -> None:
    s = session(ARM, FINGER.replace(parent="arm"))
    pose = tuple(np.eye(4).reshape(-1).tolist())
    s.set_path((Keyframe(pose, 40.0, parts={1: 0.0, 2: 0.5}), Keyframe(pose, 40.0)), loop=False)
    at_start = edits_at_time(s.document, {1: 0.0, 2: 0.5})
    assert names(at_start) == ["finger"]  # an arm at rest changes nothing
    half = edits_at_time(s.document, {1: 0.5, 2: 0.5})
    assert names(half) == ["finger", "arm"] and not half[0].parent
    np.testing.assert_allclose(half[0].operations[0].by, (0, 0, 0.01))


def test_an_autosaved_chain_is_recovered(tmp_path: Path) -> None:
    from cagefield.scene.scene import Scene
    from cagefield.server.editor.persistence import SceneStore
    from scenes import ball_field

    Scene(ball_field(), edits=EditStack([ARM, FINGER])).save(tmp_path / "ball")
    store = SceneStore(Scene.open(tmp_path / "ball"), tmp_path / "ball")
    s = Session(store.document(), BOUNDS, 0.01)
    s.change(2, parent=1)
    store.autosave(s)
    found = SceneStore(Scene.open(tmp_path / "ball"), tmp_path / "ball").recovered()
    assert found is not None and found.entry(2).edit.parent == "arm"
    store.save(s)
    assert Scene.open(tmp_path / "ball").edits[1].parent == "arm"
