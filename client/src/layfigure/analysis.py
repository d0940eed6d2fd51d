"""What a take says of its joints: how much they bore, which flowed, and what stayed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from layfigure import rotation
from layfigure.protocol import Floats
from layfigure.take import Take


@dataclass(frozen=True)
class JointSummary:
    """Angles are from the rest rotation that the character came with [deg]."""

    joint: int
    name: str
    largest_torque: float  # [N m]
    yield_torque: float  # [N m]
    yielded: bool
    rest_before_deg: float  # of the rest rotation in the first pose
    rest_after_deg: float  # in the last pose
    moved_deg: float  # of the joint's rotation, from the first pose to the last

    @property
    def load(self) -> float:
        """Largest torque over yield torque: above 1 it flowed."""
        return self.largest_torque / self.yield_torque if self.yield_torque > 0.0 else 0.0


def torque_sizes(take: Take) -> Floats:
    """(P, J) [N m]."""
    return np.asarray(np.linalg.norm(take.torques, axis=2), np.float64)


def summarize(take: Take) -> list[JointSummary]:
    """One for each joint with a body and a parent, the most loaded first."""
    sizes = torque_sizes(take)
    summaries = []
    for index, joint in enumerate(take.character.joints):
        if not joint.is_body or joint.parent < 0:
            continue
        rests, poses = take.rest_rotations[:, index], take.rotations[:, index]
        summaries.append(
            JointSummary(
                joint=index,
                name=joint.name,
                largest_torque=float(sizes[:, index].max()),
                yield_torque=joint.yield_torque,
                yielded=bool(take.yielded[:, index].any()),
                rest_before_deg=float(np.degrees(rotation.angle_between(joint.rest_rotation, rests[0]))),
                rest_after_deg=float(np.degrees(rotation.angle_between(joint.rest_rotation, rests[-1]))),
                moved_deg=float(np.degrees(rotation.angle_between(poses[0], poses[-1]))),
            )
        )
    return sorted(summaries, key=lambda summary: (-summary.load, summary.joint))
