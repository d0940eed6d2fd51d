"""Keys, recording, reduction, history and snapshots on a live doll, in Blender's own Python.

python key_scenes.py NAME FOLDER
"""

from __future__ import annotations

import os
import signal
import sys
import time
from pathlib import Path

import bpy
import numpy as np
import world
from layfigure_blender import actions, operators_keys, pose_writing, rotation_modes, sessions

from layfigure import rotation

MOVED = 0.05  # [m] or rad: more than any rounding, less than any gesture here
SAME = 1e-5  # [m], and entries of rotations
RESTS_AGAIN = 2e-3  # likewise, of a doll that was put back, and then came to rest anew
KEYED_MODES = {"upper_arm.L": "XYZ", "forearm.L": "AXIS_ANGLE", "upper_arm.R": "ZXY"}


def live_doll() -> tuple[sessions.Session, bpy.types.Object]:
    world.empty_file()
    armature = world.rig("doll")
    session = world.start(armature)
    world.settle(session)
    return session, armature


def poses_of(armature: bpy.types.Object) -> dict[str, np.ndarray]:
    bpy.context.view_layer.update()
    return {bone.name: np.array(bone.matrix) for bone in armature.pose.bones}


def farthest(a: dict[str, np.ndarray], b: dict[str, np.ndarray]) -> float:
    return max(float(np.abs(a[name] - b[name]).max()) for name in a)


def curves_of(armature: bpy.types.Object) -> list:
    found = actions.BoneCurves.find(armature)
    return [] if found is None else list(found._curves)


def snapshot_of_curves(armature: bpy.types.Object) -> dict:
    return {
        (curve.data_path, curve.array_index): [(tuple(key.co), key.interpolation) for key in curve.keyframe_points]
        for curve in curves_of(armature)
    }


def is_refused(operator: object, **arguments: object) -> str:
    try:
        result = operator(**arguments)
    except RuntimeError as error:
        return str(error)
    assert result == {"CANCELLED"}, result
    return "cancelled"


# --- scenes ---


def nothing_is_keyed_unless_asked(_: Path) -> None:
    session, armature = live_doll()
    bpy.context.scene.tool_settings.use_keyframe_insert_auto = True
    before = poses_of(armature)
    world.drag(session, "hand.L", np.array([0.0, -0.1, 0.2]))
    bpy.context.scene.frame_set(5)
    world.settle(session)
    assert farthest(before, poses_of(armature)) > MOVED
    assert curves_of(armature) == []
    assert len(bpy.data.actions) == 0


def key_all_bones(_: Path) -> None:
    session, armature = live_doll()
    for name, mode in KEYED_MODES.items():
        armature.pose.bones[name].rotation_mode = mode
    world.drag(session, "hand.L", np.array([0.0, -0.1, 0.2]))
    scene = bpy.context.scene
    bpy.context.preferences.edit.keyframe_new_interpolation_type = "CONSTANT"
    bpy.context.preferences.edit.keyframe_new_handle_type = "VECTOR"
    scene.frame_set(10)
    shown = poses_of(armature)
    assert bpy.ops.layfigure.key_pose() == {"FINISHED"}
    assert [action.name for action in bpy.data.actions] == [armature.name]
    for bone in armature.pose.bones:
        name = rotation_modes.property_of(bone.rotation_mode)
        assert all(len(curve.keyframe_points) == 1 for curve in curves_of(armature))
        if bone.name in session.bones.driven_names:
            assert actions.BoneCurves.find(armature).curve(bone.name, name, 0) is not None, bone.name
    moved = {curve.data_path for curve in curves_of(armature) if curve.data_path.endswith("location")}
    root = session.bones.driven_names[0]
    assert moved == {actions.path_of(root, "location")}
    assert all(
        curve.group.name == bpy.utils.unescape_identifier(curve.data_path.split('"')[1])
        for curve in curves_of(armature)
    )
    assert {curve.keyframe_points[0].interpolation for curve in curves_of(armature)} == {"CONSTANT"}
    assert {curve.keyframe_points[0].handle_left_type for curve in curves_of(armature)} == {"VECTOR"}
    # another pose, another frame; then the first frame alone, without the doll, is as it was
    kept = snapshot_of_curves(armature)
    world.drag(session, "hand.R", np.array([0.0, -0.1, 0.2]))
    scene.frame_set(20)
    world.settle(session)
    second = poses_of(armature)
    assert farthest(shown, second) > MOVED
    assert bpy.ops.layfigure.key_pose() == {"FINISHED"}
    now = snapshot_of_curves(armature)
    assert all(now[key][0] == keys[0] for key, keys in kept.items())
    assert all(len(keys) == 2 for keys in now.values())
    bpy.ops.layfigure.stop()
    scene.frame_set(10)
    assert farthest(shown, poses_of(armature)) < SAME
    scene.frame_set(20)
    assert farthest(second, poses_of(armature)) < SAME


