"""What a session expects: a quantity of the doll or of a hand, its bounds, and when. expectation_file.py reads it from
TOML, measures.py measures, judge.py judges.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from layfigure.protocol import (
    CHARACTER_CHANNEL,
    FORCE_CHANNEL,
    POSE_CHANNEL,
    STATUS_CHANNEL,
)

Vector = tuple[float, float, float]
Moment = float | str  # [s] from the session's start, or the name of a mark

WALL_CLOCK_CHANNELS = (STATUS_CHANNEL, CHARACTER_CHANNEL)  # their messages come by wall-clock time
RATED_CHANNELS = (POSE_CHANNEL, FORCE_CHANNEL, *WALL_CLOCK_CHANNELS)


@dataclass(frozen=True)
class Bounds:
    """A closed interval; for what is true or false, 1 or 0."""

    least: float = -math.inf
    most: float = math.inf

    def excess(self, value: float) -> float:
        """How far outside the value is: 0 inside, below 0 if too little, above 0 if too much, NaN if there is none."""
        if math.isnan(value):
            return value
        return value - self.least if value < self.least else max(value - self.most, 0.0)


@dataclass(frozen=True)
class Position:
    """How far a point of a bone is from `target` in the world, or, with `since`, from that beyond where it was [m]."""

    bone: str
    target: Vector
    point: Vector = (0.0, 0.0, 0.0)  # in the bone's frame [m]; the bone's head
    since: Moment | None = None
    unit = "m"


@dataclass(frozen=True)
class Moved:
    """How far a point of a bone is from where it was at `since` [m]."""

    bone: str
    since: Moment
    point: Vector = (0.0, 0.0, 0.0)
    unit = "m"


@dataclass(frozen=True)
class Rotation:
    """How far a joint is turned from the rest rotation that the character came with [deg]: the whole angle, or its
    twist about an axis in the bone's frame, with its sign."""

    bone: str
    about: Vector | None = None
    unit = "deg"


@dataclass(frozen=True)
class Strain:
    """How far a joint is turned from the rest rotation that it has now, to which it springs back [deg]."""

    bone: str
    unit = "deg"


@dataclass(frozen=True)
class Flow:
    """How far a joint's rest rotation has flowed from the one that the character came with [deg]."""

    bone: str
    unit = "deg"


@dataclass(frozen=True)
class Torque:
    """Of the joint's strain: its size, or its component about an axis in the bone's frame [N m]."""

    bone: str
    about: Vector | None = None
    unit = "N m"


@dataclass(frozen=True)
class Speed:
    """Of a bone's head, between the two newest poses [m/s]; without a bone, of the fastest one."""

    bone: str | None = None
    unit = "m/s"


@dataclass(frozen=True)
class Force:
    """Of a pointer's coupling on the doll or on its fingertip: its size, or its component along a direction [N]."""

    pointer: int
    along: Vector | None = None
    unit = "N"


@dataclass(frozen=True)
class Rate:
    """Messages of a channel per second of the session, over the expectation's window [Hz]."""

    channel: str
    unit = "Hz"


@dataclass(frozen=True)
class SameState:
    """The largest difference, of all joints, of the rotation or the rest rotation from the one at `moment` [deg]."""

    since: Moment
    unit = "deg"


@dataclass(frozen=True)
class Yielded:
    """Whether a joint has flowed after `since`. Between two poses too: its rest rotation tells."""

    bone: str
    since: Moment = 0.0
    unit = ""


@dataclass(frozen=True)
class Contact:
    """Whether a pointer holds or touches the doll; with a bone: that bone."""

    pointer: int
    bone: str | None = None
    unit = ""


@dataclass(frozen=True)
class Answer:
    """The reply to a command: whether it is what was expected, or with `result` the first number of that result."""

    command: str
    refused: str | None = None  # what the reason holds; None: it is to be accepted
    result: str | None = None
    unit = ""


Quantity = (
    Position | Moved | Rotation | Strain | Flow | Torque | Speed | Force | Rate | SameState | Yielded | Contact | Answer
)


@dataclass(frozen=True)
class Window:
    """When an expectation is judged: at every pose from `first` to `last`, or at one of them at least."""

    first: Moment
    last: Moment
    every: bool = True


@dataclass(frozen=True)
class Expectation:
    quantity: Quantity
    bounds: Bounds
    place: str  # in the file: "expect 3", "hand 1, action 4"
    line: int | None = None  # in the file, if it is known
    name: str = ""
    window: Window | None = None  # None: the moment of its step


def describe(quantity: Quantity) -> str:
    """What is measured, in words."""
    match quantity:
        case Position(bone, target, _, since):
            return f"distance of '{bone}' from {_vector(target)}{_since(since)}"
        case Moved(bone, since, _):
            return f"distance of '{bone}' from where it was at {_moment(since)}"
        case Rotation(bone, about):
            return f"rotation of '{bone}'{_about(about)}"
        case Strain(bone):
            return f"strain of '{bone}'"
        case Flow(bone):
            return f"flow of '{bone}'"
        case Torque(bone, about):
            return f"torque of '{bone}'{_about(about)}"
        case Speed(None):
            return "speed of the fastest bone"
        case Speed(bone):
            return f"speed of '{bone}'"
        case Force(pointer, None):
            return f"force of pointer {pointer}"
        case Force(pointer, along):
            return f"force of pointer {pointer} along {_vector(along)}"
        case Rate(channel):
            return f"rate of {channel}"
        case SameState(since):
            return f"difference from the state at {_moment(since)}"
        case Yielded(bone, since):
            return f"'{bone}' yielded since {_moment(since)}"
        case Contact(pointer, None):
            return f"pointer {pointer} touches the doll"
        case Contact(pointer, bone):
            return f"pointer {pointer} touches '{bone}'"
        case Answer(command, _, None):
            return f"the reply to '{command}'"
        case Answer(command, _, result):
            return f"'{result}' of the reply to '{command}'"


def is_boolean(quantity: Quantity) -> bool:
    return isinstance(quantity, Yielded | Contact)


def describe_bounds(expectation: Expectation) -> str:
    """What the quantity is to be, in words."""
    quantity, bounds = expectation.quantity, expectation.bounds
    if is_boolean(quantity):
        return "to be true" if bounds.least > 0.0 else "to be false"
    if isinstance(quantity, Answer) and quantity.result is None:
        return "accepted" if quantity.refused is None else f"refused with '{quantity.refused}'"
    unit = f" {quantity.unit}" if quantity.unit else ""
    if bounds.least == -math.inf or (isinstance(quantity, Position) and bounds.least == 0.0):
        return f"at most {bounds.most:g}{unit}"
    if bounds.most == math.inf:
        return f"at least {bounds.least:g}{unit}"
    return f"{bounds.least:g} to {bounds.most:g}{unit}"


def _vector(vector: Vector | None) -> str:
    return "" if vector is None else f"[{', '.join(f'{component:g}' for component in vector)}]"


def _moment(moment: Moment) -> str:
    return f"'{moment}'" if isinstance(moment, str) else f"{moment:g} s"


def _since(since: Moment | None) -> str:
    return "" if since is None else f" beyond where it was at {_moment(since)}"


def _about(about: Vector | None) -> str:
    return "" if about is None else f" about {_vector(about)}"
