"""A take: the poses of one character in order, with the forces on it, and what joins them together."""

from __future__ import annotations

import bisect
import math
from array import array
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from layfigure.errors import LayfigureError, ProtocolError
from layfigure.protocol import Bools, Character, Floats, Force, Mesh, Pose, Reply, Status
from layfigure.spilled_rows import SpilledRows

Times = NDArray[np.int64]
_FORCE = np.dtype(
    [
        ("time_us", np.int64),
        ("attached", np.bool_),
        ("joint", np.int64),
        ("position", np.float64, (3,)),
        ("force", np.float64, (3,)),
    ]
)


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


@dataclass(frozen=True)
class _LastPose:
    server_id: int
    sequence: int
    time_us: int  # of the server, not of the take


@dataclass(frozen=True)
class _Run:
    """Poses of one run of a server."""

    first_pose: int
    forces_before: dict[int, int]  # how many there were of each pointer
    pose_before: _LastPose | None
    offset_before_us: int


class TakeBuilder:
    """Collects messages. Poses of a restarted server go on one pose period after the last one before it.

    Poses and forces are kept on the disk, in files without names: of each pose 8 bytes stay in memory, its time. For J
    joints a pose takes 24 + 89 J bytes there, a force 65.
    """

    def __init__(self, character: Character, meshes: tuple[Mesh, ...], folder: Path | None = None) -> None:
        """`folder` is where the poses are kept, else in that of temporary files."""
        self._character = character
        self._meshes = meshes
        self._folder = folder
        joints = len(character.joints)
        self._root_translations = SpilledRows(np.float64, (3,), folder)
        self._rotations = SpilledRows(np.float64, (joints, 4), folder)
        self._rest_rotations = SpilledRows(np.float64, (joints, 4), folder)
        self._torques = SpilledRows(np.float64, (joints, 3), folder)
        self._yielded = SpilledRows(np.bool_, (joints,), folder)
        self._times_us = array("q")
        self._last_pose: _LastPose | None = None
        self._runs: list[_Run] = []
        self._forces: dict[int, SpilledRows] = {}  # of each pointer
        self._force_counts: dict[int, int] = {}
        self._marks: list[tuple[int, int]] = []  # time, server's id
        self._offset_us = 0
        self._last_status: Status | None = None
        self.lost_poses = 0
        self.restarts = 0

    @property
    def pose_count(self) -> int:
        return len(self._times_us)

    @property
    def duration_s(self) -> float:
        return self._times_us[-1] * 1e-6 if self._times_us else 0.0

    def add_pose(self, pose: Pose) -> None:
        """Raises LayfigureError if the pose is of another character, as a take has one, or if there is no room."""
        self._check(pose)
        last = self._last_pose
        if last is None:
            self._begin_run()
            self._offset_us = -pose.time_us
        elif pose.server_id != last.server_id:
            self.restarts += 1
            self._begin_run()
            self._begin_segment(pose)
        elif pose.sequence <= last.sequence:
            return  # a message that came twice
        else:
            self.lost_poses += pose.sequence - last.sequence - 1
            if pose.time_us <= last.time_us:  # the simulation was set back
                self._begin_segment(pose)
        self._put(pose)
        self._last_pose = _LastPose(pose.server_id, pose.sequence, pose.time_us)

    def add_force(self, force: Force) -> None:
        """A force belongs to the pose that came before it, and is left out without one."""
        if not self._is_of_this_run(force.server_id):
            return
        pointer, time_us = force.pointer, force.time_us + self._offset_us
        if pointer not in self._forces:
            self._forces[pointer] = SpilledRows(_FORCE, folder=self._folder)
        count = self._force_counts.get(pointer, 0)
        row = (time_us, force.attached, force.joint, force.position, force.force)
        self._forces[pointer].put(count, np.array(row, _FORCE))
        self._force_counts[pointer] = count + 1

    def add_mark(self, reply: Reply) -> None:
        """The answer to a `key` command; one that comes before the take's first pose is not in it."""
        mark = (reply.time_us + self._offset_us, reply.server_id)
        if self._is_of_this_run(reply.server_id) and mark[0] >= 0 and mark not in self._marks:
            self._marks.append(mark)

    def add_status(self, status: Status) -> None:
        self._last_status = status

    def drop_run(self, server_id: int) -> None:
        """Forgets the poses at the end that came from this run of a server, and the forces with them."""
        if self._is_of_this_run(server_id):
            run = self._runs.pop()
            del self._times_us[run.first_pose :]
            self._force_counts = {pointer: run.forces_before.get(pointer, 0) for pointer in self._forces}
            self._last_pose, self._offset_us = run.pose_before, run.offset_before_us
        self._marks = [mark for mark in self._marks if mark[1] != server_id]

    def motion_since(self, first: int) -> Motion:
        """From pose `first` on, of which there is one or more."""
        end = len(self._times_us)
        return Motion(
            times_us=np.array(self._times_us[first:], np.int64),
            root_translations=self._root_translations.rows(first, end),
            rotations=self._rotations.rows(first, end),
        )

    def build(self, duration_s: float = math.inf) -> Take:
        """Up to the first pose at or after `duration_s`. Raises LayfigureError if there is no pose.

        The take's arrays of poses are read from the disk where they are asked for, and cannot be written to.
        """
        if not self._times_us:
            raise LayfigureError("nothing was recorded: no pose arrived")
        count = min(bisect.bisect_left(self._times_us, duration_s * 1e6) + 1, len(self._times_us))
        end_us = self._times_us[count - 1]
        return Take(
            character=self._character,
            meshes=self._meshes,
            times_us=np.array(self._times_us[:count], np.int64),
            root_translations=self._root_translations.rows(0, count),
            rotations=self._rotations.rows(0, count),
            rest_rotations=self._rest_rotations.rows(0, count),
            torques=self._torques.rows(0, count),
            yielded=self._yielded.rows(0, count),
            pointers=tuple(
                _track(pointer, self._forces[pointer].rows(0, self._force_counts[pointer]))
                for pointer in sorted(self._forces)
            ),
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

    def _is_of_this_run(self, server_id: int) -> bool:
        return self._last_pose is not None and self._last_pose.server_id == server_id

    def _begin_run(self) -> None:
        self._runs.append(_Run(len(self._times_us), dict(self._force_counts), self._last_pose, self._offset_us))

    def _begin_segment(self, pose: Pose) -> None:
        period_us = round(1e6 / self._character.pose_hz)
        self._offset_us = self._times_us[-1] + period_us - pose.time_us

    def _put(self, pose: Pose) -> None:
        """The time last: a pose is there when all of it is."""
        index = len(self._times_us)
        self._root_translations.put(index, pose.root_translation)
        self._rotations.put(index, pose.rotations)
        self._rest_rotations.put(index, pose.rest_rotations)
        self._torques.put(index, pose.torques)
        self._yielded.put(index, pose.yielded)
        self._times_us.append(pose.time_us + self._offset_us)


def _track(pointer: int, forces: NDArray[np.void]) -> PointerTrack:
    return PointerTrack(
        pointer=pointer,
        times_us=np.array(forces["time_us"]),
        attached=np.array(forces["attached"]),
        joints=np.array(forces["joint"]),
        positions=np.array(forces["position"]),
        forces=np.array(forces["force"]),
    )
