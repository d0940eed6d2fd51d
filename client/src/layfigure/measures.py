"""Measures what a session expects, in one pose of the server. Pure: no bus, no clock."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from layfigure import protocol, rotation, skeleton
from layfigure.expectation import (
    Contact,
    Flow,
    Force,
    Moved,
    Position,
    Quantity,
    Rate,
    Rotation,
    SameState,
    Speed,
    Strain,
    Torque,
    Vector,
    Yielded,
)
from layfigure.protocol import Bools, Character, Floats, Pose

REST_CHANGE_DEG = 1e-4  # a rest rotation that differs by more has flowed: far more than rounding, far less than is seen


@dataclass(frozen=True)
class Sample:
    """What the server has said at a tick of the session."""

    tick: int
    character: Character
    pose: Pose
    before: Pose | None  # the pose before that one
    forces: Mapping[int, protocol.Force]  # of that pose, by pointers
    messages: Mapping[str, int]  # that came since the session's start, by channels

    @cached_property
    def worlds(self) -> tuple[Floats, Floats]:
        """Rotations (J, 4) and positions (J, 3) of the bones in the world."""
        return _worlds(self.character, self.pose)

    def point(self, joint: int, point: Vector) -> Floats:
        """A point of a bone, in the world [m]."""
        rotations, positions = self.worlds
        return np.asarray(positions[joint] + rotation.rotate(rotations[joint], np.array(point)))


@dataclass
class Reference:
    """A former sample, and which joints have flowed since (J)."""

    sample: Sample
    yielded: Bools


@dataclass(frozen=True)
class Seen:
    value: float  # NaN: there is nothing to measure
    detail: str = ""  # what it is, where a number does not tell it


def measure(quantity: Quantity, sample: Sample, joints: Mapping[str, int], reference: Reference | None) -> Seen:
    """The quantity in its unit, 1 or 0 for true or false. `reference`: at its moment `since`, if it has one."""
    character, pose = sample.character, sample.pose
    match quantity:
        case Position(bone, target, point):
            return _distance(sample.point(joints[bone], point) - _origin(reference, joints[bone], point), target)
        case Moved(bone, _, point):
            here = sample.point(joints[bone], point)
            return Seen(float(np.linalg.norm(here - _origin(reference, joints[bone], point))))
        case Rotation(bone, about):
            joint = joints[bone]
            return Seen(_angle_deg(character.joints[joint].rest_rotation, pose.rotations[joint], about))
        case Strain(bone):
            return Seen(_angle_deg(pose.rest_rotations[joints[bone]], pose.rotations[joints[bone]]))
        case Flow(bone):
            joint = joints[bone]
            return Seen(_angle_deg(character.joints[joint].rest_rotation, pose.rest_rotations[joint]))
        case Torque(bone, about):
            return Seen(_component(pose.torques[joints[bone]], about))
        case Speed(bone):
            return _speed(sample, None if bone is None else joints[bone])
        case Force(pointer, along):
            return _force(sample, pointer, along)
        case Contact(pointer, bone):
            return _contact(sample, pointer, None if bone is None else joints[bone])
        case Rate(channel):
            assert reference is not None
            count = sample.messages[channel] - reference.sample.messages[channel]
            return Seen(count * character.pose_hz / (sample.tick - reference.sample.tick), f"{count} messages")
        case SameState():
            return _difference(sample, reference)
        case Yielded(bone):
            return _yielded(sample, joints[bone], reference)
    raise AssertionError("a command's answer is not measured in a pose")


def _worlds(character: Character, pose: Pose) -> tuple[Floats, Floats]:
    rotations, positions = skeleton.world_poses(character, pose.root_translation[None], pose.rotations[None])
    return rotations[0], positions[0]


def _angle_deg(a: Floats, b: Floats, about: Vector | None = None) -> float:
    """Of the rotation from a to b; about an axis: of its twist, -180 to 180 (swing-twist decomposition)."""
    if about is None:
        return math.degrees(float(rotation.angle_between(a, b)))
    w, *v = rotation.multiply(rotation.conjugate(a), b)
    along = float(np.dot(v, _unit(about)))
    return math.degrees(2.0 * math.atan2(along, w) if w >= 0.0 else 2.0 * math.atan2(-along, -w))


def _unit(vector: Vector) -> Floats:
    return np.asarray(np.array(vector) / np.linalg.norm(vector))


def _component(vector: Floats, along: Vector | None) -> float:
    return float(np.linalg.norm(vector) if along is None else np.dot(vector, _unit(along)))


def _origin(reference: Reference | None, joint: int, point: Vector) -> Floats:
    """Where a point of a bone was at the reference; without one, the world's origin."""
    return np.zeros(3) if reference is None else reference.sample.point(joint, point)


def _distance(here: Floats, there: Vector) -> Seen:
    return Seen(float(np.linalg.norm(here - there)), f"it is at [{', '.join(f'{x:.4f}' for x in here)}]")


def _speed(sample: Sample, joint: int | None) -> Seen:
    if sample.before is None:
        return Seen(math.nan, "no earlier pose to tell a speed")
    passed_s = (sample.pose.time_us - sample.before.time_us) * 1e-6
    _, before = _worlds(sample.character, sample.before)
    speeds = np.linalg.norm(sample.worlds[1] - before, axis=1) / passed_s
    if joint is not None:
        return Seen(float(speeds[joint]))
    fastest = int(np.argmax(speeds))
    return Seen(float(speeds[fastest]), f"of '{sample.character.joints[fastest].name}'")


def _force(sample: Sample, pointer: int, along: Vector | None) -> Seen:
    if pointer not in sample.forces:
        return Seen(math.nan, f"no force message of pointer {pointer}")
    return Seen(_component(sample.forces[pointer].force, along))


def _contact(sample: Sample, pointer: int, joint: int | None) -> Seen:
    if pointer not in sample.forces:
        return Seen(0.0, f"no force message of pointer {pointer}")
    force = sample.forces[pointer]
    if not force.contact:
        return Seen(0.0, "it touches nothing")
    touched = sample.character.joints[force.joint].name if force.joint >= 0 else "no bone"
    return Seen(float(joint is None or force.joint == joint), f"it touches '{touched}'")


def _differences_deg(a: Floats, b: Floats) -> Floats:
    """Exactly 0 where nothing differs: the angle's own rounding would hide what is the same to the last bit."""
    return np.where((a == b).all(axis=1), 0.0, np.degrees(rotation.angle_between(a, b)))


def _difference(sample: Sample, reference: Reference | None) -> Seen:
    assert reference is not None
    former = reference.sample.pose
    angles = np.maximum(
        _differences_deg(former.rotations, sample.pose.rotations),
        _differences_deg(former.rest_rotations, sample.pose.rest_rotations),
    )
    largest = int(np.argmax(angles))
    return Seen(float(angles[largest]), f"of '{sample.character.joints[largest].name}'")


def _yielded(sample: Sample, joint: int, reference: Reference | None) -> Seen:
    assert reference is not None
    rest_deg = _angle_deg(reference.sample.pose.rest_rotations[joint], sample.pose.rest_rotations[joint])
    return Seen(
        float(reference.yielded[joint] or rest_deg > REST_CHANGE_DEG),
        f"its rest rotation has flowed by {rest_deg:.3g} deg",
    )
