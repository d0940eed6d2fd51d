# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads a recorded take with the USD that Blender brings. No bpy.

A take's joints and an armature's bones have axes of their own, but move rigidly together, as in rig.py: with the
joint's motion from its rest pose, D_J = X_WJ(t) X_WJ(rest)^-1, in the world W of the take,

    M_AB(t) = X_WA^-1 D_J X_WA M_AB(rest)

X_WA takes the armature to where it was in that world when it was given to the server: it is found from where the joints
are that have bones' names, so that the armature may stand elsewhere by now.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from layfigure import LayfigureError
from layfigure.usd.skeleton_reader import find_skeletons
from layfigure.usd.stage import metres, open_stage, quiet

from .rig import Bone, MisfitError, check_similarity

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

SAME_SHARE = 1e-5  # of the skeleton's size, that joints may be from bones that stand there: roundings are smaller
FIT_SHARE = 0.01  # likewise, from bones of the same character: other characters are farther off
_OPEN_WEIGHT = 1e-9  # of `like`, beside points: above the roundings of points in a plane, below the depth of bodies
FRAME_ROUNDING = 1e-6  # of a frame
MOST_FRAMES = 1_000_000  # Blender has no more (MAXFRAME is 1 048 574)


@dataclass(frozen=True, eq=False)
class RecordedTake:
    path: Path
    names: tuple[str, ...]  # (J) of the joints, as the character's file has them
    rests: Floats  # (J, 4, 4), joint -> world, in metres, Z up
    poses: Floats  # (F, J, 4, 4), likewise


def read_take(path: Path, frames_per_second: float) -> RecordedTake:
    """At the frames of that rate from the take's beginning. Raises LayfigureError, one line."""
    stage = open_stage(path)
    with quiet():
        return _read(path, stage, frames_per_second)


def _read(path: Path, stage: Any, frames_per_second: float) -> RecordedTake:
    skeletons = find_skeletons(stage, metres(stage, "Z"))
    if len(skeletons) != 1:
        found = "no skeleton" if not skeletons else f"{len(skeletons)} skeletons"
        raise LayfigureError(f"'{path}' holds {found}, expected the one of a take of 'layfigure record'")
    [skeleton] = skeletons
    first, last, fps = stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()
    if not stage.HasAuthoredTimeCodeRange() or fps <= 0.0 or last < first:
        raise LayfigureError(f"'{path}' does not say which frames it has: expected a take of 'layfigure record'")
    count = int((last - first) / fps * frames_per_second + FRAME_ROUNDING) + 1
    if count > MOST_FRAMES:
        raise LayfigureError(f"'{path}' has {count} frames, expected at most {MOST_FRAMES}")
    codes = first + np.arange(count) * (fps / frames_per_second)
    return RecordedTake(
        path=path,
        names=tuple(skeleton.original_names()),
        rests=skeleton.rest(first),
        poses=skeleton.world(np.minimum(codes, last)),
    )


def bone_poses(
    take: RecordedTake, bones: Sequence[Bone], object_to_world: Floats, armature: str
) -> tuple[Ints, Floats]:
    """Which of the bones are joints of the take, and where all bones are, (F, B, 4, 4), bone -> armature. Bones that
    are no joints keep their rest place on their parents. Raises MisfitError for an armature of another character."""
    joints = {name: index for index, name in enumerate(take.names)}
    keyed = np.array([b for b, bone in enumerate(bones) if bone.name in joints], np.intp)
    if not len(keyed):
        raise MisfitError(f"'{take.path}': none of its joints, such as '{take.names[0]}', is a bone of '{armature}'")
    of_bones = np.array([joints[bones[b].name] for b in keyed])
    rests = np.array([bone.rest for bone in bones])
    heads, origins = rests[keyed, :3, 3], take.rests[of_bones, :3, 3]
    to_world = _placed(heads, origins, object_to_world)
    _require_fit(take.path, [bones[b].name for b in keyed], heads, origins, to_world)
    motions = take.poses[:, of_bones] @ np.linalg.inv(take.rests[of_bones])
    poses = np.empty((len(take.poses), len(bones), 4, 4))
    poses[:, keyed] = np.linalg.inv(to_world) @ motions @ to_world @ rests[keyed]
    is_keyed = np.isin(np.arange(len(bones)), keyed)
    for b, bone in enumerate(bones):
        if not is_keyed[b]:
            above = poses[:, bone.parent] @ np.linalg.inv(rests[bone.parent]) if bone.parent >= 0 else np.eye(4)
            poses[:, b] = above @ rests[b]
    return keyed, poses


def _placed(heads: Floats, origins: Floats, object_to_world: Floats) -> Floats:
    """X_WA, (4, 4): as the armature stands now, if its heads (n, 3) are then at the joints (n, 3); else the similarity
    that takes them there best."""
    check_similarity(object_to_world)
    if _distances(heads, origins, object_to_world).max() <= SAME_SHARE * _size(origins):
        return object_to_world
    return similarity(heads, origins, object_to_world)


def similarity(source: Floats, target: Floats, like: Floats) -> Floats:
    """(4, 4) with the least sum of squares from points (n, 3) to points (n, 3), mirrors included.

    Umeyama 1991, "Least-squares estimation of transformation parameters between two point patterns". Points in a plane
    leave it open whether there is a mirror, those on a line how it is turned about that, a single one all but the
    place: there it is as in `like`, a similarity.
    """
    linear = like[:3, :3]
    scale = float(np.cbrt(abs(np.linalg.det(linear))))
    middle, aim = source.mean(axis=0), target.mean(axis=0)
    spread = float(((source - middle) ** 2).sum())
    if spread > 0.0:
        covariance = (target - aim).T @ (source - middle)
        weight = _OPEN_WEIGHT * np.linalg.norm(covariance)
        turn = linear / scale
        for _ in range(2):  # the first time it is drawn a little to `like`; then to what was found, which does nothing
            u, _, vt = np.linalg.svd(covariance + weight * turn)
            turn = u @ vt
        scale = float((turn * covariance).sum()) / spread
        linear = scale * turn
    result = np.eye(4)
    result[:3, :3] = linear
    result[:3, 3] = aim - linear @ middle
    return result


def _require_fit(path: Path, names: Sequence[str], heads: Floats, origins: Floats, to_world: Floats) -> None:
    off = _distances(heads, origins, to_world)
    worst = int(off.argmax())
    if off[worst] > FIT_SHARE * _size(origins):
        raise MisfitError(
            f"'{path}' is of a character of other proportions: its joint '{names[worst]}' is {off[worst]:.2g} m from "
            "the bone of that name"
        )


def _distances(heads: Floats, origins: Floats, to_world: Floats) -> Floats:
    return np.asarray(np.linalg.norm(heads @ to_world[:3, :3].T + to_world[:3, 3] - origins, axis=1), np.float64)


def _size(points: Floats) -> float:
    """Of a skeleton [m]; of a single joint that of anything."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0