def key_selected_bones(_: Path) -> None:
    _, armature = live_doll()
    for bone in armature.pose.bones:
        select_bone(bone, bone.name == "hand.L")
    assert bpy.ops.layfigure.key_pose(selected=True) == {"FINISHED"}
    assert {curve.data_path for curve in curves_of(armature)} == {actions.path_of("hand.L", "rotation_quaternion")}
    for bone in armature.pose.bones:
        select_bone(bone, False)
    assert "No bone is selected" in is_refused(bpy.ops.layfigure.key_pose, selected=True)


def select_bone(bone: bpy.types.PoseBone, selected: bool) -> None:
    if hasattr(bone, "select"):
        bone.select = selected
    else:
        bone.bone.select = selected


def quaternions_keep_their_sign(_: Path) -> None:
    session, armature = live_doll()
    curves = actions.BoneCurves.ensure(armature)
    bone = armature.pose.bones["hand.L"]
    for index, value in enumerate(-np.array(bone.rotation_quaternion)):
        curves.ensure_curve(bone.name, "rotation_quaternion", index).keyframe_points.insert(1, value)
    bpy.context.scene.frame_set(7)
    world.settle(session)
    before = np.array(bone.rotation_quaternion)
    assert bpy.ops.layfigure.key_pose() == {"FINISHED"}
    keyed = [curves.curve(bone.name, "rotation_quaternion", index).keyframe_points[-1].co[1] for index in range(4)]
    earlier = [curves.curve(bone.name, "rotation_quaternion", index).keyframe_points[0].co[1] for index in range(4)]
    assert np.dot(keyed, earlier) > 0.0
    assert abs(abs(np.dot(keyed, before)) - 1.0) < 1e-6


def own_slot_of_a_shared_action(_: Path) -> None:
    """An action that animates another armature already."""
    _, armature = live_doll()
    if "slots" not in bpy.types.Action.bl_rna.properties:
        return
    other = bpy.data.objects.new("other", None)
    bpy.context.scene.collection.objects.link(other)
    other.keyframe_insert("location", frame=1)
    action = other.animation_data.action
    armature.animation_data_create().action = action
    armature.animation_data.action_slot = None
    assert bpy.ops.layfigure.key_pose() == {"FINISHED"}
    assert armature.animation_data.action == action
    assert armature.animation_data.action_slot != other.animation_data.action_slot
    assert len(actions._channelbag(action, other.animation_data.action_slot, ensure=False).fcurves) == 3
    assert len(curves_of(armature)) > 3


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


