"""Motion of hotspots with the edits: from canonical space to the edited scene and back.

A hotspot that follows the edits is kept in canonical space. With x the position, y where the edits carry it
and R the rotation of the map's Jacobian there (its polar factor), the hotspot's camera goes along rigidly: a
point p of it to y + R (p - x). So the camera looks at the part from the side from which it was taken.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cagefield.edits import Edit, EditStack
from cagefield.edits.edit import Paste
from cagefield.scene.hotspots import Hotspot, HotspotView
from cagefield.typing import Array

if TYPE_CHECKING:
    from cagefield.scene.scene import Scene


def shown_hotspots(hotspots: Sequence[Hotspot], edits: Iterable[Edit]) -> tuple[Hotspot | None, ...]:
    """Hotspots where the edited scene shows them (deformed space); None for each that is not to be seen.

    A hotspot that follows is not to be seen where a discrete edit has deleted its place, or covered it with
    what it moves there. A copy takes it along; a paste moves nothing. Hotspots that do not follow return
    as they are. Positions go through the exact maps of the edits, which are in the order of their document,
    with the detours of connected control points. Raises `EditError` where an active edit cannot be evaluated.
    """
    rows = [number for number, hotspot in enumerate(hotspots) if hotspot.follows]
    shown: list[Hotspot | None] = list(hotspots)
    if rows:
        there = _moving(edits).to_deformed(np.array([hotspots[number].position for number in rows]))
        for n, number in enumerate(rows):
            moved = _moved(hotspots[number], there.points[n], _rotation(there.jacobian[n]), follows=False)
            shown[number] = None if there.hidden[n] else moved
    return tuple(shown)


def following(hotspot: Hotspot, edits: Iterable[Edit]) -> Hotspot | None:
    """Hotspot that follows the edits, of one in the edited scene; None where its place is empty.

    The inverse of `shown_hotspots`. Raises `EditError` where an active edit cannot be evaluated.
    """
    back = _moving(edits).to_canonical(np.array([hotspot.position]))
    if back.emptied[0]:
        return None
    return _moved(hotspot, back.points[0], _rotation(back.jacobian[0]), follows=True)


def visible_hotspots(scene: Scene) -> tuple[Hotspot, ...]:
    """Hotspots that a scene with its edits shows, at the places where it does; see `shown_hotspots`."""
    shown = shown_hotspots(scene.hotspots, moving_edits(scene))
    return tuple(hotspot for hotspot in shown if hotspot is not None)


def moving_edits(scene: Scene) -> tuple[Edit, ...]:
    """A scene's edits as `shown_hotspots` takes them; none where no hotspot follows them."""
    if not any(hotspot.follows for hotspot in scene.hotspots):
        return ()
    return edits_with_detours(scene)


def edits_with_detours(scene: Scene) -> tuple[Edit, ...]:
    """A scene's edits in the order of application, with the detours of connected control points."""
    return tuple(scene.patcher.with_detours(scene.edits.resolved))


def _moving(edits: Iterable[Edit]) -> EditStack:
    return EditStack(edit for edit in edits if not isinstance(edit, Paste))


def _moved(hotspot: Hotspot, position: Array, rotation: Array, *, follows: bool) -> Hotspot:
    """Hotspot at another position [3], its camera turned about it by a rotation [3,3]."""
    view = hotspot.view
    if np.array_equal(position, hotspot.position) and np.array_equal(rotation, np.eye(3)):
        return dataclasses.replace(hotspot, follows=follows)
    if view is not None:
        c2w = np.array(view.c2w).reshape(4, 4)
        c2w[:3, 3] = position + rotation @ (c2w[:3, 3] - hotspot.position)
        c2w[:3, :3] = rotation @ c2w[:3, :3]
        view = HotspotView(tuple(c2w.ravel().tolist()), view.fov_y_deg)
    x, y, z = position.tolist()
    return dataclasses.replace(hotspot, position=(x, y, z), view=view, follows=follows)


def _rotation(jacobian: Array) -> Array:
    """Rotation [3,3] that is nearest to a Jacobian [3,3]: its polar factor, proper where it mirrors."""
    if np.array_equal(jacobian, np.eye(3)):
        return jacobian
    U, _, Vt = np.linalg.svd(jacobian)
    U[:, 2] *= np.sign(np.linalg.det(U @ Vt))
    return np.asarray(U @ Vt)
