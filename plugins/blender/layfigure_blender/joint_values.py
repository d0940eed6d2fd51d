# SPDX-License-Identifier: GPL-3.0-or-later
"""What the joints of a doll are: told by the server, and computed from what is asked of them as the server does it.

Without Blender. SI units, angles in radians, quaternions w x y z. Everything here is immutable.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from layfigure import ProtocolError, Reply
from layfigure.rotation import to_matrix

from .joint_settings import (
    AXES,
    HALF_TURN_DEG,
    LAWS,
    LAWS_OF_AXES,
    LEAST_SWING_DEG,
    LIMIT_AXES,
    USUAL_MIRROR,
    Amount,
    AxisAmounts,
    DollSettings,
    JointSettings,
    MirrorRule,
)

Quaternion = tuple[float, float, float, float]
Arguments = dict[str, Any]

SAME = 1e-9  # relative; the server's numbers pass through products and quotients, which take some 1e-16
_FITS = 0.9  # cosine: axes that are each other's mirror image fit exactly but for how the character was sculpted
_RIGID_STIFFNESS = 1e9
_NO_FRAME: Quaternion = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Law:
    """A law has one number for its unit axis and each axis' multiple of it."""

    unit: float
    ratios: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def axes(self) -> tuple[float, float, float]:
        """The values of AXES themselves; an infinite one is that of its axis, whatever the other."""
        infinite = math.isinf(self.unit)
        twist, bend_y, bend_z = (math.inf if infinite or math.isinf(r) else self.unit * r for r in self.ratios)
        return twist, bend_y, bend_z

    @classmethod
    def of_axes(cls, values: tuple[float, float, float]) -> Law:
        """The unit is the smallest; where that is none, the largest."""
        unit = min(values) if min(values) > 0.0 else max(values)
        twist, bend_y, bend_z = (1.0 if value == unit else value / unit for value in values)
        return cls(unit, (twist, bend_y, bend_z))

    def is_as(self, other: Law) -> bool:
        pairs = zip((self.unit, *self.ratios), (other.unit, *other.ratios), strict=True)
        return all(_is_same(a, b) for a, b in pairs)


@dataclass(frozen=True)
class JointValues:
    """A joint as it is, or is to be."""

    laws: Mapping[str, Law]  # by LAWS
    limits: Mapping[str, tuple[float, float]]  # by LIMIT_AXES; at -pi and pi there is none
    locked: frozenset[str] = frozenset()  # of AXES
    reasons: Mapping[str, str] = field(default_factory=dict)  # why: by LAWS, "limits.twist" and so on, "locked"
    section_axes: Quaternion = _NO_FRAME  # of AXES in the bone's frame
    limit_axes: Quaternion = _NO_FRAME  # of LIMIT_AXES in the bone's frame


@dataclass(frozen=True)
class DollValues:
    """What the server chooses for a doll."""

    joints: Mapping[str, JointValues]  # by the bones that have a joint
    roots: frozenset[str] = frozenset()  # bones with a body, and no joint
    riders: Mapping[str, str] = field(default_factory=dict)  # why the bones that have no body of their own have none
    densities: Mapping[str, float] = field(default_factory=dict)  # of the bodies [kg/m^3]
    mass: float = 0.0  # [kg]
    material: str = ""

    def why_no_joint(self, bone: str) -> str:
        """One line, or "" if the bone has a joint."""
        if bone in self.joints:
            return ""
        if bone in self.roots:
            return "the doll's root, which has no joint"
        return self.riders.get(bone, "not a bone of the doll")


# --- told by the server ----------------------------------------------------------------------------------------------


