"""How two takes differ: their joints' rotations, and where their skins are.

Both are looked at in metres, Z up, at the same times since their starts, so other units, axes, rates of frames and
orders of joints are no difference.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from layfigure.errors import LayfigureError
from layfigure.protocol import Floats
from layfigure.usd.reader import PosedMesh, SkinnedStage
from layfigure.usd.skeleton_reader import PosedSkeleton, local_matrices

_END_TOLERANCE = 1e-6  # of a frame


@dataclass(frozen=True)
class Worst:
    """The largest of some differences, and where it is."""

    size: float
    name: str  # of the joint or the mesh
    time_s: float


@dataclass(frozen=True, eq=False)
class Differences:
    frames: int  # compared
    duration_s: float  # that both have
    durations_s: tuple[float, float]
    only_in: tuple[tuple[str, ...], tuple[str, ...]]  # joints of one of the two
    angles: dict[str, Worst]  # by joint: the largest [rad]
    angle_rms: float  # [rad] over joints and frames
    distances: dict[str, Worst]  # by mesh: the largest of its vertices' [m]; empty: none has a skin
    distance_rms: float  # [m] over vertices and frames

    @property
    def worst_angle(self) -> Worst:
        return max(self.angles.values(), key=lambda worst: worst.size)

    @property
    def worst_distance(self) -> Worst | None:
        return max(self.distances.values(), key=lambda worst: worst.size, default=None)


def compare(first: Path, second: Path) -> Differences:
    """At the frames of the first. Raises LayfigureError if a file has no skeleton, or if the two cannot be compared:
    no joint is in both, or their meshes are not the same."""
    stages = (SkinnedStage(first, needs_skin=False), SkinnedStage(second, needs_skin=False))
    joints = tuple(_joints(stage, path) for stage, path in zip(stages, (first, second), strict=True))
    common = [name for name in joints[0] if name in joints[1]]
    if not common:
        raise LayfigureError(f"'{first}' and '{second}' have no joint in common")
    durations = (_duration_s(stages[0]), _duration_s(stages[1]))
    times_s = _common_times_s(stages[0], min(durations))
    angles, distances = _Tally(), _Tally()
    for time_s in times_s:
        frames = [stage.first_frame + time_s * stage.fps for stage in stages]
        rotations = [_rotations(stage_joints, frame) for stage_joints, frame in zip(joints, frames, strict=True)]
        for name in common:
            angles.add(name, np.array([_angle(rotations[0][name], rotations[1][name])]), time_s)
        meshes = [stage.posed(frame) for stage, frame in zip(stages, frames, strict=True)]
        _check_meshes(*meshes)
        for a, b in zip(*meshes, strict=True):
            distances.add(a.name, np.linalg.norm(a.points - b.points, axis=1), time_s)
    return Differences(
        frames=len(times_s),
        duration_s=min(durations),
        durations_s=durations,
        only_in=(
            tuple(name for name in joints[0] if name not in joints[1]),
            tuple(name for name in joints[1] if name not in joints[0]),
        ),
        angles=angles.worst,
        angle_rms=angles.rms,
        distances=distances.worst,
        distance_rms=distances.rms,
    )


class _Tally:
    def __init__(self) -> None:
        self.worst: dict[str, Worst] = {}
        self._squares, self._count = 0.0, 0

    def add(self, name: str, sizes: Floats, time_s: float) -> None:
        largest = float(sizes.max(initial=0.0))
        if name not in self.worst or largest > self.worst[name].size:
            self.worst[name] = Worst(largest, name, time_s)
        self._squares += float(np.sum(sizes**2))
        self._count += len(sizes)

    @property
    def rms(self) -> float:
        return float(np.sqrt(self._squares / self._count)) if self._count else 0.0


_Joints = dict[str, tuple[PosedSkeleton, int]]


def _joints(stage: SkinnedStage, path: Path) -> _Joints:
    """By the joint's name, or its path where names repeat; with several skeletons after the skeleton's number."""
    skeletons = stage.skeletons()
    if not skeletons:
        raise LayfigureError(f"'{path}' holds no skeleton")
    several = len(skeletons) > 1
    found: _Joints = {}
    for number, skeleton in enumerate(skeletons):
        short = [joint.rpartition("/")[2] for joint in skeleton.joints]
        names = short if len(set(short)) == len(short) else skeleton.joints
        for index, name in enumerate(names):
            found[f"{number}:{name}" if several else name] = (skeleton, index)
    return found


def _rotations(joints: _Joints, frame: float) -> dict[str, Floats]:
    """(3, 3) of each joint in its parent's frame."""
    local = {}
    for skeleton, _ in joints.values():
        if id(skeleton) not in local:
            local[id(skeleton)] = local_matrices(skeleton.world(frame), skeleton.parents)
    return {name: local[id(skeleton)][index, :3, :3] for name, (skeleton, index) in joints.items()}


def _angle(a: Floats, b: Floats) -> float:
    """[rad], 0 to pi; exact for small ones too: |sin| from the skew part, cos from the trace."""
    r = a.T @ b
    sine = 0.5 * float(np.linalg.norm([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]))
    return float(np.arctan2(sine, 0.5 * (float(np.trace(r)) - 1.0)))


def _duration_s(stage: SkinnedStage) -> float:
    return max(stage.last_frame - stage.first_frame, 0.0) / stage.fps


def _common_times_s(stage: SkinnedStage, duration_s: float) -> list[float]:
    count = int(np.floor(duration_s * stage.fps + _END_TOLERANCE)) + 1
    return [number / stage.fps for number in range(count)]


def _check_meshes(first: list[PosedMesh], second: list[PosedMesh]) -> None:
    if len(first) != len(second):
        raise LayfigureError(f"the takes have {len(first)} and {len(second)} skinned meshes: they cannot be compared")
    for a, b in zip(first, second, strict=True):
        if len(a.points) != len(b.points):
            raise LayfigureError(
                f"mesh '{a.name}' has {len(a.points)} vertices, '{b.name}' of the other take {len(b.points)}: they "
                "cannot be compared"
            )
