# SPDX-License-Identifier: GPL-3.0-or-later
"""What operators ask of the context, and why they cannot work in it."""

from __future__ import annotations

import bpy

from . import sessions


def known_session(operator: type[bpy.types.Operator] | None, context: bpy.types.Context) -> sessions.Session | None:
    """The session of the context's armature, if its doll has come, even if it was lost since; else the operator is told
    why there is none."""
    session = sessions.active(context)
    if session is not None and session.bones is not None:
        return session
    if operator is not None:
        operator.poll_message_set("Select an armature whose doll was started" if session is None else session.message)
    return None


def live_session(operator: type[bpy.types.Operator] | None, context: bpy.types.Context) -> sessions.Session | None:
    """Likewise, if the doll takes commands."""
    session = known_session(operator, context)
    if session is None or (session.live and not session.failed):
        return session
    if operator is not None:
        operator.poll_message_set(session.message)
    return None


def sentence(error: BaseException | None) -> str:
    """As Blender shows messages."""
    text = str(error)
    return text[:1].upper() + text[1:]


def posed_armature(operator: type[bpy.types.Operator] | None, context: bpy.types.Context) -> bpy.types.Object | None:
    """The armature that is active, or that the active mesh is bound to; else the operator is told why not."""
    active = context.object
    armature = active if active is not None and active.type == "ARMATURE" else None
    if armature is None and active is not None:
        armature = active.find_armature()
    if armature is None and operator is not None:
        operator.poll_message_set("Select an armature")
    return armature
