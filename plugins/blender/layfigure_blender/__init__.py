# SPDX-License-Identifier: GPL-3.0-or-later
"""Poses a rigged character in Blender as an elasto-plastic doll, which layfigure-server simulates.

Read in this order: rig.py, link.py, server.py (no bpy: mathematics, the connection, the server's process), then
sessions.py, which ties them to an armature, pose_writing.py, export.py and blender_events.py, the operators and panels.
"""

from __future__ import annotations

import importlib
from types import ModuleType

# In the order of their registration; unregistered backwards. Each has `classes`, a tuple, register() and unregister(),
# or some of them.
MODULES = (
    "preferences",
    "properties",
    "joint_properties",
    "blender_events",
    "joint_live",
    "overlay",
    "operators_session",
    "operators_grab",
    "operators_keys",
    "operators_history",
    "operators_take",
    "operators_joints",
    "panel_session",
    "panel_grab",
    "panel_keys",
    "panel_joints",
)

_registered: list[ModuleType] = []


def register() -> None:
    import bpy

    for name in MODULES:
        module = importlib.import_module(f".{name}", __package__)
        for cls in getattr(module, "classes", ()):
            bpy.utils.register_class(cls)
        if hasattr(module, "register"):
            module.register()
        _registered.append(module)


def unregister() -> None:
    import bpy

    while _registered:
        module = _registered.pop()
        if hasattr(module, "unregister"):
            module.unregister()
        for cls in reversed(getattr(module, "classes", ())):
            bpy.utils.unregister_class(cls)
