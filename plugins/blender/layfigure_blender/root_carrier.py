# SPDX-License-Identifier: GPL-3.0-or-later
"""Bones above the doll's root are not the doll's: it goes where they go."""

from __future__ import annotations

import bpy
import numpy as np

from . import pose_writing
from .rig import BoneMap, Floats


class RootCarrier:
    """Moves `bones.placement` with the bones that the doll's root hangs from, and keeps it in the .blend: what was
    recorded of the doll in its own world is seen where the doll was when that is imported without it."""

    def __init__(self) -> None:
        self._then: Floats | None = None  # (4, 4), of the root's parent when the doll was placed
        self._placement = np.eye(4)
        self._kept: Floats | None = None

    def begin_to_place(self, armature: bpy.types.Object, bones: BoneMap) -> None:
        self._then = self._now(armature, bones)

    def end_to_place(self, bones: BoneMap) -> None:
        self._placement = bones.placement

    def follow(self, armature: bpy.types.Object, bones: BoneMap) -> None:
        if self._then is not None:
            bones.placement = self._now(armature, bones) @ np.linalg.inv(self._then) @ self._placement
        if self._kept is None or not np.array_equal(self._kept, bones.placement):
            self._kept = bones.placement
            armature.layfigure.placement = bones.placement.ravel().tolist()

    @staticmethod
    def _now(armature: bpy.types.Object, bones: BoneMap) -> Floats:
        return np.array(pose_writing.parent_matrix(armature, bones), np.float64)


def kept_placement(armature: bpy.types.Object) -> Floats:
    """(4, 4): where the doll stood in the armature's space when it was seen last; the identity if it never was."""
    return np.array(armature.layfigure.placement, np.float64).reshape(4, 4)
