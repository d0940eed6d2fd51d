"""A large character made by rule: a hub with eight long arms, each a closed tube."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from glb import Array, Bone, Indices, Mesh, rigid, write_glb

ARMS = 8
HUB_RADIUS = 0.2  # [m]
ARM_LENGTH = 0.8  # [m]
ARM_RADIUS = 0.05  # [m], at the hub; half of it at the tip
AROUND = 24  # vertices of a ring


def arm_direction(arm: int) -> Array:
    angle = 2.0 * np.pi * arm / ARMS
    return np.array([np.cos(angle), 0.0, np.sin(angle)])


def arm_bones(arm: int, count: int) -> list[Bone]:
    """A chain of `count` bones along the arm, whose first hangs on bone 0, the hub."""
    first = 1 + arm * count
    step = ARM_LENGTH / count
    outwards = arm_direction(arm)
    frames = [rigid(np.eye(3), outwards * (HUB_RADIUS + step * k)) for k in range(count)]
    return [Bone(f"arm{arm}_{k}", first + k - 1 if k else 0, frames[k]) for k in range(count)]


def tube(start: Array, end: Array, radii: tuple[float, float], rings: int) -> tuple[Array, Indices, Array]:
    """Points, outward triangles and each point's place along the tube (0 to 1), the ends closed by a point each."""
    along = np.linspace(0.0, 1.0, rings)
    axis = (end - start) / np.linalg.norm(end - start)
    u = np.cross(axis, [0.0, 1.0, 0.0]) if abs(axis[1]) < 0.9 else np.cross(axis, [1.0, 0.0, 0.0])
    u /= np.linalg.norm(u)
    v = np.cross(axis, u)
    angles = 2.0 * np.pi * np.arange(AROUND) / AROUND
    circle = np.outer(np.cos(angles), u) + np.outer(np.sin(angles), v)
    centres = start + np.outer(along, end - start)
    radius = radii[0] + along * (radii[1] - radii[0])
    points = (centres[:, None, :] + radius[:, None, None] * circle[None, :, :]).reshape(-1, 3)
    ring, corner = np.meshgrid(np.arange(rings - 1), np.arange(AROUND), indexing="ij")
    a = (ring * AROUND + corner).ravel()
    b = (ring * AROUND + (corner + 1) % AROUND).ravel()
    sides = np.concatenate([np.stack([a, b, a + AROUND], 1), np.stack([b, b + AROUND, a + AROUND], 1)])
    first, last = len(points), len(points) + 1
    edge, next_edge = np.arange(AROUND), (np.arange(AROUND) + 1) % AROUND
    top = (rings - 1) * AROUND
    start_fan = np.stack([np.full(AROUND, first), next_edge, edge], 1)
    end_fan = np.stack([np.full(AROUND, last), top + edge, top + next_edge], 1)
    places = np.concatenate([np.repeat(along, AROUND), [0.0, 1.0]])
    return np.vstack([points, start, end]), np.concatenate([sides, start_fan, end_fan]), places


def make_creature(path: Path, bones_per_arm: int = 20, vertices: int = 50_000) -> None:
    """Writes a creature of 1 + 8 * bones_per_arm bones and about so many vertices."""
    rings = max(2 * bones_per_arm, vertices // (ARMS * AROUND))
    bones = [Bone("hub", -1, np.eye(4))]
    for arm in range(ARMS):
        bones += arm_bones(arm, bones_per_arm)
    meshes = []
    for arm in range(ARMS):
        outwards = arm_direction(arm)
        start, end = outwards * 0.5 * HUB_RADIUS, outwards * (HUB_RADIUS + ARM_LENGTH)
        points, triangles, places = tube(start, end, (ARM_RADIUS, 0.5 * ARM_RADIUS), rings)
        weights = np.zeros((len(points), len(bones)))
        distance = places * np.linalg.norm(end - start) - 0.5 * HUB_RADIUS
        place = np.clip(distance / ARM_LENGTH * bones_per_arm, 0.0, bones_per_arm - 1e-9)
        bone = place.astype(int)
        fade = np.clip(2.0 * (place - bone), 0.0, 1.0)  # half of each bone still follows the one before, less and less
        rows = np.arange(len(points))
        before = np.where(bone > 0, arm * bones_per_arm + bone, 0)
        weights[rows, 1 + arm * bones_per_arm + bone] += np.where(distance < 0.0, 0.0, fade)
        weights[rows, before] += np.where(distance < 0.0, 1.0, 1.0 - fade)
        meshes.append(Mesh(f"arm{arm}", (0.4, 0.5, 0.6), points, triangles, weights))
    write_glb(path, "creature", bones, meshes)
