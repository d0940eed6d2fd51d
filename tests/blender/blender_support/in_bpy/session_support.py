"""What scenes of sessions share."""

from __future__ import annotations

import os

import bpy
import numpy as np
import world
from layfigure_blender import sessions

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


def expect_released(armature: bpy.types.Object) -> None:
    muted = [c.name for bone in armature.pose.bones for c in bone.constraints if c.mute]
    assert muted == ["Copy Scale"], muted
    assert not any(curve.mute for curve in armature.animation_data.drivers)
    assert not armature.layfigure.session
    assert not any(bone.layfigure.muted for bone in armature.pose.bones)
