# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel that starts and stops the doll, and says how it is."""

from __future__ import annotations

import textwrap

import bpy

from . import sessions

_LETTER_WIDTH = 7.0  # [px at 72 dpi], a little more than that of Blender's own font on average


class LAYFIGURE_PT_session(bpy.types.Panel):
    bl_label = "Doll"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Layfigure"

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        session = sessions.active(context)
        if session is None:
            _draw_start(context, layout)
            return
        _draw_message(context, layout, session.message, _icon(session))
        row = layout.row(align=True)
        row.operator("layfigure.stop", icon="SNAP_FACE")
        if session.failed:
            row.operator("layfigure.reconnect", icon="FILE_REFRESH")
        column = layout.column(align=True)
        column.operator("layfigure.push_pose", icon="IMPORT")
        column.operator("layfigure.reset", icon="LOOP_BACK")


def _draw_start(context: bpy.types.Context, layout: bpy.types.UILayout) -> None:
    item = context.object
    if item is None or (item.type != "ARMATURE" and item.find_armature() is None):
        layout.label(text="Select an armature", icon="ARMATURE_DATA")
        return
    layout.operator("layfigure.start", icon="PLAY")
    armature = item if item.type == "ARMATURE" else item.find_armature()
    words = sessions.last_words(armature)
    if words:
        _draw_message(context, layout, words, "ERROR")


def _icon(session: sessions.Session) -> str:
    if session.failed:
        return "ERROR"
    return "CHECKMARK" if session.live else "SORTTIME"


def _draw_message(context: bpy.types.Context, layout: bpy.types.UILayout, message: str, icon: str) -> None:
    """In as many lines as the sidebar's width asks for: labels do not wrap."""
    scale = context.preferences.system.ui_scale
    letters = max(int(context.region.width / (_LETTER_WIDTH * scale)) - 6, 16)
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(message, letters)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1")


classes = (LAYFIGURE_PT_session,)
