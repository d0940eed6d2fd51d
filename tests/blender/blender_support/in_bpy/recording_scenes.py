"""Recordings of a live doll while the timeline plays, in Blender's own Python.

python recording_scenes.py NAME FOLDER
"""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import world
from key_support import MOVED, curves_of, is_refused, live_doll
from layfigure_blender import actions, operators_keys, pose_writing, sessions


def record_while_the_timeline_plays(_: Path) -> None:
    session, armature = live_doll()
    scene = bpy.context.scene
    scene.render.fps, scene.frame_end = 24, 250
    scene.frame_set(10)
    first = actions.BoneCurves.ensure(armature)
    first.ensure_curve("hand.L", "rotation_quaternion", 1).keyframe_points.insert(1, 0.25)
    link, character = session.link, session.link.character
    place = world.layfigure.world_poses(character, link.newest.pose)[1][session.bones.joint_of_bone("hand.L")]
    link.move_pointer(0, place)
    link.send("grab", pointer=0, bone="hand.L").result(10)
    assert bpy.ops.layfigure.record() == {"FINISHED"}
    assert not bpy.ops.layfigure.record.poll()
    poses = []
    begin = time.monotonic()
    shown = 10
    while shown < 58:
        now = time.monotonic() - begin
        link.move_pointer(0, place + 0.1 * np.array([0.0, np.cos(4.0 * now) - 1.0, np.sin(4.0 * now)]))
        sessions.tick()
        newest = link.newest
        if not poses or poses[-1] is not newest.pose:
            poses.append(newest.pose)
        if int(10 + now * 24) > shown:
            shown = int(10 + now * 24)
            scene.frame_set(shown)
        time.sleep(0.003)
    link.send("release", pointer=0).result(10)
    assert bpy.ops.layfigure.record_stop() == {"FINISHED"}
    assert not bpy.ops.layfigure.record_stop.poll()
    curve = first.curve("hand.L", "rotation_quaternion", 1)
    frames = actions.keys_of(curve)[:, 0]
    assert frames[0] == 1
    assert abs(curve.evaluate(1) - 0.25) < 1e-6
    assert list(frames[1:]) == list(range(10, shown + 1))
    bpy.ops.layfigure.stop()
    # each frame is between two poses that came about its time: no farther from the nearest one than poses are apart
    bones = pose_writing.bones_of(armature)
    from layfigure_blender.rig import BoneMap

    map_ = BoneMap(character, bones, np.array(armature.matrix_world))
    hand = [bone.name for bone in bones].index("hand.L")
    path = np.array([map_.pose_matrices(pose)[hand, :3, 3] for pose in poses])
    step = np.linalg.norm(np.diff(path, axis=0), axis=1).max()
    assert np.ptp(path, axis=0).max() > MOVED
    followed = []
    for frame in range(10, shown + 1):
        scene.frame_set(frame)
        at = np.array(armature.pose.bones["hand.L"].matrix)[:3, 3]
        followed.append(at)
        assert np.linalg.norm(path - at, axis=1).min() <= step, frame
    assert np.ptp(np.array(followed), axis=0).max() > MOVED


def recording_ends_where_the_timeline_begins_anew(_: Path) -> None:
    session, armature = live_doll()
    scene = bpy.context.scene
    for frame in (1, 2, 3):
        scene.frame_set(frame)
        if frame == 1:
            assert bpy.ops.layfigure.record() == {"FINISHED"}
        time.sleep(0.05)
        sessions.tick()
    scene.frame_set(1)
    operators_keys.finish_ended()
    assert not operators_keys.is_recording(session)
    assert {len(curve.keyframe_points) for curve in curves_of(armature)} <= {2, 3}
    assert actions.BoneCurves.find(armature).key_span(set(session.bones.driven_names)).max() <= 3


def recording_without_a_window_ends_by_itself(_: Path) -> None:
    """Begun by a script: there is no window whose events would end it, and no object in a timer's context."""
    session, armature = live_doll()
    scene = bpy.context.scene
    scene.frame_set(1)
    without_window = SimpleNamespace(object=armature, scene=scene, window=None)
    assert operators_keys.LAYFIGURE_OT_record.execute(None, without_window) == {"FINISHED"}
    assert bpy.app.timers.is_registered(operators_keys.finish_unwatched)
    for frame in (2, 3, 4):
        scene.frame_set(frame)
        time.sleep(0.05)
        sessions.tick()
        assert operators_keys.finish_unwatched() is not None
    scene.frame_set(1)
    assert operators_keys.is_recording(session)
    bpy.context.view_layer.objects.active = None
    assert operators_keys.finish_unwatched() is None
    assert not operators_keys.is_recording(session)
    assert list(actions.BoneCurves.find(armature).key_span(set(session.bones.driven_names))) == [1, 2, 3, 4]


def recorded_armature_that_is_gone(_: Path) -> None:
    session, armature = live_doll()
    assert bpy.ops.layfigure.record() == {"FINISHED"}
    bpy.context.scene.frame_set(2)
    bpy.data.objects.remove(armature)
    sessions.tick()
    assert session not in sessions.all()
    bpy.context.scene.frame_set(3)
    message = is_refused(bpy.ops.layfigure.record_stop, session=session.id)
    assert "no longer there" in message, message
    assert not operators_keys.is_recording(session)


def recording_of_a_doll_that_was_stopped_is_kept(_: Path) -> None:
    session, armature = live_doll()
    assert bpy.ops.layfigure.record() == {"FINISHED"}
    for frame in range(2, 8):
        bpy.context.scene.frame_set(frame)
        sessions.tick()
        time.sleep(0.02)
    bpy.ops.layfigure.stop()
    bpy.context.scene.frame_set(8)
    operators_keys.finish_ended()
    assert not operators_keys.is_recording(session)
    assert list(actions.BoneCurves.find(armature).key_span(set(session.bones.driven_names))) == list(range(1, 8))


def pose_of_a_doll_that_was_lost_can_be_keyed(_: Path) -> None:
    session, armature = live_doll()
    assert bpy.ops.layfigure.record() == {"FINISHED"}
    bpy.context.scene.frame_set(2)
    os.kill(session.server_pid, signal.SIGKILL)
    world.wait(lambda: session.failed, "the loss")
    for name in ("undo", "redo", "mirror", "snapshot_save", "snapshot_refresh"):
        assert not getattr(bpy.ops.layfigure, name).poll(), name
    bpy.context.scene.frame_set(3)
    assert bpy.ops.layfigure.record_stop() == {"FINISHED"}
    assert list(actions.BoneCurves.find(armature).key_span(set(session.bones.driven_names))) == [1, 2, 3]
    bpy.context.scene.frame_set(9)
    assert bpy.ops.layfigure.key_pose() == {"FINISHED"}


def recording_is_one_step_of_undo(_: Path) -> None:
    session, _armature = live_doll()
    session.note_place()
    bpy.ops.ed.undo_push(message="Start")
    assert bpy.ops.layfigure.record("EXEC_DEFAULT", True) == {"FINISHED"}
    for frame in range(2, 12):
        bpy.context.scene.frame_set(frame)
        sessions.tick()
        time.sleep(0.01)
    assert bpy.ops.layfigure.record_stop("EXEC_DEFAULT", True) == {"FINISHED"}
    assert curves_of(session.armature())
    bpy.ops.ed.undo()
    assert curves_of(session.armature()) == []
    assert len(bpy.data.actions) == 0


if __name__ == "__main__":
    world.run_scene(globals())
