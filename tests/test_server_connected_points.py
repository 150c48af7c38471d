"""Connected control points in the editor's server: detours found in the background, carriers, problems."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cagefield.compute import devices
from cagefield.edits import Edit, EditStack, Translate
from cagefield.geometry.cage import Cage
from cagefield.geometry.control_points import ControlPoints
from cagefield.geometry.detour_grid import DetourGrid
from cagefield.scene.scene import Scene
from cagefield.selection.connected_points import detours_of, with_detours
from cagefield.server.editor.connected_edits import Wanted
from cagefield.server.editor.document import Document
from cagefield.server.editor.session import Session
from cagefield.server.protocol.conversion import state_of
from cagefield.server.render_queue.background import BackgroundWork
from cagefield.server.render_worker.renderer_cache import RendererCache
from cagefield.server.render_worker.task_handlers import SAMPLES, TaskHandlers
from cagefield.server.render_worker.tasks import (
    Answered,
    DetoursTask,
    ErrorTask,
    GridTask,
    Shown,
    values_of,
)
from slabs import TIP, slabs

BOUNDS = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
PULL = Edit.points([TIP], radius=0.8, connected=True, lattice=32).translate((0.0, 0.0, 0.3))


@pytest.fixture(scope="module")
def on_slabs() -> TaskHandlers:
    """Tasks on two slabs side by side."""
    devices.start()
    return TaskHandlers(RendererCache(Scene(slabs())))


def session(*edits: Edit) -> Session:
    return Session(Document.from_edits(edits), BOUNDS, 0.01)


def names(edits: tuple[Edit, ...]) -> list[str]:
    return [edit.name for edit in edits]


def test_detours_of_connected_points_are_found_in_the_background(on_slabs: TaskHandlers) -> None:
    wanted = Wanted(PULL.inner, ())
    found: list[object] = []
    asking: Any = SimpleNamespace(
        moving=False,
        drawn=lambda: (),
        shown=SimpleNamespace(applied=()),
        detours_wanted=lambda: None if found else wanted,
        detours_found=lambda asked, detours: found.append((asked, detours)),
    )
    told: list[int] = []
    store: Any = None
    background = BackgroundWork(asking, store, lambda: None, lambda _: None, lambda: told.append(1))
    background.warming, background.light_known = [], True
    first = background.next(0)
    assert first is not None
    task = first.make(1)
    first.done(on_slabs.do(task, lambda _: True))
    assert not found and not told, "given up, and asked for again"
    again = background.next(0)
    assert again is not None
    again.done(on_slabs.do(task, lambda _: False))
    assert found == [(wanted, detours_of(PULL.inner, slabs(), EditStack()))] and told == [1]
    assert background.next(0) is None


def test_points_connected_to_nothing_say_so(on_slabs: TaskHandlers) -> None:
    points = ControlPoints([(0, 0, 0.9)], 0.1, connected=True)
    answer = on_slabs.do(DetoursTask(1, points, Shown(()), 0), lambda _: False)
    assert isinstance(answer, Answered) and "control point 0" in answer.value
    assert "is connected to nothing" in answer.value
    # To the matter that an edit below has brought there it is connected.
    aside = Edit.move(Cage.box((-0.25, 0.0, -0.1), (0.3, 0.9, 1.3)), relight="none", fill="none")
    below = Shown(values_of((aside.translate((0.25, 0.0, 0.4)),)))
    moved = on_slabs.do(DetoursTask(1, points, below, 0), lambda _: False)
    assert isinstance(moved, Answered) and isinstance(moved.value, DetourGrid)


def test_the_grid_and_the_error_of_connected_points_know_their_detours(on_slabs: TaskHandlers) -> None:
    (value,) = values_of((PULL,))
    answer = on_slabs.do(GridTask(1, value), lambda _: False)
    (straight,) = values_of((Edit.points([TIP], radius=0.8).translate((0.0, 0.0, 0.3)),))
    plain = on_slabs.do(GridTask(1, straight), lambda _: False)
    assert isinstance(answer, Answered) and isinstance(plain, Answered)

    def bent_beside(lines: list[list[list[float]]]) -> float:
        """Furthest that lines along x are off their straight course on the slab at x = .25."""
        most = 0.0
        for line in map(np.array, lines):
            from_start, to_end = line[-1, 0] - line[0, 0], line[-1, 2]
            there = line[(np.abs(line[:, 0] - 0.25) < 0.08) & (np.abs(line[:, 1]) < 0.05)]
            if from_start > 1.5 and len(there) and -0.6 < to_end < 0.4:
                most = max(most, float(np.abs(there[:, 2] - to_end).max()))
        return most

    assert bent_beside(answer.value) < 0.4 * bent_beside(plain.value) > 0.02
    error = on_slabs.do(ErrorTask(1, value, 0), lambda _: False)
    resolved = with_detours(PULL, slabs(), EditStack())
    most, mean = resolved.lattice_error(samples=SAMPLES)
    assert isinstance(error, Answered) and 0.0 < mean < most
    np.testing.assert_allclose(error.value, np.array([most, mean]) / slabs().sample_spacing)


def test_connected_points_carry_once_their_detours_are_known() -> None:
    """The oracle: the chain's own map with the detours of the field."""
    arm = Edit.points([TIP], radius=0.8, connected=True, name="arm", lattice=16).translate((0, 0, 0.2))
    cage = Cage.box((0.25, 0.0, 0.2), 0.05)
    nail = Edit.continuous(cage, cage.grown(0.05), name="nail", parent="arm", lattice=16)
    s = session(arm, nail)
    assert s.carrier(s.document.entry(2)) is None
    wanted = s.detours_wanted()
    assert wanted is not None and wanted.points == arm.inner and wanted.below == ()
    found = detours_of(wanted.points, slabs(), EditStack())
    revision = s.revision
    s.detours_found(wanted, found)
    assert s.revision > revision and s.detours_wanted() is None
    carrier = s.carrier(s.document.entry(2))
    assert carrier is None  # the slab beside stays
    # On the slab of the tip it is carried, as far as there are no detours.
    s.set_cage(2, "outer", Cage.box((-0.25, 0.0, 0.2), 0.15))
    s.set_cage(2, "inner", Cage.box((-0.25, 0.0, 0.2), 0.05))
    entry = s.document.entry(2)
    carrier = s.carrier(entry)
    assert carrier is not None
    resolved = arm.replace(inner=arm.inner.with_detours(found), lattice=None)
    there = resolved.exact_warp.to_deformed(entry.edit.inner.corners).points
    carried = entry.edit.inner.corners @ carrier[:, :3].T + carrier[:, 3]
    assert np.abs(there - entry.edit.inner.corners).max() > 0.05
    np.testing.assert_allclose(carried, there, atol=5e-3)  # an affine fit to a map that bends
    # Other edits below, other detours.
    s.set_cage(2, "inner", Cage.box((-0.25, 0.0, 0.2), 0.06))
    assert s.detours_wanted() is None
    s.apply(2, "field", Translate((0.01, 0.0, 0.0)))
    again = s.detours_wanted()
    assert again is not None and again.points == arm.inner and len(again.below) == 1


def test_points_connected_to_nothing_have_a_problem_until_the_matter_is_another() -> None:
    lost = Edit.points([(0, 0, 0.9)], radius=0.1, connected=True, name="lost").translate((0, 0, 0.05))
    s = session(lost)
    wanted = s.detours_wanted()
    assert wanted is not None and names(s.drawn()) == ["lost"]
    s.detours_found(wanted, "control point 0 is connected to nothing; move it")
    assert s.drawn() == () and s.detours_wanted() is None
    assert state_of(s, "", 1, {}).edits[0].problem == "control point 0 is connected to nothing; move it"
    s.point_reach(1, 0.5, None)
    assert names(s.drawn()) == ["lost"] and s.detours_wanted() is not None
    s.undo()
    again = s.detours_wanted()
    assert again is not None
    s.detours_found(again, DetourGrid((-0.2,) * 3, 0.1, np.zeros((5, 5, 5))))
    assert names(s.drawn()) == ["lost"] and state_of(s, "", 1, {}).edits[0].problem is None
    s.point_reach(1, None, None, False)
    assert s.detours_wanted() is None
