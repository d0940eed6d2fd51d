# SPDX-License-Identifier: GPL-3.0-or-later
"""Keys of the doll's pose: of this frame, of all frames while the timeline plays, and the fewest that show the same."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass

import bpy
import numpy as np
from bpy.app.handlers import persistent
from bpy.props import BoolProperty, FloatProperty, StringProperty

from layfigure import LayfigureError

from . import actions, bound_skin, rotation_modes, sessions
from .actions import ActionError, BoneCurves
from .bone_tracks import played_tracks, posed_tracks
from .key_tracks import Recording, Tracks, reduce_keys
from .link import Sample
from .live import known_session, live_session, posed_armature, sentence
from .pose_writing import bones_of, is_selected
from .rig import BoneMap, MisfitError, check_similarity

MM = 1e-3
WATCH_INTERVAL_S = 0.1


@dataclass(frozen=True)
class Running:
    """A recording, with what it takes to make keys of it when the session has ended meanwhile."""

    recording: Recording
    armature: str  # its name
    bones: BoneMap


_recordings: dict[str, Running] = {}  # by session id; of the main thread
_ended: list[str] = []  # recordings that are to be finished, by session id


# ---------------------------------------------------------------- this pose


class LAYFIGURE_OT_key_pose(bpy.types.Operator):
    bl_idname = "layfigure.key_pose"
    bl_label = "Key Pose"
    bl_description = "Key the pose that the doll has on the current frame"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    selected: BoolProperty(name="Selected Bones", description="Key the selected bones alone", options={"SKIP_SAVE"})  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return known_session(cls, context) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        session = sessions.active(context)
        armature = session.armature()
        driven = set(session.bones.driven_names)
        bones = [bone for bone in armature.pose.bones if (is_selected(bone) if self.selected else bone.name in driven)]
        if not bones:
            self.report({"ERROR"}, "No bone is selected: select the bones to be keyed in pose mode")
            return {"CANCELLED"}
        curves = curves_to_key(self, armature)
        if curves is None:
            return {"CANCELLED"}
        frame = context.scene.frame_current_final
        movers = {bone.name for bone in moving_bones(armature, driven)}
        for bone in bones:
            for name, numbers in pose_numbers(curves, bone, frame, bone.name in driven, bone.name in movers).items():
                for index, value in enumerate(numbers):
                    curve = curves.ensure_curve(bone.name, name, index)
                    actions.insert(curve, curves.frame_of(frame), float(value), context.preferences.edit)
        session.note_place()
        self.report({"INFO"}, f"Keyed {len(bones)} bones on frame {frame:g}")
        return {"FINISHED"}


def curves_to_key(operator: bpy.types.Operator, armature: bpy.types.Object) -> BoneCurves | None:
    """None if there can be none, which has been reported then."""
    try:
        return BoneCurves.ensure(armature)
    except ActionError as error:
        operator.report({"ERROR"}, sentence(error))
        return None


def moving_bones(armature: bpy.types.Object, driven: set[str]) -> list[bpy.types.PoseBone]:
    """Those whose location is a part of the pose: the doll's roots, and what somebody else may have moved."""

    def carried(bone: bpy.types.PoseBone) -> bool:
        return any(above.name in driven for above in bone.parent_recursive)

    return [
        bone
        for bone in armature.pose.bones
        if (not carried(bone) if bone.name in driven else not bone.bone.use_connect)
    ]


def pose_numbers(
    curves: BoneCurves, bone: bpy.types.PoseBone, frame: float, is_driven: bool, moves: bool
) -> dict[str, np.ndarray]:
    """What is to be keyed of a bone as it stands, by the names of its properties."""
    name = rotation_modes.property_of(bone.rotation_mode)
    numbers = np.array(getattr(bone, name), np.float64)
    before = actions.numbers_before(curves, bone, frame)
    if is_driven and before is not None:
        turned = rotation_modes.to_rotations(bone.rotation_mode, numbers)
        numbers = rotation_modes.nearest(bone.rotation_mode, turned, before)
    return {name: numbers, **({"location": np.array(bone.location, np.float64)} if moves else {})}


# ---------------------------------------------------------------- recording


