"""Reads a skinned character back, posed by UsdSkel itself: in metres, Z up, in the world."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdSkel

from layfigure.errors import LayfigureError
from layfigure.protocol import Floats, Ints
from layfigure.usd.felt import Pull, read_pulls, read_yields
from layfigure.usd.looks import Looks, Triangles, read_looks, read_normals
from layfigure.usd.skeleton_reader import PosedSkeleton, find_skeletons
from layfigure.usd.stage import metres, open_stage, quiet


@dataclass(frozen=True, eq=False)
class PosedMesh:
    name: str  # of its prim
    points: Floats  # (V, 3) world [m]
    triangles: Ints  # (T, 3)
    colors: Floats  # (T, 3) linear RGB
    flowing: Floats  # (V) 0 to 1: how far a joint that yields at this time moves the point
    looks: Looks


@dataclass(frozen=True, eq=False)
class BoundMesh:
    """A mesh in the bind pose of its skeleton."""

    name: str
    skeleton: str  # path of its prim
    points: Floats  # (V, 3) world [m]
    triangles: Ints  # (T, 3)
    colors: Floats  # (T, 3) linear RGB
    joint_indices: Ints  # (V, K) into the skeleton's joints
    joint_weights: Floats  # (V, K)
    has_blend_shapes: bool
    looks: Looks | None = None
    normals: Floats | None = None  # (T, 3, 3) of the triangles' corners, unit, world; None: the file has none


class SkinnedStage:
    """The skinned meshes of a USD file at any of its frames, blend shapes included, with what a take's hands did."""

    def __init__(self, path: Path, *, needs_skin: bool = True, up_axis: str = "Z") -> None:
        """Raises LayfigureError if the file holds no skinned mesh that is seen, unless `needs_skin` is false. All that
        it tells is in a world in metres with `up_axis` up."""
        self._stage = open_stage(path)
        self._cache = UsdSkel.Cache()
        with quiet():
            self._skins = [_Skin(skeleton, target) for skeleton, target in self._find_bindings()]
        if needs_skin and not self._skins:
            raise LayfigureError(f"'{path}' holds no skinned mesh")
        self._to_world = metres(self._stage, up_axis)

    @property
    def first_frame(self) -> float:
        return float(self._stage.GetStartTimeCode())

    @property
    def last_frame(self) -> float:
        return float(self._stage.GetEndTimeCode())

    @property
    def fps(self) -> float:
        return float(self._stage.GetTimeCodesPerSecond())

    def posed(self, frame: float) -> list[PosedMesh]:
        with quiet():
            return [skin.posed(frame, self._to_world) for skin in self._skins]

    def skeletons(self) -> list[PosedSkeleton]:
        with quiet():
            return find_skeletons(self._stage, self._to_world)

    def bound(self) -> list[BoundMesh]:
        """The meshes as they were bound, where their skeletons stand in the first frame; without blend shapes."""
        with quiet():
            return [skin.bound(self.first_frame, self._to_world) for skin in self._skins]

    def pulls(self, frame: float) -> list[Pull]:
        """Of all hands that hold something at that time, if the file tells."""
        prims = {str(prim.GetPath()): prim for skin in self._skins if (prim := skin.animation_prim())}
        return [pull for prim in prims.values() for pull in read_pulls(prim, frame, self._to_world)]

    def _find_bindings(self) -> Any:
        everywhere = Usd.TraverseInstanceProxies()
        for prim in Usd.PrimRange.Stage(self._stage, everywhere):
            if not prim.IsA(UsdSkel.Root):
                continue
            root = UsdSkel.Root(prim)
            self._cache.Populate(root, everywhere)
            for binding in self._cache.ComputeSkelBindings(root, everywhere):
                skeleton = self._cache.GetSkelQuery(binding.GetSkeleton())
                for target in binding.GetSkinningTargets():
                    if target.GetPrim().IsA(UsdGeom.Mesh) and _is_seen(target.GetPrim()):
                        yield skeleton, target


def _is_seen(prim: Any) -> bool:
    image = UsdGeom.Imageable(prim)
    shown = image.ComputePurpose() in (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)
    return bool(shown and image.ComputeVisibility(Usd.TimeCode.EarliestTime()) != UsdGeom.Tokens.invisible)


