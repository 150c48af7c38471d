"""Handlers of messages about mesh cages, lattices and control points."""

from __future__ import annotations

import asyncio
from typing import TypeAlias

from cagefield.server.editor.free_form_kernels import FreeForm, load_kernels
from cagefield.server.editor.point_edits import decoded_mesh_cage
from cagefield.server.editor.session import Session
from cagefield.server.protocol.point_messages import PlaceMesh, PointReach, Subdivide
from cagefield.server.render_queue.coordinator import Page
from cagefield.server.web.worker_threads import run_in_thread

PointChange: TypeAlias = PlaceMesh | Subdivide | PointReach


COMPILATION_NOTICE_S = 1.0
"""Time after which a page is told that it waits for a compilation, seconds."""


async def load_free_form(page: Page, kind: FreeForm) -> None:
    """Waits, off the event loop, until the kernels of a kind of cage are ready; the page is told why."""
    loading = asyncio.ensure_future(run_in_thread(lambda: load_kernels(kind)))
    done, _ = await asyncio.wait((loading,), timeout=COMPILATION_NOTICE_S)
    if not done:
        page.notice("info", f"the kernels of {kind} cages are compiled, once after an installation")
    await loading


async def change_points(session: Session, page: Page, message: PointChange) -> None:
    """Carry out a message. Raises `CagefieldError` where that is not possible."""
    if isinstance(message, PlaceMesh):
        await load_free_form(page, "mesh")
        cage, warning = await run_in_thread(lambda: decoded_mesh_cage(message.name, message.content))
        session.place_mesh(cage, message.name)
        if warning is not None:
            page.notice("warning", warning)
    elif isinstance(message, Subdivide):
        await load_free_form(page, "lattice")
        session.subdivide(message.edit, message.cells, message.interpolation)
    else:
        session.point_reach(message.edit, message.radius, message.falloff, message.connected)
