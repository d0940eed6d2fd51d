"""The project's doll with a skin that bends: its own follows each bone rigidly, so that nothing would be blended."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from glb import Array, Bone, Mesh, write_glb
from make_doll import DARK_WOOD, WOOD, Part, all_parts, gather, part_frame, turn

FALLOFF_M = 0.012  # a bone's weight at a distance d from it is exp(-(d / falloff)^2)


def distances_to_bone(points: Array, part: Part) -> Array:
    """From each point to the line from the part's joint to its tip."""
    joint, along = np.array(part.joint), np.subtract(part.tip, part.joint)
    fraction = np.clip((points - joint) @ along / (along @ along), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - joint - fraction[:, None] * along, axis=1))


def smooth_weights(points: Array, parts: list[Part]) -> Array:
    distances = np.stack([distances_to_bone(points, part) for part in parts], axis=1)
    nearest = distances.min(axis=1, keepdims=True)
    return np.asarray(np.exp((nearest**2 - distances**2) / FALLOFF_M**2))


def write_smooth_doll(path: Path) -> None:
    parts = all_parts()
    index = {part.name: number for number, part in enumerate(parts)}
    bones = [Bone(part.name, index.get(part.parent, -1), part_frame(part)) for part in parts]
    turned = [turn(part) for part in parts]
    limbs = [(number, points, limb) for number, (points, _, limb) in enumerate(turned)]
    balls = [(number, points, ball) for number, (points, ball, _) in enumerate(turned) if len(ball)]
    meshes = []
    for name, color, pieces in (("limbs", WOOD, limbs), ("balls", DARK_WOOD, balls)):
        rigid = gather(name, color, pieces, len(bones))
        weights = smooth_weights(rigid.points, parts)
        meshes.append(Mesh(rigid.name, rigid.color, rigid.points, rigid.triangles, weights))
    write_glb(path, "doll", bones, meshes)
