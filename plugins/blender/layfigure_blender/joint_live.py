# SPDX-License-Identifier: GPL-3.0-or-later
"""Joint properties go to the doll that is live: at once, the newest alone; and to the other side, if the armature's
option says so.

values(session) -> what the server chose for the doll, to be shown; joint_settings() of the bones are what is asked
"""

from __future__ import annotations

import contextlib
import functools
import time
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import dataclass, replace

import bpy
from bpy.app.handlers import persistent

from layfigure import Character, LayfigureError

from . import asked_settings, joint_properties, pose_writing, sessions
from .background import in_background
from .doll_inspection import Prepared, own_values, prepare
from .joint_sender import JointSender
from .joint_settings import LAWS, OF_MATERIAL, USUAL_MIRROR, DollSettings, MirrorRule, mirrored
from .joint_values import DollValues, Placed, as_settings, mirror_rule
from .link import Link
from .settings_file import settings_text

FLUSH_EVERY_S = 0.02  # while something is on its way
LOOK_EVERY_S = 0.25  # for what no callback tells: undo, drivers, scripts that write ID properties


@dataclass
class LiveJoints:
    """Of one session's doll."""

    sender: JointSender
    link: Link
    server_id: int
    place: int  # the server's place in its history when the joints were last looked at
    looked_at: float = 0.0  # time.monotonic() [s]
    is_dirty: bool = True
    base: DollSettings | None = None  # what sender.own was read with, or is being read
    reading: Future[DollValues] | None = None
    trouble: str = ""  # why it could not be read, one line


_live: dict[str, LiveJoints] = {}  # by the sessions' ids
_is_spreading = False  # a change to other bones, whose callbacks are not to spread it again


# --- for panels ------------------------------------------------------------------------------------------------------


def sender_of(armature: bpy.types.Object | None) -> JointSender | None:
    """None unless the armature's doll is live."""
    session = sessions.of(armature)
    live = _live.get(session.id) if session is not None else None
    return live.sender if live is not None else None


def values_of(armature: bpy.types.Object | None) -> DollValues | None:
    """What the server chose for the armature's doll; None until that is known."""
    sender = sender_of(armature)
    return sender.own if sender is not None else None


def refusal(armature: bpy.types.Object, bone: str) -> str:
    """Why what is asked of a bone is not done, one line, or ""."""
    session = sessions.of(armature)
    if session is None:
        return ""
    sender = sender_of(armature)
    reason = sender.refusal(bone) if sender is not None else ""
    prepared = _prepared_of(session)
    if reason or prepared is None or bone not in prepared.refusals:
        return reason
    if asked_settings.joint_settings(armature.pose.bones[bone]) != prepared.asked.joints[bone]:
        return ""
    return f"left out at the start: {prepared.refusals[bone]}"


def trouble_of(armature: bpy.types.Object) -> str:
    """Why what is asked of the whole doll is not done, or its joints are not known; one line, or ""."""
    session = sessions.of(armature)
    live = _live.get(session.id) if session is not None else None
    return "" if live is None else live.trouble or live.sender.trouble


# --- to the server ---------------------------------------------------------------------------------------------------


def flush() -> float:
    """What the timer calls: sends what has changed. Returns when to call it again [s]."""
    now = time.monotonic()
    for session in sessions.all():
        sessions.guarded(session, functools.partial(_flush_session, session, now))
    for key in set(_live) - {session.id for session in sessions.all()}:
        del _live[key]
    return FLUSH_EVERY_S if any(map(_waits, _live.values())) else LOOK_EVERY_S


def _waits(live: LiveJoints) -> bool:
    """For answers, which come soon."""
    if live.link.state != "live":
        return False
    return live.reading is not None or (not live.sender.is_idle and not live.sender.trouble)


def _flush_session(session: sessions.Session, now: float) -> None:
    live = _live_of(session)
    armature = session.armature()
    if live is None or armature is None:
        return
    if session.place != live.place:  # undo, redo or a command of somebody else may have changed joints
        live.place = session.place
        live.sender.look_again()
    is_busy = live.is_dirty or live.reading is not None or not live.sender.is_idle
    if is_busy or now - live.looked_at > LOOK_EVERY_S:
        live.looked_at, live.is_dirty = now, False
        settings = asked_settings.doll_settings(armature)
        _read_own(session, live, settings.without_joints())
        if live.sender.update(settings.joints):
            _redraw()


