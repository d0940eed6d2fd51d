"""What may happen to a session in Blender, one scene in each process.

python session_scenes.py NAME FOLDER
"""

from __future__ import annotations

import functools
import os
import signal
import sys
from pathlib import Path

import bpy
import layfigure_blender
import numpy as np
import text_files
import world
from layfigure_blender import blender_events, sessions
from mathutils import Euler, Matrix, Vector

SAME_POSE = 1e-5  # [m], and entries of rotations
# Likewise, of a doll that slept and was woken: asleep, each of its joints may be 1e-5 rad from where it comes to rest.
SAME_REST = 1e-4
NAMES = ["root", "upper", "lower", "tip"]


def evaluated(armature: bpy.types.Object) -> np.ndarray:
    bpy.context.view_layer.update()
    return np.array([bone.matrix for bone in armature.pose.bones])


def expect_same(a: np.ndarray, b: np.ndarray, tolerance: float = SAME_POSE) -> None:
    assert np.abs(a - b).max() < tolerance, np.abs(a - b).max()


def expect_different(a: np.ndarray, b: np.ndarray) -> None:
    assert np.abs(a - b).max() > 0.02, np.abs(a - b).max()


def expect_following(session: sessions.Session, armature: bpy.types.Object) -> None:
    metres, radians = world.distances_from_the_doll(session, armature)
    assert metres < world.PLACE_TOLERANCE, metres
    assert radians < world.ANGLE_TOLERANCE, radians


def is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def start_fails(armature: bpy.types.Object | None, *words: str) -> None:
    said = ""
    try:
        bpy.ops.layfigure.start()
    except RuntimeError as error:
        said = str(error)
    assert said, "it started"
    assert all(word.lower() in said.lower() for word in words), said
    assert not sessions.all()
    assert armature is None or not armature.layfigure.session


def data_counts() -> dict[str, int]:
    kinds = ("objects", "meshes", "armatures", "scenes", "actions", "collections", "materials", "shape_keys")
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


# --- what start() takes, and leaves as it was ---


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


# --- the live pose ---


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


# --- constraints and drivers ---


def constrained(armature: bpy.types.Object) -> list:
    """What moves driven bones: their own constraints, a chain that ends below them, a driver."""
    target = bpy.data.objects.new("target", None)
    bpy.context.scene.collection.objects.link(target)
    target.location = (0.5, 0.0, 0.8)
    reach = armature.pose.bones["tip"].constraints.new("IK")
    reach.target, reach.chain_count = target, 2
    copy = armature.pose.bones["upper"].constraints.new("COPY_ROTATION")
    copy.target, copy.influence = target, 0.3
    muted = armature.pose.bones["upper"].constraints.new("COPY_SCALE")
    muted.mute = True
    curve = armature.pose.bones["root"].driver_add("rotation_quaternion", 1)
    curve.driver.expression = "0.1"
    bpy.context.view_layer.update()
    return [reach, copy, curve]


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


def file_that_is_saved_meanwhile_has_its_constraints(folder: Path) -> None:
    armature = world.chain(NAMES)
    moving = constrained(armature)
    session = world.start(armature)
    path = folder / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert all(item.mute for item in moving), "the doll is still live"
    pid = session.server_pid
    world.drag(session, "tip", np.array([-0.2, 0.3, -0.1]))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert not sessions.all()
    assert not is_running(pid)
    armature = bpy.data.objects["chain"]
    expect_released(armature)
    sessions.tick()
    world.drag(world.start(armature), "tip", np.array([-0.2, 0.3, -0.1]))


def expect_released(armature: bpy.types.Object) -> None:
    muted = [c.name for bone in armature.pose.bones for c in bone.constraints if c.mute]
    assert muted == ["Copy Scale"], muted
    assert not any(curve.mute for curve in armature.animation_data.drivers)
    assert not armature.layfigure.session
    assert not any(bone.layfigure.muted for bone in armature.pose.bones)


def file_of_a_crash_is_mended_when_it_is_loaded(folder: Path) -> None:
    """Blender's autosave runs no handlers."""
    armature = world.chain(NAMES)
    constrained(armature)
    world.start(armature)
    path = folder / "autosaved.blend"
    bpy.app.handlers.save_pre.remove(blender_events._before_saving)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    bpy.app.handlers.save_pre.append(blender_events._before_saving)
    bpy.ops.wm.open_mainfile(filepath=str(path))
    expect_released(bpy.data.objects["chain"])


# --- what goes wrong ---


