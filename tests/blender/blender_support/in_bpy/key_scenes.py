"""Keys of the pose of a live doll, in Blender's own Python.

python key_scenes.py NAME FOLDER
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import world
from key_support import (
    KEYED_MODES,
    MOVED,
    SAME,
    curves_of,
    farthest,
    is_refused,
    live_doll,
    poses_of,
    snapshot_of_curves,
)
from layfigure_blender import actions, rotation_modes


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


if __name__ == "__main__":
    world.run_scene(globals())
