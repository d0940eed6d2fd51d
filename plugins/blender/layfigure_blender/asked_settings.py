# SPDX-License-Identifier: GPL-3.0-or-later
"""What the properties of a doll and its joints ask for, as settings, and settings as properties."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import bpy

from .joint_properties import KEYS
from .joint_settings import (
    AXES,
    DOLL_NUMBERS,
    LAWS,
    LAWS_OF_AXES,
    LIMIT_AXES,
    Amount,
    AxisAmounts,
    DollSettings,
    JointSettings,
)
from .settings_file import of_single

_DEGREE_DIGITS = 4  # single precision in radians keeps 1.4e-5 degrees at a half turn

# --- to settings -----------------------------------------------------------------------------------------------------


def joint_settings(bone: bpy.types.PoseBone) -> JointSettings:
    """What is asked of the bone."""
    if not bone.is_property_set("layfigure_joint"):
        return JointSettings()
    joint = bone.layfigure_joint
    laws = {law: _law(law, getattr(joint, law)) for law in LAWS}
    limits = {axis: _limits(getattr(joint, f"limit_{axis}")) for axis in LIMIT_AXES}
    numbers = {} if joint.weight == "OWN" else {joint.weight: of_single(getattr(joint, joint.weight))}
    if joint.friction.override:
        numbers["friction"] = of_single(joint.friction.value)
    return JointSettings(
        laws={law: given for law, given in laws.items() if given is not None},
        limits={axis: given for axis, given in limits.items() if given is not None},
        locked=frozenset(axis for axis in AXES if getattr(joint.locks, axis)) if joint.locks.override else None,
        merge=None if joint.merge == "OWN" else joint.merge == "MERGE",
        shape=None if joint.shape == "OWN" else joint.shape,
        numbers=numbers,
    )


def all_joint_settings(armature: bpy.types.Object) -> dict[str, JointSettings]:
    """By bones, of those of which anything is asked."""
    found = {bone.name: joint_settings(bone) for bone in armature.pose.bones}
    return {name: joint for name, joint in found.items() if joint}


def doll_settings(armature: bpy.types.Object) -> DollSettings:
    doll = armature.layfigure_doll
    numbers = {name: getattr(doll, name) for name in DOLL_NUMBERS}
    return DollSettings(
        material=None if doll.material == "OWN" else doll.material,
        numbers={name: of_single(group.value) for name, group in numbers.items() if group.override},
        joints=all_joint_settings(armature),
    )


def _law(law: str, group: Any) -> Amount | AxisAmounts | None:
    if law not in LAWS_OF_AXES:
        return _amount(group)
    if not group.by_axis:
        return _amount(group.whole)
    twist, bend_y, bend_z = (_amount(getattr(group, axis)) for axis in AXES)
    return None if twist is None and bend_y is None and bend_z is None else (twist, bend_y, bend_z)


def _amount(group: Any) -> Amount | None:
    if not group.override:
        return None
    if group.kind == "FACTOR":
        return Amount(of_single(group.factor), is_factor=True)
    return Amount(math.inf if group.kind == "UNLIMITED" else of_single(group.value))


def _limits(group: Any) -> tuple[float, float] | None:
    if not group.override:
        return None
    return _degrees(group.lower), _degrees(group.upper)


def _degrees(angle: float) -> float:
    return round(math.degrees(angle), _DEGREE_DIGITS) + 0.0  # no -0.0


# --- from settings ---------------------------------------------------------------------------------------------------


def write_joint(bone: bpy.types.PoseBone, settings: JointSettings, keys: tuple[str, ...] = KEYS) -> None:
    """Asks of the bone what the settings say under these keys, and nothing else under them."""
    joint = bone.layfigure_joint
    for key in keys:
        if key in LAWS:
            _write_law(key, getattr(joint, key), settings.laws.get(key))
        elif key == "limits":
            for axis in LIMIT_AXES:
                _write_limits(getattr(joint, f"limit_{axis}"), settings.limits.get(axis))
        elif key == "locks":
            _write_locks(joint.locks, settings.locked)
        elif key == "merge":
            joint.merge = "OWN" if settings.merge is None else "MERGE" if settings.merge else "BODY"
        elif key == "shape":
            joint.shape = settings.shape or "OWN"
        elif key == "weight":
            _write_weight(joint, settings.numbers)
        elif key == "friction":
            _write_number(joint.friction, settings.numbers.get("friction"))


def write_doll(armature: bpy.types.Object, settings: DollSettings) -> None:
    """All but the joints, which write_joint() takes one by one."""
    doll = armature.layfigure_doll
    doll.material = settings.material or "OWN"
    for name in DOLL_NUMBERS:
        _write_number(getattr(doll, name), settings.numbers.get(name))


def _write_law(law: str, group: Any, given: Amount | AxisAmounts | None) -> None:
    if law not in LAWS_OF_AXES:
        _write_amount(group, given if isinstance(given, Amount) else None)
        return
    group.by_axis = isinstance(given, tuple)
    _write_amount(group.whole, given if isinstance(given, Amount) else None)
    for axis, amount in zip(AXES, given if isinstance(given, tuple) else (None, None, None), strict=True):
        _write_amount(getattr(group, axis), amount)


def _write_amount(group: Any, amount: Amount | None) -> None:
    if amount is not None:
        if amount.is_factor:
            group.kind, group.factor = "FACTOR", amount.number
        elif math.isinf(amount.number):
            group.kind = "UNLIMITED"
        else:
            group.kind, group.value = "VALUE", amount.number
    group.override = amount is not None


def _write_limits(group: Any, limits: tuple[float, float] | None) -> None:
    if limits is not None:
        group.lower, group.upper = map(math.radians, limits)
    group.override = limits is not None


def _write_locks(group: Any, locked: frozenset[str] | None) -> None:
    if locked is not None:
        for axis in AXES:
            setattr(group, axis, axis in locked)
    group.override = locked is not None


def _write_weight(joint: Any, numbers: Mapping[str, float]) -> None:
    joint.weight = next((name for name in ("density", "mass") if name in numbers), "OWN")
    if joint.weight != "OWN":
        setattr(joint, joint.weight, numbers[joint.weight])


def _write_number(group: Any, value: float | None) -> None:
    if value is not None:
        group.value = value
    group.override = value is not None
