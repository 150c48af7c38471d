"""Handlers of messages about mesh cages, lattices and control points."""

from __future__ import annotations

from typing import TypeAlias

from cagefield.server.editor.point_edits import decoded_mesh_cage
from cagefield.server.editor.session import Session
from cagefield.server.protocol.point_messages import PlaceMesh, PointReach, Subdivide
from cagefield.server.render_queue.coordinator import Page
from cagefield.server.web.worker_threads import run_in_thread

PointChange: TypeAlias = PlaceMesh | Subdivide | PointReach


async def change_points(session: Session, page: Page, message: PointChange) -> None:
    """Carry out a message. Raises `CagefieldError` where that is not possible."""
    if isinstance(message, PlaceMesh):
        cage, warning = await run_in_thread(lambda: decoded_mesh_cage(message.name, message.content))
        session.place_mesh(cage, message.name)
        if warning is not None:
            page.notice("warning", warning)
    elif isinstance(message, Subdivide):
        session.subdivide(message.edit, message.cells, message.interpolation)
    else:
        session.point_reach(message.edit, message.radius, message.falloff, message.connected)
