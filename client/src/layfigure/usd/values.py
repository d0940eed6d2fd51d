"""NumPy arrays to USD's value arrays. Quaternions are w x y z here and x y z w in USD's buffers."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Vt

from layfigure import rotation
from layfigure.protocol import Floats


def quatf_array(q: Floats) -> Any:
    """(J, 4), normalised before it is rounded to float."""
    return quatf_arrays(q[None])[0]


def quatf_arrays(q: Floats) -> list[Any]:
    """An array for each frame of (F, J, 4), as quatf_array()."""
    rounded = np.roll(rotation.normalized(q), -1, axis=-1).astype(np.float32)
    return [Vt.QuatfArray.FromNumpy(row) for row in rounded]


def vec3f_array(vectors: Any) -> Any:
    """(N, 3)."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(vectors, np.float32))


def vec2f_array(vectors: Any) -> Any:
    """(N, 2)."""
    return Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(vectors, np.float32))


def vec3f_arrays(vectors: Floats) -> list[Any]:
    """An array for each frame of (F, N, 3)."""
    return [Vt.Vec3fArray.FromNumpy(row) for row in np.ascontiguousarray(vectors, np.float32)]


def vec3h_array(vectors: Any) -> Any:
    """(N, 3)."""
    return Vt.Vec3hArray.FromNumpy(np.ascontiguousarray(vectors, np.float16))


def int_array(values: Any) -> Any:
    return Vt.IntArray.FromNumpy(np.ascontiguousarray(values, np.int32).reshape(-1))


def float_array(values: Any) -> Any:
    return Vt.FloatArray.FromNumpy(np.ascontiguousarray(values, np.float32).reshape(-1))


def double_array(values: Any) -> Any:
    return Vt.DoubleArray.FromNumpy(np.ascontiguousarray(values, np.float64).reshape(-1))


def extent_of(points: Any) -> Any:
    """The axis-aligned box of (N, 3) points, as USD's `extent`."""
    return vec3f_array(np.stack([np.min(points, axis=0), np.max(points, axis=0)]))


def matrix4d(q: Floats, translation: Floats) -> Any:
    """A rigid transform; USD's matrices act on row vectors."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation.to_matrix(q).T
    matrix[3, :3] = translation
    return Gf.Matrix4d(matrix.tolist())
