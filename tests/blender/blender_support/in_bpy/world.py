"""Of tests that run inside Blender's Python: rigs, sessions, and how far armature and doll are apart.

The caller's PYTHONPATH has the client, the extension's folder and this one. Timers do not run in the package bpy: the
tests call what the extension's timer would.
"""

from __future__ import annotations

import math
import os
import random
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import bpy
import layfigure_blender
import numpy as np
from layfigure_blender import pose_writing, sessions
from mathutils import Euler, Quaternion, Vector

import layfigure

TIMEOUT_S = 300.0  # for a machine under load; never waited for in a test that passes
PLACE_TOLERANCE = 1e-5  # [m] of the doll; single precision along a chain of bones takes 1e-6
ANGLE_TOLERANCE = 1e-5  # [rad]


def empty_file() -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)


@contextmanager
def registered() -> Iterator[None]:
    with bpy_on_the_main_thread_alone():
        layfigure_blender.register()
        try:
            yield
        finally:
            layfigure_blender.unregister()


@contextmanager
def bpy_on_the_main_thread_alone() -> Iterator[None]:
    """Fails if a thread that is started meanwhile runs any function of a module that has bpy at hand."""
    seen: set[str] = set()

    def watch(frame: FrameType, event: str, _argument: object) -> None:
        module = frame.f_globals
        name = module.get("__name__", "")
        if event == "call" and ("bpy" in module or name.partition(".")[0] in {"bpy", "mathutils"}):
            seen.add(f"{name}.{frame.f_code.co_name} in {threading.current_thread().name}")

    threading.setprofile(watch)
    try:
        yield
    finally:
        threading.setprofile(None)
    assert not seen, f"not on the main thread: {sorted(seen)}"


def run_scene(scenes: dict[str, Callable[[Path], None]]) -> None:
    """The one that the command line names, in the folder that it names."""
    name, folder = sys.argv[-2:]
    empty_file()
    with registered():
        scenes[name](Path(folder))


def clear() -> None:
    """An empty file, too, but add-ons that were enabled stay so."""
    for kind in (bpy.data.objects, bpy.data.meshes, bpy.data.armatures, bpy.data.materials):
        bpy.data.batch_remove(list(kind))


def select(item: bpy.types.Object) -> None:
    if bpy.context.object is not None and bpy.context.object.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for other in bpy.context.view_layer.objects:
        other.select_set(False)
    item.select_set(True)
    bpy.context.view_layer.objects.active = item


# --- rigs ---


def imported(path: str) -> bpy.types.Object:
    bpy.ops.import_scene.gltf(filepath=path)
    [armature] = [item for item in bpy.data.objects if item.type == "ARMATURE"]
    select(armature)
    return armature


def metarig(kind: str) -> bpy.types.Object:
    """One of Rigify's, `human` or `basic_human`, in a skin of boxes."""
    armature = bare_metarig(kind)
    box_skin(armature)
    select(armature)
    return armature


def bare_metarig(kind: str) -> bpy.types.Object:
    import addon_utils  # on the path once bpy is there

    addon_utils.enable("rigify", default_set=True)
    getattr(bpy.ops.object, f"armature_{kind}_metarig_add")()
    return bpy.context.object