class _Skin:
    """One mesh with the skeleton that moves it."""

    def __init__(self, skeleton: Any, target: Any) -> None:
        self._skeleton, self._target = skeleton, target
        self._mesh = UsdGeom.Mesh(target.GetPrim())
        self._faces = _triangulated(self._mesh)
        self._triangles = self._faces.points
        self._bound_points = np.array(self._mesh.GetPointsAttr().Get(Usd.TimeCode.EarliestTime()) or [], np.float64)
        if self._triangles.size and not 0 <= self._triangles.min() <= self._triangles.max() < len(self._bound_points):
            raise LayfigureError(
                f"'{self._mesh.GetPath()}' has faces of points it does not have: run 'layfigure check'"
            )
        self._looks = read_looks(self._mesh, self._faces)
        binding = UsdSkel.BindingAPI(target.GetPrim())
        self._shapes: Any = UsdSkel.BlendShapeQuery(binding) if target.HasBlendShapes() else None
        self._yields = read_yields(self.animation_prim(), list(skeleton.GetJointOrder()))

    def animation_prim(self) -> Any:
        query = self._skeleton.GetAnimQuery()
        return query.GetPrim() if query else None

    def posed(self, frame: float, to_world: Any) -> PosedMesh:
        points = self._mesh.GetPointsAttr().Get(frame)
        if points is None or not self._skin(points, frame):
            raise LayfigureError(f"USD cannot skin '{self._mesh.GetPath()}': run 'layfigure check'")
        skeleton_to_world = UsdGeom.XformCache(frame).GetLocalToWorldTransform(self._skeleton.GetPrim())
        matrix = np.array(skeleton_to_world * to_world)
        return PosedMesh(
            name=str(self._mesh.GetPrim().GetName()),
            points=np.array(points, np.float64) @ matrix[:3, :3] + matrix[3, :3],
            triangles=self._triangles,
            colors=self._looks.colors,
            flowing=self._flowing(len(points), frame),
            looks=self._looks,
        )

    def bound(self, frame: float, to_world: Any) -> BoundMesh:
        points = self._bound_points
        indices, weights = self._influences(len(points), frame)
        placed = UsdGeom.XformCache(frame).GetLocalToWorldTransform(self._skeleton.GetPrim())
        matrix = np.array(self._target.GetGeomBindTransform(frame) * placed * to_world)
        return BoundMesh(
            name=str(self._mesh.GetPrim().GetName()),
            skeleton=str(self._skeleton.GetPrim().GetPath()),
            points=points @ matrix[:3, :3] + matrix[3, :3],
            triangles=self._triangles,
            colors=self._looks.colors,
            joint_indices=indices,
            joint_weights=weights,
            has_blend_shapes=self._shapes is not None,
            looks=self._looks,
            normals=self._bound_normals(matrix[:3, :3]),
        )

    def _bound_normals(self, linear: Floats) -> Floats | None:
        """`linear` acts on rows of points."""
        normals = read_normals(self._mesh, self._faces)
        if normals is None:
            return None
        turned = normals @ np.linalg.inv(linear).T
        lengths = np.linalg.norm(turned, axis=2, keepdims=True)
        return np.asarray(turned / lengths) if (lengths > 0.0).all() else None

    def _influences(self, point_count: int, frame: float) -> tuple[Ints, Floats]:
        """Joints of the skeleton and weights (V, K)."""
        influences = self._target.ComputeVaryingJointInfluences(point_count, frame)
        of_skeleton = list(self._skeleton.GetJointOrder())
        order = list(self._target.GetJointOrder() or of_skeleton)
        known = set(order) <= set(of_skeleton)
        if known and influences and point_count:
            indices, weights = (np.array(values).reshape(point_count, -1) for values in influences)
            if 0 <= indices.min() <= indices.max() < len(order):
                of_order = np.array([of_skeleton.index(joint) for joint in order], np.int32)
                return of_order[indices], weights.astype(np.float64)
        raise LayfigureError(f"'{self._mesh.GetPath()}' has no joint weights that fit: run 'layfigure check'")

    def _skin(self, points: Any, frame: float) -> bool:
        """In place."""
        if self._shapes is not None and not self._add_blend_shapes(points, frame):
            return False
        transforms = self._skeleton.ComputeSkinningTransforms(frame)
        return bool(transforms and self._target.ComputeSkinnedPoints(transforms, points, frame))

    def _add_blend_shapes(self, points: Any, frame: float) -> bool:
        query, mapper = self._skeleton.GetAnimQuery(), self._target.GetBlendShapeMapper()
        weights = query.ComputeBlendShapeWeights(frame) if query and mapper else None
        if not weights:
            return True
        weights = mapper.Remap(weights)
        sub_weights, shape_indices, sub_indices = self._shapes.ComputeSubShapeWeights(weights)
        return bool(
            self._shapes.ComputeDeformedPoints(
                sub_weights,
                shape_indices,
                sub_indices,
                self._shapes.ComputeBlendShapePointIndices(),
                self._shapes.ComputeSubShapePointOffsets(),
                points,
            )
        )

    def _flowing(self, point_count: int, frame: float) -> Floats:
        joints = [event.joint for event in self._yields if event.start <= frame <= event.end]
        if not joints:
            return np.zeros(point_count)
        indices, weights = self._influences(point_count, frame)
        of_skeleton = list(self._skeleton.GetJointOrder())
        flowing = np.isin(indices, [number for number, joint in enumerate(of_skeleton) if joint in joints])
        return np.asarray((weights * flowing).sum(axis=1), np.float64)


def _triangulated(mesh: Any) -> Triangles:
    """Faces as fans."""
    earliest = Usd.TimeCode.EarliestTime()
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(earliest) or [], np.int32)
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(earliest) or [], np.int32)
    fans = np.maximum(counts - 2, 0)
    faces = np.repeat(np.arange(len(counts)), fans)
    starts = np.repeat(np.cumsum(counts) - counts, fans)
    step = np.concatenate([np.arange(1, count - 1) for count in counts]) if len(counts) else np.zeros(0, int)
    corners = np.stack([starts, starts + step, starts + step + 1], axis=1).astype(np.int32)
    if corners.size and corners.max() >= len(indices):
        raise LayfigureError(f"'{mesh.GetPath()}' has too few vertex indices for its faces: run 'layfigure check'")
    return Triangles(indices[corners], corners, faces.astype(np.int32))
