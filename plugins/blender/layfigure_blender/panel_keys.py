# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of keys, takes, and the doll's history."""

from __future__ import annotations

import bpy

from . import operators_keys, sessions


class LAYFIGURE_PT_keys(bpy.types.Panel):
    bl_label = "Keys"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Layfigure"
    bl_order = 3

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        row = layout.row(align=True)
        row.operator("layfigure.key_pose", text="Key All", icon="KEY_HLT").selected = False
        row.operator("layfigure.key_pose", text="Key Selected").selected = True
        session = sessions.active(context)
        if session is not None and operators_keys.is_recording(session):
            layout.operator("layfigure.record_stop", icon="SNAP_FACE")
        else:
            layout.operator("layfigure.record", icon="REC")
        layout.operator("layfigure.reduce_keys", icon="IPO_LINEAR")
        layout.operator("layfigure.import_take", icon="IMPORT")


class LAYFIGURE_UL_snapshots(bpy.types.UIList):
    def draw_item(  # as Blender calls it
        self,
        _context: bpy.types.Context,
        layout: bpy.types.UILayout,
        _data: bpy.types.bpy_struct,
        item: bpy.types.PropertyGroup,
        _icon: int,
        _active_data: bpy.types.bpy_struct,
        _active_property: str,
    ) -> None:
        layout.label(text=item.name, icon="ARMATURE_DATA", translate=False)


class LAYFIGURE_PT_history(bpy.types.Panel):
    bl_label = "Doll's History"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Layfigure"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        row = layout.row(align=True)
        row.operator("layfigure.undo", text="Undo", icon="LOOP_BACK")
        row.operator("layfigure.redo", text="Redo", icon="LOOP_FORWARDS")
        row = layout.row(align=True)
        for side, text in (("both", "Mirror"), ("left", "L to R"), ("right", "R to L")):
            row.operator("layfigure.mirror", text=text).side = side
        layout.label(text="Snapshots")
        session = sessions.active(context)
        known = context.window_manager.layfigure_snapshots
        row = layout.row()
        if session is not None and known.of == session.id:
            row.template_list("LAYFIGURE_UL_snapshots", "", known, "names", known, "active", rows=3)
        column = row.column(align=True)
        column.operator("layfigure.snapshot_save", text="", icon="ADD")
        column.operator("layfigure.snapshot_remove", text="", icon="REMOVE")
        column.operator("layfigure.snapshot_refresh", text="", icon="FILE_REFRESH")
        layout.operator("layfigure.snapshot_restore", text="Restore", icon="RECOVER_LAST")


classes = (LAYFIGURE_PT_keys, LAYFIGURE_UL_snapshots, LAYFIGURE_PT_history)
