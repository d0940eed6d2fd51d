# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines, discs and arrows on the screen as triangles, with soft edges of their own: what is drawn over Blender's views
is not smoothed by them. No bpy. Places are in pixels, colours are red, green, blue and alpha, 0 to 1.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from layfigure.protocol import Floats

FEATHER = 1.0  # [pixels] over which an edge fades: as smooth as it gets, and no blur
SIDES = 32  # of a circle: its corners are within a tenth of a pixel of it, up to a radius of 20 pixels

Color = tuple[float, float, float, float]


class Triangles(NamedTuple):
    points: Floats  # (3 T, 2), three for each triangle
    colors: Floats  # (3 T, 4)


NOTHING = Triangles(np.zeros((0, 2)), np.zeros((0, 4)))


def joined(parts: Iterable[Triangles]) -> Triangles:
    """Drawn one over the other, in their order."""
    shown = [NOTHING, *parts]
    return Triangles(np.concatenate([part.points for part in shown]), np.concatenate([part.colors for part in shown]))


def lines(starts: ArrayLike, ends: ArrayLike, width: float, color: Color) -> Triangles:
    """From each of the starts (N, 2) to its end (N, 2). Those without length, or with an end that is nan, are left
    out."""
    a, b = np.reshape(starts, (-1, 2)).astype(np.float64), np.reshape(ends, (-1, 2)).astype(np.float64)
    lengths = np.linalg.norm(b - a, axis=-1)
    shown = lengths > 0.0  # nan is not
    a, b, along = a[shown], b[shown], (b - a)[shown] / lengths[shown, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
    rails, alphas = _rails(0.5 * width)
    offsets = across[:, None, :] * np.array(rails)[:, None]
    return _strips(np.stack([a[:, None] + offsets, b[:, None] + offsets], axis=1), alphas, color)


def disc(center: ArrayLike, radius: float, color: Color, sides: int = SIDES) -> Triangles:
    """A full circle; with four sides a diamond."""
    radii = (0.0, radius - 0.5 * FEATHER, radius + 0.5 * FEATHER)
    return _circles(center, radii, (1.0, 1.0, 0.0), color, sides)


def ring(center: ArrayLike, radius: float, width: float, color: Color, sides: int = SIDES) -> Triangles:
    rails, alphas = _rails(0.5 * width)
    return _circles(center, tuple(radius + rail for rail in rails), alphas, color, sides)


def arrow(start: ArrayLike, end: ArrayLike, width: float, color: Color) -> Triangles:
    """Its head is three times as wide as its shaft, and shrinks with an arrow that is shorter than it."""
    a, b = np.asarray(start, np.float64), np.asarray(end, np.float64)
    length = float(np.linalg.norm(b - a))
    if not length > 0.0:
        return NOTHING
    along = (b - a) / length
    head = min(4.0 * width, length)
    across = np.array([-along[1], along[0]]) * 0.375 * head
    neck = b - head * along
    corners = np.array([neck + across, b, neck - across])
    edges = lines(corners, np.roll(corners, -1, axis=0), FEATHER, color)
    return joined([lines(a, neck, width, color), Triangles(corners, np.tile(color, (3, 1))), edges])


def _rails(half_width: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Across a line: where its edges begin and end to fade, and the share of the colour's alpha there."""
    inner, outer = max(half_width - 0.5 * FEATHER, 0.0), half_width + 0.5 * FEATHER
    return (-outer, -inner, inner, outer), (0.0, 1.0, 1.0, 0.0)


def _circles(
    center: ArrayLike, radii: tuple[float, ...], alphas: tuple[float, ...], color: Color, sides: int
) -> Triangles:
    if not np.isfinite(center).all():
        return NOTHING
    around_origin = _circles_around_origin(radii, alphas, color, sides)
    return Triangles(around_origin.points + np.asarray(center), around_origin.colors)


@functools.lru_cache(maxsize=64)
def _circles_around_origin(radii: tuple[float, ...], alphas: tuple[float, ...], color: Color, sides: int) -> Triangles:
    """Kept, as an overlay draws the same few in each frame, and elsewhere. Not to be written to."""
    turns = 2.0 * np.pi * np.arange(sides + 1) / sides
    spokes = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    corners = spokes[:, None, :] * np.maximum(radii, 0.0)[:, None]
    return _strips(np.stack([corners[:-1], corners[1:]], axis=1), alphas, color)


def _strips(corners: Floats, alphas: tuple[float, ...], color: Color) -> Triangles:
    """Of pieces (N, 2, R, 2): two ends with R rails each, between which are R - 1 quadrilaterals."""
    colors = np.tile(color, (len(alphas), 1))
    colors[:, 3] *= alphas
    a, b = corners[:, 0], corners[:, 1]
    points = np.stack([a[:, :-1], a[:, 1:], b[:, 1:], a[:, :-1], b[:, 1:], b[:, :-1]], axis=2)
    inner, outer = colors[:-1], colors[1:]
    of_a_piece = np.stack([inner, outer, outer, inner, outer, inner], axis=1)
    return Triangles(points.reshape(-1, 2), np.tile(of_a_piece.reshape(-1, 4), (len(corners), 1)))
