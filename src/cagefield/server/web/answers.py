"""Answers to questions of a page: text of an edit, sources, grid, histogram, path, point of the surface."""

from __future__ import annotations

import asyncio
from typing import Any

import numpy as np

from cagefield.edits import Continuous, EditStack, dump_edits
from cagefield.errors import CagefieldError
from cagefield.server.protocol.client_messages import Ask
from cagefield.server.protocol.conversion import view_height
from cagefield.server.protocol.server_messages import Answer
from cagefield.server.render_queue.coordinator import Coordinator, Page
from cagefield.server.render_worker.tasks import EditValues, GridTask, Shown, SurfaceTask, values_of
from cagefield.server.web.hotspot_handlers import path_of
from cagefield.server.web.selection_handlers import histogram_of
from cagefield.typing import Array


async def answer_of(coordinator: Coordinator, page: Page, message: Ask) -> Answer:
    """The answer to a question; of a point of the surface without a point where none is seen there.

    Raises:
        CagefieldError: no edit is named where one has to be, or the page has sent no camera yet.
    """
    document = coordinator.session.document
    if message.what == "edit_text":
        if message.edit is None:
            raise CagefieldError("choose an edit to copy")
        edit = document.entry(message.edit).edit
        text = dump_edits(coordinator.store.written(EditStack([edit])))
        return Answer(request=message.request, text=text)
    if message.what == "sources":
        sources = await asyncio.to_thread(coordinator.store.sources)
        return Answer(request=message.request, sources=sources)
    if message.what == "grid":
        return Answer(request=message.request, grid=await _grid(coordinator, message.edit))
    if message.what == "histogram":
        counts = await histogram_of(coordinator, message.attribute)
        return Answer(request=message.request, histogram=counts)
    if message.what == "path":
        return await path_of(coordinator.session, message.request)
    found = await _surface(coordinator, page, message.x, message.y)
    if found is None:
        return Answer(request=message.request)
    return Answer(request=message.request, point=tuple(found[0]), normal=tuple(found[1]))


async def seen_point(
    coordinator: Coordinator, page: Page, x: float | None, y: float | None
) -> tuple[Array, float]:
    """The point [3] of the surface at a pixel, deformed space, and the view frustum's height there, world
    units.

    Without a pixel it is in the middle of the view, or of the field where no surface is seen there.

    Raises:
        CagefieldError: no surface at the pixel, or the page has sent no camera yet.
    """
    anywhere = x is None or y is None
    found = await _surface(coordinator, page, 0.5 if x is None else x, 0.5 if y is None else y)
    if found is None and not anywhere:
        raise CagefieldError("there is no surface under the mouse; double-click on the object")
    camera = page.camera
    assert camera is not None
    point = np.array(found[0]) if found is not None else coordinator.session.bounds.mean(axis=0)
    return point, view_height(camera, float(np.linalg.norm(point - camera.origin)))


async def _grid(coordinator: Coordinator, number: int | None) -> Any:
    """Lines of the deformed grid of an edit; none where it has none."""
    if number is None:
        raise CagefieldError("choose an edit to show the grid of")
    session = coordinator.session
    edit = session.shown.entry(number).edit
    if not isinstance(edit, Continuous) or session.problem(edit) is not None:
        return []
    values, removed = EditValues.from_edit(edit), session.shown.removed
    below = Shown(values_of(session.below(number)), removed=removed)
    return await coordinator.ask(lambda task: GridTask(task, values, below))


async def _surface(coordinator: Coordinator, page: Page, x: float, y: float) -> Any:
    """Point and normal of the surface that the page shows at a pixel, shares of the picture, or None."""
    camera = page.camera
    if camera is None:
        raise CagefieldError("the page has sent no camera yet; try again")
    shown = coordinator.shown()
    return await coordinator.ask(lambda number: SurfaceTask(number, shown, camera, x, y))
