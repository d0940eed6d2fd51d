"""Takes of the synthetic character that move as a test says."""

from __future__ import annotations

import dataclasses

import numpy as np

from client_support.takes import make_take
from layfigure import rotation
from layfigure.protocol import Floats
from layfigure.take import Take

FPS = 50.0
FRAME_US = 20_000  # whole, so that every pose is a frame and nothing is interpolated


def moving_take(angles: Floats, roots: Floats | None = None) -> Take:
    """Turns each joint from its rest rotation about an axis of its own by angles (F, J) [rad]; roots (F, 3) [m]."""
    base = make_take(poses=1)
    rests = np.array([joint.rest_rotation for joint in base.character.joints])
    axes = np.random.default_rng(7).normal(size=(len(rests), 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    half = 0.5 * angles[..., None]
    turns = np.concatenate([np.cos(half), np.sin(half) * axes], axis=-1)
    count = len(angles)
    return dataclasses.replace(
        base,
        times_us=np.arange(count, dtype=np.int64) * FRAME_US,
        root_translations=np.repeat(base.root_translations, count, axis=0) if roots is None else roots,
        rotations=rotation.normalized(rotation.multiply(np.broadcast_to(rests, turns.shape), turns)),
        rest_rotations=np.repeat(rests[None], count, axis=0),
        torques=np.zeros((count, len(rests), 3)),
        yielded=np.zeros((count, len(rests)), np.bool_),
        pointers=(),
    )


def wandering(count: int, seed: int, size: float) -> Floats:
    """Angles (count, 4) of smooth motions of several periods, about `size` [rad]."""
    generator = np.random.default_rng(seed)
    times = np.arange(count)[:, None, None]
    frequencies = generator.uniform(0.02, 0.4, size=(1, 4, 5))
    phases = generator.uniform(0.0, 2.0 * np.pi, size=(1, 4, 5))
    return np.asarray((size * np.sin(frequencies * times + phases) / (1.0 + 20.0 * frequencies)).sum(axis=2))
