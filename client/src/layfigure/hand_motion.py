"""Where a scripted hand is to be at each tick. Pure: no bus, no clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from layfigure.protocol import Floats
from layfigure.session import Action, Hand, Move, Wait


@dataclass(frozen=True)
class Scheduled:
    """An action with its ticks; one that takes no time has start == end."""

    action: Action
    start: int
    end: int


def schedule(hand: Hand, rate_hz: float) -> tuple[Scheduled, ...]:
    """Times are summed before they are rounded to ticks, so that no rounding adds up. A move takes at least a tick."""
    scheduled = []
    time_s, tick = 0.0, 0
    for action in hand.actions:
        end = tick
        if isinstance(action, Wait | Move):
            time_s += action.duration_s
            end = max(round(time_s * rate_hz), tick + isinstance(action, Move))
        scheduled.append(Scheduled(action, tick, end))
        tick = end
    return tuple(scheduled)


def progress_of(interpolation: str, s: float) -> float:
    """How far a move has come, 0 to 1, at the part s of its time. Minimum jerk: 10 s^3 - 15 s^4 + 6 s^5."""
    return s if interpolation == "linear" else s * s * s * (10.0 + s * (6.0 * s - 15.0))


class HandMotion:
    """The pointer of one hand, world [m], from grab to release."""

    def __init__(self, hand: Hand, rate_hz: float) -> None:
        self.pointer = hand.pointer
        self.position: Floats | None = None  # None: it holds nothing
        self._schedule = schedule(hand, rate_hz)
        self._grabbed_at = np.zeros(3)
        self._held_at = np.zeros(3)
        self._moving: Scheduled | None = None
        self._from = np.zeros(3)
        self._to = np.zeros(3)

    @property
    def ticks(self) -> int:
        return self._schedule[-1].end

    def due(self, tick: int) -> list[Scheduled]:
        """The actions that begin at `tick`."""
        return [scheduled for scheduled in self._schedule if scheduled.start == tick]

    def grabbed(self, pointer: Floats, held: Floats) -> None:
        """The pointer was at `pointer` when the held point was at `held`: from now on they move alike."""
        self.position = self._grabbed_at = pointer
        self._held_at = held

    def released(self) -> None:
        self.position = None

    def begin_move(self, scheduled: Scheduled, move: Move) -> None:
        assert self.position is not None, "the session's reader lets only a holding hand move"
        to = np.array(move.to)
        self._moving = scheduled
        self._from = self.position
        self._to = self._grabbed_at + (to if move.space == "grabbed" else to - self._held_at)

    def advance(self, tick: int, moment: float) -> None:
        """Brings `position` to where it is to be at the end of the tick, which is at `moment`, in ticks."""
        if self._moving is None or not isinstance(self._moving.action, Move):
            return
        s = min((moment - self._moving.start) / (self._moving.end - self._moving.start), 1.0)
        self.position = self._from + progress_of(self._moving.action.interpolation, s) * (self._to - self._from)
        if tick == self._moving.end:
            self.position = self._to
            self._moving = None