def _read_own(session: sessions.Session, live: LiveJoints, base: DollSettings) -> None:
    """What is chosen for the doll follows its material and the like: the joints' values do at once, masses at the next
    start. Only of a server of Blender's own is the character's file known.
    """
    if live.reading is not None and live.reading.done():
        reading, live.reading = live.reading, None
        try:
            live.sender.choose(reading.result())
            live.trouble = ""
        except LayfigureError as error:
            live.trouble = str(error)
        _redraw()
    program, character = session.program, session.character
    if live.reading is None and base != live.base and program is not None and character is not None:
        live.base = base
        live.reading = in_background(functools.partial(own_values, str(program), character, base), "joints")


def _live_of(session: sessions.Session) -> LiveJoints | None:
    """Made anew for a server that was started anew."""
    link = session.link
    if link is None or link.state != "live" or link.character is None:
        return None
    character = link.character
    live = _live.get(session.id)
    if live is None or live.server_id != character.server_id or live.link is not link:
        names = {index: joint.name for index, joint in enumerate(character.joints)}
        prepared = _prepared_of(session)
        sender = JointSender(link, names, prepared.own if prepared is not None else None)
        live = LiveJoints(sender, link, character.server_id, session.place)
        live.base = prepared.asked.without_joints() if prepared is not None else None
        _live[session.id] = live
    return live


def schedule() -> None:
    """Calls flush() soon, on the main thread."""
    if bpy.app.timers.is_registered(flush):
        bpy.app.timers.unregister(flush)
    bpy.app.timers.register(flush, first_interval=0.0, persistent=True)


def _redraw() -> None:
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "PROPERTIES"}:
                area.tag_redraw()


# --- changes ---------------------------------------------------------------------------------------------------------


def _on_change(group: bpy.types.PropertyGroup, context: bpy.types.Context, is_switch: bool) -> None:
    if _is_spreading:
        return
    armature = group.id_data
    active = getattr(context, "active_pose_bone", None)
    found = joint_properties.owner(group, active if active is not None and active.id_data == armature else None)
    with spreading(armature):
        joint_properties.match_reference(armature)
        if found is None:
            return
        bone, part = found
        values = values_of(armature)
        if is_switch and group.override and values is not None and bone.name in values.joints:
            joint_properties.start_from(group, part, values.joints[bone.name])
        spread(armature, bone, part.keys)


@contextlib.contextmanager
def spreading(armature: bpy.types.Object) -> Iterator[None]:
    """What is changed in the block goes nowhere but to the server, in the end."""
    global _is_spreading
    before, _is_spreading = _is_spreading, True
    try:
        yield
    finally:
        _is_spreading = before
        session = sessions.of(armature)
        if session is not None and session.id in _live:
            _live[session.id].is_dirty = True
            schedule()


def spread(armature: bpy.types.Object, bone: bpy.types.PoseBone, keys: tuple[str, ...]) -> None:
    """Gives other bones what was changed of this one: the selected ones, if they are to be edited together, and the
    mirror images of all of them, if the armature is to be edited symmetrically.
    """
    settings = asked_settings.joint_settings(bone)
    edited = [bone]
    if armature.layfigure_doll.edit_selected and pose_writing.is_selected(bone):
        selected = filter(pose_writing.is_selected, armature.pose.bones)
        edited += [other for other in selected if other.name != bone.name]
    for other in edited[1:]:
        asked_settings.write_joint(other, settings, keys)
    write_images(armature, edited, keys)


def write_images(
    armature: bpy.types.Object, bones: list[bpy.types.PoseBone], keys: tuple[str, ...] = joint_properties.KEYS
) -> None:
    """What is asked of these bones goes to the other side, if the armature is to be edited symmetrically. Bones whose
    image is among them stay as they are.
    """
    if is_mirrored(armature):
        mirror_bones(armature, bones, keys)


