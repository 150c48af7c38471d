# SPDX-License-Identifier: GPL-3.0-or-later
"""Preferences of the add-on, and its settings in a scene."""

import bpy


class CagefieldPreferences(bpy.types.AddonPreferences):
    """The interpreter that cagefield is installed in."""

    bl_idname = __package__

    python: bpy.props.StringProperty(
        name="Python with cagefield",
        description="Interpreter in which cagefield is installed, such as /home/me/venv/bin/python",
        subtype="FILE_PATH",
    )

    def draw(self, context):
        """Draws the preferences."""
        self.layout.prop(self, "python")
        self.layout.operator("cagefield.check_python")
        self.layout.label(text="To install it: PYTHON -m pip install cagefield")


def _is_cage(self, thing):
    return thing.type in ("MESH", "LATTICE")


def _live_changed(self, context):
    from . import live

    live.follow(context.scene)


class CagefieldSettings(bpy.types.PropertyGroup):
    """Splats, cages and options of a scene."""

    source: bpy.props.PointerProperty(type=bpy.types.Object, name="Splats", description="Splats at rest")
    result: bpy.props.PointerProperty(
        type=bpy.types.Object, name="Deformed", description="Splats as deformed"
    )
    inner: bpy.props.PointerProperty(type=bpy.types.Object, name="Inner cage", poll=_is_cage)
    outer: bpy.props.PointerProperty(type=bpy.types.Object, name="Outer cage", poll=_is_cage)
    kind: bpy.props.EnumProperty(
        name="Edit",
        items=(
            ("continuous", "Continuous", "Splats between the cages give way"),
            ("move", "Move", "Only the splats in the inner cage move"),
            ("copy", "Copy", "The splats in the inner cage appear a second time"),
            ("delete", "Delete", "The splats in the inner cage go away"),
        ),
    )
    infill: bpy.props.BoolProperty(
        name="Infill and light",
        description="Fill what a move or a delete uncovers, and take contact shadows along; slower",
    )
    edit_name: bpy.props.StringProperty(
        name="Name", default="edit in Blender", description="Name of the edit"
    )
    margin: bpy.props.FloatProperty(
        name="Margin",
        default=0.5,
        min=0.01,
        max=10.0,
        description="Distance between new cages, as a share of the inner cage's size",
    )
    live: bpy.props.BoolProperty(
        name="Live", description="Deform the splats while cages move", update=_live_changed
    )
    status: bpy.props.StringProperty()


_CLASSES = (CagefieldPreferences, CagefieldSettings)


def register():
    """Registers the classes."""
    for one in _CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.cagefield = bpy.props.PointerProperty(type=CagefieldSettings)


def unregister():
    """Unregisters them."""
    del bpy.types.Scene.cagefield
    for one in reversed(_CLASSES):
        bpy.utils.unregister_class(one)
