"""From poses at simulation times to frames at a fixed rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from layfigure import rotation
from layfigure.protocol import Floats
from layfigure.take import Take

Indices = NDArray[np.intp]

_TIME_TOLERANCE_US = 0.5  # time stamps are rounded to whole microseconds


@dataclass(frozen=True, eq=False)
class Frames:
    """F frames: frame k is at k / fps seconds after the take's first pose."""

    fps: float
    root_translations: Floats  # (F, 3)
    rotations: Floats  # (F, J, 4), neighbours in one hemisphere
    rest_rotations: Floats  # (F, J, 4), likewise
    torques: Floats  # (F, J, 3)

    def __len__(self) -> int:
        return len(self.rotations)


def resample(take: Take, fps: float) -> Frames:
    """Slerp between the two poses around each frame; translations and torques linearly."""
    left, right, part = _neighbours(take.times_us.astype(np.float64), fps)

    def linear(values: Floats) -> Floats:
        weight = part.reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray((1.0 - weight) * values[left] + weight * values[right], np.float64)

    def spherical(values: Floats) -> Floats:
        return rotation.in_one_hemisphere(rotation.slerp(values[left], values[right], part[:, None]))

    return Frames(
        fps=fps,
        root_translations=linear(take.root_translations),
        rotations=spherical(take.rotations),
        rest_rotations=spherical(take.rest_rotations),
        torques=linear(take.torques),
    )


def _neighbours(times_us: Floats, fps: float) -> tuple[Indices, Indices, Floats]:
    """For each frame the pose before it, the one after it, and how far it is between the two, 0 to 1."""
    frame_us = 1e6 / fps
    count = int((times_us[-1] + _TIME_TOLERANCE_US) // frame_us) + 1
    wanted_us = np.minimum(np.arange(count) * frame_us, times_us[-1])
    last = len(times_us) - 1
    left = np.clip(np.searchsorted(times_us, wanted_us, side="right") - 1, 0, max(last - 1, 0))
    right = np.minimum(left + 1, last)
    span = np.maximum(times_us[right] - times_us[left], 1.0)
    return left, right, (wanted_us - times_us[left]) / span
