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
    joints = (_Joints(stages[0], first), _Joints(stages[1], second))
    common = [name for name in joints[0].names if name in joints[1].index]
    if not common:
        raise LayfigureError(f"'{first}' and '{second}' have no joint in common")
    durations = (_duration_s(stages[0]), _duration_s(stages[1]))
    times_s = _common_times_s(stages[0], min(durations))
    angles, distances = _Tally(), _Tally()
    for time_s in times_s:
        frames = [stage.first_frame + time_s * stage.fps for stage in stages]
        a, b = (some.rotations(frame, common) for some, frame in zip(joints, frames, strict=True))
        angles.add(common, _angles(a, b)[:, None], time_s)
        meshes = [stage.posed(frame) for stage, frame in zip(stages, frames, strict=True)]
        _check_meshes(*meshes)
        for one, other in zip(*meshes, strict=True):
            distances.add([one.name], np.linalg.norm(one.points - other.points, axis=1)[None], time_s)
    return Differences(
        frames=len(times_s),
        duration_s=min(durations),
        durations_s=durations,
        only_in=(
            tuple(name for name in joints[0].names if name not in joints[1].index),
            tuple(name for name in joints[1].names if name not in joints[0].index),
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

    def add(self, names: list[str], sizes: Floats, time_s: float) -> None:
        """A row for each name."""
        for name, largest in zip(names, sizes.max(axis=1, initial=0.0).tolist(), strict=True):
            if name not in self.worst or largest > self.worst[name].size:
                self.worst[name] = Worst(largest, name, time_s)
        self._squares += float(np.sum(sizes**2))
        self._count += sizes.size

    @property
    def rms(self) -> float:
        return float(np.sqrt(self._squares / self._count)) if self._count else 0.0


class _Joints:
    """The joints of all skeletons of a file, by their names, or their paths where names repeat; with several skeletons
    after the skeleton's number."""

    def __init__(self, stage: SkinnedStage, path: Path) -> None:
        self._skeletons = stage.skeletons()
        if not self._skeletons:
            raise LayfigureError(f"'{path}' holds no skeleton")
        self.names: list[str] = []
        for number, skeleton in enumerate(self._skeletons):
            short = [joint.rpartition("/")[2] for joint in skeleton.joints]
            names = short if len(set(short)) == len(short) else skeleton.joints
            self.names += [f"{number}:{name}" for name in names] if len(self._skeletons) > 1 else names
        self.index = {name: index for index, name in enumerate(self.names)}

    def rotations(self, frame: float, names: list[str]) -> Floats:
        """(N, 3, 3) of the named joints in their parents' frames."""
        every = np.concatenate([_local_rotations(skeleton, frame) for skeleton in self._skeletons])
        return np.asarray(every[[self.index[name] for name in names]])


def _local_rotations(skeleton: PosedSkeleton, frame: float) -> Floats:
    return local_matrices(skeleton.world(np.array([frame]))[0], skeleton.parents)[:, :3, :3]


def _angles(a: Floats, b: Floats) -> Floats:
    """(N) [rad], 0 to pi; exact for small ones too: |sin| from the skew part, cos from the trace."""
    r = a.swapaxes(1, 2) @ b
    skew = np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
    cosine = 0.5 * (np.trace(r, axis1=1, axis2=2) - 1.0)
    return np.asarray(np.arctan2(0.5 * np.linalg.norm(skew, axis=1), cosine), np.float64)


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
