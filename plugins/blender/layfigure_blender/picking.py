# SPDX-License-Identifier: GPL-3.0-or-later
"""What of an armature is under the mouse. Ring 1: no bpy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from layfigure.protocol import Floats

from .view import View

BONE_RADIUS = 8.0  # points of the screen within which a bone is hit; Blender's own selection has 10 to 15
POINT_RADIUS = 12.0  # likewise a marker, which is drawn so large
_EQUALLY_NEAR = 2.0  # points of the screen: of bones that cross, the front one is meant


@dataclass(frozen=True, eq=False)
class Hit:
    index: int
    point: Floats  # (3) of the world, on the bone
    distance: float  # from the pixel, in points of the screen


def nearest_bone(view: View, mouse: ArrayLike, heads: Floats, tails: Floats) -> Hit | None:
    """The bone, of heads and tails (B, 3) in the world, whose segment is nearest to a pixel on the screen; None if none
    is in front of the eye. It is hit if it is within BONE_RADIUS. O(B)."""
    if len(heads) == 0:
        return None
    start, end = view.in_front(heads, tails)
    a, b = view.pixels(start), view.pixels(end)
    share = _nearest_share(a, b, np.asarray(mouse, np.float64))
    distances = np.linalg.norm(a + share[:, None] * (b - a) - np.asarray(mouse, np.float64), axis=-1)
    distances = np.where(np.isnan(distances), np.inf, distances) / view.scale
    if not np.isfinite(distances.min()):
        return None
    points = start + _share_of_length(view, start, end, share)[:, None] * (end - start)
    depths = -view.in_view(points)[:, 2]
    near = distances <= distances.min() + _EQUALLY_NEAR
    index = int(np.argmin(np.where(near, depths, np.inf)))
    return Hit(index, points[index], float(distances[index]))


def point_under(view: View, mouse: ArrayLike, points: Floats) -> int | None:
    """Which of world points (N, 3) is nearest to a pixel on the screen; None if none is within POINT_RADIUS."""
    if len(points) == 0:
        return None
    distances = np.linalg.norm(view.pixels(points) - np.asarray(mouse, np.float64), axis=-1) / view.scale
    distances = np.where(np.isnan(distances), np.inf, distances)
    nearest = int(np.argmin(distances))
    return nearest if distances[nearest] <= POINT_RADIUS else None


def _nearest_share(a: Floats, b: Floats, point: Floats) -> Floats:
    """Where on segments of the screen (B, 2) they are nearest to a point: 0 at a to 1 at b."""
    along = b - a
    length_squared = np.sum(along * along, axis=-1)
    share = np.sum((point - a) * along, axis=-1) / np.where(length_squared > 0.0, length_squared, 1.0)
    return np.asarray(np.clip(share, 0.0, 1.0))


def _share_of_length(view: View, start: Floats, end: Floats, share: Floats) -> Floats:
    """The share of a segment's length in the world that is seen at a share of its length on the screen: what is
    farther away is drawn smaller."""
    if not view.is_perspective:
        return share
    near, far = -view.in_view(start)[:, 2], -view.in_view(end)[:, 2]
    total = (1.0 - share) * far + share * near
    return np.asarray(share * near / np.where(total > 0.0, total, 1.0))
