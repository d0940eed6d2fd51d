"""What a session does while its doll is live, one scene in each process.

python session_scenes.py NAME FOLDER
"""

from __future__ import annotations

import functools
from pathlib import Path

import bpy
import numpy as np
import text_files
import world
from layfigure_blender import operators_session, sessions
from mathutils import Euler
from session_support import (
    NAMES,
    SAME_POSE,
    SAME_REST,
    constrained,
    evaluated,
    expect_different,
    expect_following,
    expect_same,
    is_running,
)


def stop_tells_which_bones_constraints_take_back(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    posed = evaluated(armature)
    assert operators_session.stop_and_compare(session) == []
    expect_same(evaluated(armature), posed)
    moving = constrained(armature)
    session = world.start(armature)
    world.drag(session, "tip", np.array([-0.2, 0.3, -0.1]))
    posed = evaluated(armature)
    taken = operators_session.stop_and_compare(session)
    moved = np.abs(evaluated(armature) - posed).max(axis=(1, 2))
    assert taken == [name for name, most in zip(NAMES, moved, strict=True) if most > 0.01]
    assert taken
    for each in moving:
        each.mute = True
    expect_same(evaluated(armature), posed)


def bones_that_copy_those_of_a_rig_are_the_dolls_while_it_is_live(_: Path) -> None:
    """As an armature for a game engine does, also a bone that is no body of the doll."""
    armature = world.chain([*NAMES, "end"])
    rig = armature.copy()
    bpy.context.scene.collection.objects.link(rig)
    for bone in armature.pose.bones:
        copy = bone.constraints.new("COPY_TRANSFORMS")
        copy.target, copy.subtarget = rig, bone.name
    world.pose_at_random(rig, NAMES, 0.4, 1)
    before = evaluated(armature)
    merged = functools.partial(text_files.write_settings, '[joints."end"]\nmerge = true\n')
    sessions.add_settings_source(lambda _: merged)
    session = world.start(armature)
    assert set(session.bones.driven_names) == set(NAMES)
    world.settle(session)
    expect_same(evaluated(armature)[:-1], before[:-1])
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    expect_following(session, armature)
    tip, end = (armature.pose.bones[name] for name in ("tip", "end"))
    expect_same(np.array(end.matrix), np.array(tip.matrix @ tip.bone.matrix_local.inverted() @ end.bone.matrix_local))
    assert set(operators_session.stop_and_compare(session)) <= set(NAMES)
    expect_same(evaluated(armature), before)


def pose_mode_and_object_mode_are_alike(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    expect_following(session, armature)
    bpy.ops.object.mode_set(mode="POSE")
    world.drag(session, "tip", np.array([-0.3, 0.1, -0.1]))
    expect_following(session, armature)
    assert armature.mode == "POSE"


def nothing_is_keyed(_: Path) -> None:
    bpy.context.scene.tool_settings.use_keyframe_insert_auto = True
    armature = world.chain(NAMES)
    session = world.start(armature)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    assert armature.animation_data is None
    assert not bpy.data.actions


def animation_does_not_take_the_pose_away(_: Path) -> None:
    armature = world.chain(NAMES)
    for frame, angle in ((1, 0.0), (20, 0.5)):
        for name in NAMES:
            bone = armature.pose.bones[name]
            bone.rotation_mode = "XYZ"
            bone.rotation_euler = (angle, 0.0, 0.0)
            bone.keyframe_insert("rotation_euler", frame=frame)
    bpy.context.scene.frame_set(1)
    session = world.start(armature)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    for frame in (5, 20, 3, 11):
        bpy.context.scene.frame_set(frame)
        expect_following(session, armature)
        sessions.tick()
        expect_following(session, armature)
    session.stop()
    bpy.context.scene.frame_set(20)
    assert abs(armature.pose.bones["tip"].rotation_euler.x - 0.5) < SAME_POSE


def bones_posed_by_hand_are_not_fought_with(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    world.settle(session)
    armature.pose.bones["lower"].rotation_mode = "XYZ"
    armature.pose.bones["lower"].rotation_euler = Euler((0.0, 0.0, 0.4))
    posed = evaluated(armature)
    for _ in range(20):
        sessions.tick()
    expect_same(evaluated(armature), posed)
    assert bpy.ops.layfigure.push_pose() == {"FINISHED"}
    world.wait(lambda: session.live, "the doll")
    world.settle(session)
    expect_same(evaluated(armature), posed)
    expect_following(session, armature)
    assert bpy.ops.layfigure.reset() == {"FINISHED"}
    world.settle(session)
    expect_same(evaluated(armature), np.array([bone.matrix_local for bone in armature.data.bones]))


def what_carries_the_root_carries_the_doll(_: Path) -> None:
    """A control bone above the doll's root, the object, and its parent."""
    armature = world.chain(["control", *NAMES])
    armature.data.bones["control"].use_deform = False
    session = world.start(armature)
    assert "control" not in session.bones.driven_names
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    before = evaluated(armature)
    armature.pose.bones["control"].location = (0.5, 0.0, 0.0)
    moved = evaluated(armature)
    expect_different(before, moved)
    world.drag(session, "tip", np.array([0.0, 0.0, 0.001]))
    after = evaluated(armature)
    assert np.abs(after[1] - moved[1]).max() < 0.01
    expect_following(session, armature)
    armature.location = (3.0, 2.0, 1.0)
    bpy.context.view_layer.update()
    world.drag(session, "tip", np.array([-0.2, 0.1, 0.0]))
    expect_following(session, armature)
    tip = armature.matrix_world @ armature.pose.bones["tip"].head
    in_the_servers = session.world_to_server() @ [*tip, 1.0]
    places = world.layfigure.world_poses(session.link.character, session.applied)[1]
    assert np.linalg.norm(in_the_servers[:3] - places[session.bones.joint_of_bone("tip")]) < world.PLACE_TOLERANCE


def two_armatures_are_live_at_once(_: Path) -> None:
    one = world.chain(NAMES)
    bpy.data.objects["skin"].name = "skin of one"
    other = world.chain([name + "2" for name in NAMES])
    first, second = world.start(one), world.start(other)
    assert first.server_pid != second.server_pid
    world.drag(first, "tip", np.array([0.2, 0.3, -0.2]))
    rest = np.array([bone.matrix_local for bone in other.data.bones])
    expect_same(evaluated(other), rest)
    world.drag(second, "tip2", np.array([-0.2, 0.3, -0.2]))
    expect_following(first, one)
    expect_following(second, other)
    first.stop()
    assert sessions.all() == [second]
    world.drag(second, "tip2", np.array([0.2, 0.0, 0.0]))
    expect_following(second, other)


def listeners_hear_of_each_pose(_: Path) -> None:
    heard: list[sessions.Session] = []

    def listener(session: sessions.Session, sample: object) -> None:
        assert sample.pose is not None
        heard.append(session)

    sessions.add_listener(listener)
    armature = world.chain(NAMES)
    session = world.start(armature)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    assert len(heard) > 5
    assert set(heard) == {session}
    sessions.remove_listener(listener)
    count = len(heard)
    world.drag(session, "tip", np.array([-0.2, 0.3, -0.2]))
    assert len(heard) == count


def settings_of_joints_reach_the_server(_: Path) -> None:
    def source(armature: bpy.types.Object) -> sessions.Preparation:
        text = f'[joints."lower"]\nlocked = ["twist", "bend_y", "bend_z"]\n# of {armature.name}\n'
        return functools.partial(text_files.write_settings, text)

    sessions.add_settings_source(source)
    armature = world.chain(NAMES)
    session = world.start(armature)
    world.drag(session, "tip", np.array([0.3, 0.3, -0.4]))
    upper, lower = armature.pose.bones["upper"], armature.pose.bones["lower"]
    between = upper.matrix.inverted() @ lower.matrix
    at_rest = upper.bone.matrix_local.inverted() @ lower.bone.matrix_local
    assert np.abs(np.array(between) - np.array(at_rest)).max() < 1e-4
    sessions.remove_settings_source(source)


def constraints_rest_while_the_doll_is_live(_: Path) -> None:
    armature = world.chain(NAMES)
    moving = constrained(armature)
    before = evaluated(armature)
    session = world.start(armature)
    assert all(item.mute for item in moving)
    world.settle(session)
    expect_same(evaluated(armature), before)
    world.drag(session, "tip", np.array([-0.2, 0.3, -0.1]))
    expect_following(session, armature)
    armature.pose.bones["tip"].name = "end"
    sessions.tick()
    assert not sessions.all()
    assert not any(item.mute for item in moving)
    assert armature.pose.bones["upper"].constraints["Copy Scale"].mute
    assert not any(bone.layfigure.muted for bone in armature.pose.bones)


def undo_goes_through_the_session(_: Path) -> None:
    armature = world.chain(NAMES)
    bpy.ops.ed.undo_push(message="rig")
    session = world.start(armature)
    bpy.ops.ed.undo_push(message="Start")
    pid = session.server_pid
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    session.note_place()
    bpy.ops.ed.undo_push(message="drag")
    posed = evaluated(bpy.data.objects["chain"])
    bpy.ops.ed.undo()
    world.wait(lambda: session.live, "the way back")
    world.settle(session)
    armature = bpy.data.objects["chain"]
    expect_different(evaluated(armature), posed)
    expect_following(session, armature)
    bpy.ops.ed.redo()
    world.wait(lambda: session.live, "the way on")
    world.settle(session)
    expect_same(evaluated(bpy.data.objects["chain"]), posed, SAME_REST)
    bpy.ops.ed.undo()
    bpy.ops.ed.undo()
    sessions.tick()
    assert not sessions.all()
    assert not is_running(pid)
    armature = bpy.data.objects["chain"]
    assert "Start undone" in sessions.last_words(armature)
    bpy.ops.ed.redo()
    sessions.tick()
    armature = bpy.data.objects["chain"]
    assert not armature.layfigure.session
    world.select(armature)
    world.start(armature)


if __name__ == "__main__":
    world.run_scene(globals())
