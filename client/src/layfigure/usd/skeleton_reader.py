"""Reads the skeletons of a USD file at any time: rigid joint frames in the world, in metres."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel

from layfigure.protocol import Floats

_SCALE_TOLERANCE = 1e-3  # half3 rounds at 5e-4


class PosedSkeleton:
    """One Skeleton. Matrices act on column vectors and hold no scale: what the file scales is in their origins."""

    def __init__(self, prim: Any, to_world: Any) -> None:
        """`to_world` takes the stage's units and axes to those of the world."""
        self._cache = UsdSkel.Cache()
        self._skeleton = UsdSkel.Skeleton(prim)
        root = UsdSkel.Root.Find(prim)
        if root:
            self._cache.Populate(root, Usd.TraverseInstanceProxies())
        self._query = self._cache.GetSkelQuery(self._skeleton)
        self._to_world = to_world
        self.prim = prim
        self.joints = [str(token) for token in self._query.GetJointOrder()] if self._query else []
        topology = UsdSkel.Topology(self.joints)
        self.parents = [int(topology.GetParent(index)) for index in range(len(self.joints))]

    @property
    def is_animated(self) -> bool:
        return bool(self._query and self._query.GetAnimQuery())

    def world(self, frame: float) -> Floats:
        """(J, 4, 4)."""
        return self._rigid(self._query.ComputeJointSkelTransforms(frame), frame)

    def bind(self, frame: float) -> Floats:
        """(J, 4, 4), where the skeleton stands in that frame."""
        return self._rigid(self._query.GetJointWorldBindTransforms(), frame)

    def rest(self, frame: float) -> Floats:
        """(J, 4, 4), likewise."""
        return self._rigid(self._query.ComputeJointSkelTransforms(frame, True), frame)

    def scaled_joint(self, frame: float) -> str:
        """The first joint that has a scale of its own in that frame, empty if none has."""
        matrices = np.array(self._query.ComputeJointSkelTransforms(frame), np.float64).reshape(-1, 4, 4)
        sizes = np.linalg.norm(matrices[:, :3, :3], axis=2)
        scaled = np.abs(sizes - 1.0).max(axis=1) > _SCALE_TOLERANCE
        return self.joints[int(np.argmax(scaled))] if scaled.any() else ""

    def original_names(self) -> list[str]:
        """As the character's file had them, where a take keeps that; else the ends of the joints' paths."""
        kept = self.prim.GetCustomDataByKey("layfigure:jointNames")
        if kept is not None and len(kept) == len(self.joints):
            return [str(name) for name in kept]
        return [joint.rpartition("/")[2] for joint in self.joints]

    def _placed(self, frame: float) -> Any:
        return UsdGeom.XformCache(frame).GetLocalToWorldTransform(self.prim) * self._to_world

    def _rigid(self, matrices: Any, frame: float) -> Floats:
        placed = np.array(self._placed(frame), np.float64)
        return without_scale((np.array(matrices, np.float64).reshape(-1, 4, 4) @ placed).swapaxes(1, 2))


def without_scale(matrices: Floats) -> Floats:
    """The nearest rotations, by the polar decomposition; mirrored axes are turned back."""
    result = np.array(matrices, np.float64)
    u, _, vt = np.linalg.svd(result[:, :3, :3])
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    result[:, :3, :3] = u @ vt
    return result


def local_matrices(world: Floats, parents: list[int]) -> Floats:
    """(J, 4, 4) of each joint in its parent's frame; roots stay in the world."""
    local = world.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            local[joint] = np.linalg.inv(world[parent]) @ world[joint]
    return local


def find_skeletons(stage: Any, to_world: Any) -> list[PosedSkeleton]:
    """Those with joints, in the order of the file."""
    prims = Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies())
    found = [PosedSkeleton(prim, to_world) for prim in prims if prim.IsA(UsdSkel.Skeleton)]
    return [skeleton for skeleton in found if skeleton.joints]
