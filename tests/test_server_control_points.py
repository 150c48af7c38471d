"""Control points in the editor's session: drags, undo, refusals, and what pages are told."""

from __future__ import annotations

import base64

import numpy as np
import pytest

from cagefield.edits import Bend, Edit, EditStack, MovePoint, Rotate, Translate, dump_edits, parse_edits
from cagefield.errors import CagefieldError, EditError
from cagefield.geometry import MeshCage
from cagefield.geometry.cage import Cage
from cagefield.geometry.reach_cage import ReachCage
from cagefield.server.editor.document import Document
from cagefield.server.editor.drag_solver import appended
from cagefield.server.editor.point_edits import decoded_mesh_cage
from cagefield.server.editor.session import Session
from cagefield.server.protocol.conversion import edit_state

BOUNDS = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
NOSE = Edit.points([[0, 0, 0]], radius=0.3, name="nose")


def session(*edits: Edit) -> Session:
    return Session(Document.from_edits(edits), BOUNDS, 0.01)


def test_a_drag_moves_the_points_and_the_outer_cage_follows() -> None:
    s = session(NOSE)
    s.drag_begin(7, 1, 1, "field")
    assert s.drag(7, 1, Translate((0.2, 0.0, 0.0))).part == 1.0
    shown = s.shown.entry(1).edit
    np.testing.assert_allclose(shown.deformed.handles, [[0.2, 0, 0]])
    assert isinstance(shown.shell_settings.outer, ReachCage)
    assert shown.shell_settings.outer.aabb[1, 0] >= 0.5
    s.drag_end(7, 1, Translate((0.2, 0.0, 0.0)))
    s.apply(1, "field", Rotate((0.0, 0.0, 30.0)))
    s.apply(1, "field", MovePoint(0, (0.0, 0.1, 0.0)))
    assert [str(o) for o in s.document.entry(1).edit.operations][-1] == "of point 0 by (0, 0.1, 0)"
    for _ in range(3):
        s.undo()
    assert s.document.entry(1).edit == NOSE


def test_cages_are_set_without_moving_the_field() -> None:
    s = session(NOSE.translate((0.1, 0, 0)))
    s.apply(1, "both", Translate((0.0, 0.2, 0.0)))
    edit = s.document.entry(1).edit
    np.testing.assert_allclose(edit.inner.handles, [[0, 0.2, 0]])
    np.testing.assert_allclose(edit.deformed.handles, [[0.1, 0.2, 0]])
    assert isinstance(edit.shell_settings.outer, ReachCage)
    s.apply(1, "outer", Translate((0.0, 0.0, 0.01)))
    # Moved by hand, the outer cage stays where it is put.
    assert type(s.document.entry(1).edit.shell_settings.outer) is Cage


def test_a_drag_stops_at_an_outer_cage() -> None:
    s = session(NOSE.replace(outer=Cage.box((0, 0, 0), 0.8)))
    s.drag_begin(7, 1, 1, "field")
    moved = s.drag(7, 1, Translate((0.8, 0.0, 0.0)))
    assert 0.45 < moved.part < 0.5 and moved.why is not None and "inside the outer cage" in moved.why


@pytest.mark.parametrize("kind", ["move", "copy", "delete"])
def test_control_points_stay_continuous(kind: str) -> None:
    s = session(NOSE)
    with pytest.raises(EditError, match=f"a {kind} needs a cage with 8 corners, not control points"):
        s.change(1, kind=kind)  # type: ignore[arg-type]
    assert s.document.entry(1).edit == NOSE


def test_options_that_only_hexahedra_have_are_refused() -> None:
    s = session(NOSE)
    box = Cage.box((0, 0, 0), 0.2)
    for call, message in (
        (lambda: s.set_cage(1, "inner", box), "control points are not placed by corners"),
        (lambda: s.fit_inner(1, box), "control points are not placed by corners"),
        (lambda: s.change(1, shell="trilinear"), "a trilinear shell joins cages with 8 corners"),
        (lambda: s.change(1, width=0.5), "control points have a falloff and a radius of their own"),
    ):
        with pytest.raises(EditError, match=message):
            call()
    assert s.document.entry(1).edit == NOSE and s.saved


def test_pages_are_told_of_the_box_around_the_points() -> None:
    s = session(NOSE.translate((0.1, 0, 0)))
    state = edit_state(s.document.entry(1), None, None)
    np.testing.assert_allclose(state.inner[7], (0.3, 0.3, 0.3))
    np.testing.assert_allclose(state.deformed[0], (-0.2, -0.3, -0.3))
    assert state.outer is not None and state.kind == "continuous" and state.shell == "flow"


def test_a_document_of_control_points_is_saved_and_read() -> None:
    s = session(NOSE.rotate((0, 0, 0.4)).move_point(0, (0.1, 0, 0)))
    s.apply(1, "both", Rotate((0.0, 20.0, 0.0)))  # the inner cage now has a linear map of its own
    stack = EditStack(entry.edit for entry in s.document.entries)
    for kind in ("yaml", "json"):
        assert parse_edits(dump_edits(stack, format=kind), format=kind) == stack


def test_moves_of_one_point_are_joined_and_bends_are_not() -> None:
    moves = appended((MovePoint(0, (0.1, 0.0, 0.0)),), MovePoint(0, (0.0, 0.2, 0.0)))
    assert moves == (MovePoint(0, (0.1, 0.2, 0.0)),)
    others = appended(moves, MovePoint(1, (0.0, 0.2, 0.0)))
    assert len(others) == 2
    assert len(appended((Bend("z", 10.0),), Bend("z", 5.0))) == 2


def test_a_mesh_file_becomes_a_cage_with_its_edges() -> None:
    pytest.importorskip("trimesh", reason="trimesh is not installed")
    cube = MeshCage.of_box(Cage.box((0, 0, 0), 0.6))
    obj = "".join(f"v {x} {y} {z}\n" for x, y, z in cube.vertices)
    obj += "".join(f"f {a + 1} {c + 1} {b + 1}\n" for a, b, c in cube.triangles)  # inside out
    cage, warning = decoded_mesh_cage("cube.obj", base64.b64encode(obj.encode()).decode())
    assert warning is not None and "cube.obj: the mesh is inside out" in warning
    s = session()
    s.place_mesh(cage, "cube.obj")
    entry = s.document.entries[0]
    outer = entry.edit.shell_settings.outer
    assert entry.edit.name == "cube" and outer is not None
    np.testing.assert_allclose(outer.aabb, [3 * [-0.51], 3 * [0.51]])
    points = edit_state(entry, None, None).points
    assert points is not None and points.edges is not None and len(points.edges) == 18
    sides = {tuple(sorted((t[k - 1], t[k]))) for t in cage.triangles.tolist() for k in range(3)}
    assert set(points.edges) == sides
    s.undo()
    assert s.document.entries == ()


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("cube.obj", "%%%", "cube.obj: the file arrived damaged; choose it again"),
        ("cube.stl", "", r'cube.stl: a mesh cage is a .obj, .ply, .glb file, got ".stl"'),
        ("cube.obj", base64.b64encode(b"v 0 0 0").decode(), "cube.obj: "),
        ("cube.obj", base64.b64encode(bytes(5 << 20)).decode(), r"at most \d+ bytes; decimate"),
    ],
)
def test_mesh_files_that_are_none_are_refused(name: str, content: str, said: str) -> None:
    pytest.importorskip("trimesh", reason="trimesh is not installed")
    with pytest.raises(CagefieldError, match=said):
        decoded_mesh_cage(name, content)