def mirror_and_snapshots(_: Path) -> None:
    session, armature = live_doll()
    world.drag(session, "hand.L", np.array([0.0, -0.15, 0.25]))
    lifted = poses_of(armature)
    place = session.place
    assert bpy.ops.layfigure.snapshot_save(name="lifted") == {"FINISHED"}
    known = bpy.context.window_manager.layfigure_snapshots
    assert [each.name for each in known.names] == ["lifted"]
    assert known.of == session.id
    assert bpy.ops.layfigure.mirror(side="both") == {"FINISHED"}
    assert armature.layfigure.place == session.place != place
    world.settle(session)
    assert farthest(lifted, poses_of(armature)) > MOVED
    assert bpy.ops.layfigure.snapshot_restore() == {"FINISHED"}
    world.settle(session)
    assert farthest(lifted, poses_of(armature)) < 1e-3  # it comes to rest anew
    assert bpy.ops.layfigure.undo() == {"FINISHED"}
    world.settle(session)
    assert farthest(lifted, poses_of(armature)) > MOVED
    assert bpy.ops.layfigure.redo() == {"FINISHED"}
    world.settle(session)
    assert farthest(lifted, poses_of(armature)) < 1e-3
    assert "nothing to do again" in is_refused(bpy.ops.layfigure.redo)
    assert bpy.ops.layfigure.snapshot_save(name="second") == {"FINISHED"}
    assert [each.name for each in known.names] == ["lifted", "second"]
    assert known.active == 1
    assert bpy.ops.layfigure.snapshot_remove(name="lifted") == {"FINISHED"}
    assert [each.name for each in known.names] == ["second"]
    assert known.active == 0
    assert "there is no snapshot 'lifted'" in is_refused(bpy.ops.layfigure.snapshot_restore, name="lifted").lower()
    assert "expected 1 to 64" in is_refused(bpy.ops.layfigure.snapshot_save, name=" ")
    assert "expected 1 to 64" in is_refused(bpy.ops.layfigure.snapshot_save, name="x" * 65)
    assert bpy.ops.layfigure.snapshot_remove() == {"FINISHED"}
    assert not bpy.ops.layfigure.snapshot_restore.poll()


def snapshots_of_before_are_listed_by_themselves(_: Path) -> None:
    session, _ = live_doll()
    assert bpy.ops.layfigure.snapshot_save(name="kept") == {"FINISHED"}
    bpy.ops.layfigure.stop()
    armature = bpy.context.object
    session = world.start(armature)
    known = bpy.context.window_manager.layfigure_snapshots
    world.wait(lambda: known.of == session.id, "the list")
    assert [each.name for each in known.names] == ["kept"]
    bpy.ops.layfigure.snapshot_remove(name="kept")


def undo_many_times_in_a_row(_: Path) -> None:
    """As with Ctrl Z held down: nothing is waited for in between."""
    session, armature = live_doll()
    bpy.ops.ed.undo_push(message="Start")
    session.note_place()
    states = []
    for k in range(6):
        world.drag(session, ("hand.L", "hand.R")[k % 2], np.array([0.0, -0.08 - 0.03 * k, 0.1 + 0.03 * k]), 0.3)
        session.note_place()
        states.append((session.place, poses_of(armature)))
        bpy.ops.ed.undo_push(message=f"drag {k}")
    for _k in range(5):
        bpy.ops.ed.undo()
    session = sessions.all()[0]
    armature = session.armature()
    assert armature.layfigure.place == states[0][0]
    world.wait(lambda: session.live, "the doll's way back")
    world.settle(session)
    assert farthest(states[0][1], poses_of(armature)) < RESTS_AGAIN
    assert place_of(session) == states[0][0]
    for _k in range(3):
        bpy.ops.ed.redo()
    armature = session.armature()
    world.wait(lambda: session.live, "the doll's way on")
    world.settle(session)
    assert farthest(states[3][1], poses_of(armature)) < RESTS_AGAIN
    assert place_of(session) == states[3][0]
    # what is done now is a branch of its own, for both
    assert bpy.ops.layfigure.mirror() == {"FINISHED"}
    bpy.ops.ed.undo_push(message="mirror")
    bpy.ops.ed.undo()
    world.wait(lambda: session.live, "the doll's way back")
    world.settle(session)
    assert place_of(session) == states[3][0]


