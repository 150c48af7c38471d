# SPDX-License-Identifier: GPL-3.0-or-later
"""The process of cagefield of this Blender, the splats that it has, and results brought back to objects."""

import hashlib
import os

import bpy
import numpy as np

from . import cages, splat_nodes, splat_objects, worker

_current = None


def chosen_python():
    """The interpreter of the preferences, else of the environment variable CAGEFIELD_PYTHON."""
    addon = bpy.context.preferences.addons.get(__package__)
    chosen = addon.preferences.python if addon is not None and addon.preferences is not None else ""
    return bpy.path.abspath(chosen) if chosen else os.environ.get("CAGEFIELD_PYTHON", "")


def running():
    """The worker, or None where none runs."""
    return _current if _current is not None and _current.is_running else None


def latest():
    """The worker that was started last, which may have ended, or None."""
    return _current


def get_worker():
    """The worker of the chosen interpreter, started where it does not run. Raises WorkerError."""
    global _current
    python = chosen_python()
    if running() is None or _current.python != python:
        close()
        _current, _ = worker.started(python)
    return _current


def close():
    """Ends the worker."""
    global _current
    if _current is not None:
        _current.close()
    _current = None


def open_path(context, path):
    """A new splat object of a scene folder or splat file, chosen as the splats. Raises WorkerError."""
    if os.path.basename(path) == "scene.json" or path.endswith(("/", os.sep)):
        path = os.path.dirname(path)
    path = os.path.abspath(bpy.path.abspath(path))
    process = get_worker()
    reply, arrays = process.ask({"request": "open", "path": path})
    name = os.path.basename(path)
    thing = splat_objects.new_splat_object(name, arrays, context.collection)
    thing[splat_objects.PATH] = path
    thing.matrix_world = _upright(reply["up"])
    process.loaded = ("path", path)
    choose(context.scene, thing)
    return thing


def choose(scene, thing):
    """Takes an object as the scene's splats at rest; a result for other splats is removed."""
    if scene.cagefield.source is not thing:
        remove_result(scene)
    scene.cagefield.source = thing


def load(settings, process, *, again=False):
    """Gives the worker the splats at rest, where it does not have them; `again` reads the object anew.

    Raises WorkerError, ValueError for an object without splats.
    """
    thing = settings.source
    if thing is None:
        raise ValueError("no splats are chosen; open a scene or a splat file, or take the active object")
    path = thing.get(splat_objects.PATH)
    if path:
        if process.loaded != ("path", path):
            process.ask({"request": "open", "path": path})
            process.loaded = ("path", path)
        return
    if not again and process.loaded is not None and process.loaded[:2] == ("object", thing.session_uid):
        return
    arrays = splat_objects.read_splats(thing)
    digest = hashlib.blake2b(digest_size=16)
    for values in arrays.values():
        digest.update(np.ascontiguousarray(values).data)
    key = ("object", thing.session_uid, digest.hexdigest())
    if process.loaded != key:
        process.ask({"request": "load"}, arrays)
        process.loaded = key


def edit_request(settings, depsgraph, request="deform", **more):
    """(header, arrays) of a request with the scene's edit. Raises CageObjectError."""
    header = {
        "request": request,
        "kind": settings.kind,
        "name": settings.edit_name,
        "infill": settings.infill,
        **more,
    }
    arrays = {}
    roles = [("inner", settings.inner)] + [("outer", settings.outer)] * (settings.kind == "continuous")
    for role, cage in roles:
        header[role], parts = cages.cage_arrays(cage, settings.source, role, depsgraph)
        arrays |= parts
    return header, arrays


def show_result(scene, arrays):
    """Brings deformed splats back, into the result's object, and hides those at rest."""
    settings = scene.cagefield
    source, result = settings.source, settings.result
    if result is None or result.name not in scene.objects:
        collections = source.users_collection or (scene.collection,)
        result = splat_objects.new_splat_object(f"{source.name} deformed", arrays, collections[0])
        result.parent = source
        splat_nodes.show_ellipsoids(result, splat_nodes.shows_ellipsoids(source))
        settings.result = result
    else:
        splat_objects.write_splats(result.data, arrays)
    source.hide_render = True
    if source.name in bpy.context.view_layer.objects:
        source.hide_set(True)


def remove_result(scene):
    """Removes the deformed splats, and shows those at rest."""
    settings = scene.cagefield
    result, source = settings.result, settings.source
    settings.result = None
    if result is not None:
        mesh = result.data
        bpy.data.objects.remove(result)
        if mesh is not None and not mesh.users:
            bpy.data.meshes.remove(mesh)
    if source is not None:
        source.hide_render = False
        if source.name in bpy.context.view_layer.objects:
            source.hide_set(False)


def _upright(up):
    """The rotation that takes a direction [3] that is up to Blender's z."""
    from mathutils import Vector

    return Vector(up).rotation_difference(Vector((0.0, 0.0, 1.0))).to_matrix().to_4x4()
