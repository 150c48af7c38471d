"""Steps of the Blender add-on without a window, run by an interpreter that has bpy: `python FILE FOLDER`.

FOLDER has splats.ply. Each step writes what a test compares: arrays as .npz, and report.json at the end.
"""

# ruff: noqa: E402  bpy and the add-on are imported once the path is known
import importlib
import json
import os
import signal
import sys
import time
import types
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "integrations"))

import bpy  # which makes addon_utils importable
import numpy as np
from mathutils import Euler, Matrix, Vector

addon_utils = importlib.import_module("addon_utils")
MODULE = "blender"  # the add-on's folder
TIMEOUT_S = 1500.0  # on a machine that others use too

folder = Path(sys.argv[1])
report: dict[str, object] = {"version": bpy.app.version_string}
bpy.ops.wm.read_factory_settings(use_empty=True)
assert addon_utils.enable(MODULE, default_set=True) is not None
from blender import live, panel, session, splat_nodes, splat_objects, worker

worker.START_TIMEOUT_S = TIMEOUT_S
addon = bpy.context.preferences.addons[MODULE]
report["license"] = (ROOT / "integrations/blender/LICENSE").read_text().strip().splitlines()[0].strip()


def settings():
    return bpy.context.scene.cagefield


def fails(operator, **options):
    """The error of an operator that is not possible."""
    try:
        operator(**options)
    except RuntimeError as error:
        return str(error).strip().removeprefix("Error: ")
    return ""


def save(name, thing):
    np.savez(folder / f"{name}.npz", **splat_objects.read_splats(thing))


def activate(thing):
    for other in bpy.context.view_layer.objects:
        other.select_set(other is thing)
    bpy.context.view_layer.objects.active = thing


def refresh():
    bpy.context.view_layer.update()


def follow_until(condition):
    """Ticks of the live timer, which has no event loop here, until a condition holds."""
    end = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < end, settings().status
        refresh()
        live.tick()
        time.sleep(0.01)


# ---- preferences ----
addon.preferences.python = sys.executable
report["without cagefield"] = fails(bpy.ops.cagefield.check_python)
addon.preferences.python = str(folder / "no-python")
report["no interpreter"] = fails(bpy.ops.cagefield.check_python)
addon.preferences.python = os.environ["CAGEFIELD_PYTHON"]
bpy.ops.cagefield.check_python()
report["check"] = settings().status

# ---- what is not possible yet ----
report["nothing chosen"] = fails(bpy.ops.cagefield.update)
bpy.ops.mesh.primitive_cube_add()
cube = bpy.context.active_object
report["a cube is no splats"] = fails(bpy.ops.cagefield.use_object)
bpy.data.objects.remove(cube)

# ---- splats imported by Blender, cages made and moved ----
bpy.ops.wm.ply_import(filepath=str(folder / "splats.ply"), import_attributes=True)
imported = bpy.context.active_object
imported.matrix_world = Matrix.Translation((1, 2, 3)) @ Euler((0.3, 0, 0)).to_matrix().to_4x4()
refresh()
bpy.ops.cagefield.use_object()
save("imported", imported)
report["no cage"] = fails(bpy.ops.cagefield.update)
bpy.ops.cagefield.make_cages()
inner, outer = settings().inner, settings().outer
refresh()
bpy.ops.cagefield.update()
save("at_rest", settings().result)
inner.rotation_euler = (0.0, 0.2, 0.1)
inner.location += Vector((0.05, 0.0, 0.02))
refresh()
header, arrays = session.edit_request(settings(), bpy.context.evaluated_depsgraph_get())
np.savez(folder / "request.npz", **arrays)
bpy.ops.cagefield.update()
save("updated", settings().result)
report["status"] = settings().status
report["hidden at rest"] = bool(imported.hide_render and imported.hide_get())
report["same place"] = bool(
    np.allclose(np.array(settings().result.matrix_world), np.array(imported.matrix_world), atol=1e-6)
)
bpy.ops.cagefield.save_edits(filepath=str(folder / "edits.yaml"))
bpy.ops.cagefield.export_splats(filepath=str(folder / "exported.ply"))

