"""A session: what scripted hands do. session_file.py reads it from TOML, player.py plays it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from layfigure.expectation import Expectation, Vector
from layfigure.protocol import Argument

MAX_POINTERS = 16
MAX_DURATION_S = 3600.0
MODES = ("3dof", "6dof")
HOLDS = ("stiff", "rigid")
SCALES = (1e-3, 1e3)
MAX_SOFTNESS = 100.0
RADII_M = (1e-3, 0.1)
MAX_FRICTION = 10.0
CLOCKS = ("realtime", "lockstep")
SPACES = ("grabbed", "world")
INTERPOLATIONS = ("minimum-jerk", "linear")


@dataclass(frozen=True)
class Wait:
    duration_s: float


@dataclass(frozen=True)
class Grab:
    bone: str
    point: Vector | None = None  # in the bone's frame [m]
    mode: str = "3dof"
    stiffness: float | None = None  # [N/m]
    damping: float | None = None  # [N s/m]


@dataclass(frozen=True)
class Fingertip:
    """What is left out has the server's default."""

    radius: float | None = None  # [m]
    friction: float | None = None
    stiffness: float | None = None  # [N/m]
    damping: float | None = None  # [N s/m]
    magnet: bool = False


@dataclass(frozen=True)
class Touch:
    bone: str
    offset: Vector  # world, from the bone's point to where the fingertip comes out [m]
    point: Vector = (0.0, 0.0, 0.0)  # in the bone's frame [m]
    fingertip: Fingertip = Fingertip()


@dataclass(frozen=True)
class Pinch:
    bone: str
    second: int  # the pointer of the hand's second fingertip
    along: Vector  # world, the line through both
    width: float  # between the fingertips' centres when they come out [m]
    close: float  # between their pointers at the end: less than the limb is thick, by what presses [m]
    duration_s: float
    point: Vector = (0.0, 0.0, 0.0)  # in the bone's frame, between them [m]
    fingertip: Fingertip = Fingertip()


@dataclass(frozen=True)
class Pin:
    bone: str
    point: Vector | None = None  # in the bone's frame [m]
    mode: str = "3dof"
    hold: str = "stiff"


@dataclass(frozen=True)
class Unpin:
    bone: str | None  # None: all


@dataclass(frozen=True)
class Softness:
    factor: float
    bone: str | None = None  # None: all joints


@dataclass(frozen=True)
class Scale:
    scale: float


@dataclass(frozen=True)
class Clutch:
    held: bool


@dataclass(frozen=True)
class Magnet:
    on: bool


@dataclass(frozen=True)
class Move:
    to: Vector  # [m]
    duration_s: float
    space: str = "grabbed"  # "grabbed": from where the held point was when it was grabbed; "world": where it goes
    interpolation: str = "minimum-jerk"


@dataclass(frozen=True)
class Release:
    pass


@dataclass(frozen=True)
class Key:
    pass


@dataclass(frozen=True)
class Mark:
    """Names this moment for the expectations."""

    name: str


@dataclass(frozen=True)
class Command:
    """A message command_t, as it is."""

    name: str
    arguments: tuple[Argument, ...] = ()
    answer: Expectation | None = None  # of an Answer; None: the session ends if the command is refused


@dataclass(frozen=True)
class Expect:
    expectation: Expectation


Action = (
    Wait
    | Grab
    | Touch
    | Pinch
    | Move
    | Release
    | Pin
    | Unpin
    | Softness
    | Scale
    | Clutch
    | Magnet
    | Key
    | Mark
    | Command
    | Expect
)
Tool = Grab | Touch | Pinch


def duration_of(action: Action) -> float:
    """[s]"""
    return action.duration_s if isinstance(action, Wait | Move | Pinch) else 0.0


def timed(actions: Sequence[Action]) -> Iterator[tuple[Action, float]]:
    """Each action with its time from the hand's start [s]."""
    time_s = 0.0
    for action in actions:
        yield action, time_s
        time_s += duration_of(action)


@dataclass(frozen=True)
class Hand:
    pointer: int
    actions: tuple[Action, ...]

    @property
    def pointers(self) -> tuple[int, ...]:
        """Its own, and those of its second fingertips."""
        seconds = {action.second for action in self.actions if isinstance(action, Pinch)}
        return (self.pointer, *sorted(seconds))

    @property
    def uses_map(self) -> bool:
        """It depends on how the server maps its pointers to the world."""
        return any(isinstance(action, Touch | Pinch | Scale | Clutch) for action in self.actions)


@dataclass(frozen=True)
class Server:
    """What a session needs of its server. None: whatever there is."""

    character: str | None = None  # its name; may hold * and ?
    clock: str | None = None
    physics_hz: float | None = None
    pose_hz: float | None = None


@dataclass(frozen=True)
class Session:
    title: str
    hands: tuple[Hand, ...]
    server: Server = Server()
    expectations: tuple[Expectation, ...] = ()  # those with a window

    @property
    def duration_s(self) -> float:
        return max(sum(map(duration_of, hand.actions)) for hand in self.hands)

    @property
    def all_expectations(self) -> tuple[Expectation, ...]:
        """The hands' own first."""
        own: list[Expectation] = []
        for hand in self.hands:
            for action in hand.actions:
                if isinstance(action, Expect):
                    own.append(action.expectation)
                elif isinstance(action, Command) and action.answer is not None:
                    own.append(action.answer)
        return (*own, *self.expectations)
