"""What is plotted of a take, from an event log or from USD: the torques of its joints, the forces of its hands."""

from __future__ import annotations

import fnmatch
from dataclasses import dataclass

import numpy as np

from layfigure.analysis import summarize, torque_sizes
from layfigure.errors import UsageError
from layfigure.protocol import Bools, Floats
from layfigure.take import PointerTrack, Take, Times


@dataclass(frozen=True, eq=False)
class JointLoads:
    """N values, at the times of its Loads."""

    name: str
    torques: Floats  # (N) sizes [N m]
    yield_torque: float  # [N m] about its weakest axis, infinity for an elastic joint
    flows: Bools  # (N)
    rest_moved_deg: float | None  # of its rest rotation, from the first pose to the last; None: not told

    @property
    def load(self) -> float:
        """Largest torque over yield torque: above 1 it flowed, or bore it about a stronger axis."""
        return float(self.torques.max(initial=0.0)) / self.yield_torque if self.yield_torque > 0.0 else 0.0


@dataclass(frozen=True, eq=False)
class HandLoads:
    """M values, at times of their own."""

    pointer: int
    times_s: Floats  # (M)
    forces: Floats  # (M) sizes [N]
    holds: Bools  # (M)
    joint_names: list[str]  # (M) held or touched, empty: none


@dataclass(frozen=True, eq=False)
class Loads:
    title: str
    times_s: Floats  # (N)
    joints: tuple[JointLoads, ...]  # of those with a body and a parent, parents before children
    hands: tuple[HandLoads, ...]


def loads_of_take(take: Take) -> Loads:
    sizes = torque_sizes(take)
    summaries = sorted(summarize(take), key=lambda summary: summary.joint)
    joints = tuple(
        JointLoads(
            name=summary.name,
            torques=sizes[:, summary.joint],
            yield_torque=summary.yield_torque,
            flows=take.yielded[:, summary.joint],
            rest_moved_deg=summary.rest_after_deg - summary.rest_before_deg,
        )
        for summary in summaries
    )
    hands = tuple(_hand(take, track) for track in take.pointers)
    return Loads(take.character.name, _seconds(take.times_us), joints, hands)


def _seconds(times_us: Times) -> Floats:
    return times_us.astype(np.float64) * 1e-6


def _hand(take: Take, track: PointerTrack) -> HandLoads:
    joints = take.character.joints
    return HandLoads(
        pointer=track.pointer,
        times_s=_seconds(track.times_us),
        forces=np.linalg.norm(track.forces, axis=1),
        holds=track.attached,
        joint_names=[joints[joint].name if joint >= 0 else "" for joint in track.joints],
    )


def short_name(name: str) -> str:
    """Without the rig's prefix."""
    return name.rpartition(":")[2]


def choose_joints(loads: Loads, patterns: list[str], most: int) -> list[JointLoads]:
    """Those whose names, with or without the rig's prefix, match a pattern; without patterns the most loaded `most` of
    those that can yield. Raises UsageError if a pattern matches none, or if they match more than `most`."""
    if not patterns:
        plastic = [joint for joint in loads.joints if np.isfinite(joint.yield_torque)]
        return sorted(plastic, key=lambda joint: -joint.load)[:most]
    for pattern in patterns:
        if not any(_matches(joint, pattern) for joint in loads.joints):
            raise UsageError(f"no joint of '{loads.title}' matches --joints '{pattern}'")
    chosen = [joint for joint in loads.joints if any(_matches(joint, pattern) for pattern in patterns)]
    if len(chosen) > most:
        raise UsageError(f"--joints matches {len(chosen)} joints, at most {most} can be read in one picture")
    return chosen


def _matches(joint: JointLoads, pattern: str) -> bool:
    return any(fnmatch.fnmatchcase(name, pattern) for name in (joint.name, short_name(joint.name)))
