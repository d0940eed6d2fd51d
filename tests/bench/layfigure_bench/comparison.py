"""Errors of runs, the least CPU time for an error, and how much more the best peer needs for it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from layfigure_bench.engine import Run
from layfigure_bench.ladder import Reference, rms, rms_angle
from layfigure_bench.programs import OWN

DECADES = tuple(10.0**-k for k in range(1, 11))
# An error is judged only where the reference is known this many times better.
JUDGED = 3.0


@dataclass(frozen=True)
class Point:
    """A run as a point of the work-precision diagram."""

    engine: str
    family: str
    h: float
    steps: int
    cpu_s: float
    error: float  # rms com position at the end [m]; infinite if the run blew up
    rest_error: float | None  # rms angle of the rest rotations at the end [rad]: the residual pose
    energy: float

    @property
    def own(self) -> bool:
        return self.family == OWN


@dataclass(frozen=True)
class Comparison:
    """What an error costs at least."""

    error: float
    own: Point | None
    peer: Point | None

    @property
    def ratio(self) -> float | None:
        """Times more CPU that the best peer takes. None where one of the two does not get there."""
        if self.own is None or self.peer is None:
            return None
        return self.peer.cpu_s / self.own.cpu_s


@dataclass(frozen=True)
class Agreement:
    """How near an engine came to the reference, and how fast."""

    engine: str
    least_error: float
    h: float
    order: float | None  # observed, between the shortest step and the one before it


def point_of(engine: str, family: str, run: Run, reference: Reference) -> Point:
    error = rms(run.com - reference.run.com) if run.finite else math.inf
    rest_error = None
    if run.rest is not None and reference.run.rest is not None:
        rest_error = rms_angle(run.rest, reference.run.rest)
    return Point(engine, family, run.h, run.steps, run.cpu_s, error, rest_error, run.energy)


def least_work(points: Iterable[Point], error: float) -> Point | None:
    """The cheapest run that is at least this accurate: runs that were made, nothing in between."""
    return min((p for p in points if p.error <= error), key=lambda p: p.cpu_s, default=None)


def compare(points: Sequence[Point], change: float) -> list[Comparison]:
    """For every decade of error that the reference, known to `change`, can judge."""
    return [
        Comparison(
            error,
            least_work((p for p in points if p.own), error),
            least_work((p for p in points if not p.own), error),
        )
        for error in DECADES
        if error >= JUDGED * change
    ]


def front(points: Iterable[Point]) -> list[Point]:
    """The runs that no other run beats in both time and error, from the cheapest on."""
    kept: list[Point] = []
    for point in sorted((p for p in points if math.isfinite(p.error)), key=lambda p: (p.cpu_s, p.error)):
        if not kept or point.error < kept[-1].error:
            kept.append(point)
    return kept


def agreement(points: Sequence[Point]) -> list[Agreement]:
    """For each engine that had a finite run; its points come in the order of their step lengths, longest first."""
    found = []
    for engine in dict.fromkeys(p.engine for p in points):
        finite = [p for p in points if p.engine == engine and math.isfinite(p.error)]
        if finite:
            best = min(finite, key=lambda p: p.error)
            found.append(Agreement(engine, best.error, best.h, _observed_order(finite[-2:])))
    return found


def _observed_order(pair: Sequence[Point]) -> float | None:
    if len(pair) < 2 or min(p.error for p in pair) <= 0.0:
        return None
    return math.log(pair[0].error / pair[1].error) / math.log(pair[0].h / pair[1].h)
