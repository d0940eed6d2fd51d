# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel that tells how a doll is posed by hand."""

from __future__ import annotations

import bpy

from . import overlay, sessions
from .operators_grab import KEYS, TOOL
from .seen_dolls import is_posable


class LAYFIGURE_PT_grab(bpy.types.Panel):
    bl_label = "Pose by Hand"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Layfigure"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        session = sessions.active(context)
        return session is not None and is_posable(session)

    def draw(self, context: bpy.types.Context) -> None:
        column = self.layout.column()
        button = column.row()
        button.enabled = context.mode in {"OBJECT", "POSE"}
        tool = context.workspace.tools.from_space_view3d_mode(context.mode, create=False)
        is_on = tool is not None and tool.idname == TOOL
        button.operator("wm.tool_set_by_id", text="Pose Doll", icon="VIEW_PAN", depress=is_on).name = TOOL
        if is_on:
            self._draw_keys(column)
        session = sessions.active(context)
        pins = len(overlay.pins_of(session).known) if session is not None else 0
        row = column.row()
        row.enabled = pins > 0
        row.operator("layfigure.unpin", text=f"Unpin All ({pins})", icon="UNPINNED").all = True

    def _draw_keys(self, column: bpy.types.UILayout) -> None:
        box = column.box().column(align=True)
        for key, meaning in KEYS:
            split = box.split(factor=0.4)
            split.label(text=key)
            split.label(text=meaning)


classes = (LAYFIGURE_PT_grab,)
