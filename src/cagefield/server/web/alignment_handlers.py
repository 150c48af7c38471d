"""Messages about scale, up direction and alignment: the rendering process measures, the session keeps."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from cagefield.edits import Paste
from cagefield.errors import CagefieldError, EditError
from cagefield.scene.alignment import up_from_points
from cagefield.server.editor.pasting import points_at_rest, source_points
from cagefield.server.protocol import alignment_messages as messages
from cagefield.server.render_queue.coordinator import Coordinator, Page
from cagefield.server.render_worker.tasks import AlignTask, EditValues, FloorTask

NO_FLOOR = "no plane is nearly level in this scene; give three points of one that is level"


async def change_alignment(coordinator: Coordinator, page: Page, message: messages.AlignmentMessage) -> None:
    """Follow a message about alignment. Raises CagefieldError where it cannot be followed."""
    session = coordinator.session
    if isinstance(message, messages.ScaleChange):
        session.set_scale(message.meters_per_unit)
    elif isinstance(message, messages.AlignPaste):
        await _align_paste(coordinator, page, message)
    elif message.by == "cameras":
        session.set_up(None)
    elif message.by == "floor":
        await _take_floor(coordinator, page)
    else:
        if len(message.points) != 3:
            raise CagefieldError(f"a level plane takes three points, not {len(message.points)}")
        normal = up_from_points(message.points, coordinator.up)
        tilt = _tilt(normal, coordinator.up)
        session.set_up(normal)
        page.notice("info", f"up: normal of the three points, tilted by {tilt:.1f}° from up so far")


def _tilt(normal: ArrayLike, up: ArrayLike) -> float:
    """Angle in degrees between two unit directions [3]."""
    return float(np.degrees(np.arccos(np.clip(np.asarray(normal) @ np.asarray(up), -1.0, 1.0))))


async def _take_floor(coordinator: Coordinator, page: Page) -> None:
    session, up = coordinator.session, coordinator.up
    removed = session.document.removed
    found = await coordinator.ask(lambda number: FloorTask(number, up, removed))
    if found is None:
        raise CagefieldError(NO_FLOOR)
    normal, share = np.array(found[0]), found[1]
    tilt = _tilt(normal, up)
    session.set_up(normal)
    page.notice("info", f"floor: {share:.0%} of the surfaces, tilted by {tilt:.1f}° from up so far")


async def _align_paste(coordinator: Coordinator, page: Page, message: messages.AlignPaste) -> None:
    session = coordinator.session
    entry = session.document.entry(message.edit)
    edit = entry.edit
    if not isinstance(edit, Paste):
        raise EditError(f'edit "{edit.name}" is no paste; pairs of points align what is pasted')
    carrier = session.carrier(entry)
    pasted = points_at_rest(carrier, np.array([pair.pasted for pair in message.pairs]))
    goal = points_at_rest(carrier, np.array([pair.scene for pair in message.pairs]))
    values, source = EditValues.from_edit(edit), source_points(edit, pasted)
    removed = session.document.removed
    found, residual, surfaces = await coordinator.ask(
        lambda number: AlignTask(
            number,
            values,
            source.tolist(),
            goal.tolist(),
            message.refine,
            message.keep_scale,
            message.match_colors,
            removed,
        )
    )
    session.align(message.edit, edit, found.edit())
    near = "" if surfaces is None else f"; surfaces {surfaces[1]:.3g} apart, {surfaces[0]:.3g} before"
    page.notice("info", f"aligned: pairs {residual:.3g} apart{near}")
