"""Checks a take's USD: with USD's own validators, and for what they miss of skeletons."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel, UsdValidation

from layfigure.usd.reader import open_stage

UNIT_TOLERANCE = 1e-5  # of a quaternion's length: quatf rounds at 6e-8
WEIGHT_TOLERANCE = 1e-4  # of a sum of float weights
LENGTH_TOLERANCE = 1e-6  # of a bone's length, relative: float translations round at 6e-8


@dataclass(frozen=True)
class Finding:
    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"


@dataclass(frozen=True)
class Report:
    validators: int
    skeletons: int
    frames: int
    findings: tuple[Finding, ...]


def check(path: Path) -> Report:
    """Raises LayfigureError if the file cannot be opened."""
    stage = open_stage(path)
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    findings = list(_usd_findings(stage, validators))
    findings += _stage_findings(stage)
    skeletons = [UsdSkel.Skeleton(prim) for prim in stage.Traverse() if prim.IsA(UsdSkel.Skeleton)]
    if not skeletons:
        findings.append(Finding(str(path), "holds no skeleton"))
    for skeleton in skeletons:
        findings += _skeleton_findings(skeleton)
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            findings += _mesh_findings(UsdGeom.Mesh(prim))
    frames = round(stage.GetEndTimeCode() - stage.GetStartTimeCode()) + 1
    return Report(len(validators), len(skeletons), frames, tuple(findings))


def _usd_findings(stage: Any, validators: Any) -> Iterator[Finding]:
    for error in UsdValidation.ValidationContext(validators).Validate(stage):
        sites = ", ".join(_site_name(site) for site in error.GetSites())
        yield Finding(sites or "stage", f"{error.GetMessage().strip()} ({error.GetName()})")


def _site_name(site: Any) -> str:
    if site.IsPrim():
        return str(site.GetPrim().GetPath())
    if site.IsProperty():
        return str(site.GetProperty().GetPath())
    return str(site.GetLayer().GetDisplayName())


def _stage_findings(stage: Any) -> Iterator[Finding]:
    layer = stage.GetRootLayer()
    where = layer.GetDisplayName()
    needed = ("defaultPrim", "metersPerUnit", "upAxis", "timeCodesPerSecond", "framesPerSecond")
    for name in (*needed, "startTimeCode", "endTimeCode"):
        if not stage.HasAuthoredMetadata(name):
            yield Finding(where, f"{name} is not set")
    if stage.GetTimeCodesPerSecond() != stage.GetFramesPerSecond():
        yield Finding(where, "timeCodesPerSecond and framesPerSecond differ: frames would not be time codes")
    if stage.GetEndTimeCode() < stage.GetStartTimeCode():
        yield Finding(where, "endTimeCode is before startTimeCode")
    if stage.GetDefaultPrim() and not Usd.ModelAPI(stage.GetDefaultPrim()).GetKind():
        yield Finding(str(stage.GetDefaultPrim().GetPath()), "has no kind")


def _skeleton_findings(skeleton: Any) -> Iterator[Finding]:
    where = str(skeleton.GetPath())
    joints = list(skeleton.GetJointsAttr().Get() or [])
    if not joints:
        yield Finding(where, "has no joints")
        return
    yield from _topology_findings(where, joints)
    for attribute in (skeleton.GetBindTransformsAttr(), skeleton.GetRestTransformsAttr()):
        yield from _transforms_findings(attribute, len(joints))
    animation = UsdSkel.BindingAPI(skeleton.GetPrim()).GetInheritedAnimationSource()
    if not animation:
        yield Finding(where, "has no animation source")
        return
    yield from _animation_findings(UsdSkel.Animation(animation), joints)


def _topology_findings(where: str, joints: list[str]) -> Iterator[Finding]:
    earlier: set[str] = set()
    for joint in joints:
        parent = joint.rpartition("/")[0]
        if not Sdf.Path.IsValidPathString(joint):
            yield Finding(where, f"joint '{joint}' is not a legal path")
        if parent and parent not in earlier:
            what = "comes after it" if parent in joints else "is missing"
            yield Finding(where, f"the parent of joint '{joint}' {what}")
        if joint in earlier:
            yield Finding(where, f"joint '{joint}' is listed twice")
        earlier.add(joint)


def _transforms_findings(attribute: Any, joint_count: int) -> Iterator[Finding]:
    where = str(attribute.GetPath())
    matrices = attribute.Get()
    if matrices is None:
        yield Finding(where, "is not set")
        return
    if len(matrices) != joint_count:
        yield Finding(where, f"has {len(matrices)} transforms, expected {joint_count}")
    array = np.array(matrices, np.float64)
    if not np.isfinite(array).all() or (np.abs(np.linalg.det(array)) < 1e-12).any():
        yield Finding(where, "holds a transform that cannot be inverted")


def _animation_findings(animation: Any, skeleton_joints: list[str]) -> Iterator[Finding]:
    where = str(animation.GetPath())
    joints = list(animation.GetJointsAttr().Get() or [])
    for joint in sorted(set(joints) - set(skeleton_joints)):
        yield Finding(where, f"animates joint '{joint}', which the skeleton does not have")
    yield from _type_findings(animation.GetScalesAttr(), "half3[]")
    yield from _type_findings(animation.GetTranslationsAttr(), "float3[]")
    yield from _type_findings(animation.GetRotationsAttr(), "quatf[]")
    yield from _sample_findings(animation.GetScalesAttr(), len(joints), _check_scales)
    yield from _sample_findings(animation.GetTranslationsAttr(), len(joints), _check_finite)
    yield from _sample_findings(animation.GetRotationsAttr(), len(joints), _check_rotations)
    yield from _bone_length_findings(animation, joints)


def _type_findings(attribute: Any, expected: str) -> Iterator[Finding]:
    """By what is written in the file: the schema's type hides it."""
    for spec in attribute.GetPropertyStack():
        if str(spec.typeName) != expected:
            yield Finding(str(attribute.GetPath()), f"is of type {spec.typeName}, expected {expected}")


