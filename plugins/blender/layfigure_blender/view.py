# SPDX-License-Identifier: GPL-3.0-or-later
"""A 3D view as numbers: what its pixels see, and where the world is on it.

Ring 1: no bpy. With V the view matrix (world -> view; the eye looks along -z, y is up) and P the window matrix
(view -> clip), as region_data of any 3D view has them, a point p of the world is at the clip coordinates c = P V p, and

    pixel = (width (1 + c_x / c_w) / 2, height (1 + c_y / c_w) / 2),    from the lower left of the region

as mouse events have it. Nothing else is assumed of P: it may be perspective or orthographic, with the lens shift of a
camera; and V may have a scale, where the world is in other units than the view. Rays are found from the rows x, y and w
of P alone, never through the inverse of P V, which loses its digits to the near and far plane. Single points are (3).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from layfigure.protocol import Floats

NEAREST_DEPTH = 1e-6  # of what is drawn in perspective; Blender's own least clip distance


@dataclass(frozen=True, eq=False)
class View:
    view_matrix: Floats  # (4, 4)
    window_matrix: Floats  # (4, 4)
    width: float  # of the region, pixels
    height: float
    scale: float = 1.0  # pixels of one of the user interface's points: 2 on a screen of high resolution

    @cached_property
    def is_perspective(self) -> bool:
        return bool(self.window_matrix[3, 2] != 0.0)

    @cached_property
    def _to_world(self) -> Floats:
        return np.asarray(np.linalg.inv(self.view_matrix), np.float64)

    @property
    def right(self) -> Floats:
        """Unit vectors of the world: to the right and up on the screen, and `back`, to who looks at it."""
        return _unit(self._to_world[:3, 0])

    @property
    def up(self) -> Floats:
        return _unit(self._to_world[:3, 1])

    @property
    def back(self) -> Floats:
        return _unit(self._to_world[:3, 2])

    def in_view(self, points: ArrayLike) -> Floats:
        """World points (..., 3) in the view's frame."""
        return np.asarray(points, np.float64) @ self.view_matrix[:3, :3].T + self.view_matrix[:3, 3]

    def depth(self, point: ArrayLike) -> float:
        """How far a point is from the plane of the eye, along the view, in the view's units; negative behind it, as
        may be in orthographic views."""
        return -float(self.in_view(point)[2])

    def is_seen(self, points: ArrayLike) -> np.ndarray:
        """Whether points (..., 3) can be on the screen: they are in front of the eye, or there is none."""
        depths = -self.in_view(points)[..., 2]
        return np.asarray(depths >= NEAREST_DEPTH) if self.is_perspective else np.ones(depths.shape, np.bool_)

    def pixels(self, points: ArrayLike) -> Floats:
        """Where world points (..., 3) are on the screen (..., 2); nan for those behind the eye."""
        seen = self.is_seen(points)
        clip = self._clip(self.in_view(points))
        w = np.where(seen, clip[..., 3], np.nan)
        return np.asarray(0.5 * self._size * (1.0 + clip[..., :2] / w[..., None]))

    def in_front(self, starts: Floats, ends: Floats) -> tuple[Floats, Floats]:
        """The parts of segments (N, 3), (N, 3) that are in front of the eye; those that have none stay behind it."""
        if not self.is_perspective:
            return starts, ends
        a, b = -self.in_view(starts)[:, 2:], -self.in_view(ends)[:, 2:]
        crosses = (a < NEAREST_DEPTH) != (b < NEAREST_DEPTH)
        # A little in front of the plane, so that rounding does not put it behind.
        share = (2.0 * NEAREST_DEPTH - a) / np.where(crosses, b - a, 1.0)
        cut = starts + share * (ends - starts)
        return (
            np.where(crosses & (a < NEAREST_DEPTH), cut, starts),
            np.where(crosses & (b < NEAREST_DEPTH), cut, ends),
        )

    def point_under(self, pixel: ArrayLike, depth: float) -> Floats:
        """The world point that a pixel shows at a depth."""
        start, along = self._line(pixel)
        return self._world(start - depth * along)

    def ray(self, pixel: ArrayLike) -> tuple[Floats, Floats]:
        """What is under a pixel: an origin on the near plane, and a unit direction away from who looks."""
        start, along = self._line(pixel)
        # On the near plane c_z = -c_w, so (P_z + P_w) (start + z along) = 0.
        row = self.window_matrix[2] + self.window_matrix[3]
        z = -(row[:3] @ start + row[3]) / (row[:3] @ along)
        return self._world(start + z * along), _unit(self._to_world[:3, :3] @ -along)

    def reach(self, depth: float) -> float:
        """The length that depth is moved by shares of: how far away a point is or, where there is no eye, how much of
        the world is seen from top to bottom."""
        return depth if self.is_perspective else float(2.0 / np.linalg.norm(self.window_matrix[1, :3]))

    def pixel_size(self, point: ArrayLike) -> float:
        """The world's length that is one pixel high on the screen at a point."""
        w = -self.depth(point) * self.window_matrix[3, 2] + self.window_matrix[3, 3]
        in_view = 2.0 * w / (self.height * np.linalg.norm(self.window_matrix[1, :2]))
        return float(in_view * np.linalg.norm(self._to_world[:3, 1]))

    @property
    def _size(self) -> Floats:
        return np.array([self.width, self.height])

    def _clip(self, points: Floats) -> Floats:
        return points @ self.window_matrix[:, :3].T + self.window_matrix[:, 3]

    def _line(self, pixel: ArrayLike) -> tuple[Floats, Floats]:
        """All points of the view's frame that a pixel shows: start + z along, of z = 0 and 1 along z."""
        ndc = 2.0 * np.asarray(pixel, np.float64) / self._size - 1.0
        # c_x = ndc_x c_w and c_y = ndc_y c_w are two linear equations for x, y, with z given.
        rows = self.window_matrix[:2] - np.outer(ndc, self.window_matrix[3])
        start = np.append(np.linalg.solve(rows[:, :2], -rows[:, 3]), 0.0)
        along = np.append(np.linalg.solve(rows[:, :2], -rows[:, 2]), 1.0)
        return start, along

    def _world(self, point: Floats) -> Floats:
        return np.asarray(self._to_world[:3, :3] @ point + self._to_world[:3, 3])


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
