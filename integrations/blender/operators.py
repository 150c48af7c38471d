# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators of the sidebar. One that is not possible reports one line and changes nothing."""

import os

import bpy
import numpy as np
from bpy_extras.io_utils import ExportHelper, ImportHelper

from . import cages, live, session, splat_nodes, splat_objects, worker

CENTRAL_SHARE = 0.25
"""Share of the splats along each axis that new cages leave out on either side, where nothing is selected."""


class _Operator:
    """`execute` with errors reported, which also stand in the sidebar."""

    def execute(self, context):
        """Runs the operator."""
        try:
            said = self.run(context)
        except (worker.WorkerError, cages.CageObjectError, ValueError) as error:
            context.scene.cagefield.status = str(error)
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        context.scene.cagefield.status = said
        self.report({"INFO"}, said)
        return {"FINISHED"}


class CheckPython(_Operator, bpy.types.Operator):
    """Start the interpreter and ask for cagefield's version"""

    bl_idname = "cagefield.check_python"
    bl_label = "Check"

    def run(self, context):
        session.close()
        process, version = worker.started(session.chosen_python())
        process.close()
        return f"cagefield {version} answers"


class OpenSplats(_Operator, bpy.types.Operator, ImportHelper):
    """Open a scene of cagefield (its scene.json, or its folder) or a splat file"""

    bl_idname = "cagefield.open"
    bl_label = "Open scene or splat file"
    filter_glob: bpy.props.StringProperty(
        default="scene.json;*.ply;*.spz;*.sog;*.splat;*.ksplat;*.glb;*.gltf;*.usda;*.usdc;*.usdz",
        options={"HIDDEN"},
    )

    def run(self, context):
        thing = session.open_path(context, self.filepath)
        return f"{len(thing.data.vertices)} splats of {thing.name}"


class UseObject(_Operator, bpy.types.Operator):
    """Take the active object, whose points have the attributes of 3DGS, as the splats"""

    bl_idname = "cagefield.use_object"
    bl_label = "Use active object"

    def run(self, context):
        thing = context.active_object
        missing = splat_objects.missing_attributes(thing)
        if missing:
            raise ValueError(
                "the active object is no splat object: its points lack"
                f" {', '.join(missing[:6])}; import a PLY of 3DGS with its attributes"
            )
        session.choose(context.scene, thing)
        return f"{thing.name} is taken as the splats"


class MakeCages(_Operator, bpy.types.Operator):
    """Put two cubes around the active object, the selected points, or the middle of the splats"""

    bl_idname = "cagefield.make_cages"
    bl_label = "Make cages"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def run(self, context):
        settings = context.scene.cagefield
        source = settings.source
        if source is None:
            raise ValueError("no splats are chosen; open a scene or a splat file, or take the active object")
        low, high = _region(context, source)
        size = np.maximum(high - low, 1e-6)
        collection = (source.users_collection or (context.scene.collection,))[0]
        margin = settings.margin * float(size.max())
        inner, outer = cages.make_cages(source, 0.5 * (low + high), size, margin, collection)
        context.view_layer.update()
        for role, cage in (("inner", inner), ("outer", outer)):
            cages.assign(cage, source, context.evaluated_depsgraph_get())
            setattr(settings, role, cage)
        live.follow(context.scene)
        return f"{inner.name} and {outer.name} are assigned"


def _region(context, source):
    """Box (low [3], high [3]) in the space of the splats that new cages go around."""
    active = context.active_object
    if (
        active is not None
        and active not in (source, context.scene.cagefield.result)
        and active.type == "MESH"
    ):
        to_splats = np.array(source.matrix_world.inverted_safe() @ active.matrix_world)
        points = np.array(active.bound_box) @ to_splats[:3, :3].T + to_splats[:3, 3]
        return points.min(axis=0), points.max(axis=0)
    if source.type == "MESH" and source.mode == "EDIT":
        source.update_from_editmode()
    count = len(source.data.attributes["position"].data)
    points = np.empty(3 * count, np.float32)
    source.data.attributes["position"].data.foreach_get("vector", points)
    points = points.reshape(-1, 3).astype(np.float64)
    selected = np.zeros(count, bool)
    if source.type == "MESH" and source.mode == "EDIT":
        source.data.vertices.foreach_get("select", selected)
    if selected.any():
        return points[selected].min(axis=0), points[selected].max(axis=0)
    return np.quantile(points, CENTRAL_SHARE, axis=0), np.quantile(points, 1.0 - CENTRAL_SHARE, axis=0)


