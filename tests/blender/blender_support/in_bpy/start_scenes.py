"""What a session begins with, one scene in each process.

python start_scenes.py NAME FOLDER
"""

from __future__ import annotations

import os
from pathlib import Path

import bpy
import numpy as np
import world
from layfigure_blender import sessions
from mathutils import Matrix, Vector
from session_support import NAMES, data_counts, evaluated, expect_following, expect_same, start_fails


def export_leaves_everything_as_it_was(_: Path) -> None:
    armature = world.chain(NAMES)
    skin = bpy.data.objects["skin"]
    world.pose_at_random(armature, NAMES, 0.4, 1)
    skin.select_set(True)
    bpy.context.scene.frame_set(17)
    bpy.ops.object.mode_set(mode="POSE")
    before = evaluated(armature)
    counts = data_counts()
    selected = {item.name: item.select_get() for item in bpy.context.scene.objects}
    scene = bpy.context.window.scene
    assert bpy.ops.layfigure.start() == {"FINISHED"}
    assert data_counts() == counts
    assert {item.name: item.select_get() for item in bpy.context.scene.objects} == selected
    assert bpy.context.window.scene == scene
    assert bpy.context.object == armature
    assert armature.mode == "POSE"
    assert bpy.context.scene.frame_current == 17
    assert armature.data.pose_position == "POSE"
    assert [m.show_viewport for m in skin.modifiers] == [True]
    expect_same(evaluated(armature), before)
    session = sessions.of(armature)
    world.wait(lambda: session.live, "the doll")
    assert armature.mode == "POSE"
    expect_same(evaluated(armature), before)
    assert sessions.of(skin) is session


def start_leaves_the_mesh_in_its_mode(_: Path) -> None:
    """From a mesh that is being edited or painted; what is being edited is in what is exported."""
    armature = world.chain(NAMES)
    skin = bpy.data.objects["skin"]
    for mode in ("WEIGHT_PAINT", "EDIT", "SCULPT"):
        world.select(skin)
        bpy.ops.object.mode_set(mode=mode)
        assert bpy.ops.layfigure.start() == {"FINISHED"}
        assert skin.mode == mode
        assert bpy.context.object == skin
        session = sessions.active(bpy.context)
        assert session is sessions.of(armature)
        world.wait(lambda session=session: session.live, "the doll")
        assert skin.mode == mode
        assert bpy.ops.layfigure.stop() == {"FINISHED"}
        bpy.ops.object.mode_set(mode="OBJECT")


def names_of_bones_stay(_: Path) -> None:
    """Whatever else has the name, and in whatever script it is written."""
    names = ["Wurzel", "Öberarm.L", "前腕.L", 'a "quoted" / name', "skin"]
    armature = world.chain(names)
    armature.name = "Wurzel"
    armature.data.name = "前腕.L"
    bpy.data.objects["skin"].data.name = "Öberarm.L"
    bpy.data.objects.new('a "quoted" / name', None)
    session = world.start(armature)
    assert {joint.name for joint in session.link.character.joints} >= set(names)
    assert set(session.bones.driven_names) == set(names)
    world.drag(session, "skin", np.array([0.2, 0.3, -0.2]))
    expect_following(session, armature)