def chain(names: list[str], length: float = 0.3, radius: float = 0.04) -> bpy.types.Object:
    """Bones one behind the other, upwards, in a skin of boxes."""
    armature = bpy.data.objects.new("chain", bpy.data.armatures.new("chain"))
    bpy.context.scene.collection.objects.link(armature)
    select(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    above = None
    for index, name in enumerate(names):
        bone = armature.data.edit_bones.new(name)
        bone.head, bone.tail = (0.0, 0.0, length * index), (0.0, 0.0, length * (index + 1))
        bone.parent, bone.use_connect = above, above is not None
        above = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    box_skin(armature, radius)
    select(armature)
    return armature


def box_skin(armature: bpy.types.Object, radius: float = 0.02) -> bpy.types.Object:
    """A mesh of a box around each deforming bone, which follows that bone alone."""
    points: list[Vector] = []
    faces: list[tuple[int, ...]] = []
    groups: list[tuple[str, range]] = []
    for bone in armature.data.bones:
        if not bone.use_deform:
            continue
        across = min(radius, 0.3 * bone.length)
        first = len(points)
        for along in (0.1 * bone.length, 0.95 * bone.length):
            for x, z in ((-across, -across), (across, -across), (across, across), (-across, across)):
                points.append(bone.matrix_local @ Vector((x, along, z)))
        faces += [tuple(first + corner for corner in face) for face in _BOX]
        groups.append((bone.name, range(first, first + 8)))
    mesh = bpy.data.meshes.new("skin")
    mesh.from_pydata(points, [], faces)
    skin = bpy.data.objects.new("skin", mesh)
    bpy.context.scene.collection.objects.link(skin)
    for name, vertices in groups:
        skin.vertex_groups.new(name=name).add(vertices, 1.0, "REPLACE")
    skin.parent = armature
    skin.modifiers.new("Armature", "ARMATURE").object = armature
    return skin


_BOX = ((3, 2, 1, 0), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def roll_bones(armature: bpy.types.Object, seed: int) -> None:
    """Turns each bone's axes about it by any angle."""
    dice = random.Random(seed)
    select(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    for bone in armature.data.edit_bones:
        bone.roll = dice.uniform(-math.pi, math.pi)
    bpy.ops.object.mode_set(mode="OBJECT")


def place(armature: bpy.types.Object, scale: float = 1.0, *, turned: bool = False, parented: bool = False) -> None:
    armature.rotation_mode = "XYZ"
    armature.scale = (scale, scale, scale)
    if turned:
        armature.rotation_euler = Euler((0.3, -0.5, 1.1))
        armature.location = Vector((0.4, -0.2, 0.3)) * scale
    if parented:
        carrier = bpy.data.objects.new("carrier", None)
        bpy.context.scene.collection.objects.link(carrier)
        carrier.rotation_euler = Euler((-0.2, 0.4, 0.7))
        carrier.location = Vector((-0.3, 0.5, 0.1)) * scale
        armature.parent = carrier
    bpy.context.view_layer.update()


def pose_at_random(armature: bpy.types.Object, names: list[str] | tuple[str, ...], most: float, seed: int) -> None:
    """Turns these bones by angles up to `most` [rad], about any axes, in all rotation modes."""
    dice = random.Random(seed)
    modes = ("QUATERNION", "XYZ", "ZYX", "AXIS_ANGLE")
    for name in names:
        bone = armature.pose.bones[name]
        axis = Vector([dice.gauss(0.0, 1.0) for _ in range(3)])
        turn = Quaternion(axis.normalized(), dice.uniform(-most, most))
        bone.rotation_mode = dice.choice(modes)
        bone.matrix_basis = turn.to_matrix().to_4x4()
    bpy.context.view_layer.update()


# --- sessions ---


def wait(condition: Callable[[], bool], what: str, timeout_s: float = TIMEOUT_S) -> None:
    """Lets the timer's work go on until the condition holds."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        told = [(session.message, session.link and session.link.status) for session in sessions.all()]
        assert time.monotonic() < deadline, f"{what} did not happen: {told}"
        sessions.tick()
        time.sleep(0.002)


def start(armature: bpy.types.Object) -> sessions.Session:
    """The session of a doll that is live."""
    select(armature) if bpy.context.object != armature else None
    assert bpy.ops.layfigure.start() == {"FINISHED"}
    session = sessions.of(armature)
    assert session is not None
    wait(lambda: session.live or session.failed or session not in sessions.all(), "the doll")
    assert session.live, session.message or sessions.last_words(armature)
    return session


def settle(session: sessions.Session, timeout_s: float = TIMEOUT_S) -> None:
    """Until the doll rests, for a while of the simulation, and the pose in which it does has been applied."""
    deadline = time.monotonic() + timeout_s
    now_us = session.link.send("history").result(timeout_s).time_us  # what was sent before has come, poses may lag
    wait(lambda: session.link.newest.pose.time_us >= now_us, "a pose", timeout_s)
    pose = since = session.link.newest.pose
    while pose.time_us - since.time_us < 3e5 or session.applied is None or not _are_same(session.applied, pose):
        assert time.monotonic() < deadline, "the doll did not come to rest"
        sessions.tick()
        pose = session.link.newest.pose
        if not _are_same(pose, since):
            since = pose
        time.sleep(0.005)


def _are_same(a: layfigure.Pose, b: layfigure.Pose) -> bool:
    return np.allclose(a.rotations, b.rotations, rtol=0.0, atol=1e-12) and np.allclose(
        a.root_translation, b.root_translation, rtol=0.0, atol=1e-12
    )


def bones_in_the_servers_world(session: sessions.Session, armature: bpy.types.Object) -> np.ndarray:
    """(B, 4, 4), as Blender has evaluated them."""
    bpy.context.view_layer.update()
    evaluated = armature.evaluated_get(bpy.context.evaluated_depsgraph_get())
    return session.to_server() @ pose_writing.matrices_of(evaluated, session.bones.bones)


def distances_from_the_doll(session: sessions.Session, armature: bpy.types.Object) -> tuple[float, float]:
    """The largest [m, rad] between driven bones and the joints of their names, as layfigure.world_poses() has them."""
    pose = session.applied
    character = session.link.character
    rotations, places = layfigure.world_poses(character, pose)
    rest = rest_pose(character)
    rest_rotations, _ = layfigure.world_poses(character, rest)
    bones = bones_in_the_servers_world(session, armature)
    farthest = widest = 0.0
    for b in session.bones.driven:
        bone = session.bones.bones[b]
        joint = session.bones.joint_of_bone(bone.name)
        farthest = max(farthest, float(np.linalg.norm(bones[b][:3, 3] - places[joint])))
        # turned since the rest pose as the joint is
        motion = bones[b][:3, :3] @ np.linalg.inv((session.bones.to_world @ bone.rest)[:3, :3])
        of_joint = layfigure.rotation.multiply(rotations[joint], layfigure.rotation.conjugate(rest_rotations[joint]))
        of_bone = layfigure.rotation.from_matrix(_nearest_rotation(motion))
        widest = max(widest, float(layfigure.rotation.angle_between(of_bone, of_joint)))
    return farthest, widest


def distances(a: np.ndarray, b: np.ndarray, indices: np.ndarray) -> tuple[float, float]:
    """The largest [m, rad] between bones (B, 4, 4) of two poses."""
    farthest = float(np.linalg.norm(a[indices, :3, 3] - b[indices, :3, 3], axis=1).max())
    turns = [
        layfigure.rotation.angle_between(
            layfigure.rotation.from_matrix(_nearest_rotation(x)), layfigure.rotation.from_matrix(_nearest_rotation(y))
        )
        for x, y in zip(a[indices, :3, :3], b[indices, :3, :3], strict=True)
    ]
    return farthest, float(max(turns))


def rest_pose(character: layfigure.Character) -> layfigure.Pose:
    joints = character.joints
    root = next(joint for joint in joints if joint.parent < 0)
    rotations = np.array([joint.rest_rotation for joint in joints])
    count = len(joints)
    return layfigure.Pose(
        0, 0, 0, 0, 0, root.rest_translation, rotations, rotations, np.zeros((count, 3)), np.zeros(count, np.bool_)
    )


def _nearest_rotation(linear: np.ndarray) -> np.ndarray:
    u, _, vt = np.linalg.svd(linear)
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


def drag(session: sessions.Session, bone: str, by: np.ndarray, seconds: float = 0.6) -> None:
    """Grabs a bone at its joint, leads it away, lets go, and waits until the doll rests.

    `by`: [m] in the server's world; `seconds`: of the simulation, however slow the machine is.
    """
    link = session.link
    places = layfigure.world_poses(link.character, link.newest.pose)[1]
    start_at = places[session.bones.joint_of_bone(bone)]
    link.move_pointer(0, start_at)
    link.send("grab", pointer=0, bone=bone, point=[0.0, 0.0, 0.0]).result(TIMEOUT_S)
    moves = 40
    for move in range(1, moves + 1):
        link.move_pointer(0, start_at + by * (move / moves))
        _let_time_pass(session, seconds / moves)
    _let_time_pass(session, 0.5 * seconds)  # held for a while where it was led to
    link.send("release", pointer=0).result(TIMEOUT_S)
    settle(session)


def _let_time_pass(session: sessions.Session, seconds: float) -> None:
    """Of the simulation, from the newest pose on."""
    begun_us = session.link.newest.pose.time_us
    wait(lambda: session.link.newest.pose.time_us - begun_us >= 1e6 * seconds, "the simulation's going on")


def rig(name: str, glb: str = "") -> bpy.types.Object:
    """One of Rigify's, `metarig` or `basic_metarig`, or what a file holds, by default $LAYFIGURE_TEST_NAME."""
    if name == "metarig":
        return metarig("human")
    if name == "basic_metarig":
        return metarig("basic_human")
    return imported(glb or os.environ[f"LAYFIGURE_TEST_{name.upper()}"])
