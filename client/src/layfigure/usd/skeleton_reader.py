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

    def world(self, frames: Floats) -> Floats:
        """(F, J, 4, 4), at F time codes."""
        return without_scale(self._matrices(frames) @ self._placed_at(frames)).swapaxes(2, 3)

    def bind(self, frame: float) -> Floats:
        """(J, 4, 4), where the skeleton stands in that frame."""
        return self._rigid(self._query.GetJointWorldBindTransforms(), frame)

    def rest(self, frame: float) -> Floats:
        """(J, 4, 4), likewise."""
        return self._rigid(self._query.ComputeJointSkelTransforms(frame, True), frame)

    def scaled_joint(self, frames: Floats) -> tuple[str, float] | None:
        """The first joint that has a scale of its own, and in which frame."""
        sizes = np.linalg.norm(self._matrices(frames)[..., :3, :3], axis=3)
        scaled = np.argwhere(np.abs(sizes - 1.0).max(axis=2) > _SCALE_TOLERANCE)
        return (self.joints[scaled[0, 1]], float(frames[scaled[0, 0]])) if len(scaled) else None

    def _matrices(self, frames: Floats) -> Floats:
        """(F, J, 4, 4) in the skeleton's space, as USD has them: they act on rows."""
        matrices = [np.array(self._query.ComputeJointSkelTransforms(frame), np.float64) for frame in frames]
        return np.array(matrices).reshape(len(frames), len(self.joints), 4, 4)

    def _placed_at(self, frames: Floats) -> Floats:
        """(F, 1, 4, 4)."""
        return np.array([np.array(self._placed(frame), np.float64)[None] for frame in frames])

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
        return without_scale(np.array(matrices, np.float64).reshape(-1, 4, 4) @ placed).swapaxes(1, 2)


def without_scale(matrices: Floats) -> Floats:
    """Of matrices (..., 4, 4) that act on rows: the first axis keeps its direction, the second its plane with it, and
    the third is that of a right-handed frame."""
    result = np.array(matrices, np.float64)
    x, y = result[..., 0, :3], result[..., 1, :3]
    x = x / np.linalg.norm(x, axis=-1, keepdims=True)
    y = y - np.sum(x * y, axis=-1, keepdims=True) * x
    y = y / np.linalg.norm(y, axis=-1, keepdims=True)
    result[..., :3, :3] = np.stack([x, y, np.cross(x, y)], axis=-2)
    return result


def local_matrices(world: Floats, parents: list[int]) -> Floats:
    """(..., J, 4, 4) of each joint in its parent's frame, of rigid ones in the world; roots stay there."""
    local = world.copy()
    children = [joint for joint, parent in enumerate(parents) if parent >= 0]
    above = world[..., [parents[joint] for joint in children], :, :]
    turned = above[..., :3, :3].swapaxes(-1, -2)
    local[..., children, :3, :3] = turned @ world[..., children, :3, :3]
    local[..., children, :3, 3:] = turned @ (world[..., children, :3, 3:] - above[..., :3, 3:])
    return local


def find_skeletons(stage: Any, to_world: Any) -> list[PosedSkeleton]:
    """Those with joints, in the order of the file."""
    prims = Usd.PrimRange.Stage(stage, Usd.TraverseInstanceProxies())
    found = [PosedSkeleton(prim, to_world) for prim in prims if prim.IsA(UsdSkel.Skeleton)]
    return [skeleton for skeleton in found if skeleton.joints]
