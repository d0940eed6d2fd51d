# SPDX-License-Identifier: GPL-3.0-or-later
"""What is asked of a doll and of its joints, in place of what the server chooses: plain data, without Blender.

It says what a settings file of the server says, CHARACTER.doll.toml (settings_file.py reads and writes it), with the
same names and ranges. Whatever is not given stays as the server chooses it. Units are SI; angles of limits are degrees,
as in the file. Everything here is immutable and may be used from any thread.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

AXES = ("twist", "bend_y", "bend_z")
"""Of a joint's section: along the limb, and the principal axes of bending."""

LIMIT_AXES = ("twist", "swing_y", "swing_z")
"""Of a joint's limits: along the limb, and across it."""

LAWS_OF_AXES = ("stiffness", "damping", "yield_torque")
"""Of the joint's laws those that each axis may have its own value of."""

LAWS = (*LAWS_OF_AXES, "flow_damping", "hardening")
UNITS = {
    "stiffness": "N m/rad",
    "damping": "N m s/rad",
    "yield_torque": "N m",
    "flow_damping": "N m s/rad",
    "hardening": "N m/rad",
}
UNLIMITED_LAWS = ("stiffness", "yield_torque")
"""Those that may be infinite: rigid until it yields; never yields."""

MATERIALS = ("soft vinyl", "wood", "wire armature", "clay")
SHAPES = ("hull", "capsule", "none")

HALF_TURN_DEG = 180.0  # a limit there is none
LEAST_SWING_DEG = 1.0  # a swing's bounds are the semi-axes of an ellipse, which cannot vanish


@dataclass(frozen=True)
class Range:
    """Of numbers that the server takes, both ends included unless `least_excluded`."""

    least: float
    most: float
    least_excluded: bool = False

    def complaint(self, name: str, value: float) -> str:
        """One line, or "" if the value is allowed."""
        above = value > self.least if self.least_excluded else value >= self.least
        if above and value <= self.most:
            return ""
        start = "(" if self.least_excluded else "["
        return f"{name} = {value:g}, expected a number in {start}{self.least:g}, {self.most:g}]"


FACTORS = Range(0.0, 1e6, least_excluded=True)
AMOUNTS = {
    name: Range(0.0, math.inf if name in UNLIMITED_LAWS else 1e12)  # what `set` takes, less than a file
    for name in LAWS
}
BODY_NUMBERS = {
    "friction": Range(0.0, 1e6),
    "density": Range(0.0, 1e6, least_excluded=True),  # [kg/m^3]
    "mass": Range(0.0, 1e6, least_excluded=True),  # [kg]
}
_MOST = 1e18
DOLL_NUMBERS = {
    "total_mass": Range(0.0, 1e6, least_excluded=True),  # [kg]
    "density": Range(0.0, 1e6, least_excluded=True),  # [kg/m^3]
    "elastic_modulus": Range(0.0, _MOST),  # [Pa]
    "poisson_ratio": Range(-1.0, 0.5, least_excluded=True),
    "viscosity": Range(0.0, _MOST),  # [Pa s]
    "flow_viscosity": Range(0.0, _MOST),  # [Pa s]
    "yield_stress": Range(0.0, _MOST),  # [Pa]
    "hardening": Range(0.0, _MOST),  # [Pa]
    "largest_sag": Range(0.0, 1.0, least_excluded=True),  # [rad]
    "largest_strain": Range(0.0, math.pi, least_excluded=True),  # [rad]
    "hold_margin": Range(1.0, 1e6),
    "damping_ratio": Range(0.0, 10.0),
    "largest_flow_rate": Range(0.0, 1e6, least_excluded=True),  # [rad/s]
}
OF_MATERIAL = (
    "density",
    "elastic_modulus",
    "poisson_ratio",
    "viscosity",
    "flow_viscosity",
    "yield_stress",
    "hardening",
)
"""Those of DOLL_NUMBERS that a material gives."""


@dataclass(frozen=True)
class Amount:
    """A number given outright, or as a multiple of the one that the server chooses."""

    number: float
    is_factor: bool = False


AxisAmounts = tuple[Amount | None, Amount | None, Amount | None]
"""One for each of AXES; None: as chosen."""

Limits = tuple[float, float]
"""Lower bound in [-180, 0], upper one in [0, 180], from the joint's neutral pose [deg]."""


@dataclass(frozen=True)
class JointSettings:
    """Of a bone: of its joint to the parent (laws, limits, locks) and of its body."""

    laws: Mapping[str, Amount | AxisAmounts] = field(default_factory=dict)  # by LAWS; of axes by LAWS_OF_AXES alone
    limits: Mapping[str, Limits] = field(default_factory=dict)  # by LIMIT_AXES
    locked: frozenset[str] | None = None  # of AXES; empty: none is locked, whatever the server would choose
    merge: bool | None = None  # True: rides on its parent's body; False: is a body
    shape: str | None = None  # of SHAPES, in contacts
    numbers: Mapping[str, float] = field(default_factory=dict)  # by BODY_NUMBERS; not both density and mass

    def __bool__(self) -> bool:
        """Whether anything is asked for."""
        return self != JointSettings()

    @property
    def is_about_joint(self) -> bool:
        return bool(self.laws or self.limits) or self.locked is not None

    def without_joint(self) -> JointSettings:
        """What is about the body alone."""
        return replace(self, laws={}, limits={}, locked=None)

    def merge_alone(self) -> JointSettings:
        return JointSettings(merge=self.merge)


