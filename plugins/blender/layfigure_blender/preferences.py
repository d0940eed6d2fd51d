# SPDX-License-Identifier: GPL-3.0-or-later
"""What is set once for all files."""

from __future__ import annotations

import bpy
from bpy.props import FloatProperty, StringProperty

from . import server


class LayfigurePreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    server_path: StringProperty(  # type: ignore[valid-type]
        name="Server",
        description="The program layfigure-server. Empty: it is looked for on PATH",
        subtype="FILE_PATH",
    )
    url: StringProperty(  # type: ignore[valid-type]
        name="Connect to",
        description="LCM URL of a server that runs already, such as tcpq://127.0.0.1:7700. Empty: one is started",
    )
    pose_hz: FloatProperty(  # type: ignore[valid-type]
        name="Poses per second",
        description=(
            "How many poses a server that is started sends in a second. The fewer they are, the later the doll follows "
            "the mouse"
        ),
        default=server.USUAL_POSE_HZ,
        min=10.0,
        max=240.0,
    )

    def draw(self, _context: bpy.types.Context) -> None:
        column = self.layout.column()
        column.prop(self, "server_path")
        column.prop(self, "url")
        column.prop(self, "pose_hz")


def of(context: bpy.types.Context) -> LayfigurePreferences | None:
    """None while the package runs without being enabled, as in tests."""
    addon = context.preferences.addons.get(__package__)
    return addon.preferences if addon is not None else None


classes = (LayfigurePreferences,)
