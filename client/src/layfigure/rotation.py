"""Rotations as unit quaternions w x y z, in arrays (..., 4); q and -q are the same rotation."""

from __future__ import annotations

import numpy as np

from layfigure.protocol import Floats

_SMALL_ANGLE = 1e-9  # [rad] below which a sine is its angle
_NEARLY_PARALLEL = 1.0 - 1e-12  # cosine of the half angle above which slerp's sine has lost its digits


def multiply(a: Floats, b: Floats) -> Floats:
    """The product a b: first b, then a."""
    aw, ax, ay, az = _components(a)
    bw, bx, by, bz = _components(b)
    product = _result(a, np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = aw * bw - ax * bx - ay * by - az * bz
    product[..., 1] = aw * bx + ax * bw + ay * bz - az * by
    product[..., 2] = aw * by - ax * bz + ay * bw + az * bx
    product[..., 3] = aw * bz + ax * by - ay * bx + az * bw
    return product


def conjugate(q: Floats) -> Floats:
    return np.asarray(q * np.array([1.0, -1.0, -1.0, -1.0]), np.float64)


def rotate(q: Floats, vectors: Floats) -> Floats:
    """R(q) v, for vectors (..., 3)."""
    u = 2.0 * _cross(q[..., 1:], vectors)
    return np.asarray(vectors + q[..., :1] * u + _cross(q[..., 1:], u), np.float64)


def to_matrix(q: Floats) -> Floats:
    """(..., 3, 3), whose columns are the rotated axes."""
    w, x, y, z = _components(q)
    matrix = np.empty((*q.shape[:-1], 3, 3))
    matrix[..., 0, 0] = 1.0 - 2.0 * (y * y + z * z)
    matrix[..., 0, 1] = 2.0 * (x * y - w * z)
    matrix[..., 0, 2] = 2.0 * (x * z + w * y)
    matrix[..., 1, 0] = 2.0 * (x * y + w * z)
    matrix[..., 1, 1] = 1.0 - 2.0 * (x * x + z * z)
    matrix[..., 1, 2] = 2.0 * (y * z - w * x)
    matrix[..., 2, 0] = 2.0 * (x * z - w * y)
    matrix[..., 2, 1] = 2.0 * (y * z + w * x)
    matrix[..., 2, 2] = 1.0 - 2.0 * (x * x + y * y)
    return matrix


def from_matrix(r: Floats) -> Floats:
    """(..., 4) of rotation matrices (..., 3, 3), by the largest of the four components, so that none loses digits."""
    xx, yy, zz = r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]
    a, b, c = r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]
    d, e, f = r[..., 0, 1] + r[..., 1, 0], r[..., 0, 2] + r[..., 2, 0], r[..., 1, 2] + r[..., 2, 1]
    # 4 times the outer product of the quaternion with itself: each row is the quaternion, times one of its components
    rows = np.stack(
        [
            np.stack([1.0 + xx + yy + zz, a, b, c], axis=-1),
            np.stack([a, 1.0 + xx - yy - zz, d, e], axis=-1),
            np.stack([b, d, 1.0 - xx + yy - zz, f], axis=-1),
            np.stack([c, e, f, 1.0 - xx - yy + zz], axis=-1),
        ],
        axis=-2,
    )
    largest = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    return normalized(np.take_along_axis(rows, largest[..., None, None], axis=-2)[..., 0, :])


def normalized(q: Floats) -> Floats:
    return np.asarray(q / np.linalg.norm(q, axis=-1, keepdims=True), np.float64)


def slerp(a: Floats, b: Floats, s: Floats) -> Floats:
    """From a (s = 0) to b (s = 1) at constant angular velocity, the short way round. s: (...)."""
    cosine = np.sum(a * b, axis=-1)
    b = np.where((cosine < 0.0)[..., None], -b, b)
    cosine = np.minimum(np.abs(cosine), 1.0)
    angle = np.arccos(cosine)
    sine = np.where(cosine > _NEARLY_PARALLEL, 1.0, np.sin(angle))
    near = cosine > _NEARLY_PARALLEL
    wa = np.where(near, 1.0 - s, np.sin((1.0 - s) * angle) / sine)
    wb = np.where(near, s, np.sin(s * angle) / sine)
    return normalized(wa[..., None] * a + wb[..., None] * b)


def angle_between(a: Floats, b: Floats) -> Floats:
    """The angle of the rotation from a to b [rad], 0 to pi."""
    difference = multiply(conjugate(a), b)
    return np.asarray(2.0 * np.arctan2(np.linalg.norm(difference[..., 1:], axis=-1), np.abs(difference[..., 0])))


def to_vector(q: Floats) -> Floats:
    """(..., 3): the axis times the angle [rad], 0 to pi."""
    q = np.where(q[..., :1] < 0.0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    small = sine < _SMALL_ANGLE
    return np.asarray(
        q[..., 1:] * np.where(small, 2.0, 2.0 * np.arctan2(sine, q[..., :1]) / np.where(small, 1.0, sine))
    )


def from_vector(vectors: Floats) -> Floats:
    """The rotation about an axis by the vector's length [rad]."""
    angle = np.linalg.norm(vectors, axis=-1, keepdims=True)
    small = angle < _SMALL_ANGLE
    share = np.where(small, 0.5, np.sin(0.5 * angle) / np.where(small, 1.0, angle))
    return np.concatenate([np.cos(0.5 * angle), share * vectors], axis=-1)


def in_one_hemisphere(q: Floats) -> Floats:
    """Signs chosen along axis 0 so that neighbours are closest: curves of the components are then continuous."""
    flips = np.ones(q.shape[:-1])
    flips[1:] = np.where(np.einsum("...k,...k->...", q[1:], q[:-1]) < 0.0, -1.0, 1.0)
    signs = np.cumprod(flips, axis=0)
    return np.asarray(q * signs[..., None], np.float64)


def _result(like: Floats, shape: tuple[int, ...]) -> Floats:
    """Empty, in the same order in memory: of arrays that are kept component by component it is so, too."""
    return np.empty_like(like, np.float64, shape=shape)


def _components(q: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    return q[..., 0], q[..., 1], q[..., 2], q[..., 3]


def _cross(a: Floats, b: Floats) -> Floats:
    """np.cross of vectors (..., 3), which spends more on finding out what it was given than on the product."""
    product = _result(a, np.broadcast_shapes(a.shape, b.shape))
    product[..., 0] = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    product[..., 1] = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    product[..., 2] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product
