# SPDX-License-Identifier: GPL-3.0-or-later
"""How the mouse moves what is held: parallel to the view, deeper and nearer, slowly, and turning it.

Ring 1: no bpy. Lengths are the world's, rotations unit quaternions w x y z.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from layfigure import rotation
from layfigure.protocol import Floats

from .view import View

SLOW = 0.1  # of the motion while shift is held, as Blender's own transforms have it
NOTCH = 0.05  # of the distance: what a notch of the wheel moves by
TURN = 0.01  # [rad] for a point of the screen that the mouse moves by; a turn of half a circle is a hand's width
ROLL = 0.1  # [rad] about the view axis for a notch of the wheel


class Drag:
    """Where a held point is to be, and how what it belongs to is to be turned, as the mouse moves.

    Each motion of the mouse is added to where the point is on the screen now. So the point stays under the mouse where
    it was taken, at its depth, whatever the view; and neither a change of the view (a camera that moves during
    playback), nor pressing or releasing shift or ctrl, makes it jump.
    """

    def __init__(self, held: ArrayLike, mouse: ArrayLike) -> None:
        """`held` is the point in the world, `mouse` the pixel at which it was taken, which need not be right on it."""
        self.position: Floats = np.array(held, np.float64)
        self.turned: Floats = np.array([1.0, 0.0, 0.0, 0.0])  # since the beginning, in the world
        self._mouse = np.array(mouse, np.float64)

    def move(self, view: View, mouse: ArrayLike, *, slow: bool = False, turn: bool = False) -> None:
        """The mouse is at a pixel now. With `turn` it rolls what is held like a ball under it, which stays in place."""
        before, self._mouse = self._mouse, np.array(mouse, np.float64)
        way = (self._mouse - before) * _pace(slow)
        if turn:
            x, y = TURN * way / view.scale
            self._turn(x * view.up - y * view.right)
        elif view.is_seen(self.position):
            pixel = view.pixels(self.position) + way
            self.position = view.point_under(pixel, view.depth(self.position))

    def wheel(self, view: View, notches: float, *, slow: bool = False, turn: bool = False) -> None:
        """Moves away from who looks, by a share of the distance for each notch; the point stays under its pixel. With
        `turn` it turns counter-clockwise on the screen instead."""
        notches *= _pace(slow)
        if turn:
            self._turn(ROLL * notches * view.back)
        elif view.is_seen(self.position):
            depth = view.depth(self.position)
            pixel = view.pixels(self.position)
            self.position = view.point_under(pixel, _deeper(view, depth, notches))

    def _turn(self, vector: Floats) -> None:
        """By a rotation vector of the world."""
        self.turned = rotation.normalized(rotation.multiply(rotation.from_vector(vector), self.turned))


def _pace(slow: bool) -> float:
    return SLOW if slow else 1.0


def _deeper(view: View, depth: float, notches: float) -> float:
    """As many notches back lead to where one came from; in perspective nothing leads through the eye."""
    if view.is_perspective:
        return float(depth * (1.0 + NOTCH) ** notches)
    return depth + NOTCH * notches * view.reach(depth)