# ---- a cage that is edited: a corner of the mesh, then inside out, then subdivided ----
moved = inner.matrix_basis.copy()
inner.matrix_basis = Matrix.Translation(inner.location - Vector((0.05, 0.0, 0.02)))
corner = inner.data.vertices[7].co.copy()
inner.data.vertices[7].co = corner * 1.2
inner.data.update()
refresh()
bpy.ops.cagefield.update()
save("corner", settings().result)
bpy.ops.cagefield.save_edits(filepath=str(folder / "corner.yaml"))
activate(inner)
bpy.ops.object.mode_set(mode="EDIT")
import bmesh

bmesh.from_edit_mesh(inner.data).verts.ensure_lookup_table()
bmesh.from_edit_mesh(inner.data).verts[7].co = corner * 1.1
header, arrays = session.edit_request(settings(), bpy.context.evaluated_depsgraph_get())
report["corner in edit mode"] = float(
    np.linalg.norm(arrays["inner_target"] - arrays["inner_rest"], axis=1).max()
)
report["corner in edit mode expected"] = float(np.linalg.norm(corner) * 0.1)
bpy.ops.object.mode_set(mode="OBJECT")
inner.scale = (-1.0, 1.0, 1.0)
inner.data.vertices[7].co = corner
refresh()
report["inside out"] = fails(bpy.ops.cagefield.update)
inner.scale = (1.0, 1.0, 1.0)
modifier = inner.modifiers.new("Subdivision", "SUBSURF")
refresh()
report["subdivided"] = fails(bpy.ops.cagefield.update)
inner.modifiers.remove(modifier)

# ---- reset ----
bpy.ops.cagefield.reset()
refresh()
report["reset"] = bool(settings().result is None and not imported.hide_get())
header, arrays = session.edit_request(settings(), bpy.context.evaluated_depsgraph_get())
report["reset cage"] = float(np.abs(arrays["inner_target"] - arrays["inner_rest"]).max())

# ---- live: newest wins ----
process = session.get_worker()
settings().live = True
follow_until(lambda: settings().result is not None)
for _ in range(8):  # a drag: eight places before the first answer is fetched
    inner.location.x += 0.01
    refresh()
    live._timer()
follow_until(lambda: not process.is_busy)
follow_until(lambda: not process.is_busy)
save("live", settings().result)
np.savez(
    folder / "live_request.npz", **session.edit_request(settings(), bpy.context.evaluated_depsgraph_get())[1]
)
sent = process._number
inner.select_set(True)
inner.update_tag()
refresh()
report["a change is noticed"] = bpy.context.scene.name in live._changed
live.tick()
report["equal shapes sent"] = process._number - sent

# ---- live: an animated cage ----
before = inner.location.copy()
inner.keyframe_insert("location", frame=1)
inner.location.z += 0.05
inner.keyframe_insert("location", frame=2)
bpy.context.scene.frame_set(2)
follow_until(lambda: process._number > sent and not process.is_busy)
save("animated", settings().result)
animated = session.edit_request(settings(), bpy.context.evaluated_depsgraph_get())[1]
np.savez(folder / "animated_request.npz", **animated)
inner.animation_data_clear()
inner.location = before
refresh()

# ---- the process ends: one line, and the next update starts another ----
process._process.send_signal(signal.SIGSTOP)  # it has a request, and will never answer
inner.location.y += 0.01
refresh()
live.tick()
process._process.kill()
follow_until(lambda: not settings().live)
report["killed"] = settings().status
inner.location.y -= 0.01
refresh()
bpy.ops.cagefield.update()
save("after_restart", settings().result)

# ---- a lattice as the inner cage ----
lattice = bpy.data.objects.new("lattice", bpy.data.lattices.new("lattice"))
lattice.data.points_u, lattice.data.points_v, lattice.data.points_w = 2, 3, 2
lattice.parent = imported
lattice.location, lattice.scale = inner.location, inner.dimensions
bpy.context.collection.objects.link(lattice)
refresh()
activate(lattice)
bpy.ops.cagefield.assign(role="inner")
for number in (2, 3, 8, 9):  # the middle of v
    lattice.data.points[number].co_deform.z += 0.1
