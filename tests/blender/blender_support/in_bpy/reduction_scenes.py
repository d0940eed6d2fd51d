"""Keys that are reduced to the fewest, in Blender's own Python.

python reduction_scenes.py NAME FOLDER
"""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np
import world
from key_support import KEYED_MODES, curves_of, is_refused, snapshot_of_curves
from layfigure_blender import actions

from layfigure import rotation


def reduced_keys_hold_the_tolerance(_: Path) -> None:
    """Of the skin as Blender itself evaluates it, in every frame."""
    for modes in ({}, KEYED_MODES, dict.fromkeys(("upper_arm.L", "hand.L", "chest"), "YZX")):
        for scale, tolerance_mm in ((1.0, 0.5), (0.1, 0.2), (30.0, 20.0)):
            reduce_one(modes, scale, tolerance_mm)


def reduce_one(modes: dict[str, str], scale: float, tolerance_mm: float) -> None:
    world.empty_file()
    armature = world.rig("doll")
    world.place(armature, scale, turned=True)
    for name, mode in modes.items():
        armature.pose.bones[name].rotation_mode = mode
    frames = np.arange(1.0, 121.0)
    animate(armature, frames)
    before = skins(armature, frames)
    assert bpy.ops.layfigure.reduce_keys(tolerance_mm=tolerance_mm) == {"FINISHED"}
    after = skins(armature, frames)
    error = float(np.linalg.norm(after - before, axis=-1).max())
    counts = sorted({len(curve.keyframe_points) for curve in curves_of(armature)})
    named = sorted(set(modes.values()))
    print(f"scale {scale:g}, modes {named}: {counts[-1]} keys, {1e3 * error:.3f} mm of {tolerance_mm:g}")
    assert error <= 1e-3 * tolerance_mm
    assert error > 0.3e-3 * tolerance_mm, "it is the fewest, so it comes near to the tolerance"
    assert counts[-1] < 60
    kinds = {key.interpolation for curve in curves_of(armature) for key in curve.keyframe_points}
    assert kinds == {"LINEAR"}


def animate(armature: bpy.types.Object, frames: np.ndarray) -> None:
    dice = np.random.default_rng(5)
    curves = actions.BoneCurves.ensure(armature)
    seconds = frames / 24.0
    for bone in armature.pose.bones:
        axis = dice.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = dice.uniform(0.2, 0.9) * np.sin(dice.uniform(0.2, 1.0) * seconds + dice.uniform(0.0, 6.0))
        turns = rotation.from_vector(angle[:, None] * axis + 0.1 * np.sin(seconds)[:, None])
        actions.write(curves, bone, actions.rotation_numbers(curves, bone, turns, frames[0]), frames)
    root = next(bone for bone in armature.pose.bones if bone.parent is None)
    path = 0.2 * np.stack([np.sin(seconds), seconds / 5.0, np.cos(seconds)], axis=1)
    actions.write(curves, root, {"location": path}, frames)


def skins(armature: bpy.types.Object, frames: np.ndarray) -> np.ndarray:
    """(F, V, 3) in the world."""
    result = []
    for frame in frames:
        bpy.context.scene.frame_set(int(frame))
        graph = bpy.context.evaluated_depsgraph_get()
        points = []
        for item in bpy.context.scene.objects:
            if item.type == "MESH" and item.find_armature() == armature:
                evaluated = item.evaluated_get(graph)
                mesh = evaluated.to_mesh()
                flat = np.empty(3 * len(mesh.vertices), np.float32)
                mesh.vertices.foreach_get("co", flat)
                evaluated.to_mesh_clear()
                place = np.array(item.matrix_world)
                points.append(flat.reshape(-1, 3).astype(np.float64) @ place[:3, :3].T + place[:3, 3])
        result.append(np.concatenate(points))
    return np.array(result)


def what_cannot_be_reduced_is_refused(_: Path) -> None:
    world.empty_file()
    armature = world.rig("doll")
    frames = np.arange(1.0, 31.0)
    animate(armature, frames)
    before = snapshot_of_curves(armature)

    def refused(reason: str) -> None:
        message = is_refused(bpy.ops.layfigure.reduce_keys)
        assert reason in message, message
        assert snapshot_of_curves(armature) == before

    bone = armature.pose.bones["hand.L"]
    constraint = bone.constraints.new("LIMIT_ROTATION")
    refused("has a constraint")
    constraint.mute = True
    bone.scale = (1.0, 2.0, 1.0)
    refused("is scaled")
    bone.scale = (1.0, 1.0, 1.0)
    bone.bone.use_inherit_rotation = False
    refused("does not inherit rotation")
    bone.bone.use_inherit_rotation = True
    armature.scale = (1.0, 2.0, 1.0)
    bpy.context.view_layer.update()
    refused("scaled unevenly")
    armature.scale = (1.0, 1.0, 1.0)
    bpy.context.view_layer.update()
    modifier = next(item for item in bpy.data.objects["limbs"].modifiers if item.type == "ARMATURE")
    modifier.use_deform_preserve_volume = True
    refused("Preserve Volume")
    modifier.use_deform_preserve_volume = False
    for item in [item for item in bpy.data.objects if item.type == "MESH"]:
        bpy.data.objects.remove(item)
    refused("No mesh is bound")


if __name__ == "__main__":
    world.run_scene(globals())
