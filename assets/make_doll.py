#!/usr/bin/env python3
"""Makes the project's own character: an artist's wooden lay figure, 0.30 m tall, in an A-pose.

Each part is turned on a lathe: a ball at its joint, a groove, a tapered limb. A part follows its bone rigidly.

    make_doll.py doll.glb
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glb import Array, Bone, Indices, Mesh, rigid, write_glb

SIDES = 16
BALL_RINGS = 5
WOOD = (0.72, 0.47, 0.23)  # linear RGB
DARK_WOOD = (0.35, 0.17, 0.07)  # of the balls

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Part:
    """A turned part from its joint to its tip; metres, Y up, looking along +Z."""

    name: str
    parent: str  # "" for the root
    joint: Point
    tip: Point
    ball: float  # radius [m]; 0: no ball
    profile: tuple[tuple[float, float], ...]  # (fraction of the way from joint to tip, radius [m]), after the ball
    width: float = 1.0  # across, as a multiple of the radius
    depth: float = 1.0  # front to back, as a multiple of the radius


def limb(start: float, thick: float, end: float) -> tuple[tuple[float, float], ...]:
    """A tapered limb between two balls: radii at its shoulder, its belly and its end."""
    calf = 0.55 * thick + 0.45 * end
    return ((0.2, 0.75 * start), (0.26, start), (0.42, thick), (0.62, calf), (0.82, end), (0.9, 0.8 * end))


def side_parts(side: str, x: float) -> list[Part]:
    """Arm and leg of one side; x is +1 for the figure's left, -1 for its right."""
    slope = np.radians(40.0)
    along = np.array([x * np.cos(slope), -np.sin(slope), 0.0])
    shoulder = np.array([x * 0.0335, 0.2365, 0.0])
    elbow, wrist, fingers = (shoulder + length * along for length in (0.054, 0.104, 0.140))

    def at(p: Array) -> Point:
        return float(p[0]), float(p[1]), float(p[2])

    hip, knee = (x * 0.017, 0.146, 0.0), (x * 0.020, 0.082, 0.001)
    ankle, toe = (x * 0.022, 0.0145, -0.002), (x * 0.027, 0.0055, 0.036)
    hand = ((0.2, 0.0045), (0.32, 0.007), (0.5, 0.0085), (0.72, 0.0075), (0.9, 0.0045), (0.98, 0.0015))
    foot = ((0.17, 0.0058), (0.22, 0.0080), (0.45, 0.0092), (0.72, 0.0098), (0.92, 0.0070), (0.99, 0.0025))
    return [
        Part(f"upper_arm.{side}", "chest", at(shoulder), at(elbow), 0.0085, limb(0.0075, 0.0088, 0.0066)),
        Part(f"forearm.{side}", f"upper_arm.{side}", at(elbow), at(wrist), 0.0068, limb(0.0066, 0.0076, 0.0052)),
        Part(f"hand.{side}", f"forearm.{side}", at(wrist), at(fingers), 0.0050, hand, width=0.55),
        Part(f"thigh.{side}", "pelvis", hip, knee, 0.0115, limb(0.0115, 0.0132, 0.0092)),
        Part(f"shin.{side}", f"thigh.{side}", knee, ankle, 0.0092, limb(0.0090, 0.0102, 0.0066)),
        Part(f"foot.{side}", f"shin.{side}", ankle, toe, 0.0068, foot, depth=0.72),
    ]


def all_parts() -> list[Part]:
    pelvis = ((-1.35, 0.007), (-1.1, 0.0135), (-0.4, 0.0165), (0.3, 0.0150), (0.75, 0.0112), (0.9, 0.006))
    abdomen = ((0.32, 0.0095), (0.38, 0.0118), (0.52, 0.0130), (0.68, 0.0128), (0.82, 0.0110), (0.92, 0.006))
    chest = ((0.2, 0.0095), (0.25, 0.0120), (0.45, 0.0152), (0.68, 0.0172), (0.84, 0.0158), (0.95, 0.009))
    neck = ((0.42, 0.0052), (0.5, 0.0058), (0.6, 0.0060), (0.7, 0.0058), (0.8, 0.0050), (0.9, 0.003))
    head = ((0.13, 0.0060), (0.19, 0.0088), (0.38, 0.0128), (0.6, 0.0150), (0.82, 0.0124), (0.95, 0.0062))
    trunk = [
        Part("pelvis", "", (0.0, 0.155, 0.0), (0.0, 0.171, 0.0), 0.0, pelvis, width=1.7),
        Part("abdomen", "pelvis", (0.0, 0.172, 0.0), (0.0, 0.2, 0.0), 0.0105, abdomen, width=1.25),
        Part("chest", "abdomen", (0.0, 0.2, 0.0), (0.0, 0.2475, 0.0), 0.0105, chest, width=1.5),
        Part("neck", "chest", (0.0, 0.2475, 0.0), (0.0, 0.262, 0.001), 0.0068, neck),
        Part("head", "neck", (0.0, 0.262, 0.001), (0.0, 0.300, 0.003), 0.0056, head, width=0.86, depth=1.06),
    ]
    return trunk + side_parts("L", 1.0) + side_parts("R", -1.0)