def mirror_bones(
    armature: bpy.types.Object, bones: list[bpy.types.PoseBone], keys: tuple[str, ...] = joint_properties.KEYS
) -> int:
    """As write_images(), whatever the armature's options say; returns how many bones were written."""
    given = {bone.name for bone in bones}
    count = 0
    for bone in bones:
        image = image_of(armature, bone)
        if image is not None and image.name not in given:
            settings = mirrored(asked_settings.joint_settings(bone), rule_of(armature, bone.name, image.name))
            asked_settings.write_joint(image, settings, keys)
            count += 1
    return count


def is_mirrored(armature: bpy.types.Object) -> bool:
    return bool(armature.pose.use_mirror_x or armature.data.use_mirror_x)


def image_of(armature: bpy.types.Object, bone: bpy.types.PoseBone) -> bpy.types.PoseBone | None:
    """The bone on the other side, by its name; None for bones in the middle."""
    name = bpy.utils.flip_name(bone.name)
    return armature.pose.bones.get(name) if name != bone.name else None


def rule_of(armature: bpy.types.Object, bone: str, image: str) -> MirrorRule:
    """How values of the bone become those of its image: by the axes of both, where the doll is known."""
    session = sessions.of(armature)
    values = values_of(armature)
    character = session.link.character if session is not None and session.link is not None else None
    if values is None or character is None or bone not in values.joints or image not in values.joints:
        return USUAL_MIRROR
    return mirror_rule(_placed(values, character, bone), _placed(values, character, image))


def _placed(values: DollValues, character: Character, name: str) -> Placed:
    joint = next(joint for joint in character.joints if joint.name == name)
    return Placed(values.joints[name], tuple(joint.bind_translation), tuple(joint.bind_rotation))


# --- materials -------------------------------------------------------------------------------------------------------


def values_of_material(armature: bpy.types.Object, material: str) -> DollValues:
    """What the server would choose if the whole doll were of that material, of the same weight if that is given.

    Waits for the server, for some tenths of a second. Raises LayfigureError.
    """
    session = sessions.of(armature)
    if session is None or session.program is None or session.character is None:
        raise LayfigureError("what a material makes of a joint is known while a server of Blender's own runs: start it")
    base = asked_settings.doll_settings(armature).without_joints()
    kept = {name: number for name, number in base.numbers.items() if name not in OF_MATERIAL}
    return own_values(str(session.program), session.character, replace(base, material=material, numbers=kept))


def write_material(bone: bpy.types.PoseBone, values: DollValues) -> None:
    """The bone's joint is asked to be as those values have it, and its body to weigh as much."""
    made = replace(as_settings(values.joints[bone.name]), numbers={"density": values.densities[bone.name]})
    asked_settings.write_joint(bone, made, (*LAWS, "weight"))


# --- the file ----------------------------------------------------------------------------------------------------


def settings_text_of(armature: bpy.types.Object) -> str:
    """CHARACTER.doll.toml of the armature."""
    return settings_text(asked_settings.doll_settings(armature))


def _preparation(armature: bpy.types.Object) -> sessions.Preparation | None:
    settings = asked_settings.doll_settings(armature)
    return None if settings == DollSettings() else functools.partial(prepare, settings)


def _prepared_of(session: sessions.Session) -> Prepared | None:
    """What the session's own server was started with; None: nothing was asked."""
    return next((result for result in session.prepared if isinstance(result, Prepared)), None)


@persistent  # handlers that are not go when another file is loaded
def _before_save(*_: object) -> None:
    for armature in bpy.data.objects:
        if armature.type == "ARMATURE":
            joint_properties.match_reference(armature)


classes: tuple[type, ...] = ()


def register() -> None:
    bpy.app.handlers.save_pre.append(_before_save)
    joint_properties.add_change_listener(_on_change)
    sessions.add_settings_source(_preparation)
    schedule()


def unregister() -> None:
    sessions.remove_settings_source(_preparation)
    joint_properties.remove_change_listener(_on_change)
    bpy.app.handlers.save_pre.remove(_before_save)
    if bpy.app.timers.is_registered(flush):
        bpy.app.timers.unregister(flush)
    _live.clear()