def bones_without_weights_ride_along(_: Path) -> None:
    armature = world.chain(NAMES)
    world.select(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    for name, parent, head in (("target", None, (1.0, 0.0, 0.0)), ("leaf", "tip", (0.0, 0.0, 1.3))):
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail = head, Vector(head) + Vector((0.0, 0.0, 0.2))
        bone.parent = armature.data.edit_bones[parent] if parent else None
        bone.use_deform = False
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.pose.bones["target"].location = (0.1, 0.2, 0.3)
    armature.pose.bones["leaf"].rotation_quaternion = (0.8, 0.6, 0.0, 0.0)
    session = world.start(armature)
    assert set(session.bones.driven_names) == set(NAMES)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    expect_following(session, armature)
    assert armature.pose.bones["target"].location == Vector((0.1, 0.2, 0.3))
    assert tuple(armature.pose.bones["leaf"].rotation_quaternion) == tuple(np.float32([0.8, 0.6, 0.0, 0.0]))


def meshes_that_hang_on_bones_are_its_skin(_: Path) -> None:
    """As a robot's parts do: parented to bones, in a pose other than the rest pose, one on another."""
    armature = world.chain(NAMES)
    bpy.data.objects.remove(bpy.data.objects["skin"])
    for index, name in enumerate(NAMES):
        mesh = bpy.data.meshes.new(name)
        corners = [(x, y, z) for x in (-0.04, 0.04) for y in (-0.28, -0.02) for z in (-0.04, 0.04)]
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        mesh.from_pydata(corners, [], faces)
        part = bpy.data.objects.new(f"part {index}", mesh)
        bpy.context.scene.collection.objects.link(part)
        part.parent, part.parent_type, part.parent_bone = armature, "BONE", name
    knob = bpy.data.objects.new("knob", bpy.data.meshes["tip"])
    bpy.context.scene.collection.objects.link(knob)
    knob.parent = bpy.data.objects["part 3"]
    knob.location = (0.0, 0.1, 0.0)
    world.pose_at_random(armature, NAMES, 0.4, 1)
    session = world.start(armature)
    assert set(session.bones.driven_names) == set(NAMES)
    world.settle(session)
    expect_following(session, armature)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    expect_following(session, armature)


def what_cannot_be_a_doll_is_refused(_: Path) -> None:
    armature = world.chain(NAMES)
    skin = bpy.data.objects["skin"]
    world.select(armature)
    armature.scale = (1.0, 1.0, 1.2)
    bpy.context.view_layer.update()
    start_fails(armature, "scaled unevenly", "apply its scale")
    armature.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    skin.hide_set(True)
    start_fails(armature, "are hidden")
    skin.hide_set(False)
    groups = {group.name: [v.index for v in skin.data.vertices] for group in skin.vertex_groups}
    skin.vertex_groups.clear()
    start_fails(armature, "have no weights", "With Automatic Weights")
    skin.modifiers.clear()
    skin.parent = None
    start_fails(armature, "no mesh is bound to 'chain'")
    armature.data.pose_position = "REST"
    start_fails(armature, "switch to Pose Position")
    armature.data.pose_position = "POSE"
    bpy.ops.object.mode_set(mode="EDIT")
    start_fails(armature, "leave edit mode")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert groups
    os.environ["PATH"] = "/nowhere"
    start_fails(armature, "not on PATH", "preferences")
    world.select(skin)
    assert not bpy.ops.layfigure.start.poll()


def rig_of_controls_is_refused(_: Path) -> None:
    """Those that Rigify generates, of which the doll would be in pieces; the way out that is told is one."""
    for kind in ("basic_human", "human", "horse"):
        world.clear()
        metarig = world.bare_metarig(kind)
        assert bpy.ops.pose.rigify_generate() == {"FINISHED"}
        rig = bpy.context.object
        assert rig != metarig
        skin = world.box_skin(rig)
        world.select(rig)
        start_fails(rig, "'rig' is a rig of controls", "such as 'DEF-", "constraints move", "Rigify's metarig")
        for bone in rig.pose.bones:
            for constraint in bone.constraints:
                constraint.mute = True  # which puts it together no better
        start_fails(rig, "'rig' is a rig of controls")
        world.select(metarig)
        skin.select_set(True)
        assert bpy.ops.object.parent_set(type="ARMATURE_AUTO") == {"FINISHED"}
        session = world.start(metarig)
        world.settle(session)
        expect_following(session, metarig)
        session.stop()


def parts_that_constraints_keep_in_place_are_taken(_: Path) -> None:
    """As a shield is kept in a hand; and what hangs together in no way at all."""
    armature = world.chain([*NAMES, "holder", "shield", "loose"])
    bpy.ops.object.mode_set(mode="EDIT")
    bones = armature.data.edit_bones
    for name in ("holder", "loose"):
        bones[name].use_connect, bones[name].parent = False, None
    bpy.ops.object.mode_set(mode="OBJECT")
    armature.data.bones["holder"].use_deform = False
    hold = armature.pose.bones["holder"].constraints.new("COPY_ROTATION")
    hold.target, hold.subtarget = armature, "tip"
    session = world.start(armature)
    assert set(session.bones.driven_names) > set(NAMES)
    session.stop()


def server_that_fails_says_why(folder: Path) -> None:
    program = folder / "layfigure-server"
    program.write_text("#!/bin/sh\necho 'layfigure-server: the character has no bones' >&2\nexit 1\n")
    program.chmod(0o755)
    os.environ["PATH"] = f"{folder}:/bin:/usr/bin"
    armature = world.chain(NAMES)
    assert bpy.ops.layfigure.start() == {"FINISHED"}
    world.wait(lambda: not sessions.all(), "the end")
    assert sessions.last_words(armature) == "the character has no bones"
    assert not armature.layfigure.session


def start_keeps_the_pose(_: Path) -> None:
    """Also that of a root that was moved and turned, of scaled bones, and of what constraints do."""
    armature = world.chain(NAMES)
    world.pose_at_random(armature, NAMES, 0.4, 3)
    armature.pose.bones["root"].location = (0.1, -0.2, 0.3)
    armature.pose.bones["tip"].scale = (1.2, 1.2, 1.2)
    turn = armature.pose.bones["lower"].constraints.new("LIMIT_ROTATION")
    turn.use_limit_x, turn.min_x, turn.max_x, turn.owner_space = True, 0.3, 0.5, "LOCAL"
    before = evaluated(armature)
    session = world.start(armature)
    assert turn.mute
    world.settle(session)
    expect_same(evaluated(armature), before)
    session.stop()
    assert not turn.mute


def bones_that_constraints_move_carry_the_doll(_: Path) -> None:
    """Above its root constraints go on; between its bones they rest, as they would move what the doll holds."""
    for name, rests in (("control", False), ("lower", True)):
        world.clear()
        armature = world.chain(["control", *NAMES])
        bpy.ops.object.mode_set(mode="EDIT")
        armature.data.edit_bones["root"].use_connect = False  # a doll's root gives way where it is pinned
        bpy.ops.object.mode_set(mode="OBJECT")
        armature.data.bones["control"].use_deform = armature.data.bones[name].use_deform = False
        target = bpy.data.objects.new("target", None)
        bpy.context.scene.collection.objects.link(target)
        target.rotation_euler = (0.3, 0.2, 0.1)
        turn = armature.pose.bones[name].constraints.new("COPY_ROTATION")
        turn.target = target
        before = evaluated(armature)
        session = world.start(armature)
        assert set(session.bones.driven_names) == set(NAMES) - {name}
        assert turn.mute == rests
        world.settle(session)
        if not rests:
            expect_same(evaluated(armature), before)
        expect_following(session, armature)
        target.rotation_euler = (0.6, 0.1, -0.4)
        bpy.context.view_layer.update()
        world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
        expect_following(session, armature)
        session.stop()
        assert not turn.mute


def running_server_is_joined(folder: Path) -> None:
    """That of another program, with an armature that was imported and moved."""
    first = world.chain(NAMES)
    session = world.start(first)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    url = session.link.url
    second = first.copy()
    bpy.context.scene.collection.objects.link(second)
    second.layfigure.session = ""
    second.matrix_world = Matrix.Translation((2.0, 1.0, 0.0)) @ Matrix.Rotation(0.7, 4, "Z") @ Matrix.Scale(3.0, 4)
    bpy.context.view_layer.update()
    joined = sessions.Session(second, np.array(second.matrix_world))
    joined._connect(url)
    second.layfigure.session = joined.id
    sessions._sessions[joined.id] = joined
    world.wait(lambda: joined.live, "the other's doll")
    world.drag(joined, "tip", np.array([-0.2, 0.3, 0.1]))
    expect_following(joined, second)
    expect_following(session, first)
    joined.stop()
    world.drag(session, "tip", np.array([0.1, 0.0, 0.0]))
    expect_following(session, first)


if __name__ == "__main__":
    world.run_scene(globals())
