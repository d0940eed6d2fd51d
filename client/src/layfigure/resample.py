"""From poses at simulation times to frames at a fixed rate."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from layfigure import rotation
from layfigure.protocol import Bools, Character, Floats
from layfigure.skeleton import first_root
from layfigure.take import PointerTrack, Take, Times

_BLOCK = 1024  # frames between whose poses slerp goes at once: more would fill the memory with what it needs besides
_TIME_TOLERANCE_US = 0.5  # time stamps are rounded to whole microseconds


@dataclass(frozen=True, eq=False)
class Frames:
    """F frames: frame k is at k / fps seconds after the take's first pose."""

    fps: float
    root_translations: Floats  # (F, 3)
    rotations: Floats  # (F, J, 4), neighbours in one hemisphere

    def __len__(self) -> int:
        return len(self.rotations)


def resample(take: Take, fps: float) -> Frames:
    """Slerp between the two poses around each frame; translations linearly."""
    between = Between(take.times_us, frame_times_us(take.times_us, fps))
    return Frames(
        fps=fps,
        root_translations=between.linear(take.root_translations),
        rotations=rotation.in_one_hemisphere(between.spherical(take.rotations)),
    )


def frame_times_us(times_us: Times, fps: float, first: int = 0) -> Floats:
    """Of the frames from `first` on that poses at these times reach."""
    frame_us = 1e6 / fps
    count = int((times_us[-1] + _TIME_TOLERANCE_US) // frame_us) + 1
    return np.asarray(np.minimum(np.arange(first, count) * frame_us, times_us[-1]), np.float64)


def at_rest(frames: Frames, character: Character, moving: Bools) -> Frames:
    """The same, with all but the moving joints (J) at rest as the character came."""
    if moving.all():
        return frames
    rests = np.array([joint.rest_rotation for joint in character.joints])
    root = first_root(character)
    roots = frames.root_translations
    still = np.broadcast_to(character.joints[root].rest_translation, roots.shape)
    return dataclasses.replace(
        frames,
        rotations=np.where(moving[:, None], frames.rotations, rests),
        root_translations=roots if moving[root] else still,
    )


@dataclass(frozen=True, eq=False)
class Felt:
    """What the joints bear in each frame."""

    rest_rotations: Floats  # (F, J, 4), neighbours in one hemisphere
    torques: Floats  # (F, J, 3) [N m], in the joint's frame
    yielded: Bools  # (F, J)


def felt(take: Take, fps: float) -> Felt:
    """Of the frames of resample(): slerp, torques linearly; a joint flows while the newest pose says so."""
    between = Between(take.times_us, frame_times_us(take.times_us, fps))
    return Felt(
        rest_rotations=rotation.in_one_hemisphere(between.spherical(take.rest_rotations)),
        torques=between.linear(take.torques),
        yielded=between.newest(take.yielded),
    )


@dataclass(frozen=True, eq=False)
class Pulls:
    """What a pointer does to the doll in each frame."""

    joints: NDArray[np.int64]  # (F) held joint, -1 for none
    positions: Floats  # (F, 3) of the held point, world [m]
    forces: Floats  # (F, 3) on the doll, world [N]


def pulls(track: PointerTrack, frames: Frames) -> Pulls:
    """What the newest message said in each frame; before the first one nothing is held."""
    index = np.searchsorted(track.times_us, np.arange(len(frames)) * (1e6 / frames.fps) + _TIME_TOLERANCE_US) - 1
    heard = index >= 0
    return Pulls(
        joints=np.where(heard, track.joints[index], -1),
        positions=np.where(heard[:, None], track.positions[index], 0.0),
        forces=np.where(heard[:, None], track.forces[index], 0.0),
    )


class Between:
    """For each wanted time the pose before it, the one after it, and how far it is between the two, 0 to 1."""

    def __init__(self, times_us: Times, wanted_us: Floats) -> None:
        last = len(times_us) - 1
        times = times_us.astype(np.float64)
        self.left = np.clip(np.searchsorted(times, wanted_us, side="right") - 1, 0, max(last - 1, 0))
        self.right = np.minimum(self.left + 1, last)
        span = np.maximum(times[self.right] - times[self.left], 1.0)
        self.part = (wanted_us - times[self.left]) / span

    def linear(self, values: Floats) -> Floats:
        weight = self.part.reshape(-1, *[1] * (values.ndim - 1))
        return np.asarray((1.0 - weight) * values[self.left] + weight * values[self.right], np.float64)

    def spherical(self, values: Floats) -> Floats:
        turned = np.empty((len(self.part), *values.shape[1:]))
        for start in range(0, len(turned), _BLOCK):
            block = slice(start, start + _BLOCK)
            ends = values[self.left[block]], values[self.right[block]]
            turned[block] = rotation.slerp(*ends, self.part[block, None])
        return turned

    def newest(self, values: Bools) -> Bools:
        return np.asarray(values[np.where(self.part < 1.0, self.left, self.right)], np.bool_)