lattice.update_tag()
refresh()
header, arrays = session.edit_request(settings(), bpy.context.evaluated_depsgraph_get())
report["lattice"] = header["inner"]
np.savez(folder / "lattice_request.npz", **arrays)
bpy.ops.cagefield.update()
save("lattice", settings().result)
bpy.ops.cagefield.save_edits(filepath=str(folder / "lattice.yaml"))

# ---- a point cloud as the splats ----
cloud = imported.copy()
cloud.data = imported.data.copy()
bpy.context.collection.objects.link(cloud)
cloud.hide_set(False)
activate(cloud)
bpy.ops.object.convert(target="POINTCLOUD")
cloud = bpy.context.active_object
report["cloud"] = cloud.type
bpy.ops.cagefield.use_object()
bpy.ops.cagefield.make_cages()
settings().kind = "move"
settings().inner.location.x += 0.5
refresh()
cloud_request = session.edit_request(settings(), bpy.context.evaluated_depsgraph_get())
np.savez(folder / "cloud_request.npz", **cloud_request[1])
bpy.ops.cagefield.update()
save("cloud", settings().result)
settings().kind = "continuous"

# ---- a scene of cagefield ----
bpy.ops.cagefield.open(filepath=str(folder / "scene" / "scene.json"))
opened = settings().source
save("opened", opened)
up = opened.matrix_world.to_3x3() @ Vector((0.0, -1.0, 0.0))
report["up"] = list(up)
report["old result is gone"] = settings().result is None
bpy.ops.cagefield.show_ellipsoids(shown=True)
refresh()
instances = [one for one in bpy.context.evaluated_depsgraph_get().object_instances if one.is_instance]
report["ellipsoids"] = len(instances)
bpy.ops.cagefield.make_cages()
bpy.ops.cagefield.update()
report["the result has ellipsoids"] = splat_nodes.shows_ellipsoids(settings().result)
bpy.ops.cagefield.reset()
bpy.ops.cagefield.show_ellipsoids(shown=False)


# ---- the panel: every operator and property that it shows exists ----
class Layout:
    """A layout that looks up what it is asked to show."""

    def __init__(self):
        self.shown = []
        self.lines = []

    def column(self, **_):
        return self

    row = column

    def operator(self, name, **_):
        group, operator = name.split(".")
        self.shown.append(getattr(getattr(bpy.ops, group), operator).get_rna_type().identifier)
        return types.SimpleNamespace()

    def prop(self, data, name, **_):
        self.shown.append(data.bl_rna.properties[name].identifier)

    def label(self, text):
        self.lines.append(text)


settings().status = "a line of words that is longer than the panel is wide, and is wrapped"
layout = Layout()
panel.CagefieldPanel.draw(types.SimpleNamespace(layout=layout), bpy.context)
report["panel"] = layout.shown
report["panel lines"] = layout.lines

# ---- a cage that moves while answers come ----
settings().live = True
follow_until(lambda: settings().result is not None and not session.get_worker().is_busy)
process, shapes = session.get_worker(), []
for _ in range(4):
    settings().inner.location.x += 0.02
    refresh()
    live.tick()
    follow_until(lambda: not process.is_busy)
    shapes.append((process._number, splat_objects.read_splats(settings().result)["means"].copy()))
report["moves sent"] = [number for number, _ in shapes]
report["every answer is shown"] = all(not np.array_equal(shapes[k][1], shapes[k + 1][1]) for k in range(3))

# ---- a file that is saved and opened while it is live ----
bpy.ops.wm.save_as_mainfile(filepath=str(folder / "live.blend"))
bpy.ops.wm.open_mainfile(filepath=str(folder / "live.blend"))
report["live after opening"] = settings().live and bpy.context.scene.name in live._changed
settings().inner.location.y += 0.03
refresh()
follow_until(lambda: not live._changed and not session.get_worker().is_busy)
save("reopened", settings().result)
np.savez(
    folder / "reopened_request.npz",
    **session.edit_request(settings(), bpy.context.evaluated_depsgraph_get())[1],
)
settings().live = False

# ---- the end: the process goes with the add-on ----
last = session.running()
addon_utils.disable(MODULE, default_set=True)
report["ended"] = last is None or last._process.poll() is not None
report["unregistered"] = not hasattr(bpy.types.Scene, "cagefield")
(folder / "report.json").write_text(json.dumps(report))
