"""Views as Blender has them, without Blender."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

REPOSITORY = Path(__file__).resolve().parents[3]
sys.path.append(str(REPOSITORY / "plugins/blender"))
from layfigure_blender.view import View  # noqa: E402


def looking(eye: np.ndarray, at: np.ndarray, roll: float = 0.0) -> np.ndarray:
    """(4, 4), world -> view, of an eye that looks at a point, upright but for the roll."""
    back = (eye - at) / np.linalg.norm(eye - at)
    helper = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(helper, back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    c, s = np.cos(roll), np.sin(roll)
    to_world = np.eye(4)
    to_world[:3, :3] = np.column_stack([c * right + s * up, c * up - s * right, back])
    to_world[:3, 3] = eye
    return np.linalg.inv(to_world)


def perspective(
    width: float, height: float, *, focal: float = 2.0, shift: tuple[float, float] = (0.0, 0.0), near: float = 0.01
) -> np.ndarray:
    """(4, 4), as of a camera: focal lengths per half of the width, the shift in halves of the region."""
    far = 1000.0
    matrix = np.zeros((4, 4))
    matrix[0, 0], matrix[1, 1] = focal, focal * width / height
    matrix[0, 2], matrix[1, 2] = shift
    matrix[2, 2], matrix[2, 3] = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    matrix[3, 2] = -1.0
    return matrix


def orthographic(
    width: float, height: float, *, seen: float = 2.0, shift: tuple[float, float] = (0.0, 0.0)
) -> np.ndarray:
    """(4, 4), as of an axis view: so much of the world from left to right; what is behind the eye is seen too."""
    far = 1000.0
    matrix = np.eye(4)
    matrix[0, 0], matrix[1, 1], matrix[2, 2] = 2.0 / seen, 2.0 / seen * width / height, -1.0 / far
    matrix[0, 3], matrix[1, 3] = shift
    return matrix


def random_view(rng: np.random.Generator) -> View:
    """Anything that a region may show: axis views, cameras with shift, quad views' slim regions."""
    width, height = rng.uniform(100.0, 3000.0, 2)
    eye, at = rng.normal(0.0, 4.0, 3), rng.normal(0.0, 1.0, 3)
    shift = tuple(rng.uniform(-0.5, 0.5, 2))
    if rng.random() < 0.5:
        window = perspective(width, height, focal=rng.uniform(0.5, 8.0), shift=shift, near=10.0 ** rng.uniform(-3, 0))
    else:
        window = orthographic(width, height, seen=10.0 ** rng.uniform(-2, 2), shift=shift)
    return View(looking(eye, at, rng.uniform(-np.pi, np.pi)), window, width, height)


def front_view(width: float = 800.0, height: float = 600.0) -> View:
    """Perspective, from 4 m in front (-y): x to the right, z up."""
    eye = np.array([0.0, -4.0, 1.0])
    view = np.eye(4)
    view[:3, :3] = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    view[:3, 3] = -view[:3, :3] @ eye
    return View(view, perspective(width, height), width, height)


def shifted(pixel: np.ndarray, x: float, y: float) -> np.ndarray:
    return pixel + np.array([x, y])
