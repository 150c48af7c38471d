# SPDX-License-Identifier: GPL-3.0-or-later
"""Splats that follow their cages: changes are noticed by a handler, and sent and fetched by a timer.

While the worker is busy only the newest shape of the cages waits for it. Shapes that are equal to those sent
before are not sent.
"""

import bpy

from . import cages, session, worker

INTERVAL_S = 0.04
CHANNEL = "live"

_changed = set()
"""Names of scenes whose cages have changed."""

_sent = {}
"""Request of a scene, by name, that was sent last: its header's text and the arrays' bytes."""


def follow(scene):
    """Starts to follow a scene's cages where it is live, and deforms its splats once."""
    _sent.pop(scene.name, None)
    if scene.cagefield.live:
        _changed.add(scene.name)
        if not bpy.app.timers.is_registered(_timer):
            bpy.app.timers.register(_timer, first_interval=INTERVAL_S)


@bpy.app.handlers.persistent
def _on_change(scene, depsgraph):
    settings = scene.cagefield
    if not settings.live:
        return
    followed = {
        thing.session_uid
        for cage in (settings.inner, settings.outer, settings.source)
        if cage is not None
        for thing in (cage, cage.data)
    }
    if any(update.id.original.session_uid in followed for update in depsgraph.updates):
        _changed.add(scene.name)


@bpy.app.handlers.persistent
def _on_frame(scene, depsgraph):
    """Cages may be animated."""
    if scene.cagefield.live:
        _changed.add(scene.name)


@bpy.app.handlers.persistent
def _on_load(*_):
    """A file that is opened has nothing to do with the requests before it; its live scenes go on."""
    _changed.clear()
    _sent.clear()
    for scene in bpy.data.scenes:
        follow(scene)


def tick():
    """Fetches results, and sends the newest shapes of cages that have changed."""
    process = session.latest()
    try:
        if process is not None and (process.is_running or process.is_busy):
            process.poll()
        for name in sorted(_changed):
            _changed.discard(name)
            scene = bpy.data.scenes.get(name)
            if scene is not None and scene.cagefield.live:
                _send(scene)
    except (worker.WorkerError, cages.CageObjectError, ValueError) as error:
        for scene in bpy.data.scenes:
            if scene.cagefield.live:
                scene.cagefield.status = str(error)
                if isinstance(error, worker.WorkerError):
                    scene.cagefield.live = False
        if isinstance(error, worker.WorkerError):
            session.close()


def _timer():
    tick()
    process = session.running()
    wanted = any(scene.cagefield.live for scene in bpy.data.scenes)
    return INTERVAL_S if wanted or (process is not None and process.is_busy) else None


def _send(scene):
    settings = scene.cagefield
    process = session.get_worker()
    session.load(settings, process)
    header, arrays = session.edit_request(settings, bpy.context.evaluated_depsgraph_get())
    content = (repr(header), *(values.tobytes() for values in arrays.values()))
    if _sent.get(scene.name) == content:
        return
    _sent[scene.name] = content
    name = scene.name
    process.submit(header, arrays, lambda reply, splats: _show(name, reply, splats), channel=CHANNEL)


def _show(name, reply, splats):
    scene = bpy.data.scenes.get(name)
    if scene is None or scene.cagefield.source is None:
        return
    if "error" in reply:
        scene.cagefield.status = reply["error"]
        return
    session.show_result(scene, splats)
    scene.cagefield.status = f"{reply['count']} splats"


def register():
    """Adds the handlers."""
    bpy.app.handlers.depsgraph_update_post.append(_on_change)
    bpy.app.handlers.frame_change_post.append(_on_frame)
    bpy.app.handlers.load_post.append(_on_load)


def unregister():
    """Removes the handlers and the timer, and ends the worker."""
    bpy.app.handlers.depsgraph_update_post.remove(_on_change)
    bpy.app.handlers.frame_change_post.remove(_on_frame)
    bpy.app.handlers.load_post.remove(_on_load)
    if bpy.app.timers.is_registered(_timer):
        bpy.app.timers.unregister(_timer)
    session.close()
