"""From the armature to the doll and back, for one rig, at several scales and places, with its bones rolled or not.

    python round_trip.py RIG [GLB]

For each: a pose that is made in Blender and put to the doll, and one that is dragged at the doll and comes to Blender.
"""

from __future__ import annotations

import functools
import sys

import bpy
import numpy as np
import text_files
import world
from layfigure_blender import pose_writing, sessions

MOST_TURN = 0.5  # [rad] of each joint
# What no pose is kept from: it is the way there and back that is tried, and not the doll.
FREE_JOINTS = """[joints."*"]
shape = "none"
limits = {twist = [-180, 180], swing_y = [-180, 180], swing_z = [-180, 180]}
"""
PLACES = (
    {"scale": 1.0, "turned": False, "parented": False, "rolled": False},
    {"scale": 1.0, "turned": True, "parented": True, "rolled": True},
    {"scale": 0.01, "turned": True, "parented": False, "rolled": True},
    {"scale": 100.0, "turned": False, "parented": True, "rolled": True},
)


def metres_per_unit(session: sessions.Session) -> float:
    """Of the armature's own space, in the server's world."""
    return float(np.cbrt(abs(np.linalg.det(session.bones.to_world[:3, :3]))))


def put_a_pose(session: sessions.Session, armature: bpy.types.Object, seed: int) -> None:
    bones = session.bones
    world.pose_at_random(armature, bones.driven_names, MOST_TURN, seed)
    wanted = pose_writing.matrices_of(armature, bones.bones)
    pushed = session.push_pose()
    world.wait(pushed.done, "the pose's arrival")
    pushed.result()
    world.settle(session)
    bpy.context.view_layer.update()
    got = pose_writing.matrices_of(armature, bones.bones)
    away, turned = world.distances(got, wanted, bones.driven)
    check("put, from what was wanted", away * metres_per_unit(session), turned)
    check("put, from the doll", *world.distances_from_the_doll(session, armature))


def drag_a_pose(session: sessions.Session, armature: bpy.types.Object) -> None:
    before = pose_writing.matrices_of(armature, session.bones.bones)
    [hand, *_] = [name for name in session.bones.driven_names if "hand" in name.lower()]
    size = np.ptp([joint.bind_translation for joint in session.link.character.joints], axis=0).max()
    world.drag(session, hand, 0.3 * size * np.array([0.3, -0.8, 0.5]))
    bpy.context.view_layer.update()
    after = pose_writing.matrices_of(armature, session.bones.bones)
    moved, _ = world.distances(before, after, session.bones.driven)
    assert moved * metres_per_unit(session) > 0.01 * size, "the drag has left nothing"
    check("dragged", *world.distances_from_the_doll(session, armature))


def check(what: str, metres: float, radians: float) -> None:
    print(f"  {what}: {metres:.1e} m, {radians:.1e} rad")
    assert metres < world.PLACE_TOLERANCE, what
    assert radians < world.ANGLE_TOLERANCE, what


def try_place(name: str, glb: str, number: int, setting: dict) -> None:
    print(name, setting)
    world.clear()
    armature = world.rig(name, glb)
    if setting["rolled"]:
        world.roll_bones(armature, number)
    world.place(armature, setting["scale"], turned=setting["turned"], parented=setting["parented"])
    session = world.start(armature)
    world.settle(session)
    check("rest", *world.distances_from_the_doll(session, armature))
    put_a_pose(session, armature, 10 + number)
    drag_a_pose(session, armature)
    session.stop()


def main(name: str, glb: str = "") -> None:
    world.empty_file()
    with world.registered():
        sessions.add_settings_source(lambda _: functools.partial(text_files.write_settings, FREE_JOINTS))
        for number, setting in enumerate(PLACES):
            try_place(name, glb, number, setting)


main(*sys.argv[1:])
