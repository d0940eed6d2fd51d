# SPDX-License-Identifier: GPL-3.0-or-later
"""What sessions do when Blender loads, saves, undoes or changes the frame; and their beginning and end with the
extension's.
"""

from __future__ import annotations

import functools
import threading

import bpy
from bpy.app.handlers import persistent

from . import pose_writing, sessions
from .session_armature import release


@persistent
def _before_loading(*_: object) -> None:
    for session in sessions.all():
        session.stop("another file was loaded: the doll has ended")


@persistent
def _after_loading(*_: object) -> None:
    """A file that was saved, by a crash perhaps, while a doll was live."""
    sessions.forget_last_words()
    _release_the_orphaned()


def _release_the_orphaned() -> None:
    """Objects that bear the mark of a session that is over."""
    live = {session.id for session in sessions.all()}
    for item in bpy.data.objects:
        if item.layfigure.session and item.layfigure.session not in live:
            release(item)


@persistent
def _before_saving(*_: object) -> None:
    """The file is to be as it is without a doll."""
    for session in sessions.all():
        armature = session.armature()
        if armature is not None:
            pose_writing.unmute(armature)


@persistent
def _after_saving(*_: object) -> None:
    for session in sessions.all():
        session.mute_again()


@persistent
def _after_undo(*_: object) -> None:
    _release_the_orphaned()
    for session in sessions.all():
        armature = session.armature()
        if armature is None:
            continue  # the timer ends it
        session.mute_again()
        place, run = armature.layfigure.place, armature.layfigure.run
        sessions.guarded(session, functools.partial(session.go_to_place, place, run))


@persistent
def _after_frame_change(*_: object) -> None:
    """Animation has put its own pose on the bones. A render's frames, on a thread of its own, are the animation's."""
    if threading.current_thread() is not threading.main_thread():
        return
    for session in sessions.all():
        sessions.guarded(session, session.apply_again)


_HANDLERS = {
    "load_pre": _before_loading,
    "load_post": _after_loading,
    "save_pre": _before_saving,
    "save_post": _after_saving,
    "save_post_fail": _after_saving,
    "undo_post": _after_undo,
    "redo_post": _after_undo,
    "frame_change_post": _after_frame_change,
}


def register() -> None:
    for name, handler in _HANDLERS.items():
        if hasattr(bpy.app.handlers, name):  # save_post_fail is not in every version
            getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for session in sessions.all():
        session.stop()
    if bpy.app.timers.is_registered(sessions.tick):
        bpy.app.timers.unregister(sessions.tick)
    for name, handler in _HANDLERS.items():
        if hasattr(bpy.app.handlers, name):
            getattr(bpy.app.handlers, name).remove(handler)
    sessions.forget_last_words()
