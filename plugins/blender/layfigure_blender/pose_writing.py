# SPDX-License-Identifier: GPL-3.0-or-later
"""Pose bones read and written. Nothing is keyed: writing to a bone's properties never does."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable

import bpy
import numpy as np
from mathutils import Matrix, Quaternion

from .rig import Bone, BoneMap, Floats

_TRANSFORM_PATH = re.compile(r'pose\.bones\["(?P<bone>(?:[^"\\]|\\.)*)"\]\.(?P<channel>location|rotation_\w+|scale)')


def bones_of(armature: bpy.types.Object) -> tuple[Bone, ...]:
    """The bones in their rest pose, parents first."""
    bones = list(armature.data.bones)
    order = {bone.name: index for index, bone in enumerate(bones)}
    return tuple(
        Bone(bone.name, order[bone.parent.name] if bone.parent else -1, np.array(bone.matrix_local)) for bone in bones
    )


def is_selected(bone: bpy.types.PoseBone) -> bool:
    """Blender 5 keeps that in the pose bone, earlier ones in the bone."""
    return bool(bone.select if hasattr(bone, "select") else bone.bone.select)


def matrices_of(armature: bpy.types.Object, bones: Iterable[Bone]) -> Floats:
    """(B, 4, 4), bone -> armature, as the bones stand, with their constraints. Raises KeyError if one is missing."""
    return np.array([armature.pose.bones[bone.name].matrix for bone in bones])


def write(armature: bpy.types.Object, bones: BoneMap, matrices: Floats) -> None:
    """Puts the driven bones where `matrices` (B, 4, 4) have them; other bones keep their own channels. Those above the
    doll stand where they were evaluated, with their constraints.

    Rotation and, unless the bone is connected, location are written, in the bone's rotation mode and with its ways of
    inheriting; its scale stays. Raises KeyError if a bone is missing.
    """
    driven = set(bones.driven.tolist())
    actual: list[Matrix] = []
    for index, bone in enumerate(bones.bones):
        pose_bone = armature.pose.bones[bone.name]
        if index not in bones.moved:
            actual.append(pose_bone.matrix.copy())
            continue
        rest = pose_bone.bone
        above = {}
        if bone.parent >= 0:
            above = {
                "parent_matrix": actual[bone.parent],
                "parent_matrix_local": armature.data.bones[bones.bones[bone.parent].name].matrix_local,
            }
        if index in driven:
            wanted = Matrix(matrices[index].tolist())
            _write_channels(pose_bone, rest.convert_local_to_pose(wanted, rest.matrix_local, invert=True, **above))
        actual.append(rest.convert_local_to_pose(pose_bone.matrix_basis, rest.matrix_local, **above))


def _write_channels(bone: bpy.types.PoseBone, basis: Matrix) -> None:
    location, rotation, _ = basis.decompose()
    if not bone.bone.use_connect:
        bone.location = location
    if bone.rotation_mode == "QUATERNION":
        rotation.make_compatible(bone.rotation_quaternion)
        bone.rotation_quaternion = rotation
    elif bone.rotation_mode == "AXIS_ANGLE":
        bone.rotation_axis_angle = _axis_angle(rotation)
    else:
        bone.rotation_euler = rotation.to_euler(bone.rotation_mode, bone.rotation_euler)


def _axis_angle(rotation: Quaternion) -> tuple[float, float, float, float]:
    """Exact for small angles, too, of which the cosine in single precision knows little."""
    sine = math.hypot(rotation.x, rotation.y, rotation.z)
    if sine == 0.0:
        return 0.0, 0.0, 1.0, 0.0
    return 2.0 * math.atan2(sine, rotation.w), rotation.x / sine, rotation.y / sine, rotation.z / sine


def parent_matrix(armature: bpy.types.Object, bones: BoneMap) -> Matrix:
    """Where the parent of the doll's root was evaluated, with its constraints; (4, 4) of none: identity."""
    above = bones.bones[bones.root].parent
    return armature.pose.bones[bones.bones[above].name].matrix.copy() if above >= 0 else Matrix()


def mute(armature: bpy.types.Object, bones: BoneMap) -> None:
    """Takes constraints and drivers off the bones that the doll holds, off others that it carries what would tear the
    skin from it, and notes in the bones which they were.

    It may be repeated.
    """
    held, moved = set(bones.holding_names), {bones.bones[b].name for b in bones.moved}
    for bone in armature.pose.bones:
        muted = _noted(bone)
        for constraint in bone.constraints:
            if not constraint.mute and (_reaches(bone, constraint, held) or _takes_away(bone, constraint, moved)):
                constraint.mute = True
                muted.append(["constraint", constraint.name])
        _note(bone, muted)
    for curve in armature.animation_data.drivers if armature.animation_data else ():
        path = _TRANSFORM_PATH.fullmatch(curve.data_path)
        name = bpy.utils.unescape_identifier(path["bone"]) if path else None
        if name in held and not curve.mute and name in armature.pose.bones:
            curve.mute = True
            bone = armature.pose.bones[name]
            _note(bone, [*_noted(bone), ["driver", path["channel"], curve.array_index]])


def unmute(armature: bpy.types.Object) -> None:
    """Undoes mute(), also that of a session that is long over."""
    if armature.pose is None:
        return
    drivers = list(armature.animation_data.drivers) if armature.animation_data else []
    for bone in armature.pose.bones:
        for kind, name, *rest in _noted(bone):
            if kind == "constraint" and name in bone.constraints:
                bone.constraints[name].mute = False
            elif kind == "driver":
                path = bone.path_from_id(name)
                for curve in drivers:
                    if curve.data_path == path and [curve.array_index] == rest:
                        curve.mute = False
        _note(bone, [])


def _reaches(bone: bpy.types.PoseBone, constraint: bpy.types.Constraint, held: set[str]) -> bool:
    """Whether it moves a held bone: chains of inverse kinematics move what is above them."""
    if bone.name in held:
        return True
    if constraint.type not in {"IK", "SPLINE_IK"}:
        return False
    length = constraint.chain_count or len(bone.parent_recursive) + 1
    return any(above.name in held for above in bone.parent_recursive[: length - 1])


def _takes_away(bone: bpy.types.PoseBone, constraint: bpy.types.Constraint, moved: set[str]) -> bool:
    """Whether it puts skin that the doll carries where something is that the doll does not carry."""
    if constraint.type != "COPY_TRANSFORMS" or bone.name not in moved or not bone.bone.use_deform:
        return False
    return constraint.target != bone.id_data or constraint.subtarget not in moved


def _noted(bone: bpy.types.PoseBone) -> list[list]:
    return json.loads(bone.layfigure.muted) if bone.layfigure.muted else []


def _note(bone: bpy.types.PoseBone, muted: list[list]) -> None:
    text = json.dumps(muted, ensure_ascii=False) if muted else ""
    if bone.layfigure.muted != text:
        bone.layfigure.muted = text