@dataclass(frozen=True)
class DollSettings:
    material: str | None = None  # of MATERIALS: what the numbers that are not given are those of
    numbers: Mapping[str, float] = field(default_factory=dict)  # by DOLL_NUMBERS
    joints: Mapping[str, JointSettings] = field(default_factory=dict)  # by bone or pattern; later ones win

    def without_joints(self) -> DollSettings:
        """The doll before anything is said of its joints' laws, limits and locks."""
        bodies = {name: joint.without_joint() for name, joint in self.joints.items()}
        return replace(self, joints={name: body for name, body in bodies.items() if body})


def matches(pattern: str, name: str) -> bool:
    """Whether the whole name is as the pattern says: * any characters or none, ? any one, all others themselves."""
    reached = {0}  # places in the pattern up to which the name so far may have come
    for k, letter in enumerate(pattern):  # leading stars may stand for nothing
        if letter != "*":
            break
        reached.add(k + 1)
    for letter in name:
        reached = _after(pattern, reached, letter)
    return len(pattern) in reached


def _after(pattern: str, places: set[int], letter: str) -> set[int]:
    following: set[int] = set()
    for place in places:
        if place == len(pattern):
            continue
        if pattern[place] == "*":
            following.add(place)
        elif pattern[place] in ("?", letter):
            following.add(place + 1)
    for place in list(following):
        while place < len(pattern) and pattern[place] == "*":
            place += 1
            following.add(place)
    return following


def resolve(joints: Mapping[str, JointSettings], bones: Iterable[str]) -> tuple[dict[str, JointSettings], list[str]]:
    """What a file's tables say of each bone, put together as the server does: a bone's own name wins over patterns and
    the later pattern over the earlier, value by value. With the patterns that match no bone.
    """
    names = list(bones)
    known = set(names)
    result: dict[str, JointSettings] = {}
    idle = []
    for exact in (False, True):
        for pattern, joint in joints.items():
            if (pattern in known) != exact:
                continue
            found = [pattern] if exact else [name for name in names if matches(pattern, name)]
            if not found:
                idle.append(pattern)
            for name in found:
                result[name] = laid_over(result.get(name, JointSettings()), joint)
    return {name: result[name] for name in names if name in result}, idle


def laid_over(under: JointSettings, over: JointSettings) -> JointSettings:
    """`under` with what `over` gives in its place."""
    numbers = {**under.numbers, **over.numbers}
    for one, other in (("density", "mass"), ("mass", "density")):  # two ways to say one thing
        if one in over.numbers:
            numbers.pop(other, None)
    return JointSettings(
        laws={**under.laws, **over.laws},
        limits={**under.limits, **over.limits},
        locked=under.locked if over.locked is None else over.locked,
        merge=under.merge if over.merge is None else over.merge,
        shape=under.shape if over.shape is None else over.shape,
        numbers=numbers,
    )


@dataclass(frozen=True)
class MirrorRule:
    """How values of a joint become those of its mirror image, whose axes are its own."""

    limits: tuple[tuple[str, int], ...]  # for each of LIMIT_AXES of the image: whose range it takes, and its sign
    section: tuple[str, str, str]  # for each of AXES of the image: whose value it takes


USUAL_MIRROR = MirrorRule(limits=(("twist", -1), ("swing_y", 1), ("swing_z", -1)), section=AXES)
"""The two joints of a mirrored pair have limits about axes x, y, z and S x, -S y, S z, S the reflection. A rotation
vector w becomes -S w, so that twists and swings about z change their sign and those about y do not.
"""


def mirrored(joint: JointSettings, rule: MirrorRule = USUAL_MIRROR) -> JointSettings:
    """What is to be asked of the bone on the other side, so that it behaves as the mirror image."""
    return replace(
        joint,
        laws={name: _mirrored_law(law, rule) for name, law in joint.laws.items()},
        limits={
            axis: _signed(joint.limits[source], sign)
            for axis, (source, sign) in zip(LIMIT_AXES, rule.limits, strict=True)
            if source in joint.limits
        },
        locked=None
        if joint.locked is None
        else frozenset(axis for axis, source in zip(AXES, rule.section, strict=True) if source in joint.locked),
    )


def _mirrored_law(law: Amount | AxisAmounts, rule: MirrorRule) -> Amount | AxisAmounts:
    if isinstance(law, Amount):
        return law
    of_axis = dict(zip(AXES, law, strict=True))
    first, second, third = (of_axis[source] for source in rule.section)
    return first, second, third


def _signed(limits: Limits, sign: int) -> Limits:
    lower, upper = limits
    return (lower, upper) if sign > 0 else (-upper + 0.0, -lower + 0.0)  # no -0.0
