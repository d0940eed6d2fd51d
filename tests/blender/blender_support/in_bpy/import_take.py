"""Runs inside Blender's own Python (package bpy): imports a USD file as its users do, and tells what it became.

    python import_take.py TAKE.usd OUT.npz

OUT.npz holds, in Blender's world, which is in metres and Z up: `bones` (J) names, `heads` (F, J, 3), `meshes` (M)
names, and for each mesh `vertices_M` (F, V, 3) as its modifiers leave them.
"""

import sys

import bpy
import numpy as np


def only(kind: str) -> list:
    return sorted((o for o in bpy.context.scene.objects if o.type == kind), key=lambda o: o.name)


def to_world(matrix: object, points: np.ndarray) -> np.ndarray:
    world = np.array(matrix)
    return points @ world[:3, :3].T + world[:3, 3]


def head_positions(armature: object) -> np.ndarray:
    return to_world(armature.matrix_world, np.array([bone.head for bone in armature.pose.bones]))


def skinned_vertices(mesh: object) -> np.ndarray:
    evaluated = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    vertices = evaluated.to_mesh().vertices
    flat = np.empty(3 * len(vertices), np.float32)
    vertices.foreach_get("co", flat)
    evaluated.to_mesh_clear()
    return to_world(evaluated.matrix_world, flat.reshape(-1, 3).astype(np.float64))


def main(path: str, out: str) -> None:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.usd_import(filepath=path)
    scene = bpy.context.scene
    [armature] = only("ARMATURE")
    meshes = only("MESH")
    heads, vertices = [], [[] for _ in meshes]
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        heads.append(head_positions(armature))
        for mesh, of_mesh in zip(meshes, vertices, strict=True):
            of_mesh.append(skinned_vertices(mesh))
    np.savez(
        out,
        bones=np.array([bone.name for bone in armature.pose.bones]),
        heads=np.array(heads),
        meshes=np.array([mesh.name for mesh in meshes]),
        **{f"vertices_{index}": np.array(of_mesh) for index, of_mesh in enumerate(vertices)},
    )


main(*sys.argv[-2:])
