"""Checks of a Skeleton and of the SkelAnimation that moves it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from pxr import Sdf, UsdSkel

from layfigure.usd.findings import Finding, error, warning

UNIT_TOLERANCE = 1e-5  # of a quaternion's length: quatf rounds at 6e-8
LENGTH_TOLERANCE = 1e-4  # of a bone's length, relative: a finger's, computed from float matrices in the world
_SINGULAR = 1e-12  # determinant: bones a hundredth of a millimetre long in metres are still above


def skeleton_findings(skeleton: Any) -> Iterator[Finding]:
    where = skeleton.GetPath()
    joints = list(skeleton.GetJointsAttr().Get() or [])
    if not joints:
        yield error(where, "has no joints")
        return
    yield from _topology_findings(where, joints)
    yield from _transforms_findings(skeleton.GetBindTransformsAttr(), len(joints), error)
    yield from _transforms_findings(skeleton.GetRestTransformsAttr(), len(joints), warning)
    binding = UsdSkel.BindingAPI(skeleton.GetPrim())
    if animation := binding.GetInheritedAnimationSource():
        yield from _animation_findings(UsdSkel.Animation(animation), joints)
    elif targets := binding.GetAnimationSourceRel().GetTargets():
        yield error(where, f"its animation source '{targets[0]}' is no SkelAnimation")
    else:
        yield warning(where, "has no animation source")


def _topology_findings(where: object, joints: list[str]) -> Iterator[Finding]:
    earlier: set[str] = set()
    for joint in joints:
        parent = joint.rpartition("/")[0]
        if not Sdf.Path.IsValidPathString(joint):
            yield error(where, f"joint '{joint}' is not a legal path")
        if parent and parent not in earlier:
            if parent in joints:
                yield error(where, f"the parent of joint '{joint}' comes after it")
            else:  # USD then takes the nearest ancestor that is there, or none
                yield warning(where, f"the parent of joint '{joint}' is missing")
        if joint in earlier:
            yield error(where, f"joint '{joint}' is listed twice")
        earlier.add(joint)


def _transforms_findings(
    attribute: Any, joint_count: int, if_not_set: Callable[[object, str], Finding]
) -> Iterator[Finding]:
    where = attribute.GetPath()
    matrices = attribute.Get()
    if matrices is None:
        yield if_not_set(where, "is not set")
        return
    if len(matrices) != joint_count:
        yield error(where, f"has {len(matrices)} transforms, expected {joint_count}")
    array = np.array(matrices, np.float64).reshape(-1, 4, 4)
    if not np.isfinite(array).all() or (np.abs(np.linalg.det(array)) < _SINGULAR).any():
        yield error(where, "holds a transform that cannot be inverted")


def _animation_findings(animation: Any, skeleton_joints: list[str]) -> Iterator[Finding]:
    joints = list(animation.GetJointsAttr().Get() or [])
    for joint in sorted(set(joints) - set(skeleton_joints)):
        yield warning(animation.GetPath(), f"animates joint '{joint}', which the skeleton does not have")
    for attribute, type_name, judge in (
        (animation.GetScalesAttr(), "half3[]", _judge_scales),
        (animation.GetTranslationsAttr(), "float3[]", _judge_finite),
        (animation.GetRotationsAttr(), "quatf[]", _judge_rotations),
    ):
        yield from _type_findings(attribute, type_name)
        if joints or attribute.HasAuthoredValue():  # an animation of blend shapes alone has none of the three
            yield from _sample_findings(attribute, len(joints), judge)
        yield from _range_findings(attribute)
    yield from _bone_length_findings(animation, joints)
    yield from _blend_weight_findings(animation)


def _type_findings(attribute: Any, expected: str) -> Iterator[Finding]:
    """By what is written in the file: the schema's type hides it."""
    for spec in attribute.GetPropertyStack():
        if str(spec.typeName) != expected:
            yield error(attribute.GetPath(), f"is of type {spec.typeName}, expected {expected}")


def _samples(attribute: Any) -> Iterator[tuple[str, Any]]:
    """Every value with a name for where it is: the default, or each time sample."""
    codes = attribute.GetTimeSamples()
    for code in codes:
        yield f"{attribute.GetPath()} at frame {code:g}", attribute.Get(code)
    if not codes and attribute.HasAuthoredValue():
        yield str(attribute.GetPath()), attribute.Get()


def _sample_findings(attribute: Any, expected: int, judge: Callable[[Any], str]) -> Iterator[Finding]:
    """The first bad sample, and how many more there are."""
    bad = []
    authored = False
    for where, value in _samples(attribute):
        authored = authored or value is not None
        if value is not None and len(value) != expected:
            bad.append((where, f"has {len(value)} values, expected {expected}"))
        elif value is not None and (what := judge(np.array(value, np.float64))):
            bad.append((where, what))
    if bad:
        where, what = bad[0]
        more = f", and {len(bad) - 1} more frames are bad" if len(bad) > 1 else ""
        yield error(where, what + more)
    if not authored:
        yield error(attribute.GetPath(), "is not set: importers then drop the animation")


def _judge_finite(values: Any) -> str:
    return "" if np.isfinite(values).all() else "holds a value that is not finite"


def _judge_scales(values: Any) -> str:
    return _judge_finite(values) or ("" if (values > 0.0).all() else "holds a scale that is not positive")


def _judge_rotations(quaternions: Any) -> str:
    if what := _judge_finite(quaternions):
        return what
    errors = np.linalg.norm(quaternions.reshape(-1, 4), axis=1) - 1.0
    worst = float(errors[np.argmax(np.abs(errors))]) if len(errors) else 0.0
    return "" if abs(worst) <= UNIT_TOLERANCE else f"holds a quaternion of length 1 {worst:+.2g}"


def _range_findings(attribute: Any) -> Iterator[Finding]:
    """Players show the stage's range alone."""
    stage = attribute.GetStage()
    codes = attribute.GetTimeSamples()
    if not codes or not stage.HasAuthoredTimeCodeRange():
        return
    first, last = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if codes[-1] < first or codes[0] > last:
        yield error(
            attribute.GetPath(),
            f"its frames {codes[0]:g} to {codes[-1]:g} are outside of the stage's {first:g} to {last:g}",
        )
    elif codes[0] < first or codes[-1] > last:
        yield warning(
            attribute.GetPath(), f"its frames {codes[0]:g} to {codes[-1]:g} go beyond the stage's {first:g} to {last:g}"
        )


def _bone_length_findings(animation: Any, joints: list[str]) -> Iterator[Finding]:
    """A bone's length is that of its joint's translation; a root has none."""
    bones = [index for index, joint in enumerate(joints) if "/" in joint]
    samples = [
        np.array(value, np.float64) for _, value in _samples(animation.GetTranslationsAttr()) if value is not None
    ]
    lengths = np.array([np.linalg.norm(sample[bones], axis=1) for sample in samples if len(sample) == len(joints)])
    if lengths.size == 0 or not np.isfinite(lengths).all():
        return
    spread = np.ptp(lengths, axis=0)
    for bone in np.flatnonzero(spread > LENGTH_TOLERANCE * lengths.max(axis=0)):
        part = spread[bone] / lengths[:, bone].max()
        yield warning(animation.GetPath(), f"bone '{joints[bones[bone]]}' changes its length by {part:.2g} of it")


def _blend_weight_findings(animation: Any) -> Iterator[Finding]:
    names = list(animation.GetBlendShapesAttr().Get() or [])
    if names:
        yield from _sample_findings(animation.GetBlendShapeWeightsAttr(), len(names), _judge_finite)
