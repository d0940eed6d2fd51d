"""A session: what scripted hands do. session_file.py reads it from TOML, player.py plays it."""

from __future__ import annotations

from dataclasses import dataclass

MAX_POINTERS = 16
MAX_DURATION_S = 3600.0
MODES = ("3dof", "6dof")
HOLDS = ("stiff", "rigid")
SCALES = (1e-3, 1e3)
MAX_SOFTNESS = 100.0
RADII_M = (1e-3, 0.1)
MAX_FRICTION = 10.0
SPACES = ("grabbed", "world")
INTERPOLATIONS = ("minimum-jerk", "linear")

Vector = tuple[float, float, float]


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


Action = Wait | Grab | Touch | Pinch | Move | Release | Pin | Unpin | Softness | Scale | Clutch | Magnet | Key
Tool = Grab | Touch | Pinch


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
class Session:
    title: str
    hands: tuple[Hand, ...]
