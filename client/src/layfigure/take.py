"""A take: the poses of one character in order, with the forces on it, and what joins them together."""

from __future__ import annotations

import bisect
import math
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from layfigure.errors import LayfigureError, ProtocolError
from layfigure.protocol import Bools, Character, Floats, Force, Mesh, Pose, Reply, Status

Times = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class PointerTrack:
    """What one pointer did to the doll; N force messages."""

    pointer: int
    times_us: Times  # (N) since the take's first pose
    attached: Bools  # (N)
    joints: NDArray[np.int64]  # (N) held joint, -1 for none
    positions: Floats  # (N, 3) of the held point, world [m]
    forces: Floats  # (N, 3) on the doll, world [N]


@dataclass(frozen=True, eq=False)
class Motion:
    """P poses."""

    times_us: Times  # (P) since the take's first pose
    root_translations: Floats  # (P, 3)
    rotations: Floats  # (P, J, 4)


@dataclass(frozen=True, eq=False)
class Take:
    """P poses of one character with J joints."""

    character: Character
    meshes: tuple[Mesh, ...]
    times_us: Times  # (P) simulation time since the first pose, strictly growing
    root_translations: Floats  # (P, 3)
    rotations: Floats  # (P, J, 4)
    rest_rotations: Floats  # (P, J, 4)
    torques: Floats  # (P, J, 3) [N m], in the joint's frame
    yielded: Bools  # (P, J)
    pointers: tuple[PointerTrack, ...]
    lost_poses: int
    restarts: int  # of the server, in the middle of the take
    last_status: Status | None
    marks_us: Times = field(default_factory=lambda: np.zeros(0, np.int64))  # when the user marked a key, rising

    @property
    def duration_s(self) -> float:
        return float(self.times_us[-1]) * 1e-6


class TakeBuilder:
    """Collects messages. Poses of a restarted server go on one pose period after the last one before it."""

    def __init__(self, character: Character, meshes: tuple[Mesh, ...]) -> None:
        self._character = character
        self._meshes = meshes
        self._poses: list[Pose] = []
        self._times_us: list[int] = []
        self._forces: dict[int, list[tuple[int, Force]]] = defaultdict(list)
        self._marks: list[tuple[int, int]] = []  # time, server's id
        self._offset_us = 0
        self._last_status: Status | None = None
        self.lost_poses = 0
        self.restarts = 0

    @property
    def pose_count(self) -> int:
        return len(self._poses)

    @property
    def duration_s(self) -> float:
        return self._times_us[-1] * 1e-6 if self._times_us else 0.0

    def add_pose(self, pose: Pose) -> None:
        """Raises LayfigureError if the pose is of another character: a take has one."""
        self._check(pose)
        if not self._poses:
            self._offset_us = -pose.time_us
        elif pose.server_id != self._poses[-1].server_id:
            self.restarts += 1
            self._begin_segment(pose)
        elif pose.sequence <= self._poses[-1].sequence:
            return  # a message that came twice
        else:
            self.lost_poses += pose.sequence - self._poses[-1].sequence - 1
            if pose.time_us <= self._poses[-1].time_us:  # the simulation was set back
                self._begin_segment(pose)
        self._poses.append(pose)
        self._times_us.append(pose.time_us + self._offset_us)

    def add_force(self, force: Force) -> None:
        """A force belongs to the pose that came before it, and is left out without one."""
        if self._poses and force.server_id == self._poses[-1].server_id:
            self._forces[force.pointer].append((force.time_us + self._offset_us, force))

    def add_mark(self, reply: Reply) -> None:
        """The answer to a `key` command; one that comes before the take's first pose is not in it."""
        mark = (reply.time_us + self._offset_us, reply.server_id)
        if self._poses and reply.server_id == self._poses[-1].server_id and mark[0] >= 0 and mark not in self._marks:
            self._marks.append(mark)

    def add_status(self, status: Status) -> None:
        self._last_status = status

    def drop_run(self, server_id: int) -> None:
        """Forgets the poses at the end that came from this run of a server, and the forces with them."""
        while self._poses and self._poses[-1].server_id == server_id:
            del self._poses[-1], self._times_us[-1]
        for track in self._forces.values():
            track[:] = [(time_us, force) for time_us, force in track if force.server_id != server_id]
        self._marks = [mark for mark in self._marks if mark[1] != server_id]

    def motion_since(self, first: int) -> Motion:
        """From pose `first` on, of which there is one or more."""
        poses = self._poses[first:]
        return Motion(
            times_us=np.array(self._times_us[first:], np.int64),
            root_translations=np.array([pose.root_translation for pose in poses]),
            rotations=np.array([pose.rotations for pose in poses]),
        )

    def build(self, duration_s: float = math.inf) -> Take:
        """Up to the first pose at or after `duration_s`. Raises LayfigureError if there is no pose."""
        if not self._poses:
            raise LayfigureError("nothing was recorded: no pose arrived")
        poses = self._poses[: bisect.bisect_left(self._times_us, duration_s * 1e6) + 1]
        end_us = self._times_us[len(poses) - 1]
        return Take(
            character=self._character,
            meshes=self._meshes,
            times_us=np.array(self._times_us[: len(poses)], np.int64),
            root_translations=np.array([pose.root_translation for pose in poses]),
            rotations=np.array([pose.rotations for pose in poses]),
            rest_rotations=np.array([pose.rest_rotations for pose in poses]),
            torques=np.array([pose.torques for pose in poses]),
            yielded=np.array([pose.yielded for pose in poses]),
            pointers=tuple(_track(pointer, self._forces[pointer]) for pointer in sorted(self._forces)),
            lost_poses=self.lost_poses,
            restarts=self.restarts,
            last_status=self._last_status,
            marks_us=np.array(sorted({time_us for time_us, _ in self._marks if time_us <= end_us}), np.int64),
        )

    def _check(self, pose: Pose) -> None:
        if pose.content_hash != self._character.content_hash:
            raise LayfigureError(
                f"the server changed the character: the take of '{self._character.name}' ends here; start a new one"
            )
        counts = {len(pose.rotations), len(pose.rest_rotations), len(pose.torques), len(pose.yielded)}
        if counts != {len(self._character.joints)}:
            raise ProtocolError(f"pose of {len(pose.rotations)} joints, expected {len(self._character.joints)}")

    def _begin_segment(self, pose: Pose) -> None:
        period_us = round(1e6 / self._character.pose_hz)
        self._offset_us = self._times_us[-1] + period_us - pose.time_us


def _track(pointer: int, forces: list[tuple[int, Force]]) -> PointerTrack:
    return PointerTrack(
        pointer=pointer,
        times_us=np.array([time_us for time_us, _ in forces], np.int64),
        attached=np.array([force.attached for _, force in forces], np.bool_),
        joints=np.array([force.joint for _, force in forces], np.int64),
        positions=np.array([force.position for _, force in forces]),
        forces=np.array([force.force for _, force in forces]),
    )
