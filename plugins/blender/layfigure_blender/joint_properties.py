# SPDX-License-Identifier: GPL-3.0-or-later
"""What is asked of the doll and its joints as properties of the armature's object and of its pose bones: kept in the
.blend, copied with the armature, and allowed in library overrides.

    pose_bone.layfigure_joint.stiffness.whole.override, .kind "FACTOR" | "VALUE" | "UNLIMITED", .factor, .value
                              stiffness.by_axis, .twist, .bend_y, .bend_z    each as whole; damping, yield_torque too
                              flow_damping, hardening                        as whole
                              limit_twist, limit_swing_y, limit_swing_z      .override, .lower, .upper [rad]
                              locks.override, .twist, .bend_y, .bend_z
                              merge, shape, weight, density, mass, friction  of the body, from the next start on
    object.layfigure_doll.material, .total_mass and so on, each .override, .value

What has no `override` is the doll's own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, PointerProperty

from .joint_settings import (
    AMOUNTS,
    AXES,
    BODY_NUMBERS,
    DOLL_NUMBERS,
    FACTORS,
    LAWS,
    LAWS_OF_AXES,
    LIMIT_AXES,
    MATERIALS,
    SHAPES,
    UNLIMITED_LAWS,
    Range,
)
from .joint_values import JointValues

LABELS = {
    "stiffness": "Stiffness",
    "damping": "Damping",
    "yield_torque": "Yield Torque",
    "flow_damping": "Flow Damping",
    "hardening": "Hardening",
    "twist": "Twist",
    "bend_y": "Bend Y",
    "bend_z": "Bend Z",
    "swing_y": "Swing Y",
    "swing_z": "Swing Z",
    "locks": "Locked",
    "merge": "Body",
    "shape": "Contact Shape",
    "weight": "Weight",
    "friction": "Friction",
}
_DESCRIPTIONS = {
    "stiffness": "Torque by which the joint springs back, per angle [N m/rad]",
    "damping": "Torque against the motion of the spring, per angular speed [N m s/rad]",
    "yield_torque": "Torque from which on the joint flows and keeps its new pose [N m]",
    "flow_damping": "Torque above the yield torque, per angular speed of the flow [N m s/rad]",
    "hardening": "Growth of the yield torque with the flow [N m/rad]",
}
KEYS = (*LAWS, "limits", "locks", "merge", "shape", "weight", "friction")
"""Of what is copied or taken back at once."""

_LEAST = 1e-9  # in place of 0, where 0 is excluded
_LARGEST = 1e12
_OVERRIDABLE = {"override": {"LIBRARY_OVERRIDABLE"}}

Changed = Callable[[bpy.types.PropertyGroup, bpy.types.Context, bool], None]
_listeners: list[Changed] = []


def add_change_listener(listener: Changed) -> None:
    """Calls it with the innermost group of whatever property of this module was changed, and whether that was its
    switch, `override`.
    """
    _listeners.append(listener)


def remove_change_listener(listener: Changed) -> None:
    _listeners.remove(listener)


def _on_change(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for listener in tuple(_listeners):
        listener(group, context, False)


def _on_switch(group: bpy.types.PropertyGroup, context: bpy.types.Context) -> None:
    for listener in tuple(_listeners):
        listener(group, context, True)


# --- the groups ------------------------------------------------------------------------------------------------------


def _group(name: str, doc: str, properties: Mapping[str, Any]) -> type[bpy.types.PropertyGroup]:
    return type(name, (bpy.types.PropertyGroup,), {"__doc__": doc, "__annotations__": dict(properties)})


def _switch(description: str = "Use this in place of the doll's own value") -> Any:
    return BoolProperty(name="Override", description=description, update=_on_switch, **_OVERRIDABLE)


def _flag(name: str, description: str) -> Any:
    return BoolProperty(name=name, description=description, update=_on_change, **_OVERRIDABLE)


def _float(name: str, description: str, allowed: Range, default: float, **more: Any) -> Any:
    least = max(allowed.least, _LEAST) if allowed.least_excluded and allowed.least == 0.0 else allowed.least
    bounds = {"min": least, "max": min(allowed.most, _LARGEST), "default": default}
    return FloatProperty(name=name, description=description, update=_on_change, **{**bounds, **_OVERRIDABLE, **more})


def _enum(name: str, description: str, items: list[tuple[str, str, str]]) -> Any:
    return EnumProperty(name=name, description=description, items=items, update=_on_change, **_OVERRIDABLE)


def _pointer(group: type) -> Any:
    return PointerProperty(type=group, **_OVERRIDABLE)


_FACTOR = ("FACTOR", "Factor", "Times the doll's own value")
_VALUE = ("VALUE", "Value", "This value")
_UNLIMITED = {
    "stiffness": ("UNLIMITED", "Rigid", "Does not turn until it yields"),
    "yield_torque": ("UNLIMITED", "Never Yields", "Always springs back"),
}


def _amount_group(law: str) -> type[bpy.types.PropertyGroup]:
    kinds = [_FACTOR, _VALUE] + ([_UNLIMITED[law]] if law in UNLIMITED_LAWS else [])
    name = "LayfigureAmountOf" + law.title().replace("_", "")
    return _group(
        name,
        f"A number for {law}, or the doll's own.",
        {
            "override": _switch(),
            "kind": _enum("Kind", "What the number is", kinds),
            "factor": _float("Factor", "Times the doll's own value", FACTORS, 1.0, soft_min=0.01, soft_max=100.0),
            "value": _float(LABELS[law], _DESCRIPTIONS[law], AMOUNTS[law], 0.0, precision=5, step=1),
        },
    )


_amounts = {law: _amount_group(law) for law in LAWS}


def _law_group(law: str) -> type[bpy.types.PropertyGroup]:
    amount = _amounts[law]
    return _group(
        "LayfigureLawOf" + law.title().replace("_", ""),
        f"{LABELS[law]} of the whole joint, or of single axes.",
        {
            "by_axis": _flag("By Axis", "Values of single axes, in place of one that all axes follow"),
            "whole": _pointer(amount),
            **{axis: _pointer(amount) for axis in AXES},
        },
    )


_laws = {law: _law_group(law) for law in LAWS_OF_AXES}


class LayfigureLimit(bpy.types.PropertyGroup):
    """How far a joint turns about one axis of its limits."""

    __annotations__ = {
        "override": _switch(),
        "lower": _float(
            "Min",
            "From the neutral pose; -180 degrees: no limit",
            Range(-math.pi, 0.0),
            -math.pi,
            subtype="ANGLE",
            precision=2,
        ),
        "upper": _float(
            "Max",
            "From the neutral pose; 180 degrees: no limit",
            Range(0.0, math.pi),
            math.pi,
            subtype="ANGLE",
            precision=2,
        ),
    }


class LayfigureLocks(bpy.types.PropertyGroup):
    """The axes that do not turn."""

    __annotations__ = {
        "override": _switch(),
        **{axis: _flag(LABELS[axis], "This axis of the joint does not turn") for axis in AXES},
    }


class LayfigureNumber(bpy.types.PropertyGroup):
    """Friction of a body."""

    __annotations__ = {
        "override": _switch(),
        "value": _float("Friction", "Coulomb's coefficient in contacts", BODY_NUMBERS["friction"], 0.5, soft_max=2.0),
    }


_OWN = ("OWN", "Doll's Own", "As the doll has it")


class LayfigureJoint(bpy.types.PropertyGroup):
    """Of a pose bone: pose_bone.layfigure_joint."""

    __annotations__ = {
        **{law: _pointer(_laws[law]) for law in LAWS_OF_AXES},
        **{law: _pointer(_amounts[law]) for law in LAWS if law not in LAWS_OF_AXES},
        **{f"limit_{axis}": _pointer(LayfigureLimit) for axis in LIMIT_AXES},
        "locks": _pointer(LayfigureLocks),
        "merge": _enum(
            "Body",
            "Whether the bone is a body of the doll, from the next start on",
            [
                _OWN,
                ("BODY", "A Body", "It has a joint, however small its skin is"),
                ("MERGE", "Merged", "Its skin belongs to its parent's body"),
            ],
        ),
        "shape": _enum(
            "Contact Shape",
            "What others meet, from the next start on",
            [_OWN, *((shape, shape.title(), "") for shape in SHAPES)],
        ),
        "weight": _enum(
            "Weight",
            "From the next start on",
            [_OWN, ("density", "Density", "[kg/m³]"), ("mass", "Mass", "[kg]")],
        ),
        "density": _float("Density", "[kg/m³]", BODY_NUMBERS["density"], 250.0),
        "mass": _float("Mass", "[kg]", BODY_NUMBERS["mass"], 1.0, precision=4),
        "friction": _pointer(LayfigureNumber),
    }


_DOLL_LABELS = {
    "total_mass": ("Total Mass", "Of the whole doll [kg]", 14.0),
    "density": ("Density", "[kg/m³]", 250.0),
    "elastic_modulus": ("Elastic Modulus", "Of stiffness [Pa]", 4.1e5),
    "poisson_ratio": ("Poisson's Ratio", "Of twist against bend", 0.47),
    "viscosity": ("Viscosity", "Of damping [Pa s]", 1.0e4),
    "flow_viscosity": ("Flow Viscosity", "Of flow damping [Pa s]", 1.0e5),
    "yield_stress": ("Yield Stress", "In tension [Pa]", 6.1e4),
    "hardening": ("Hardening", "[Pa]", 0.0),
    "largest_sag": ("Largest Sag", "Of a joint under its limb's weight, stretched out level [rad]", 0.04),
    "largest_strain": ("Largest Strain", "Of a joint before it yields: so far it springs back [rad]", 0.2),
    "hold_margin": ("Hold Margin", "Least yield torque, as a multiple of that of the weight", 2.0),
    "damping_ratio": ("Damping Ratio", "Least, of a joint with its limb", 0.7),
    "largest_flow_rate": ("Largest Flow Rate", "Of a joint at twice its yield torque [rad/s]", 3.0),
}


def _number_group(name: str) -> type[bpy.types.PropertyGroup]:
    label, description, default = _DOLL_LABELS[name]
    return _group(
        "LayfigureDoll" + name.title().replace("_", ""),
        f"{label} of the whole doll.",
        {
            "override": _switch("Use this in place of the material's or the server's value"),
            "value": _float(label, description, DOLL_NUMBERS[name], default, precision=4),
        },
    )


_doll_numbers = {name: _number_group(name) for name in DOLL_NUMBERS}


class LayfigureDoll(bpy.types.PropertyGroup):
    """Of an armature object: object.layfigure_doll."""

    __annotations__ = {
        "material": _enum(
            "Material",
            "What the whole doll is made of",
            [
                ("OWN", "Default", "The server's default: soft vinyl"),
                *((material, material.title(), "") for material in MATERIALS),
            ],
        ),
        "edit_selected": BoolProperty(
            name="Edit Selected Bones", description="What is changed of one bone is changed of all that are selected"
        ),
        **{name: _pointer(group) for name, group in _doll_numbers.items()},
    }


# --- where a group belongs -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Part:
    """What a property group is about."""

    keys: tuple[str, ...]  # of KEYS
    law: str = ""  # of LAWS
    axis: str = ""  # of AXES, for a law; of LIMIT_AXES; empty: of all


def owner(group: bpy.types.PropertyGroup, first: bpy.types.PoseBone | None) -> tuple[bpy.types.PoseBone, Part] | None:
    """The pose bone that a group is of, and what it is there; None if it is of the whole doll. `first` is looked at
    first. (path_from_id() does not know groups of pose bones in all versions of Blender.)
    """
    armature = group.id_data
    wanted = group.as_pointer()
    bones = [bone for bone in armature.pose.bones if bone.is_property_set("layfigure_joint")] if armature.pose else []
    if first is not None and first in bones:
        bones.insert(0, first)
    for bone in bones:
        for part, candidate in _parts(bone.layfigure_joint):
            if candidate.as_pointer() == wanted:
                return bone, part
    return None


def _parts(joint: Any) -> Iterator[tuple[Part, Any]]:
    yield Part(("merge", "shape", "weight")), joint
    for law in LAWS:
        group = getattr(joint, law)
        yield Part((law,), law), group
        if law in LAWS_OF_AXES:
            yield Part((law,), law), group.whole
            for axis in AXES:
                yield Part((law,), law, axis), getattr(group, axis)
    for axis in LIMIT_AXES:
        yield Part(("limits",), axis=axis), getattr(joint, f"limit_{axis}")
    yield Part(("locks",)), joint.locks
    yield Part(("friction",)), joint.friction


def match_reference(armature: bpy.types.Object) -> None:
    """Gives the linked armature that this one overrides the groups that this one has, with nothing asked in them:
    Blender keeps an override of what both have, and of a whole group it keeps none.
    """
    override = armature.override_library
    reference = override.reference if override is not None else None
    if reference is None or reference.pose is None:
        return
    for rig in (armature, reference):
        for name in DOLL_NUMBERS:
            getattr(rig.layfigure_doll, name)
        for bone in armature.pose.bones:
            if bone.is_property_set("layfigure_joint") and bone.name in rig.pose.bones:
                for _ in _parts(rig.pose.bones[bone.name].layfigure_joint):
                    pass


def start_from(group: Any, part: Part, own: JointValues) -> None:
    """A group that has just been switched on and was never changed begins with the doll's own values."""
    if part.keys == ("limits",) and (group.lower, group.upper) == _default(group, "lower", "upper"):
        group.lower, group.upper = own.limits[part.axis]
    elif part.keys == ("locks",) and not any(getattr(group, axis) for axis in AXES):
        for axis in own.locked:
            setattr(group, axis, True)
    elif part.law and hasattr(group, "value") and group.value == 0.0:
        law = own.laws[part.law]
        value = law.axes[AXES.index(part.axis)] if part.axis else law.unit
        group.value = value if math.isfinite(value) else 0.0


def _default(group: Any, *names: str) -> tuple[float, ...]:
    return tuple(group.bl_rna.properties[name].default for name in names)


classes = (
    *_amounts.values(),
    *_laws.values(),
    LayfigureLimit,
    LayfigureLocks,
    LayfigureNumber,
    LayfigureJoint,
    *_doll_numbers.values(),
    LayfigureDoll,
)


def register() -> None:
    bpy.types.PoseBone.layfigure_joint = PointerProperty(type=LayfigureJoint, **_OVERRIDABLE)
    bpy.types.Object.layfigure_doll = PointerProperty(type=LayfigureDoll, **_OVERRIDABLE)


def unregister() -> None:
    del bpy.types.Object.layfigure_doll
    del bpy.types.PoseBone.layfigure_joint
