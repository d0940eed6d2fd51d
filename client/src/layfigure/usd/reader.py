"""Reads a skinned character back, posed by UsdSkel itself: in metres, Z up, in the world."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom, UsdSkel, UsdUtils

from layfigure.errors import LayfigureError
from layfigure.protocol import Floats, Ints

_DEFAULT_COLOR = (0.6, 0.6, 0.6)


@contextmanager
def quiet() -> Iterator[None]:
    """Keeps USD's own warnings off stderr: what they tell is told in our words."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        delegate.TakeUncoalescedDiagnostics()  # it would print what is left in it


def open_stage(path: Path) -> Any:
    """Raises LayfigureError, in one line, if there is no such file or USD cannot read it."""
    if not path.is_file():
        raise LayfigureError(f"no USD file '{path}': check the name")
    try:
        with quiet():
            return Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise LayfigureError(f"cannot read '{path}' as USD: it is broken or of another kind") from error


@dataclass(frozen=True, eq=False)
class PosedMesh:
    points: Floats  # (V, 3) world [m]
    triangles: Ints  # (T, 3)
    color: Floats  # (3) linear RGB


class SkinnedStage:
    """The skinned meshes of a USD file at any of its frames."""

    def __init__(self, path: Path) -> None:
        """Raises LayfigureError if the file holds no skinned mesh."""
        self._stage = open_stage(path)
        self._cache = UsdSkel.Cache()
        self._bindings = list(self._find_bindings())
        if not self._bindings:
            raise LayfigureError(f"'{path}' holds no skinned mesh")
        self._to_world = self._metres_z_up()

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
        return [self._pose_mesh(skeleton, target, frame) for skeleton, target in self._bindings]

    def _find_bindings(self) -> Any:
        for prim in self._stage.Traverse():
            if not prim.IsA(UsdSkel.Root):
                continue
            root = UsdSkel.Root(prim)
            self._cache.Populate(root, Usd.PrimDefaultPredicate)
            for binding in self._cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate):
                skeleton = self._cache.GetSkelQuery(binding.GetSkeleton())
                for target in binding.GetSkinningTargets():
                    if target.GetPrim().IsA(UsdGeom.Mesh):
                        yield skeleton, target

    def _pose_mesh(self, skeleton: Any, target: Any, frame: float) -> PosedMesh:
        mesh = UsdGeom.Mesh(target.GetPrim())
        points = mesh.GetPointsAttr().Get(frame)
        transforms = skeleton.ComputeSkinningTransforms(frame)
        if not target.ComputeSkinnedPoints(transforms, points, frame):
            raise LayfigureError(f"USD cannot skin '{target.GetPrim().GetPath()}': run 'layfigure check'")
        skeleton_to_world = UsdGeom.XformCache(frame).GetLocalToWorldTransform(skeleton.GetPrim())
        matrix = np.array(skeleton_to_world * self._to_world)
        color = mesh.GetDisplayColorAttr().Get()
        return PosedMesh(
            points=np.array(points, np.float64) @ matrix[:3, :3] + matrix[3, :3],
            triangles=_triangulated(mesh),
            color=np.array(color[0] if color else _DEFAULT_COLOR, np.float64),
        )

    def _metres_z_up(self) -> Any:
        scale = Gf.Matrix4d().SetScale(UsdGeom.GetStageMetersPerUnit(self._stage))
        if UsdGeom.GetStageUpAxis(self._stage) == UsdGeom.Tokens.z:
            return scale
        return scale * Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d.XAxis(), 90.0))


def _triangulated(mesh: Any) -> Ints:
    """Faces as fans of triangles."""
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(), np.int32)
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(), np.int32)
    starts = np.repeat(np.cumsum(counts) - counts, np.maximum(counts - 2, 0))
    corner = np.concatenate([np.arange(1, count - 1) for count in counts]) if len(counts) else np.zeros(0, int)
    return np.stack([indices[starts], indices[starts + corner], indices[starts + corner + 1]], axis=1)
