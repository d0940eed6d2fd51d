"""Reads BVH by the format's description alone, and where its joints are."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from layfigure.protocol import Floats


@dataclass
class BvhJoint:
    name: str
    parent: int
    offset: Floats
    channels: list[str] = field(default_factory=list)
    is_end: bool = False


@dataclass
class Bvh:
    joints: list[BvhJoint]
    frame_time: float
    motion: Floats  # (F, channels)

    def frames_of(self, frame: int) -> list[Floats]:
        """(4, 4) of each joint in the world: the offset, then the channels in their order."""
        values = iter(self.motion[frame])
        worlds: list[Floats] = []
        for joint in self.joints:
            local = np.eye(4)
            local[:3, 3] = joint.offset
            for channel in joint.channels:
                local = local @ _channel(channel, next(values))
            worlds.append(local if joint.parent < 0 else worlds[joint.parent] @ local)
        return worlds


def _channel(name: str, value: float) -> Floats:
    matrix = np.eye(4)
    axis = "XYZ".index(name[0])
    if name.endswith("position"):
        matrix[axis, 3] = value
        return matrix
    c, s = math.cos(math.radians(value)), math.sin(math.radians(value))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix


def read_bvh(path: Path) -> Bvh:
    words = iter(path.read_text().split())
    joints: list[BvhJoint] = []
    open_joints: list[int] = []
    for word in words:
        if word in ("ROOT", "JOINT", "End"):
            joints.append(
                BvhJoint(next(words), open_joints[-1] if open_joints else -1, np.zeros(3), is_end=word == "End")
            )
        elif word == "{":
            open_joints.append(len(joints) - 1)
        elif word == "}":
            open_joints.pop()
        elif word == "OFFSET":
            joints[open_joints[-1]].offset = np.array([float(next(words)) for _ in range(3)])
        elif word == "CHANNELS":
            joints[open_joints[-1]].channels = [next(words) for _ in range(int(next(words)))]
        elif word == "MOTION":
            break
    assert next(words) == "Frames:"
    count = int(next(words))
    assert (next(words), next(words)) == ("Frame", "Time:")
    frame_time = float(next(words))
    motion = np.array([float(word) for word in words]).reshape(count, -1)
    assert motion.shape[1] == sum(len(joint.channels) for joint in joints)
    return Bvh(joints, frame_time, motion)
