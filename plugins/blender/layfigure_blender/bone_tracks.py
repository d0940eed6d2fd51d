# SPDX-License-Identifier: GPL-3.0-or-later
"""Between poses of all bones and what each bone has beside its parent, in many frames."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from layfigure import rotation

from . import actions, rotation_modes
from .actions import BoneCurves
from .key_tracks import Tracks
from .rig import Bone, moved_by

Floats = NDArray[np.float64]


def posed_tracks(armature: bpy.types.Object, bones: Sequence[Bone], driven: Sequence[int], poses: Floats) -> Tracks:
    """What the driven bones have to have to be where `poses` (F, B, 4, 4), bone -> armature, have them, with their ways
    of inheriting, as pose_writing.write() has them too.

    Other bones stand as they do now, those above the driven ones with their constraints; they, and what is no longer
    there, have no rotation and no location in the result.
    """
    found = [armature.pose.bones.get(bone.name) for bone in bones]
    wanted = [b for b in driven if found[b] is not None]
    asked = _with_ancestors(bones, wanted)
    rotations, locations = np.zeros((len(poses), len(bones), 4)), np.zeros((len(poses), len(bones), 3))
    rotations[..., 0] = 1.0
    is_wanted = np.isin(np.arange(len(bones)), wanted)
    moved = moved_by(bones, wanted)
    for frame, matrices in enumerate(poses):
        actual: dict[int, Matrix] = {}
        for b in asked:
            if b not in moved:
                actual[b] = found[b].matrix
                continue
            rest = found[b].bone
            above = {}
            if bones[b].parent >= 0:
                above = {
                    "parent_matrix": actual[bones[b].parent],
                    "parent_matrix_local": found[bones[b].parent].bone.matrix_local,
                }
            if is_wanted[b]:
                actual[b] = Matrix(matrices[b].tolist())
                basis = rest.convert_local_to_pose(actual[b], rest.matrix_local, invert=True, **above)
                locations[frame, b], rotations[frame, b], _ = basis.decompose()
            else:
                actual[b] = rest.convert_local_to_pose(found[b].matrix_basis, rest.matrix_local, **above)
    return Tracks(rotation.in_one_hemisphere(rotation.normalized(rotations)), locations)


def played_tracks(curves: BoneCurves, bones: Sequence[bpy.types.PoseBone], frames: Floats) -> Tracks:
    """What the bones have in these frames of the scene, by their curves or as they are now."""
    rotations = [_rotations(curves, bone, frames) for bone in bones]
    locations = [actions.channel(curves, bone, "location", frames) for bone in bones]
    return Tracks(np.stack(rotations, axis=1), np.stack(locations, axis=1))


def _rotations(curves: BoneCurves, bone: bpy.types.PoseBone, frames: Floats) -> Floats:
    mode = bone.rotation_mode
    return rotation_modes.to_rotations(mode, actions.channel(curves, bone, rotation_modes.property_of(mode), frames))


def _with_ancestors(bones: Sequence[Bone], wanted: Sequence[int]) -> list[int]:
    """Parents first."""
    found = set(wanted)
    for b in wanted:
        while (b := bones[b].parent) >= 0:
            found.add(b)
    return sorted(found)