class AssignCage(_Operator, bpy.types.Operator):
    """Take the active object as a cage: its shape now is the shape at rest"""

    bl_idname = "cagefield.assign"
    bl_label = "Assign cage"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    role: bpy.props.EnumProperty(items=(("inner", "Inner", ""), ("outer", "Outer", "")))

    def run(self, context):
        settings, cage = context.scene.cagefield, context.active_object
        if settings.source is None:
            raise ValueError("no splats are chosen; open a scene or a splat file, or take the active object")
        if cage is None or cage in (settings.source, settings.result):
            raise ValueError("the active object is no cage; select a cube, a lattice or a closed mesh")
        cages.assign(cage, settings.source, context.evaluated_depsgraph_get())
        setattr(settings, self.role, cage)
        live.follow(context.scene)
        return f"{cage.name} is the {self.role} cage"


class UpdateSplats(_Operator, bpy.types.Operator):
    """Deform the splats by the cages as they are now"""

    bl_idname = "cagefield.update"
    bl_label = "Update"

    def run(self, context):
        reply, arrays = _ask(context, "deform")
        session.show_result(context.scene, arrays)
        return f"{reply['count']} splats"


class SaveEdits(_Operator, bpy.types.Operator, ExportHelper):
    """Write an edit file with the scene's edits and this one, which `cagefield edit` reads"""

    bl_idname = "cagefield.save_edits"
    bl_label = "Save edit file"
    filename_ext = ".yaml"

    def run(self, context):
        reply, _ = _ask(context, "save", path=os.path.abspath(self.filepath), overwrite=True)
        return f"{reply['edits']} edits written to {reply['path']}"


class ExportSplats(_Operator, bpy.types.Operator, ExportHelper):
    """Write the deformed splats to a file, .ply, .spz or another format of cagefield"""

    bl_idname = "cagefield.export_splats"
    bl_label = "Export deformed splats"
    filename_ext = ".ply"
    check_extension = None

    def run(self, context):
        reply, _ = _ask(context, "export", path=os.path.abspath(self.filepath), overwrite=True)
        return f"{reply['count']} splats written to {reply['path']}"


class ResetSplats(_Operator, bpy.types.Operator):
    """Take the cages back to their shape at rest, and show the splats as they were"""

    bl_idname = "cagefield.reset"
    bl_label = "Reset"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def run(self, context):
        settings = context.scene.cagefield
        for cage in (settings.inner, settings.outer):
            if settings.source is not None and cage is not None and cages.REST in cage:
                cages.to_rest(cage, settings.source)
        session.remove_result(context.scene)
        live.follow(context.scene)
        return "the cages are at rest"


class ShowEllipsoids(_Operator, bpy.types.Operator):
    """Show the splats as ellipsoids, or as points"""

    bl_idname = "cagefield.show_ellipsoids"
    bl_label = "Ellipsoids"
    shown: bpy.props.BoolProperty(default=True)

    def run(self, context):
        settings = context.scene.cagefield
        for thing in (settings.source, settings.result):
            if thing is not None:
                splat_nodes.show_ellipsoids(thing, self.shown)
        return "shown as ellipsoids" if self.shown else "shown as points"


def _ask(context, request, **more):
    """(reply, arrays) of a request with the scene's edit."""
    settings = context.scene.cagefield
    process = session.get_worker()
    session.load(settings, process, again=True)
    header, arrays = session.edit_request(settings, context.evaluated_depsgraph_get(), request, **more)
    return process.ask(header, arrays)


_CLASSES = (
    CheckPython,
    OpenSplats,
    UseObject,
    MakeCages,
    AssignCage,
    UpdateSplats,
    SaveEdits,
    ExportSplats,
    ResetSplats,
    ShowEllipsoids,
)


def register():
    """Registers the operators."""
    for one in _CLASSES:
        bpy.utils.register_class(one)


def unregister():
    """Unregisters them."""
    for one in reversed(_CLASSES):
        bpy.utils.unregister_class(one)
