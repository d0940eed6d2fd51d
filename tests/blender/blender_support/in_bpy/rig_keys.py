"""Keys, mirror, recording and the fewest keys on a rig of another maker, from Start to the animation without a doll.

python rig_keys.py RIG [GLB]
"""

from __future__ import annotations

import sys
import time

import bpy
import numpy as np
import world
from key_support import MOVED, SAME, curves_of, farthest, poses_of
from layfigure_blender import commands, sessions
from reduction_scenes import skins

from layfigure import Character

TOLERANCE_MM = 2.0  # of the fewest keys, of a body 1.7 m tall
MIRRORED = 0.02  # of the size of the whole: a doll that is put into a mirrored pose comes to rest anew
RECORDED = 12  # frames

Pose = dict[str, np.ndarray]


def hands(session: sessions.Session) -> tuple[str, str]:
    """The bones of both, found by their places: a rig's names are its maker's."""
    names = [name for name in session.bones.driven_names if "hand" in name.lower()]
    heads = {bone.name: bone.rest[:3, 3] for bone in session.bones.bones}
    left = max(names, key=lambda name: heads[name][0])
    right = min(names, key=lambda name: np.linalg.norm(heads[name] * [-1, 1, 1] - heads[left]))
    return left, right


def size_of(character: Character) -> float:
    return float(np.ptp([joint.bind_translation for joint in character.joints], axis=0).max())


def key_on(frame: int, armature: bpy.types.Object) -> Pose:
    """The pose that is keyed there."""
    bpy.context.scene.frame_set(frame)
    pose = poses_of(armature)
    assert bpy.ops.layfigure.key_pose() == {"FINISHED"}
    return pose


def key_and_mirror(session: sessions.Session, armature: bpy.types.Object) -> tuple[Pose, Pose]:
    left, right = hands(session)
    size = size_of(session.link.character)
    at_rest = poses_of(armature)
    world.drag(session, left, size * np.array([-0.05, -0.15, 0.15]))
    lifted = key_on(1, armature)
    assert farthest(at_rest, lifted) > MOVED
    assert bpy.ops.layfigure.mirror(side="both") == {"FINISHED"}
    world.settle(session)
    mirrored = key_on(20, armature)
    for one, other in ((left, right), (right, left)):
        away = mirrored[one][:3, 3] - lifted[other][:3, 3] * [-1, 1, 1]
        assert np.linalg.norm(away) < MIRRORED * size, (one, away)
    keyed = {curve.data_path.split('"')[1] for curve in curves_of(armature)}
    assert set(session.bones.driven_names) <= {bpy.utils.unescape_identifier(name) for name in keyed}
    bpy.context.scene.frame_set(1)
    world.settle(session)
    assert farthest(poses_of(armature), mirrored) < SAME, "while it is live, the doll's pose is shown"
    return lifted, mirrored


def record(session: sessions.Session, armature: bpy.types.Object) -> np.ndarray:
    """Frames 101 and on, while the left hand is led on."""
    left, _ = hands(session)
    link, size = session.link, size_of(session.link.character)
    place = world.layfigure.world_poses(link.character, link.newest.pose)[1][session.bones.joint_of_bone(left)]
    link.move_pointer(0, place)
    link.send("grab", pointer=0, bone=session.link.character.joints[session.bones.joint_of_bone(left)].name).result(
        world.TIMEOUT_S
    )
    frames = np.arange(101, 101 + RECORDED)
    bpy.context.scene.frame_set(int(frames[0]))
    assert bpy.ops.layfigure.record() == {"FINISHED"}
    for k, frame in enumerate(frames):
        link.move_pointer(0, place + size * 0.02 * k * np.array([0.0, -1.0, 0.5]))
        world._let_time_pass(session, 1.0 / 24.0)
        bpy.context.scene.frame_set(int(frame))
        time.sleep(1.0 / 24.0)
    link.send("release", pointer=0).result(world.TIMEOUT_S)
    assert bpy.ops.layfigure.record_stop() == {"FINISHED"}
    return frames


def main(name: str, glb: str = "") -> None:
    commands.REPLY_TIMEOUT_S = world.TIMEOUT_S
    world.empty_file()
    with world.registered():
        armature = world.rig(name, glb)
        session = world.start(armature)
        world.settle(session)
        lifted, mirrored = key_and_mirror(session, armature)
        frames = record(session, armature)
        assert bpy.ops.layfigure.stop() == {"FINISHED"}
        print(f"{name}: {len(armature.data.bones)} bones, {len(session.bones.driven)} of the doll")
        for frame, pose in ((1, lifted), (20, mirrored)):
            bpy.context.scene.frame_set(frame)
            assert farthest(poses_of(armature), pose) < SAME, frame
        before = skins(armature, frames)
        assert np.ptp(before, axis=0).max() > 0.1 * MOVED, "the recording has moved nothing"
        assert bpy.ops.layfigure.reduce_keys(tolerance_mm=TOLERANCE_MM) == {"FINISHED"}
        error = np.linalg.norm(skins(armature, frames) - before, axis=-1).max()
        print(f"fewest keys: the farthest vertex is {1e3 * error:.2f} mm off")
        assert error <= 1e-3 * TOLERANCE_MM


main(*sys.argv[1:])
