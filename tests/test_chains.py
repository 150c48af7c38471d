"""Edits with parents: a child is carried by its parent's map, whatever the order and kinds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cagefield.cameras.keyframes import Keyframe
from cagefield.edits import Edit, EditStack, PreparedStack, dump_edits, parse_edits
from cagefield.edits.chains import ancestors, application_order
from cagefield.edits.partial_edit import partial_edit
from cagefield.errors import EditError, EditFileError
from cagefield.geometry import MeshCage
from cagefield.geometry.cage import Cage
from cagefield.pages.path_states import in_application_order
from tiers import nightly_after_first

TURN = Rotation.from_euler("XYZ", (20, 30, 40), degrees=True)
SHIFT = np.array([0.3, -0.2, 0.5])

ARM_CAGE = Cage.box((0, 0, 0), (2.0, 0.8, 0.8))
ARM = Edit.continuous(ARM_CAGE, ARM_CAGE.grown(1.4), name="arm").rotate(TURN).translate(SHIFT)
FINGER_CAGE = Cage.box((0.6, 0, 0), 0.2)
FINGER = Edit.continuous(FINGER_CAGE, FINGER_CAGE.grown(0.1), name="finger", parent="arm").translate(
    (0.05, 0.04, 0)
)
BODY = Edit.continuous(Cage.box((0.3, 0, 0.4), 0.6), Cage.box((0.3, 0, 0.4), 1.6), name="body").rotate(
    (0, 0.4, 0)
)
LATTICE = Edit.continuous(ARM_CAGE.subdivided((4, 1, 1)), ARM_CAGE.grown(1.4), name="arm").bend("x", 0.9)
POINTS = Edit.points([[0.6, 0, 0]], radius=0.7, name="arm").translate((0.1, 0.2, 0))
MESH = (
    Edit.continuous(MeshCage.of_box(ARM_CAGE), ARM_CAGE.grown(1.4), name="arm")
    .twist("x", 0.8)
    .move_point(7, (0.2, 0.1, 0.1))
)


def inside(edit: Edit, count: int = 300) -> np.ndarray:
    """Points [count,3] in the box of an edit's outer cage."""
    low, high = edit.outer.aabb if hasattr(edit, "outer") else edit.inner.aabb
    return np.random.default_rng(5).uniform(low, high, (count, 3))


@pytest.mark.parametrize(
    "parent",
    [
        ARM,
        LATTICE,
        POINTS,
        pytest.param(MESH, marks=pytest.mark.nightly),
        Edit.move(ARM_CAGE, name="arm").rotate(TURN),
    ],
)
@pytest.mark.parametrize("is_child_first", [True, False])
def test_a_child_acts_first_and_its_parent_carries_it(parent: Edit, is_child_first: bool) -> None:
    stack = EditStack([FINGER, parent] if is_child_first else [parent, FINGER])
    p = inside(FINGER)
    own = FINGER.replace(parent="").exact_warp.to_deformed(p)
    expected = parent.exact_warp.to_deformed(own.points)
    found = stack.to_deformed(p)
    assert np.linalg.norm(found.points - parent.exact_warp.to_deformed(p).points, axis=1).max() > 0.05
    np.testing.assert_allclose(found.points, expected.points, atol=1e-12)
    np.testing.assert_allclose(found.jacobian, expected.jacobian @ own.jacobian, atol=1e-12)
    # A composition of one-to-one maps: nothing folds, and the way back is exact.
    assert np.linalg.det(found.jacobian).min() > 0.05
    np.testing.assert_allclose(stack.to_canonical(found.points).points, p, atol=2e-4)


def test_a_rigid_parent_carries_cage_and_operation_as_a_hand_would_place_them() -> None:
    # Oracle: the child placed after its parent, its cages and vectors turned and moved by hand.
    R, there = TURN.as_matrix(), EditStack([ARM]).to_deformed
    inner, outer = (Cage(there(cage.corners).points) for cage in (FINGER_CAGE, FINGER_CAGE.grown(0.1)))
    np.testing.assert_allclose(inner.center, R @ FINGER_CAGE.center + SHIFT, atol=1e-12)
    by_hand = Edit.continuous(inner, outer, name="finger").translate(R @ (0.05, 0.04, 0))
    p = there(inside(FINGER)).points
    ours, theirs = EditStack([ARM, FINGER]).to_canonical(p), EditStack([ARM, by_hand]).to_canonical(p)
    # Both flows take the same steps in congruent cages.
    np.testing.assert_allclose(ours.points, theirs.points, atol=1e-9)
    np.testing.assert_allclose(ours.jacobian, theirs.jacobian, atol=1e-7)


def test_moving_the_parent_moves_the_effect_of_its_child() -> None:
    before, after = (EditStack([FINGER, arm]) for arm in (ARM, ARM.translate((0, 0, 0.3))))
    tip = before.to_deformed([FINGER_CAGE.center]).points
    np.testing.assert_allclose(after.to_deformed([FINGER_CAGE.center]).points - tip, [[0, 0, 0.3]], atol=1e-9)