def _samples(attribute: Any) -> Iterator[tuple[str, Any]]:
    """Every value with a name for where it is: the default, or each time sample."""
    codes = attribute.GetTimeSamples()
    for code in codes:
        yield f"{attribute.GetPath()} at frame {code:g}", attribute.Get(code)
    if not codes and attribute.HasAuthoredValue():
        yield str(attribute.GetPath()), attribute.Get()


def _sample_findings(attribute: Any, joint_count: int, check_values: Callable[[Any], str]) -> Iterator[Finding]:
    authored = False
    for where, value in _samples(attribute):
        authored = True
        if len(value) != joint_count:
            yield Finding(where, f"has {len(value)} values, expected {joint_count}")
        elif what := check_values(value):
            yield Finding(where, what)
    if not authored:
        yield Finding(str(attribute.GetPath()), "is not set: importers then drop the animation")


def _check_finite(value: Any) -> str:
    return "" if np.isfinite(np.array(value, np.float64)).all() else "holds a value that is not finite"


def _check_scales(value: Any) -> str:
    return _check_finite(value) or ("" if (np.array(value) > 0).all() else "holds a scale that is not positive")


def _check_rotations(value: Any) -> str:
    lengths = np.array([quaternion.GetLength() for quaternion in value], np.float64)
    worst = float(np.max(np.abs(lengths - 1.0), initial=0.0))
    return "" if worst <= UNIT_TOLERANCE else f"holds a quaternion of length 1 {worst:+.2g}"


def _bone_length_findings(animation: Any, joints: list[str]) -> Iterator[Finding]:
    """A bone's length is that of its joint's translation; a root has none."""
    bones = [index for index, joint in enumerate(joints) if "/" in joint]
    samples = [np.array(value, np.float64) for _, value in _samples(animation.GetTranslationsAttr())]
    lengths = np.array([np.linalg.norm(sample[bones], axis=1) for sample in samples if len(sample) == len(joints)])
    if lengths.size == 0:
        return
    spread = np.ptp(lengths, axis=0) > LENGTH_TOLERANCE * np.maximum(lengths.max(axis=0), LENGTH_TOLERANCE)
    for bone in np.flatnonzero(spread):
        yield Finding(str(animation.GetPath()), f"bone '{joints[bones[bone]]}' changes its length")


def _mesh_findings(mesh: Any) -> Iterator[Finding]:
    where = str(mesh.GetPath())
    points = np.array(mesh.GetPointsAttr().Get() or np.zeros((0, 3)), np.float64)
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get() or [], np.int64)
    if not len(points) or not len(indices):
        yield Finding(where, "has no faces")
        return
    if indices.min() < 0 or indices.max() >= len(points):
        yield Finding(where, f"has a vertex index out of range, expected 0 to {len(points) - 1}")
    extent = mesh.GetExtentAttr().Get()
    box = np.stack([points.min(axis=0), points.max(axis=0)])
    if extent is None or not np.allclose(np.array(extent), box, atol=1e-5):
        yield Finding(where, "its extent is not the box of its points")
    binding = UsdSkel.BindingAPI(mesh.GetPrim())
    if binding.GetJointIndicesPrimvar().HasAuthoredValue():
        yield from _skinning_findings(binding, len(points))


def _skinning_findings(binding: Any, point_count: int) -> Iterator[Finding]:
    where = str(binding.GetPath())
    primvar = binding.GetJointIndicesPrimvar()
    indices, weights = np.array(primvar.Get()), np.array(binding.GetJointWeightsPrimvar().Get() or [])
    expected = point_count * primvar.GetElementSize()
    if len(indices) != expected or len(weights) != expected:
        yield Finding(where, f"has {len(indices)} joint indices and {len(weights)} weights, expected {expected}")
        return
    skeleton = binding.GetInheritedSkeleton()
    joint_count = len(skeleton.GetJointsAttr().Get() or []) if skeleton else 0
    if indices.min() < 0 or indices.max() >= joint_count:
        yield Finding(where, f"has a joint index out of range, expected 0 to {joint_count - 1}")
    sums = weights.reshape(point_count, -1).sum(axis=1)
    if weights.min() < 0.0 or np.abs(sums - 1.0).max() > WEIGHT_TOLERANCE:
        yield Finding(where, "has weights that do not sum to 1 at a vertex")