def server_that_is_killed_is_told_and_started_again(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    posed = evaluated(armature)
    os.kill(session.server_pid, signal.SIGKILL)
    world.wait(lambda: session.failed, "the loss")
    world.wait(lambda: "killed by signal 9" in session.message, "the reason")
    assert "Reconnect" in session.message
    for _ in range(5):
        sessions.tick()
    expect_same(evaluated(armature), posed)
    assert bpy.ops.layfigure.reconnect() == {"FINISHED"}
    world.wait(lambda: session.live, "the doll")
    world.settle(session)
    expect_same(evaluated(armature), posed)
    world.drag(session, "tip", np.array([-0.2, 0.1, -0.2]))
    expect_following(session, armature)


def server_that_is_killed_while_it_loads_ends_the_start(_: Path) -> None:
    armature = world.chain(NAMES)
    assert bpy.ops.layfigure.start() == {"FINISHED"}
    os.kill(sessions.of(armature).server_pid, signal.SIGKILL)
    world.wait(lambda: not sessions.all(), "the end")
    assert "killed by signal 9" in sessions.last_words(armature)
    world.start(armature)


def armature_that_is_deleted_ends_the_session(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    pid = session.server_pid
    bpy.data.objects.remove(armature)
    sessions.tick()
    assert not sessions.all()
    assert not is_running(pid)
    armature = world.chain([name + "2" for name in NAMES])
    session = world.start(armature)
    bpy.context.scene.collection.objects.unlink(armature)
    sessions.tick()
    assert not sessions.all()


def armature_that_is_renamed_goes_on(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    armature.name = "another"
    bpy.data.objects.new("chain", None)
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    expect_following(session, armature)
    assert sessions.of(armature) is session


def duplicate_of_an_armature_is_free(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    bpy.ops.object.duplicate()
    double = bpy.context.object
    assert double != armature
    assert sessions.of(double) is None
    world.drag(session, "tip", np.array([0.2, 0.3, -0.2]))
    expect_following(session, armature)
    rest = np.array([bone.matrix_local for bone in double.data.bones])
    expect_same(evaluated(double), rest)
    session.stop()
    assert not double.layfigure.session


def bones_that_are_edited_end_the_session(_: Path) -> None:
    armature = world.chain(NAMES)
    world.start(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    for _ in range(5):
        sessions.tick()
    bpy.ops.object.mode_set(mode="OBJECT")
    sessions.tick()
    assert len(sessions.all()) == 1, "nothing was edited"
    bpy.ops.object.mode_set(mode="EDIT")
    sessions.tick()
    armature.data.edit_bones["tip"].roll += 0.5
    bpy.ops.object.mode_set(mode="OBJECT")
    sessions.tick()
    assert not sessions.all()
    assert "bones were edited" in sessions.last_words(armature)
    world.start(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones.remove(armature.data.edit_bones["tip"])
    bpy.ops.object.mode_set(mode="OBJECT")
    sessions.tick()
    assert not sessions.all()


def file_that_is_loaded_anew_ends_the_session(_: Path) -> None:
    armature = world.chain(NAMES)
    session = world.start(armature)
    pid, folder = session.server_pid, session.character.parent
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not sessions.all()
    assert not is_running(pid)
    assert not folder.exists()
    assert sessions.tick() is None
    world.start(world.chain(NAMES))


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


def extension_that_is_unregistered_ends_all(_: Path) -> None:
    armature = world.chain(NAMES)
    moving = constrained(armature)
    pid = world.start(armature).server_pid
    layfigure_blender.unregister()
    assert not is_running(pid)
    assert not any(item.mute for item in moving)
    layfigure_blender.register()
    assert not armature.layfigure.session
    world.start(armature)


def registration_leaves_nothing_behind(_: Path) -> None:
    layfigure_blender.unregister()
    before = traces()
    for _ in range(3):
        layfigure_blender.register()
        assert traces() != before
        layfigure_blender.unregister()
        assert traces() == before
    layfigure_blender.register()


def traces() -> dict:
    handlers = {
        name: [str(handler) for handler in getattr(bpy.app.handlers, name)]
        for name in dir(bpy.app.handlers)
        if isinstance(getattr(bpy.app.handlers, name), list)
    }
    types = [item for name in dir(bpy.types) if isinstance(item := getattr(bpy.types, name), type)]
    subclasses = {cls.__name__ for base in (bpy.types.Operator, bpy.types.Panel) for cls in base.__subclasses__()}
    return {
        "types": sorted(dir(bpy.types)),
        "attributes": sorted(
            (cls.__name__, name) for cls in types for name in vars(cls) if name.startswith("layfigure")
        ),
        "properties": sorted(
            (cls.__name__, name)
            for cls in types
            if hasattr(cls, "bl_rna")
            for name in cls.bl_rna.properties.keys()  # noqa: SIM118
            if "layfigure" in name
        ),
        "operators": [name for name in dir(bpy.ops) if "layfigure" in name and dir(getattr(bpy.ops, name))],
        "registered": sorted(name for name in subclasses if hasattr(bpy.types, name) and "LAYFIGURE" in name),
        "handlers": handlers,
        "timer": bpy.app.timers.is_registered(sessions.tick),
        "listeners": [len(sessions._listeners), len(sessions._settings_sources)],
    }


def main(name: str, folder: str) -> None:
    world.empty_file()
    with world.registered():
        globals()[name](Path(folder))


main(*sys.argv[1:])
