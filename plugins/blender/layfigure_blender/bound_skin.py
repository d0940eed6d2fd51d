# SPDX-License-Identifier: GPL-3.0-or-later
"""The skin that an armature moves, as numbers."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from numpy.typing import NDArray

from layfigure import Mesh


class SkinError(Exception):
    """Why there is no skin; one line, with the mend."""


def meshes(armature: bpy.types.Object, bones: Sequence[str], scene: bpy.types.Scene) -> list[Mesh]:
    """Those that the armature deforms or carries, bound as they are modelled, in its space. Raises SkinError."""
    found = [_mesh(each, armature, bones) for each in scene.objects if each.type == "MESH" and _moves(armature, each)]
    if not any(len(mesh.points) for mesh in found):
        raise SkinError(f"No mesh is bound to '{armature.name}', on which a tolerance could be measured")
    return found


def _moves(armature: bpy.types.Object, mesh: bpy.types.Object) -> bool:
    return mesh.find_armature() == armature or _carrier(armature, mesh) != ""


def _carrier(armature: bpy.types.Object, mesh: bpy.types.Object) -> str:
    """The bone that a mesh hangs on as a whole."""
    return mesh.parent_bone if mesh.parent == armature and mesh.parent_type == "BONE" else ""


def _mesh(mesh: bpy.types.Object, armature: bpy.types.Object, bones: Sequence[str]) -> Mesh:
    vertices = mesh.data.vertices
    points = np.empty(3 * len(vertices), np.float32)
    vertices.foreach_get("co", points)
    to_armature = np.array(armature.matrix_world.inverted() @ mesh.matrix_world)
    carrier = _carrier(armature, mesh)
    if carrier in bones:
        posed = armature.pose.bones[carrier].matrix
        rest = armature.data.bones[carrier].matrix_local
        to_armature = np.array(rest @ posed.inverted()) @ to_armature
        joints = np.full((len(vertices), 1), bones.index(carrier))
        weights = np.ones((len(vertices), 1))
    else:
        _require_linear(mesh, armature)
        joints, weights = _groups(mesh, armature, bones)
    sums = weights.sum(axis=1)
    moved = sums > 0.0
    placed = points.reshape(-1, 3).astype(np.float64)[moved] @ to_armature[:3, :3].T + to_armature[:3, 3]
    return Mesh(
        name=mesh.name,
        material=None,
        points=placed.astype(np.float32),
        triangles=np.zeros((0, 3), np.int32),
        joint_indices=joints[moved].astype(np.int32),
        joint_weights=(weights[moved] / sums[moved, None]).astype(np.float32),
        normals=None,
        uvs=None,
        wedges=np.zeros((0, 3), np.int32),
    )


def _require_linear(mesh: bpy.types.Object, armature: bpy.types.Object) -> None:
    for modifier in mesh.modifiers:
        if modifier.type == "ARMATURE" and modifier.object == armature and modifier.use_deform_preserve_volume:
            raise SkinError(
                f"'{mesh.name}' is deformed with Preserve Volume, for which no tolerance is known: switch that off in "
                f"its modifier '{modifier.name}' while keys are reduced"
            )


def _groups(
    mesh: bpy.types.Object, armature: bpy.types.Object, bones: Sequence[str]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Bones and weights (V, K) of vertices that deforming bones move."""
    columns = {name: index for index, name in enumerate(bones) if armature.data.bones[name].use_deform}
    of_group = {group.index: columns[group.name] for group in mesh.vertex_groups if group.name in columns}
    of_vertices = [
        [(of_group[element.group], element.weight) for element in vertex.groups if element.group in of_group]
        for vertex in mesh.data.vertices
    ]
    most = max(map(len, of_vertices), default=0) or 1
    joints, weights = np.zeros((len(of_vertices), most), np.intp), np.zeros((len(of_vertices), most))
    for vertex, own in enumerate(of_vertices):
        for k, (joint, weight) in enumerate(own):
            joints[vertex, k], weights[vertex, k] = joint, weight
    return joints, weights
