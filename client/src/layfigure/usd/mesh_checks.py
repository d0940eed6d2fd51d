"""Checks of meshes: their faces, what binds them to a skeleton, their blend shapes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from layfigure.usd.findings import Finding, error, warning

WEIGHT_TOLERANCE = 1e-4  # of a sum of float weights
EXTENT_TOLERANCE = 1e-5  # of the box's size: float rounds at 6e-8
NORMAL_TOLERANCE = 2e-3  # of a normal's length: half floats round at 5e-4
_TEXTURE_COORDINATES = (
    Sdf.ValueTypeNames.TexCoord2fArray,
    Sdf.ValueTypeNames.TexCoord2dArray,
    Sdf.ValueTypeNames.TexCoord2hArray,
)
_EARLIEST = Usd.TimeCode.EarliestTime()  # the default, or the first sample of what is animated


def mesh_findings(mesh: Any) -> Iterator[Finding]:
    where = mesh.GetPath()
    points = np.array(mesh.GetPointsAttr().Get(_EARLIEST) or np.zeros((0, 3)), np.float64)
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(_EARLIEST) or [], np.int64)
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(_EARLIEST) or [], np.int64)
    if not len(points) or not len(indices):
        is_skinned = UsdSkel.BindingAPI(mesh.GetPrim()).GetJointIndicesPrimvar().HasAuthoredValue()
        yield (error if is_skinned else warning)(where, "has no faces")
        return
    if counts.min(initial=3) < 3 or counts.sum() != len(indices):
        yield error(where, f"its faces take {counts.sum()} vertex indices, of at least 3 each; it has {len(indices)}")
    if indices.min() < 0 or indices.max() >= len(points):
        yield error(where, f"has a vertex index out of range, expected 0 to {len(points) - 1}")
    if not np.isfinite(points).all():
        yield error(where, "has a point that is not finite")
        return
    yield from _extent_findings(mesh, points)
    yield from _shading_findings(
        mesh,
        {
            UsdGeom.Tokens.constant: 1,
            UsdGeom.Tokens.uniform: len(counts),
            UsdGeom.Tokens.varying: len(points),
            UsdGeom.Tokens.vertex: len(points),
            UsdGeom.Tokens.faceVarying: len(indices),
        },
    )
    yield from _skinning_findings(UsdSkel.BindingAPI(mesh.GetPrim()), len(points))


def _extent_findings(mesh: Any, points: Any) -> Iterator[Finding]:
    extent = mesh.GetExtentAttr().Get(_EARLIEST)
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    tolerance = EXTENT_TOLERANCE * max(float(np.abs(box).max()), EXTENT_TOLERANCE)
    if extent is None or np.shape(extent) != (2, 3) or not np.allclose(np.array(extent), box, rtol=0.0, atol=tolerance):
        yield warning(mesh.GetPath(), "its extent is not the box of its points")


def _shading_findings(mesh: Any, expected: dict[str, int]) -> Iterator[Finding]:
    """Of normals and texture coordinates, of which there are to be `expected`, by how they are interpolated."""
    normals = mesh.GetNormalsAttr()
    if normals.HasAuthoredValue():
        values = np.array(normals.Get(_EARLIEST) or np.zeros((0, 3)), np.float64)
        yield from _count_findings(normals.GetPath(), len(values), mesh.GetNormalsInterpolation(), expected)
        yield from _normal_findings(normals.GetPath(), values)
    for primvar in UsdGeom.PrimvarsAPI(mesh.GetPrim()).GetPrimvarsWithAuthoredValues():
        where = primvar.GetAttr().GetPath()
        is_normals = primvar.GetPrimvarName() == "normals"
        if not is_normals and primvar.GetTypeName() not in _TEXTURE_COORDINATES:
            continue
        values = np.array(primvar.Get(_EARLIEST) or [], np.float64)
        indices = np.array(primvar.GetIndices(_EARLIEST) or [], np.int64)
        if primvar.IsIndexed() and len(indices) and not 0 <= indices.min() <= indices.max() < len(values):
            yield error(where, f"has an index out of range, expected 0 to {len(values) - 1}")
        count = len(indices) if primvar.IsIndexed() else len(values)
        yield from _count_findings(where, count, primvar.GetInterpolation(), expected)
        if is_normals:
            yield from _normal_findings(where, values)
        elif not np.isfinite(values).all():
            yield error(where, "holds a value that is not finite")


def _count_findings(where: object, count: int, interpolation: str, expected: dict[str, int]) -> Iterator[Finding]:
    if interpolation not in expected:
        yield error(where, f"has the interpolation '{interpolation}', which USD does not know")
    elif count != expected[interpolation]:
        yield error(where, f"has {count} values, expected {expected[interpolation]} ({interpolation})")


def _normal_findings(where: object, normals: Any) -> Iterator[Finding]:
    if not np.isfinite(normals).all():
        yield error(where, "holds a normal that is not finite")
        return
    lengths = np.linalg.norm(normals.reshape(-1, 3), axis=1)
    bad = np.abs(lengths - 1.0) > NORMAL_TOLERANCE
    if bad.any():
        number = int(np.argmax(bad))
        more = f", and {int(bad.sum()) - 1} more" if bad.sum() > 1 else ""
        yield warning(where, f"normal {number} is {lengths[number]:.6g} long, not 1{more}")


def _skinning_findings(binding: Any, point_count: int) -> Iterator[Finding]:
    where = binding.GetPath()
    yield from _blend_shape_findings(binding, point_count)
    indices_primvar, weights_primvar = binding.GetJointIndicesPrimvar(), binding.GetJointWeightsPrimvar()
    if not indices_primvar.HasAuthoredValue() and not weights_primvar.HasAuthoredValue():
        return
    indices = np.array(indices_primvar.Get(_EARLIEST) or [], np.int64)
    weights = np.array(weights_primvar.Get(_EARLIEST) or [], np.float64)
    rigid = indices_primvar.GetInterpolation() == UsdGeom.Tokens.constant  # one set for all points
    expected = indices_primvar.GetElementSize() * (1 if rigid else point_count)
    if len(indices) != expected or len(weights) != expected:
        yield error(where, f"has {len(indices)} joint indices and {len(weights)} weights, expected {expected}")
        return
    skeleton = binding.GetInheritedSkeleton()
    if not skeleton:
        yield error(where, "has joint weights, but is bound to no skeleton")
        return
    joint_count = len(binding.GetJointsAttr().Get() or skeleton.GetJointsAttr().Get() or [])
    if indices.min() < 0 or indices.max() >= joint_count:
        yield error(where, f"has a joint index out of range, expected 0 to {joint_count - 1}")
    yield from _joint_order_findings(binding, skeleton)
    yield from _weight_findings(where, weights.reshape(-1, indices_primvar.GetElementSize()))


def _joint_order_findings(binding: Any, skeleton: Any) -> Iterator[Finding]:
    """A mesh may list the joints that its indices mean itself."""
    known = set(skeleton.GetJointsAttr().Get() or [])
    for joint in binding.GetJointsAttr().Get() or []:
        if joint not in known:
            yield error(binding.GetPath(), f"is bound to joint '{joint}', which the skeleton does not have")


def _weight_findings(where: object, weights: Any) -> Iterator[Finding]:
    sums = weights.sum(axis=1)
    bad = ~(np.abs(sums - 1.0) <= WEIGHT_TOLERANCE)  # also true of what is not a number
    if bad.any():
        vertex = int(np.argmax(bad))
        more = f", and of {int(bad.sum()) - 1} more" if bad.sum() > 1 else ""
        yield error(where, f"its weights do not sum to 1: {sums[vertex]:.6g} at vertex {vertex}{more}")
    if (weights < 0.0).any():
        yield error(where, f"has a negative weight at vertex {int(np.argwhere(weights < 0.0)[0, 0])}")


def _blend_shape_findings(binding: Any, point_count: int) -> Iterator[Finding]:
    names = list(binding.GetBlendShapesAttr().Get() or [])
    targets = binding.GetBlendShapeTargetsRel().GetTargets()
    if len(names) != len(targets):
        yield error(binding.GetPath(), f"names {len(names)} blend shapes, and has {len(targets)} targets")
    for target in targets:
        shape = UsdSkel.BlendShape(binding.GetPrim().GetStage().GetPrimAtPath(target))
        if not shape:
            yield error(binding.GetPath(), f"its blend shape '{target}' is missing")
            continue
        offsets = shape.GetOffsetsAttr().Get() or []
        indices = np.array(shape.GetPointIndicesAttr().Get() or [], np.int64)
        expected = len(indices) or point_count
        if len(offsets) != expected:
            yield error(target, f"has {len(offsets)} offsets, expected {expected}")
        if len(indices) and (indices.min() < 0 or indices.max() >= point_count):
            yield error(target, f"has a point index out of range, expected 0 to {point_count - 1}")
