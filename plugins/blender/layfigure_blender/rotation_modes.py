# SPDX-License-Identifier: GPL-3.0-or-later
"""A bone's rotation in the numbers of its rotation mode, as Blender reads them and plays them between keys. No bpy.

    QUATERNION  w x y z, of which Blender takes the direction
    AXIS_ANGLE  angle [rad], x y z of an axis, of which it takes the direction
    XYZ, ...    angles [rad] about x, y, z, turned about in the order of the name: R = R_z R_y R_x for XYZ

Each rotation has many numbers: -q is q, an angle may go round, and there are two sets of Euler angles. Keys beside each
other must have those that are nearest to each other, since Blender goes from one to the other in a straight line.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from layfigure import rotation

Floats = NDArray[np.float64]

QUATERNION = "QUATERNION"
AXIS_ANGLE = "AXIS_ANGLE"
_NO_TURN = 1e-7  # sine of half an angle below which the axis is noise, in single precision
_GIMBAL_LOCK = 1e-7  # cosine of the middle angle likewise, of the first and the last one


def property_of(mode: str) -> str:
    """The name of the pose bone's property that has the numbers."""
    return {QUATERNION: "rotation_quaternion", AXIS_ANGLE: "rotation_axis_angle"}.get(mode, "rotation_euler")


def neutral(mode: str) -> Floats:
    """The numbers of no rotation that Blender begins with."""
    return np.array({QUATERNION: [1.0, 0.0, 0.0, 0.0], AXIS_ANGLE: [0.0, 0.0, 1.0, 0.0]}.get(mode, [0.0, 0.0, 0.0]))


def to_rotations(mode: str, numbers: Floats) -> Floats:
    """(..., 4), w x y z, of numbers (..., n). Numbers without a direction are no rotation."""
    if mode == QUATERNION:
        return _directions(numbers, neutral(QUATERNION))
    if mode == AXIS_ANGLE:
        axes = _directions(numbers[..., 1:], np.zeros(3))
        return rotation.from_vector(axes * numbers[..., :1])
    result = np.broadcast_to(neutral(QUATERNION), (*numbers.shape[:-1], 4))
    for axis in _order(mode):
        half = 0.5 * numbers[..., axis]
        turn = np.zeros((*half.shape, 4))
        turn[..., 0], turn[..., 1 + axis] = np.cos(half), np.sin(half)
        result = rotation.multiply(turn, result)
    return np.asarray(result, np.float64)


def nearest(mode: str, rotations: Floats, before: Floats) -> Floats:
    """(..., n): of the numbers of rotations (..., 4) those nearest to `before` (..., n)."""
    if mode == QUATERNION:
        flipped = np.sum(rotations * before, axis=-1, keepdims=True) < 0.0
        return np.where(flipped, -rotations, rotations)
    if mode == AXIS_ANGLE:
        return _nearest_axis_angle(rotations, before)
    return _nearest_euler(mode, rotations, before)


def continuous(mode: str, rotations: Floats, before: Floats | None = None) -> Floats:
    """(F, B, n): the numbers of rotations (F, B, 4) nearest to the last frame's, or else to `before` (B, n)."""
    numbers = np.empty((*rotations.shape[:2], len(neutral(mode))))
    last = np.broadcast_to(neutral(mode), numbers.shape[1:]) if before is None else before
    if mode == AXIS_ANGLE and before is None and len(rotations):
        last = _with_first_axes(rotations, last)
    for frame, turned in enumerate(rotations):
        last = numbers[frame] = nearest(mode, turned, last)
    return numbers


def _with_first_axes(rotations: Floats, numbers: Floats) -> Floats:
    """A bone that has not turned yet has the axis about which it will, so that the axis stays."""
    sines = np.linalg.norm(rotations[..., 1:], axis=-1)  # (F, B)
    first = np.argmax(sines > _NO_TURN, axis=0)
    bones = np.arange(rotations.shape[1])
    axes = _directions(rotations[first, bones, 1:], neutral(AXIS_ANGLE)[1:])
    turns = (sines > _NO_TURN).any(axis=0)[:, None]
    return np.where(turns, np.concatenate([np.zeros((len(bones), 1)), axes], axis=1), numbers)


def _nearest_axis_angle(rotations: Floats, before: Floats) -> Floats:
    q = np.where(rotations[..., :1] < 0.0, -rotations, rotations)
    sines = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    known = _directions(before[..., 1:], neutral(AXIS_ANGLE)[1:])
    axes = np.where(sines > _NO_TURN, q[..., 1:] / np.where(sines > _NO_TURN, sines, 1.0), known)
    signs = np.where(np.sum(axes * known, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    angles = _wound(signs * 2.0 * np.arctan2(sines, q[..., :1]), before[..., :1])
    return np.concatenate([angles, signs * axes], axis=-1)


def _nearest_euler(mode: str, rotations: Floats, before: Floats) -> Floats:
    """Of the two sets of angles, and any turns added to each, those with the least sum of differences."""
    matrix = rotation.to_matrix(rotations)
    first, second, third = _order(mode)
    sign = 1.0 if (second - first) % 3 == 1 else -1.0  # of the permutation
    cosine = np.hypot(matrix[..., first, first], matrix[..., second, first])
    locked = cosine < _GIMBAL_LOCK
    angles = np.empty((*rotations.shape[:-1], 3))
    angles[..., second] = np.arctan2(-sign * matrix[..., third, first], cosine)
    angles[..., first] = np.arctan2(sign * matrix[..., third, second], matrix[..., third, third])
    angles[..., third] = np.arctan2(sign * matrix[..., second, first], matrix[..., first, first])
    if locked.any():  # the first and the last angle are about one axis: the last stays as it was
        both = np.arctan2(-sign * matrix[..., second, third], matrix[..., second, second])
        last = np.broadcast_to(before[..., third], both.shape)
        carried = np.where(angles[..., second] > 0.0, sign, -sign) * last
        angles[..., first] = np.where(locked, both + carried, angles[..., first])
        angles[..., third] = np.where(locked, last, angles[..., third])
    other = angles + np.pi
    other[..., second] = np.pi - angles[..., second]
    candidates = [_wound(each, before) for each in (angles, other)]
    farther = [np.abs(each - before).sum(axis=-1, keepdims=True) for each in candidates]
    return np.where(farther[1] < farther[0], candidates[1], candidates[0])


def _wound(angles: Floats, before: Floats) -> Floats:
    turn = 2.0 * np.pi
    return np.asarray(angles + turn * np.round((before - angles) / turn), np.float64)


def _order(mode: str) -> tuple[int, int, int]:
    first, second, third = ("XYZ".index(axis) for axis in mode)
    return first, second, third


def _directions(vectors: Floats, otherwise: Floats) -> Floats:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.where(lengths > 0.0, vectors / np.where(lengths > 0.0, lengths, 1.0), otherwise), np.float64)