class LAYFIGURE_OT_record(bpy.types.Operator):
    bl_idname = "layfigure.record"
    bl_label = "Record"
    bl_description = "Play the timeline and record the doll's pose on each frame, up to the last one or until stopped"
    bl_options = {"REGISTER"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        session = live_session(cls, context)
        if session is not None and session.id in _recordings:
            cls.poll_message_set("A take is being recorded: stop it first")
            return False
        return session is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        session = sessions.active(context)
        try:
            BoneCurves.require_possible(session.armature())
        except ActionError as error:
            self.report({"ERROR"}, sentence(error))
            return {"CANCELLED"}
        recording = Recording(frames_per_second(context.scene))
        _recordings[session.id] = Running(recording, session.armature().name, session.bones)
        note_frame(recording, session, context.scene)
        if context.window is not None:
            if not context.screen.is_animation_playing:
                bpy.ops.screen.animation_play()
            if LAYFIGURE_OT_record_watch.timer is None:
                bpy.ops.layfigure.record_watch("INVOKE_DEFAULT")
        elif not bpy.app.timers.is_registered(finish_unwatched):
            bpy.app.timers.register(finish_unwatched, first_interval=WATCH_INTERVAL_S)
        return {"FINISHED"}


class LAYFIGURE_OT_record_watch(bpy.types.Operator):
    """End recordings with the playback, or where their frames end.

    An operator, since what ends them are operators that need a window. A timer of bpy.app has none, and could only be
    lent one by temp_override(): under that Blender asks Python for each member of its context while the call of the
    operator has released the interpreter's lock. Up to Python 3.11, which Blender 5.0 still has, it takes the lock for
    its own then if any thread has it, and crashes beside one that is running, such as a link's.
    """

    bl_idname = "layfigure.record_watch"
    bl_label = "Watch Recording"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    timer: bpy.types.Timer | None = None  # of the one that runs: it watches all recordings

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        timer = context.window_manager.event_timer_add(WATCH_INTERVAL_S, window=context.window)
        LAYFIGURE_OT_record_watch.timer = timer
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type == "TIMER":  # not TIMER0, the playback's, which may be stopped here
            self._look(context)
            if not _recordings:
                self.forget_timer(context)
                return {"FINISHED", "PASS_THROUGH"}
        return {"PASS_THROUGH"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends it with its window, and before another file: what is still recorded ends by the button."""
        self.forget_timer(context)

    def _look(self, context: bpy.types.Context) -> None:
        if not any(window.screen.is_animation_playing for window in context.window_manager.windows):
            for id_ in _recordings:
                note_end(id_)
        try:
            finish_ended()
        except RuntimeError as error:  # what an operator reports to whom it was called by
            self.report({"ERROR"}, str(error).removeprefix("Error: ").strip())

    @classmethod
    def forget_timer(cls, context: bpy.types.Context) -> None:
        if cls.timer is not None:
            context.window_manager.event_timer_remove(cls.timer)
        LAYFIGURE_OT_record_watch.timer = None


class LAYFIGURE_OT_record_stop(bpy.types.Operator):
    bl_idname = "layfigure.record_stop"
    bl_label = "Stop Recording"
    bl_description = "End the recording; its poses become keys of the armature's action"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    session: StringProperty(options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]  # empty: the active one

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not _recordings:
            cls.poll_message_set("Nothing is being recorded")
        return bool(_recordings)

    def execute(self, context: bpy.types.Context) -> set[str]:
        active = sessions.active(context) if not self.session else None  # a timer's context may have no object
        wanted = active.id if active is not None else self.session
        running = _recordings.pop(wanted, None)
        if context.screen is not None and context.screen.is_animation_playing:
            bpy.ops.screen.animation_cancel(restore_frame=False)
        if running is None:
            self.report({"ERROR"}, "The doll of this armature is not being recorded")
            return {"CANCELLED"}
        session = session_of(wanted)
        armature = bpy.data.objects.get(running.armature) if session is None else session.armature()
        if armature is None or armature.type != "ARMATURE":
            self.report({"ERROR"}, "The recorded armature is no longer there: nothing was keyed")
            return {"CANCELLED"}
        return self._key(armature, running, session)

    def _key(self, armature: bpy.types.Object, running: Running, session: sessions.Session | None) -> set[str]:
        if session is not None and session.live:
            session.apply(session.link.newest)  # where the doll is carried by now, and its bones are
        poses = running.recording.poses()
        if not poses:
            self.report({"ERROR"}, "No pose came while recording: nothing was keyed")
            return {"CANCELLED"}
        curves = curves_to_key(self, armature)
        if curves is None:
            return {"CANCELLED"}
        bones, driven = running.bones.bones, running.bones.driven
        frames = running.recording.first_frame + np.arange(len(poses), dtype=np.float64)
        tracks = posed_tracks(armature, bones, driven, np.array([running.bones.pose_matrices(pose) for pose in poses]))
        count = write_tracks(armature, curves, [bone.name for bone in bones], driven, tracks, frames)
        if session is not None:
            session.note_place()
        self.report({"INFO"}, f"Recorded {count} bones on frames {frames[0]:g} to {frames[-1]:g}")
        return {"FINISHED"}


def session_of(id_: str) -> sessions.Session | None:
    return next((session for session in sessions.all() if session.id == id_), None)


def is_recording(session: sessions.Session) -> bool:
    return session.id in _recordings


def frames_per_second(scene: bpy.types.Scene) -> float:
    return scene.render.fps / scene.render.fps_base


def write_tracks(
    armature: bpy.types.Object,
    curves: BoneCurves,
    names: Sequence[str],
    keyed: Sequence[int],
    tracks: Tracks,
    frames: np.ndarray,
) -> int:
    """LINEAR keys in each of the frames, of the bones `keyed` of those that have tracks; returns of how many.

    Locations of the doll's roots alone are keyed: those of others do not change, and are put to zero.
    """
    bones = armature.pose.bones
    driven = {names[b] for b in keyed}
    movers = {bone.name for bone in moving_bones(armature, driven)}
    count = 0
    for b in keyed:
        bone = bones.get(names[b])
        if bone is None:
            continue  # somebody has renamed or removed it meanwhile
        numbers = actions.rotation_numbers(curves, bone, tracks.rotations[:, b], float(frames[0]))
        if bone.name in movers:
            numbers["location"] = tracks.locations[:, b]
        actions.write(curves, bone, numbers, frames)
        count += 1
    return count


def note_frame(recording: Recording, session: sessions.Session, scene: bpy.types.Scene) -> bool:
    newest = session.link.newest if session.link is not None else None
    if newest is not None:
        recording.add(newest)
    return recording.show(scene.frame_current, time.monotonic())


def on_sample(session: sessions.Session, sample: Sample) -> None:
    if session.id in _recordings:
        _recordings[session.id].recording.add(sample)


@persistent
def on_frame(scene: bpy.types.Scene, _depsgraph: object = None) -> None:
    if threading.current_thread() is not threading.main_thread():
        return  # a render's frames, which nobody poses at
    for id_, running in _recordings.items():
        session = session_of(id_)
        if session is None or not note_frame(running.recording, session, scene):
            note_end(id_)


@persistent
def on_load(*_: object) -> None:
    _recordings.clear()
    _ended.clear()


def note_end(id_: str) -> None:
    """Operators cannot be called while Blender changes the frame."""
    if id_ not in _ended:
        _ended.append(id_)


def finish_ended() -> None:
    """Where operators may be called: makes keys of the recordings that have ended."""
    while _ended:
        id_ = _ended.pop()
        if id_ in _recordings:
            bpy.ops.layfigure.record_stop("EXEC_DEFAULT", True, session=id_)


def finish_unwatched() -> float | None:
    """A timer, of recordings that were begun without a window, as other programs' scripts do: nothing but their frames
    ends them, and what does so needs no window."""
    with contextlib.suppress(RuntimeError):  # what an operator reports, which Blender has told the console
        finish_ended()
    return WATCH_INTERVAL_S if _recordings else None


# ---------------------------------------------------------------- the fewest keys


class LAYFIGURE_OT_reduce_keys(bpy.types.Operator):
    bl_idname = "layfigure.reduce_keys"
    bl_label = "Reduce Keys"
    bl_description = (
        "Replace the keys of the bones in the armature's action by the fewest that move the skin the same way, up to "
        "a tolerance"
    )
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    tolerance_mm: FloatProperty(  # type: ignore[valid-type]
        name="Tolerance",
        description="How far any vertex of the skin may be from where it was, in any frame [mm]",
        default=0.5,
        min=0.05,
        soft_max=10.0,
        max=1000.0,
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        armature = posed_armature(cls, context)
        if armature is None:
            return False
        curves = BoneCurves.find(armature)
        if curves is None or not curves.of_bones():
            cls.poll_message_set("The armature has no action with keys of bones: key or record a pose first")
            return False
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        try:
            return self._reduce(context, posed_armature(None, context))
        except (ActionError, MisfitError, bound_skin.SkinError, LayfigureError) as error:
            self.report({"ERROR"}, sentence(error))
            return {"CANCELLED"}

    def _reduce(self, context: bpy.types.Context, armature: bpy.types.Object) -> set[str]:
        curves = BoneCurves.ensure(armature)
        keyed = curves.of_bones() & {bone.name for bone in armature.pose.bones}
        frames = curves.key_span(keyed)
        require_plain_bones(armature, curves)
        bones = bones_of(armature)
        meshes = bound_skin.meshes(armature, [bone.name for bone in bones], context.scene)
        poses = [armature.pose.bones[bone.name] for bone in bones]
        modes = [pose.rotation_mode for pose in poses]
        tracks = played_tracks(curves, poses, frames)
        scale = check_similarity(np.array(armature.matrix_world))
        reduced = reduce_keys(bones, modes, tracks, meshes, scale, MM * self.tolerance_mm)
        at = frames[reduced.frames]
        for b, pose in enumerate(poses):
            if pose.name not in keyed:
                continue
            numbers = {}
            rotated = rotation_modes.property_of(pose.rotation_mode)
            if curves.has(pose.name, rotated):
                numbers[rotated] = reduced.numbers[b]
            if curves.has(pose.name, "location"):
                numbers["location"] = reduced.locations[:, b]
            actions.write(curves, pose, numbers, at, span=(float(frames[0]), float(frames[-1])))
        off_mm = reduced.error_m / MM
        self.report({"INFO"}, f"{len(at)} keys for {len(frames)} frames; the farthest vertex is {off_mm:.2g} mm off")
        return {"FINISHED"}


def require_plain_bones(armature: bpy.types.Object, curves: BoneCurves) -> None:
    """Raises ActionError for bones that are not where their rotations and locations alone put them."""
    drivers = armature.animation_data.drivers
    driven = {driver.data_path for driver in drivers}
    for bone in armature.pose.bones:
        mend = ""
        if any(not each.mute and each.influence > 0.0 for each in bone.constraints):
            mend = "has a constraint: mute it first"
        elif any(path.startswith(actions.path_of(bone.name, "")) for path in driven):
            mend = "has a driver: remove it first"
        elif curves.has(bone.name, "scale") or np.abs(np.array(bone.scale) - 1.0).max() > 1e-5:
            mend = "is scaled: clear its scale (Alt S), and remove the keys of it"
        elif bone.parent is not None and not bone.bone.use_inherit_rotation:
            mend = "does not inherit rotation: switch that on in its relations"
        elif not bone.bone.use_local_location and curves.has(bone.name, "location"):
            mend = "does not move in its own axes: switch Local Location on in its relations"
        if mend:
            raise ActionError(f"The skin cannot be followed: bone '{bone.name}' {mend}")


classes = (
    LAYFIGURE_OT_key_pose,
    LAYFIGURE_OT_record,
    LAYFIGURE_OT_record_watch,
    LAYFIGURE_OT_record_stop,
    LAYFIGURE_OT_reduce_keys,
)

_HANDLERS = (
    ("frame_change_post", on_frame),
    ("load_pre", on_load),
)


def register() -> None:
    sessions.add_listener(on_sample)
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).append(handler)


def unregister() -> None:
    for name, handler in _HANDLERS:
        getattr(bpy.app.handlers, name).remove(handler)
    sessions.remove_listener(on_sample)
    LAYFIGURE_OT_record_watch.forget_timer(bpy.context)
    if bpy.app.timers.is_registered(finish_unwatched):
        bpy.app.timers.unregister(finish_unwatched)
    on_load()
