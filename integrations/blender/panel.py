# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel in the 3D view's sidebar."""

import textwrap

import bpy

LINE_CHARACTERS = 42


class CagefieldPanel(bpy.types.Panel):
    """Splats, cages, edit, files."""

    bl_idname = "VIEW3D_PT_cagefield"
    bl_label = "cagefield"
    bl_category = "cagefield"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"

    def draw(self, context):
        """Draws the panel."""
        settings, layout = context.scene.cagefield, self.layout
        box = layout.column(align=True)
        box.operator("cagefield.open", icon="FILE_FOLDER")
        box.operator("cagefield.use_object", icon="POINTCLOUD_DATA")
        box.prop(settings, "source")
        row = box.row(align=True)
        row.operator("cagefield.show_ellipsoids", text="Ellipsoids").shown = True
        row.operator("cagefield.show_ellipsoids", text="Points").shown = False
        box = layout.column(align=True)
        box.operator("cagefield.make_cages", icon="CUBE")
        box.prop(settings, "margin")
        row = box.row(align=True)
        row.operator("cagefield.assign", text="Assign inner").role = "inner"
        row.operator("cagefield.assign", text="Assign outer").role = "outer"
        box.prop(settings, "inner")
        box.prop(settings, "outer")
        box = layout.column(align=True)
        box.prop(settings, "edit_name")
        box.prop(settings, "kind")
        box.prop(settings, "infill")
        row = box.row(align=True)
        row.operator("cagefield.update", icon="FILE_REFRESH")
        row.prop(settings, "live", toggle=True)
        box.operator("cagefield.reset", icon="LOOP_BACK")
        box = layout.column(align=True)
        box.operator("cagefield.save_edits", icon="TEXT")
        box.operator("cagefield.export_splats", icon="EXPORT")
        for line in textwrap.wrap(settings.status, LINE_CHARACTERS):
            layout.label(text=line)


def register():
    """Registers the panel."""
    bpy.utils.register_class(CagefieldPanel)


def unregister():
    """Unregisters it."""
    bpy.utils.unregister_class(CagefieldPanel)