def test_order_of_chains_of_several_links() -> None:
    finger, hand = FINGER.replace(parent="hand"), FINGER.replace(name="hand", parent="arm")
    ring = FINGER.replace(name="ring", parent="finger")
    edits = [
        BODY,
        ARM,
        ring,
        hand,
        finger,
        BODY.replace(name="thumb", parent="hand"),
        POINTS.replace(name="x"),
    ]
    names = [edits[n].name for n in application_order(edits)]
    assert names == ["body", "ring", "finger", "thumb", "hand", "arm", "x"]
    assert [edits[n].name for n in ancestors(edits, 2)] == ["finger", "hand", "arm"]
    stack = EditStack(edits)
    assert [edit.name for edit in stack.active] == names and not any(e.parent for e in stack.resolved)
    assert stack.edits == tuple(edits)  # the document keeps its own order
    assert stack.resolved[0] is edits[0] and stack.resolved[1] is ring.without_parent
    many = [BODY.replace(name=str(n), parent=str(n + 1) if n < 499 else "") for n in range(500)]
    assert application_order(many[::-1]) == tuple(range(499, -1, -1))


def test_a_hidden_parent_carries_nothing_and_a_hidden_child_changes_nothing() -> None:
    p = inside(FINGER)
    hidden = EditStack([ARM.replace(enabled=False), FINGER])
    np.testing.assert_array_equal(hidden.to_deformed(p).points, FINGER.exact_warp.to_deformed(p).points)
    hidden = EditStack([ARM, FINGER.replace(enabled=False)])
    np.testing.assert_array_equal(hidden.to_deformed(p).points, ARM.exact_warp.to_deformed(p).points)


CASES = [
    ([FINGER], r'edit "finger": its parent "arm" is not in the stack; name another edit'),
    ([BODY, FINGER], r'"arm" is not in the stack; name one of "body", or leave parent out'),
    ([ARM, FINGER, ARM], r'its parent "arm" is the name of 2 edits; rename all but one'),
    ([ARM.replace(parent="arm")], r'edit "arm": parents go in a circle, "arm" -> "arm"'),
    ([FINGER, ARM.replace(parent="finger")], r'in a circle, "finger" -> "arm" -> "finger"; leave out one'),
    ([Edit.paste("x", ARM_CAGE, name="arm"), FINGER], r'"arm" is a paste, which carries no edits'),
]


@pytest.mark.parametrize(("edits", "message"), CASES)
def test_impossible_parents(edits: list[Edit], message: str) -> None:
    stack = EditStack(edits)
    for evaluate in (stack.check, lambda: stack.active, lambda: stack.to_canonical(np.zeros((1, 3)))):
        with pytest.raises(EditError, match=message):
            evaluate()
    with pytest.raises(EditFileError, match=r"edits\[\d\]\.parent: .*" + message):
        parse_edits(dump_edits(stack))
    parse_edits(dump_edits(stack), check=False)  # for texts of a part of a stack


def test_parents_in_python_and_in_files() -> None:
    assert FINGER.replace(parent="").parented_to(ARM) == FINGER == FINGER.parented_to("arm")
    assert FINGER.parented_to("") == FINGER.without_parent and ARM.without_parent is ARM
    with pytest.raises(EditError, match="its parent has no name; give it one"):
        FINGER.parented_to(ARM.replace(name=""))
    with pytest.raises(EditError, match='parent must be the name of an edit, or "", got int'):
        FINGER.replace(parent=3)
    with pytest.raises(EditError, match=r"the name of its parent .* control character"):
        FINGER.replace(parent="a\nb")
    for form in ("yaml", "json"):
        stack = EditStack([FINGER, ARM, Edit.delete(FINGER_CAGE, name="no nail", parent="finger")])
        text = dump_edits(stack, format=form)
        assert parse_edits(text, format=form) == stack and "parent" in text
    assert not parse_edits("[{inner: {center: [0, 0, 0], size: 1}, outer: {margin: 1}, parent: null}]")[
        0
    ].parent


@pytest.mark.parametrize("parent", nightly_after_first([ARM, LATTICE, POINTS, MESH]))
def test_keyframes_move_parent_and_child(parent: Edit) -> None:
    # At half of both, as a camera path shows it: halves of the operations, still a chain.
    half = PreparedStack(partial_edit(edit, 0.5) for edit in EditStack([parent, FINGER]).resolved)
    own, arm = (partial_edit(edit, 0.5) for edit in (FINGER.without_parent, parent))
    p = inside(FINGER)
    np.testing.assert_allclose(
        half.to_deformed(p).points, arm.exact_warp.to_deformed(own.exact_warp.to_deformed(p).points).points
    )


def test_parts_of_a_camera_path_are_renumbered_with_the_edits() -> None:
    pose = tuple(np.eye(4).reshape(-1).tolist())
    keys = [Keyframe(pose, 40.0, parts={1: 0.1, 2: 0.2, 3: 0.3, 7: 0.7})]
    stack, (key,) = in_application_order(EditStack([BODY, ARM, FINGER]), keys)
    assert [edit.name for edit in stack] == ["body", "finger", "arm"]
    assert key.parts == {1: 0.1, 3: 0.2, 2: 0.3}