def inspected(description: Mapping[str, Any]) -> DollValues:
    """From what `layfigure-server --inspect --json` prints. Raises ProtocolError."""
    try:
        bodies = description["bodies"]
        return DollValues(
            joints={body["name"]: _inspected_joint(body) for body in bodies if body["parent"] is not None},
            roots=frozenset(body["name"] for body in bodies if body["parent"] is None),
            riders={rider["bone"]: _rides(rider["body"], rider["reason"]) for rider in description["merged"]},
            densities={body["name"]: float(body["density"]) for body in bodies},
            mass=float(description["mass"]),
            material=str(description["settings"]["material"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise ProtocolError(f"layfigure-server told of no doll ({error!r}): is it of this version?") from error


def _rides(body: str | None, reason: str) -> str:
    return f"no body of its own ({reason})" + (f": moves with {body}" if body else "")


def _inspected_joint(body: Mapping[str, Any]) -> JointValues:
    ratios = body["axis_ratios"]
    limits = body["limits"]
    why = body["reasons"]
    return JointValues(
        laws={name: Law(_number(body[name]), _triple(ratios.get(name, (1.0, 1.0, 1.0)))) for name in LAWS},
        limits=_free() if limits is None else {axis: _range(limits[axis]) for axis in LIMIT_AXES},
        locked=frozenset(body["locked"]),
        reasons={name: why[name] for name in (*LAWS, "locked")}
        | {f"limits.{axis}": why["limits"][axis] for axis in LIMIT_AXES},
        section_axes=_quaternion(body["section"]["axes"]),
        limit_axes=_NO_FRAME if limits is None else _quaternion(limits["axes"]),
    )


def replied(reply: Reply, names: Mapping[int, str]) -> dict[str, JointValues]:
    """From the answer to `get_joints`; `names` of the bones by their indices. Raises ProtocolError."""
    bones = [names.get(int(joint), "") for joint in reply.values("joints")]
    count = len(bones)
    rows = {name: _rows(reply, name, count, width) for name, width in _WIDTHS.items()}
    return {
        bone: JointValues(
            laws={name: Law(rows[name][k][0], _triple(_ratios(rows, name, k))) for name in LAWS},
            limits={axis: _range(rows[f"limits.{axis}"][k]) for axis in LIMIT_AXES},
            locked=frozenset(axis for axis, on in zip(AXES, rows["locked"][k], strict=True) if on),
            section_axes=_quaternion(rows["section_axes"][k]),
            limit_axes=_quaternion(rows["limit_axes"][k]),
        )
        for k, bone in enumerate(bones)
    }


_WIDTHS = (
    dict.fromkeys(LAWS, 1)
    | {f"{name}.ratios": 3 for name in LAWS_OF_AXES}
    | {f"limits.{axis}": 2 for axis in LIMIT_AXES}
    | {"locked": 3, "section_axes": 4, "limit_axes": 4}
)


def _rows(reply: Reply, name: str, count: int, width: int) -> list[tuple[float, ...]]:
    values = reply.values(name)
    if len(values) != count * width:
        raise ProtocolError(f"the server's reply holds {len(values)} numbers of '{name}', expected {count * width}")
    return [values[k * width : (k + 1) * width] for k in range(count)]


def _ratios(rows: Mapping[str, list[tuple[float, ...]]], name: str, k: int) -> tuple[float, ...]:
    return rows[f"{name}.ratios"][k] if name in LAWS_OF_AXES else (1.0, 1.0, 1.0)


def _number(value: float | None) -> float:
    return math.inf if value is None else float(value)


def _triple(values: Any) -> tuple[float, float, float]:
    first, second, third = map(_number, values)
    return first, second, third


def _range(values: Any) -> tuple[float, float]:
    lower, upper = values
    return (
        -math.pi if lower is None else max(float(lower), -math.pi),
        math.pi if upper is None else min(float(upper), math.pi),
    )


def _quaternion(values: Any) -> Quaternion:
    w, x, y, z = map(float, values)
    return w, x, y, z


def _free() -> dict[str, tuple[float, float]]:
    return dict.fromkeys(LIMIT_AXES, (-math.pi, math.pi))


# --- asked of it -----------------------------------------------------------------------------------------------------


def asked(own: JointValues, settings: JointSettings) -> JointValues:
    """The joint that the server chose as `own`, with the settings: what a settings file makes of it."""
    limits = {axis: _radians(axis, settings.limits[axis]) for axis in LIMIT_AXES if axis in settings.limits}
    return replace(
        own,
        laws={name: _law(name, own.laws[name], settings.laws.get(name)) for name in LAWS},
        limits={**own.limits, **limits},
        locked=own.locked if settings.locked is None else settings.locked,
    )


def _of(amount: Amount, chosen: float) -> float:
    return amount.number * chosen if amount.is_factor else amount.number


def _law(name: str, own: Law, given: Amount | AxisAmounts | None) -> Law:
    if given is None:
        return own
    if isinstance(given, Amount):
        return Law(_of(given, own.unit), own.ratios)
    most = _RIGID_STIFFNESS if name == "stiffness" else math.inf
    twist, bend_y, bend_z = (
        value if amount is None else min(_of(amount, value), most)
        for amount, value in zip(given, own.axes, strict=True)
    )
    return Law.of_axes((twist, bend_y, bend_z))


def _radians(axis: str, limits: tuple[float, float]) -> tuple[float, float]:
    least = 0.0 if axis == "twist" else LEAST_SWING_DEG
    lower, upper = max(min(limits[0], -least), -HALF_TURN_DEG), min(max(limits[1], least), HALF_TURN_DEG)
    return math.radians(lower), math.radians(upper)


def applicable(settings: DollSettings, own: DollValues) -> DollSettings:
    """The settings without what the server would refuse: what is asked of a joint or body where there is none, or of
    bones that it does not know.
    """

    def of_bone(bone: str, joint: JointSettings) -> JointSettings:
        if bone in own.joints:
            return joint
        if bone in own.roots:
            return joint.without_joint()
        return joint.merge_alone() if bone in own.riders else JointSettings()

    joints = {bone: of_bone(bone, joint) for bone, joint in settings.joints.items()}
    return replace(settings, joints={bone: joint for bone, joint in joints.items() if joint})


def as_settings(values: JointValues) -> JointSettings:
    """Settings that make the laws of any joint those of these values."""

    def given(name: str) -> Amount | AxisAmounts:
        law = values.laws[name]
        twist, bend_y, bend_z = law.axes
        if name not in LAWS_OF_AXES or law.is_as(Law(law.unit)):
            return Amount(law.unit)
        return Amount(twist), Amount(bend_y), Amount(bend_z)

    return JointSettings(laws={name: given(name) for name in LAWS})


# --- commands --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Change:
    """One command for a joint."""

    command: str
    arguments: tuple[tuple[str, Any], ...]  # without the bone

    def apart(self) -> list[Change]:
        """One command for each value: of those that belong together, one refused refuses all."""
        groups: dict[str, list[tuple[str, Any]]] = {}
        for name, value in self.arguments:
            key = name if name.startswith("limits.") else name.partition(".")[0]
            groups.setdefault(key, []).append((name, value))
        return [Change(self.command, tuple(group)) for group in groups.values()]


def changes(now: JointValues, then: JointValues) -> list[Change]:
    """The commands that make the joint that is as `now` as `then`; none if it is."""
    result = []
    laws: list[tuple[str, Any]] = []
    for name in LAWS:
        laws += _law_arguments(name, now.laws[name], then.laws[name])
    limits = [
        (f"limits.{axis}", then.limits[axis])
        for axis in LIMIT_AXES
        if not _same_range(now.limits[axis], then.limits[axis])
    ]
    if laws or limits:
        result.append(Change("set", (*laws, *limits)))
    for command, axes in (("unlock", now.locked - then.locked), ("lock", then.locked - now.locked)):
        if axes:
            result.append(Change(command, (("axes", " ".join(axis for axis in AXES if axis in axes)),)))
    return result


def _law_arguments(name: str, now: Law, then: Law) -> list[tuple[str, Any]]:
    if now.is_as(then):
        return []
    if replace(now, unit=then.unit).is_as(then):  # the server leaves the ratios between axes as they are
        return [(name, then.unit)]
    return [(f"{name}.{axis}", value) for axis, value in zip(AXES, then.axes, strict=True)]


def _is_same(a: float, b: float) -> bool:
    return a == b or math.isclose(a, b, rel_tol=SAME, abs_tol=0.0)


def _same_range(a: tuple[float, float], b: tuple[float, float]) -> bool:
    return all(math.isclose(x, y, rel_tol=SAME, abs_tol=SAME) for x, y in zip(a, b, strict=True))


# --- the other side --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Placed:
    """A joint and where its bone is when the skin is bound to it, world."""

    values: JointValues
    position: tuple[float, float, float]  # [m]
    rotation: Quaternion  # bone -> world


def mirror_rule(joint: Placed, image: Placed) -> MirrorRule:
    """How values of `joint` become those of its image on the other side, by how the axes of the two lie.

    A rotation vector w of the one is -S w of the other, S the reflection in the plane between them. Where the axes are
    not each other's image, or it is one and the same joint, the rule is the usual one.
    """
    across = np.subtract(joint.position, image.position)
    if not np.linalg.norm(across) > 0.0:
        return USUAL_MIRROR
    normal = across / np.linalg.norm(across)
    reflection = np.eye(3) - 2.0 * np.outer(normal, normal)

    def turned(frame: str) -> Any:  # [j, k]: along axis j of the image, of what is axis k of the joint
        own, other = (
            to_matrix(np.array(placed.rotation)) @ to_matrix(np.array(getattr(placed.values, frame)))
            for placed in (joint, image)
        )
        return other.T @ (-reflection @ own)

    limits = _permutation(turned("limit_axes"))
    section = _permutation(turned("section_axes"))
    return MirrorRule(
        limits=USUAL_MIRROR.limits if limits is None else tuple((LIMIT_AXES[k], sign) for k, sign in limits),
        section=USUAL_MIRROR.section if section is None else _names(section),
    )


def _permutation(turned: Any) -> list[tuple[int, int]] | None:
    """For each row the column that it is along, and its sign; None if some row is along none, or the first, the
    limb's own axis, is along another's.
    """
    columns = np.argmax(np.abs(turned), axis=1)
    values = turned[np.arange(3), columns]
    if columns[0] != 0 or sorted(columns) != [0, 1, 2] or np.abs(values).min() < _FITS:
        return None
    return [(int(column), 1 if value > 0.0 else -1) for column, value in zip(columns, values, strict=True)]


def _names(section: list[tuple[int, int]]) -> tuple[str, str, str]:
    twist, bend_y, bend_z = (AXES[column] for column, _ in section)
    return twist, bend_y, bend_z
