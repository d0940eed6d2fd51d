# SPDX-License-Identifier: GPL-3.0-or-later
"""The armature of a session, found anew each time: undo and loading replace Blender's data."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from . import pose_writing
from .properties import NO_PLACE
from .rig import Bone


class SessionArmature:
    """The object that bears the id of the session, object.layfigure.session, whatever its name is by now."""

    def __init__(self, armature: bpy.types.Object, session: str) -> None:
        self.name = armature.name  # as it was found last
        self.bones = pose_writing.bones_of(armature)  # in the rest pose, as the doll is made of them
        self._session = session
        self._was_in_edit_mode = False

    def find(self) -> bpy.types.Object | None:
        """None if it was deleted."""
        known = bpy.data.objects.get(self.name)
        if known is None or known.layfigure.session != self._session:
            known = next((item for item in bpy.data.objects if item.layfigure.session == self._session), None)
        if known is None or known.type != "ARMATURE" or not known.users_scene:
            return None
        self.name = known.name
        return known

    def mark(self, armature: bpy.types.Object) -> None:
        armature.layfigure.session = self._session
        armature.layfigure.place = NO_PLACE

    def release(self) -> None:
        """Takes the marks off, also off a duplicate, which has them too."""
        for item in bpy.data.objects:
            if item.layfigure.session == self._session:
                release(item)

    def has_the_same_bones(self, armature: bpy.types.Object) -> bool:
        """Looked at after edit mode; names always, as bones are found by them."""
        in_edit_mode = armature.mode == "EDIT"
        was_in_edit_mode, self._was_in_edit_mode = self._was_in_edit_mode, in_edit_mode
        if in_edit_mode:
            return True
        if any(bone.name not in armature.pose.bones for bone in self.bones):
            return False
        return not was_in_edit_mode or _same_bones(self.bones, pose_writing.bones_of(armature))


def release(armature: bpy.types.Object) -> None:
    """Takes all traces of a session off it."""
    if armature.type == "ARMATURE":
        pose_writing.unmute(armature)
    for name in ("session", "place", "run"):
        armature.layfigure.property_unset(name)


def evaluate(armature: bpy.types.Object) -> None:
    """What was set of its bones shows in their matrices, in whatever scene it is."""
    scenes = armature.users_scene
    layers = [bpy.context.view_layer] if bpy.context.scene in scenes else [scene.view_layers[0] for scene in scenes[:1]]
    for layer in layers:
        layer.update()


def _same_bones(a: Sequence[Bone], b: Sequence[Bone]) -> bool:
    if [(bone.name, bone.parent) for bone in a] != [(bone.name, bone.parent) for bone in b]:
        return False
    return np.array_equal([bone.rest for bone in a], [bone.rest for bone in b])
