# SPDX-License-Identifier: GPL-3.0-or-later
"""What is kept in the .blend, beside objects and bones."""

from __future__ import annotations

import bpy
from bpy.props import FloatVectorProperty, IntProperty, PointerProperty, StringProperty

NO_PLACE = -1
_IDENTITY = tuple(float(row == column) for row in range(4) for column in range(4))


class LayfigureObject(bpy.types.PropertyGroup):
    """Of an armature object: object.layfigure. It is part of Blender's undo steps."""

    session: StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]  # id of the session that it is posed by
    place: IntProperty(default=NO_PLACE, options={"HIDDEN"})  # type: ignore[valid-type]  # in the history of ...
    run: StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]  # ... this run of a server
    placement: FloatVectorProperty(  # type: ignore[valid-type]  # (4, 4) by rows: BoneMap.placement, outlives the session
        size=16, default=_IDENTITY, options={"HIDDEN"}
    )


class LayfigureBone(bpy.types.PropertyGroup):
    """Of a pose bone: pose_bone.layfigure."""

    muted: StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]  # what is to be unmuted at Stop, JSON


classes = (LayfigureObject, LayfigureBone)


def register() -> None:
    bpy.types.Object.layfigure = PointerProperty(type=LayfigureObject)
    bpy.types.PoseBone.layfigure = PointerProperty(type=LayfigureBone)


def unregister() -> None:
    del bpy.types.PoseBone.layfigure
    del bpy.types.Object.layfigure
