"""A perspective camera that frames a set of points."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from layfigure.protocol import Floats

_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Camera:
    position: Floats  # world [m]
    right: Floats  # unit vectors, world
    up: Floats
    forward: Floats
    tan_half_width: float  # of the view angle
    tan_half_height: float


@dataclass(frozen=True)
class View:
    """From where a character that faces -Y is looked at."""

    azimuth: float = math.radians(32.0)  # from its front towards its left
    elevation: float = math.radians(10.0)
    half_angle: float = math.radians(12.0)  # of the larger side
    margin: float = 1.06  # of the frame around the points


def view_axes(view: View) -> tuple[Floats, Floats, Floats]:
    """Right, up and forward."""
    horizontal = math.cos(view.elevation)
    forward = -np.array(
        [horizontal * math.sin(view.azimuth), -horizontal * math.cos(view.azimuth), math.sin(view.elevation)]
    )
    right = np.cross(forward, _UP)
    right /= np.linalg.norm(right)
    return right, np.cross(right, forward), forward


def picture_aspect(points: Floats, view: View, least: float, most: float) -> float:
    """Width over height of the points as they are seen, within the bounds."""
    right, up, _ = view_axes(view)
    height = float(np.ptp(points @ up))
    return min(max(float(np.ptp(points @ right)) / height, least), most) if height > 0.0 else most


def frame_points(points: Floats, aspect: float, view: View) -> Camera:
    """The nearest camera in the view's direction that sees all of the points (N, 3), in its middle.

    A point at depth z along `forward` and x to the right is inside if |x| <= (z + distance) tan_half_width.
    """
    right, up, forward = view_axes(view)
    tangent = math.tan(view.half_angle) / view.margin
    tan_width, tan_height = tangent * min(aspect, 1.0), tangent * min(1.0 / aspect, 1.0)
    x, y, z = points @ right, points @ up, points @ forward
    x_middle, y_middle = (x.min() + x.max()) / 2, (y.min() + y.max()) / 2
    distance = float(np.max(np.maximum(np.abs(x - x_middle) / tan_width, np.abs(y - y_middle) / tan_height) - z))
    position = x_middle * right + y_middle * up - distance * forward
    return Camera(position, right, up, forward, tan_width * view.margin, tan_height * view.margin)
