# SPDX-License-Identifier: GPL-3.0-or-later
"""Start, stop, connect again; the pose of the bones to the doll; the doll's rest pose."""

from __future__ import annotations

import bpy
import numpy as np

from layfigure import LayfigureError

from . import sessions
from .commands import ChangesDoll
from .export import ExportError
from .live import known_session, live_session, posed_armature, sentence
from .rig import MisfitError
from .seen_dolls import is_posable
from .server import ServerError
from .session_armature import evaluate

KEPT = 1e-3  # [rad], and of a bone's length: far above single precision, less than is seen


class LAYFIGURE_OT_start(bpy.types.Operator):
    """Make a doll of the active armature and its meshes, and pose the armature by it"""

    bl_idname = "layfigure.start"
    bl_label = "Start"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return posed_armature(cls, context) is not None and sessions.active(context) is None

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            sessions.start(context, posed_armature(None, context))
        except (ExportError, LayfigureError, MisfitError, ServerError) as error:
            self.report({"ERROR"}, sentence(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class LAYFIGURE_OT_stop(bpy.types.Operator):
    """End the doll; the armature keeps its pose"""

    bl_idname = "layfigure.stop"
    bl_label = "Stop"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return sessions.active(context) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        taken = stop_and_compare(sessions.active(context))
        if taken:
            self.report(
                {"WARNING"},
                f"Constraints, drivers or keys have moved {len(taken)} bones, such as '{taken[0]}', from where the "
                "doll had them: mute those to see its pose",
            )
        return {"FINISHED"}


def stop_and_compare(session: sessions.Session) -> list[str]:
    """Ends the session; the doll's bones that do not keep their pose, as what rested meanwhile moves them again."""
    armature = session.armature()
    names = session.bones.driven_names if session.bones is not None else ()
    driven = [bone for bone in armature.pose.bones if bone.name in names] if armature is not None else []
    if not driven:
        session.stop()
        return []
    evaluate(armature)
    shown = np.array([bone.matrix for bone in driven])
    session.stop()
    evaluate(armature)
    away = np.abs(np.array([bone.matrix for bone in driven]) - shown)
    away[:, :3, 3] /= np.array([[bone.bone.length] for bone in driven])
    return [bone.name for bone, most in zip(driven, away.max(axis=(1, 2)), strict=True) if most > KEPT]


class LAYFIGURE_OT_reconnect(bpy.types.Operator):
    """Connect again, with a new server if the former has ended; the doll takes the armature's pose"""

    bl_idname = "layfigure.reconnect"
    bl_label = "Reconnect"
    bl_options = {"REGISTER"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return sessions.active(context) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            sessions.active(context).reconnect()
        except ServerError as error:
            self.report({"ERROR"}, sentence(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class LAYFIGURE_OT_push_pose(bpy.types.Operator):
    """Give the doll the pose that the armature's bones have"""

    bl_idname = "layfigure.push_pose"
    bl_label = "Pose the Doll"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return live_session(cls, context) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        session = sessions.active(context)
        pushed = session.push_pose()
        if pushed.done() and pushed.exception() is not None:
            self.report({"ERROR"}, sentence(pushed.exception()))
            return {"CANCELLED"}
        session.note_place()
        return {"FINISHED"}


class LAYFIGURE_OT_reset(ChangesDoll, bpy.types.Operator):
    """Bring the doll, and with it the armature, to the rest pose"""

    bl_idname = "layfigure.reset"
    bl_label = "Rest Pose"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        """Also where the simulation has stopped: it is what lets it go on."""
        session = known_session(cls, context)
        return session is not None and is_posable(session)

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.only_change(context, "reset")


classes = (
    LAYFIGURE_OT_start,
    LAYFIGURE_OT_stop,
    LAYFIGURE_OT_reconnect,
    LAYFIGURE_OT_push_pose,
    LAYFIGURE_OT_reset,
)
