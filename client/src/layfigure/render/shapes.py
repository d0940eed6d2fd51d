"""Surfaces of simple shapes: what is drawn of forces and hands, seen also where a body is in front of them."""

from __future__ import annotations

import itertools
import math

import numpy as np

from layfigure.protocol import Floats
from layfigure.render.scene import Surface

_SIDES = 20
_HEAD_LENGTH, _HEAD_RADIUS = 5.0, 2.4  # of an arrow, in radii of its shaft


def ball(centre: Floats, radius: float, color: Floats) -> Surface:
    latitudes = np.linspace(0.0, math.pi, _SIDES // 2 + 1)
    return _turned(centre, np.array([0.0, 0.0, 1.0]), radius * np.sin(latitudes), radius * np.cos(latitudes), color)


def arrow(start: Floats, vector: Floats, radius: float, color: Floats) -> Surface:
    """From `start` as long as `vector`; a short one is all head."""
    length = float(np.linalg.norm(vector))
    head = min(_HEAD_LENGTH * radius, length)
    wide = _HEAD_RADIUS * head / _HEAD_LENGTH
    radii = np.array([0.0, min(radius, wide), min(radius, wide), wide, 0.0])
    return _turned(start, vector, radii, np.array([0.0, 0.0, length - head, length - head, length]), color)


def _turned(start: Floats, axis: Floats, radii: Floats, heights: Floats, color: Floats) -> Surface:
    """The surface of a profile (N) that turns about `axis`, with a ring of its own on both sides of each edge."""
    direction = axis / max(float(np.linalg.norm(axis)), 1e-12)
    aside = np.eye(3)[np.argmin(np.abs(direction))]
    u = np.cross(direction, aside)
    u /= np.linalg.norm(u)
    v = np.cross(direction, u)
    angles = np.linspace(0.0, 2.0 * math.pi, _SIDES, endpoint=False)
    circle = np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v
    rings = start + heights[:, None, None] * direction + radii[:, None, None] * circle
    points: list[Floats] = []
    triangles: list[list[int]] = []
    for first, second in itertools.pairwise(rings):
        base = 2 * _SIDES * len(points)
        points.append(np.concatenate([first, second]))
        for side in range(_SIDES):
            following = (side + 1) % _SIDES
            a, b, c, d = base + side, base + following, base + _SIDES + side, base + _SIDES + following
            triangles += [[a, b, c], [b, d, c]]
    return Surface(np.concatenate(points), np.array(triangles, np.int32), color, shines_through=True)
