"""Filled polygons as triangles."""

from __future__ import annotations

import numpy as np

from layfigure.protocol import Floats, Ints


def triangulate(polygon: Floats) -> Ints:
    """Triangles (N - 2, 3) that fill a simple polygon (N, 2), by cutting off ears; of one that crosses itself, about
    so. O(N^3)."""
    order = list(range(len(polygon)))
    if _signed_area(polygon) < 0.0:
        order.reverse()
    triangles = []
    while len(order) > 3:
        ear = _find_ear(polygon, order)
        triangles.append([order[ear - 1], order[ear], order[(ear + 1) % len(order)]])
        del order[ear]
    return np.array([*triangles, order], np.int32)


def _find_ear(polygon: Floats, order: list[int]) -> int:
    """A corner that can be cut off: convex, without another corner in its triangle; if there is none, the first."""
    points = polygon[order]
    before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
    for index in np.flatnonzero(_cross(points - before, after - points) > 0.0):
        a, b, c = before[index], points[index], after[index]
        inside = (
            (_cross(b - a, points - a) >= 0.0) & (_cross(c - b, points - b) >= 0.0) & (_cross(a - c, points - c) >= 0.0)
        )
        inside[[index - 1, index, (index + 1) % len(order)]] = False
        if not inside.any():
            return int(index)
    return 0


def _signed_area(polygon: Floats) -> float:
    following = np.roll(polygon, -1, axis=0)
    return float(np.sum(_cross(polygon, following))) / 2.0


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