def place_of(session: sessions.Session) -> int:
    return int(session.link.send("history").result(world.TIMEOUT_S).values("place")[0])


def undo_while_the_doll_is_held(_: Path) -> None:
    session, armature = live_doll()
    session.note_place()
    before = poses_of(armature)
    bpy.ops.ed.undo_push(message="Start")
    world.drag(session, "hand.L", np.array([0.0, -0.1, 0.2]))
    session.note_place()
    bpy.ops.ed.undo_push(message="drag")
    link = session.link
    place = world.layfigure.world_poses(link.character, link.newest.pose)[1][session.bones.joint_of_bone("hand.R")]
    link.move_pointer(0, place)
    link.send("grab", pointer=0, bone="hand.R").result(world.TIMEOUT_S)
    link.move_pointer(0, place + np.array([0.0, -0.2, 0.2]))
    world.wait(lambda: link.forces and link.forces[0].attached, "the grab")
    bpy.ops.ed.undo()
    world.wait(lambda: session.live, "the doll's way back")
    world.settle(session)
    assert farthest(before, poses_of(session.armature())) < RESTS_AGAIN
    world.wait(lambda: not link.forces[0].attached, "letting go")
    link.move_pointer(0, place)  # the hand that has lost the doll goes on: nothing happens
    world.settle(session)
    assert farthest(before, poses_of(session.armature())) < RESTS_AGAIN


def undo_of_a_key_leaves_the_doll(_: Path) -> None:
    session, armature = live_doll()
    world.drag(session, "hand.L", np.array([0.0, -0.1, 0.2]))
    session.note_place()
    bpy.ops.ed.undo_push(message="drag")
    before = poses_of(armature)
    bpy.ops.layfigure.key_pose("EXEC_DEFAULT", True)
    assert curves_of(session.armature())
    bpy.ops.ed.undo()
    assert curves_of(session.armature()) == []
    world.wait(lambda: session.live, "the doll")
    world.settle(session)
    assert farthest(before, poses_of(session.armature())) < RESTS_AGAIN


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


def without_a_doll_all_are_polled_off(_: Path) -> None:
    world.empty_file()
    named = (
        "key_pose",
        "record",
        "record_stop",
        "undo",
        "redo",
        "mirror",
        "snapshot_save",
        "snapshot_restore",
        "snapshot_remove",
        "snapshot_refresh",
        "reduce_keys",
        "import_take",
    )
    for name in named:
        assert not getattr(bpy.ops.layfigure, name).poll(), name
        assert "poll()" in is_refused(getattr(bpy.ops.layfigure, name)), name
    world.rig("doll")
    for name in named[:-1]:
        assert not getattr(bpy.ops.layfigure, name).poll(), name
    assert bpy.ops.layfigure.import_take.poll() == (bpy.app.version >= (4, 2, 0))


def reduced_keys_hold_the_tolerance(_: Path) -> None:
    """Of the skin as Blender itself evaluates it, in every frame."""
    for modes in ({}, KEYED_MODES, dict.fromkeys(("upper_arm.L", "hand.L", "chest"), "YZX")):
        for scale, tolerance_mm in ((1.0, 0.5), (0.1, 0.2), (30.0, 20.0)):
            reduce_one(modes, scale, tolerance_mm)


def reduce_one(modes: dict[str, str], scale: float, tolerance_mm: float) -> None:
    world.empty_file()
    armature = world.rig("doll")
    world.place(armature, scale, turned=True)
    for name, mode in modes.items():
        armature.pose.bones[name].rotation_mode = mode
    frames = np.arange(1.0, 121.0)
    animate(armature, frames)
    before = skins(armature, frames)
    assert bpy.ops.layfigure.reduce_keys(tolerance_mm=tolerance_mm) == {"FINISHED"}
    after = skins(armature, frames)
    error = float(np.linalg.norm(after - before, axis=-1).max())
    counts = sorted({len(curve.keyframe_points) for curve in curves_of(armature)})
    named = sorted(set(modes.values()))
    print(f"scale {scale:g}, modes {named}: {counts[-1]} keys, {1e3 * error:.3f} mm of {tolerance_mm:g}")
    assert error <= 1e-3 * tolerance_mm
    assert error > 0.3e-3 * tolerance_mm, "it is the fewest, so it comes near to the tolerance"
    assert counts[-1] < 60
    kinds = {key.interpolation for curve in curves_of(armature) for key in curve.keyframe_points}
    assert kinds == {"LINEAR"}


