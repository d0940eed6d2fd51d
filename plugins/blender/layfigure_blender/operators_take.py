# SPDX-License-Identifier: GPL-3.0-or-later
"""Imports a recorded take, USD written by `layfigure record`, onto an armature."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
from bpy.props import StringProperty
from bpy_extras.io_utils import ImportHelper

from layfigure import LayfigureError

from . import sessions
from .actions import ActionError, BoneCurves
from .bone_tracks import posed_tracks
from .live import posed_armature, sentence
from .operators_keys import frames_per_second, write_tracks
from .pose_writing import bones_of
from .rig import MisfitError
from .root_carrier import kept_placement

USD_SINCE = (4, 2, 0)  # Blender brings Python's bindings of USD, and the extension reads them, since this version


class LAYFIGURE_OT_import_take(bpy.types.Operator, ImportHelper):
    bl_idname = "layfigure.import_take"
    bl_label = "Import Take"
    bl_description = "Import a take of 'layfigure record', USD, onto the armature, as a new action"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    filename_ext = ".usda"
    filter_glob: StringProperty(default="*.usd;*.usda;*.usdc;*.usdz", options={"HIDDEN"})  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if bpy.app.version < USD_SINCE:
            cls.poll_message_set("Takes are USD, which needs Blender 4.2 or later")
            return False
        return posed_armature(cls, context) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature = posed_armature(None, context)
        try:
            count, frames = import_take(context, armature, Path(bpy.path.abspath(self.filepath)))
        except (LayfigureError, MisfitError, ActionError) as error:
            self.report({"ERROR"}, sentence(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{count} bones move on frames {frames[0]:g} to {frames[-1]:g}")
        return {"FINISHED"}


def import_take(context: bpy.types.Context, armature: bpy.types.Object, path: Path) -> tuple[int, np.ndarray]:
    """Of how many bones, on which frames of the scene. Raises LayfigureError, MisfitError or ActionError."""
    from . import take_reading  # the only one that needs USD, which older Blenders do not have

    bones = bones_of(armature)
    take = take_reading.read_take(path, frames_per_second(context.scene))
    keyed, poses = take_reading.bone_poses(take, bones, np.array(armature.matrix_world, np.float64), armature.name)
    session = sessions.of(armature)
    has_doll = session is not None and session.bones is not None
    placement = session.bones.placement if has_doll else kept_placement(armature)
    poses = placement @ poses  # where the doll is seen, or was
    curves = BoneCurves.new(armature, path.stem)
    frames = context.scene.frame_start + np.arange(len(poses), dtype=np.float64)
    for pose in (armature.pose.bones[bones[b].name] for b in keyed):
        pose.location, pose.scale = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
    tracks = posed_tracks(armature, bones, keyed, poses)
    count = write_tracks(armature, curves, [bone.name for bone in bones], keyed, tracks, frames)
    context.scene.frame_set(context.scene.frame_current)
    return count, frames


def _menu(self: bpy.types.Menu, _context: bpy.types.Context) -> None:
    self.layout.operator(LAYFIGURE_OT_import_take.bl_idname, text="Layfigure Take (.usd*)")


classes = (LAYFIGURE_OT_import_take,)


def register() -> None:
    bpy.types.TOPBAR_MT_file_import.append(_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_menu)
