"""What scenes of keys and of the doll's history share."""

from __future__ import annotations

import bpy
import numpy as np
import world
from layfigure_blender import actions, sessions

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


def place_of(session: sessions.Session) -> int:
    return int(session.link.send("history").result(world.TIMEOUT_S).values("place")[0])