def animate(armature: bpy.types.Object, frames: np.ndarray) -> None:
    dice = np.random.default_rng(5)
    curves = actions.BoneCurves.ensure(armature)
    seconds = frames / 24.0
    for bone in armature.pose.bones:
        axis = dice.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = dice.uniform(0.2, 0.9) * np.sin(dice.uniform(0.2, 1.0) * seconds + dice.uniform(0.0, 6.0))
        turns = rotation.from_vector(angle[:, None] * axis + 0.1 * np.sin(seconds)[:, None])
        actions.write(curves, bone, actions.rotation_numbers(curves, bone, turns, frames[0]), frames)
    root = next(bone for bone in armature.pose.bones if bone.parent is None)
    path = 0.2 * np.stack([np.sin(seconds), seconds / 5.0, np.cos(seconds)], axis=1)
    actions.write(curves, root, {"location": path}, frames)


def skins(armature: bpy.types.Object, frames: np.ndarray) -> np.ndarray:
    """(F, V, 3) in the world."""
    result = []
    for frame in frames:
        bpy.context.scene.frame_set(int(frame))
        graph = bpy.context.evaluated_depsgraph_get()
        points = []
        for item in bpy.context.scene.objects:
            if item.type == "MESH" and item.find_armature() == armature:
                evaluated = item.evaluated_get(graph)
                mesh = evaluated.to_mesh()
                flat = np.empty(3 * len(mesh.vertices), np.float32)
                mesh.vertices.foreach_get("co", flat)
                evaluated.to_mesh_clear()
                place = np.array(item.matrix_world)
                points.append(flat.reshape(-1, 3).astype(np.float64) @ place[:3, :3].T + place[:3, 3])
        result.append(np.concatenate(points))
    return np.array(result)


def what_cannot_be_reduced_is_refused(_: Path) -> None:
    world.empty_file()
    armature = world.rig("doll")
    frames = np.arange(1.0, 31.0)
    animate(armature, frames)
    before = snapshot_of_curves(armature)

    def refused(reason: str) -> None:
        message = is_refused(bpy.ops.layfigure.reduce_keys)
        assert reason in message, message
        assert snapshot_of_curves(armature) == before

    bone = armature.pose.bones["hand.L"]
    constraint = bone.constraints.new("LIMIT_ROTATION")
    refused("has a constraint")
    constraint.mute = True
    bone.scale = (1.0, 2.0, 1.0)
    refused("is scaled")
    bone.scale = (1.0, 1.0, 1.0)
    bone.bone.use_inherit_rotation = False
    refused("does not inherit rotation")
    bone.bone.use_inherit_rotation = True
    armature.scale = (1.0, 2.0, 1.0)
    bpy.context.view_layer.update()
    refused("scaled unevenly")
    armature.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    modifier = next(item for item in bpy.data.objects["limbs"].modifiers if item.type == "ARMATURE")
    modifier.use_deform_preserve_volume = True
    refused("Preserve Volume")
    modifier.use_deform_preserve_volume = False
    for item in [item for item in bpy.data.objects if item.type == "MESH"]:
        bpy.data.objects.remove(item)
    refused("No mesh is bound")


def main() -> None:
    scene, folder = sys.argv[-2:]
    world.empty_file()
    with world.registered():
        globals()[scene](Path(folder))


if __name__ == "__main__":
    main()
