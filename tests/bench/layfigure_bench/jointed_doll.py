"""A character of 60 joints for the benchmark of latencies: a trunk, and limbs that branch off it."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(REPOSITORY / "assets"))

from glb import Bone, Mesh, rigid, write_glb  # noqa: E402

JOINTS = 60  # and a root, which has none
BRANCHES = 6  # the trunk among them, of as many bones each
LENGTH = 0.04  # of a bone [m]
BOX = (0.015, 0.5 * LENGTH, 0.015)  # of its skin [m]: bones that are neighbours do not touch, nor do the limbs
# Corners of a box and its faces, counter-clockwise seen from outside.
CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (0.0, 1.0) for z in (-0.5, 0.5)])
FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


def make_jointed_doll(path: Path) -> None:
    """Metres, Y up, as glTF is."""
    bones = [Bone("root", -1, np.eye(4))]
    for branch in range(BRANCHES):
        angle = 2.0 * np.pi * branch / BRANCHES
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        parent = 0
        for number in range(JOINTS // BRANCHES):
            origin = turn @ np.array([0.0, LENGTH * (number + 1.5), 0.0])
            bones.append(Bone(f"limb{branch}.{number}", parent, rigid(turn, origin)))
            parent = len(bones) - 1
    points = [(CORNERS * BOX) @ bone.frame[:3, :3].T + bone.frame[:3, 3] for bone in bones]
    triangles = [FACES + len(CORNERS) * number for number in range(len(bones))]
    weights = np.repeat(np.eye(len(bones)), len(CORNERS), axis=0)
    mesh = Mesh("boxes", (0.6, 0.6, 0.6), np.concatenate(points), np.concatenate(triangles), weights)
    write_glb(path, "jointed", bones, [mesh])
