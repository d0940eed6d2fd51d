"""A session: what scripted hands do. session_file.py reads it from TOML, player.py plays it."""

from __future__ import annotations

from dataclasses import dataclass

MAX_POINTERS = 16
MAX_DURATION_S = 3600.0
MODES = ("3dof", "6dof")
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


Action = Wait | Grab | Move | Release | Key


@dataclass(frozen=True)
class Hand:
    pointer: int
    actions: tuple[Action, ...]


@dataclass(frozen=True)
class Session:
    title: str
    hands: tuple[Hand, ...]