def part_frame(part: Part) -> Array:
    """Y from joint to tip, Z to the front (of a foot: up)."""
    joint = np.array(part.joint, dtype=float)
    y = np.array(part.tip) - joint
    y /= np.linalg.norm(y)
    front = np.array([0.0, 1.0, 0.0]) if part.name.startswith("foot") else np.array([0.0, 0.0, 1.0])
    x = np.cross(y, front)
    x /= np.linalg.norm(x)
    return rigid(np.column_stack([x, y, np.cross(x, y)]), joint)


def rings(part: Part) -> tuple[Array, int]:
    """The lathe's profile as rows of height, half width, half depth, and how many of them are the ball's."""
    length = float(np.linalg.norm(np.subtract(part.tip, part.joint)))
    body = [(t * length, r * part.width, r * part.depth) for t, r in part.profile]
    if part.ball == 0.0:
        return np.array(body), 0
    # The ball is round whatever the limb, and ends where the groove of the limb begins.
    angles = np.linspace(0.0, np.radians(135.0), BALL_RINGS + 1)[1:]
    ball = [(-part.ball * np.cos(a), part.ball * np.sin(a), part.ball * np.sin(a)) for a in angles]
    return np.array(ball + [row for row in body if row[0] > ball[-1][0]]), BALL_RINGS


def turn(part: Part) -> tuple[Array, Indices, Indices]:
    """A closed surface: points in the world, triangles of the ball, triangles of the limb."""
    profile, ball_rings = rings(part)
    angles = np.arange(SIDES) * 2.0 * np.pi / SIDES
    x = profile[:, 1:2] * np.cos(angles)
    z = profile[:, 2:3] * np.sin(angles)
    y = np.repeat(profile[:, 0:1], SIDES, axis=1)
    length = float(np.linalg.norm(np.subtract(part.tip, part.joint)))
    first_pole = -part.ball if ball_rings else profile[0, 0] - 0.35 * profile[0, 2]
    poles = np.array([[0.0, first_pole, 0.0], [0.0, max(length, profile[-1, 0] + 0.0005), 0.0]])
    local = np.concatenate([np.stack([x, y, z], axis=-1).reshape(-1, 3), poles])
    frame = part_frame(part)

    count = len(profile)
    bottom, top = count * SIDES, count * SIDES + 1
    ball: list[tuple[int, int, int]] = []
    limb_: list[tuple[int, int, int]] = []
    for k in range(SIDES):
        nxt = (k + 1) % SIDES
        (ball if ball_rings else limb_).append((bottom, k, nxt))
        for ring in range(count - 1):
            a, b = ring * SIDES + k, ring * SIDES + nxt
            quad = [(a, a + SIDES, b), (b, a + SIDES, b + SIDES)]
            (ball if ring + 1 < ball_rings else limb_).extend(quad)
        limb_.append((top, (count - 1) * SIDES + nxt, (count - 1) * SIDES + k))
    points = local @ frame[:3, :3].T + frame[:3, 3]
    return points, np.array(ball, dtype=np.int64).reshape(-1, 3), np.array(limb_, dtype=np.int64)


def gather(name: str, color: Point, pieces: list[tuple[int, Array, Indices]], bones: int) -> Mesh:
    """One mesh of pieces (bone, points, triangles), each with only the points that it uses."""
    points: list[Array] = []
    triangles: list[Indices] = []
    weights: list[Array] = []
    start = 0
    for bone, piece_points, piece_triangles in pieces:
        used, compact = np.unique(piece_triangles, return_inverse=True)
        points.append(piece_points[used])
        triangles.append(compact.reshape(-1, 3) + start)
        weight = np.zeros((len(used), bones))
        weight[:, bone] = 1.0
        weights.append(weight)
        start += len(used)
    return Mesh(name, color, np.concatenate(points), np.concatenate(triangles), np.concatenate(weights))


def make_doll(out: Path) -> None:
    parts = all_parts()
    index = {part.name: number for number, part in enumerate(parts)}
    bones = [Bone(part.name, index.get(part.parent, -1), part_frame(part)) for part in parts]
    turned = [turn(part) for part in parts]
    limbs = [(number, points, limb_) for number, (points, _, limb_) in enumerate(turned)]
    balls = [(number, points, ball) for number, (points, ball, _) in enumerate(turned) if len(ball)]
    meshes = [gather("limbs", WOOD, limbs, len(bones)), gather("balls", DARK_WOOD, balls, len(bones))]
    write_glb(out, "doll", bones, meshes)


def main() -> int:
    parser = argparse.ArgumentParser(description="Makes a wooden lay figure with ball joints as a rigged GLB.")
    parser.add_argument("out", type=Path, metavar="OUT.glb")
    options = parser.parse_args()
    try:
        make_doll(options.out)
    except OSError as error:
        print(f"make_doll.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
