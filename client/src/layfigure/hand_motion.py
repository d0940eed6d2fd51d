"""Where a scripted hand is to be at each tick. Pure: no bus, no clock."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from layfigure.hand_map import HandMap
from layfigure.protocol import Floats
from layfigure.session import Action, Hand, Move, Pinch, Wait


@dataclass(frozen=True)
class Scheduled:
    """An action with its ticks; one that takes no time has start == end."""

    action: Action
    start: int
    end: int


def schedule(hand: Hand, rate_hz: float) -> tuple[Scheduled, ...]:
    """Times are summed before they are rounded to ticks: no rounding adds up. A motion takes at least a tick."""
    scheduled = []
    time_s, tick = 0.0, 0
    for action in hand.actions:
        end = tick
        if isinstance(action, Wait | Move | Pinch):
            time_s += action.duration_s
            end = max(round(time_s * rate_hz), tick + (not isinstance(action, Wait)))
        scheduled.append(Scheduled(action, tick, end))
        tick = end
    return tuple(scheduled)


def progress_of(interpolation: str, s: float) -> float:
    """How far a move has come, 0 to 1, at the part s of its time. Minimum jerk: 10 s^3 - 15 s^4 + 6 s^5."""
    return s if interpolation == "linear" else s * s * s * (10.0 + s * (6.0 * s - 15.0))


class HandMotion:
    """The pointers of one hand from grab to release, in the hand's own space: the world's, until scale or clutch say
    otherwise [m]."""

    def __init__(self, hand: Hand, rate_hz: float) -> None:
        self.pointer = hand.pointer
        self.pointers = hand.pointers
        self.maps = {pointer: HandMap() for pointer in hand.pointers}
        self.position: Floats | None = None  # None: it holds nothing
        self._fingers: dict[int, Floats] = {}  # of each pointer that has the tool, from `position`
        self._schedule = schedule(hand, rate_hz)
        self._grabbed_at = np.zeros(3)
        self._grabbed_world = np.zeros(3)
        self._held_at = np.zeros(3)  # in the world
        self._moving: Scheduled | None = None
        self._from = np.zeros(3)
        self._to = np.zeros(3)
        self._opened: dict[int, Floats] = {}  # the fingers when a pinch began

    @property
    def ticks(self) -> int:
        return self._schedule[-1].end

    @property
    def holding(self) -> tuple[int, ...]:
        """The pointers that have a tool."""
        return tuple(self._fingers)

    def due(self, tick: int) -> list[Scheduled]:
        """The actions that begin at `tick`."""
        return [scheduled for scheduled in self._schedule if scheduled.start == tick]

    def grabbed(self, pointer: Floats, held: Floats) -> None:
        """The pointer was at `pointer` when the held point was at `held`: from now on they move alike."""
        self._take({self.pointer: pointer}, held)

    def touched(self, world: Floats) -> None:
        """The fingertip has come out there."""
        self._take({self.pointer: self.maps[self.pointer].to_hand(world)}, world)

    def begin_pinch(self, scheduled: Scheduled, fingers: dict[int, Floats]) -> None:
        """The fingertips have come out there, in the world; they close over the action's time."""
        middle = sum(fingers.values(), np.zeros(3)) / len(fingers)
        self._take({pointer: self.maps[pointer].to_hand(world) for pointer, world in fingers.items()}, middle)
        self._opened = dict(self._fingers)
        self._moving = scheduled

    def _take(self, hands: dict[int, Floats], held: Floats) -> None:
        middle = next(iter(hands.values())) if len(hands) == 1 else sum(hands.values(), np.zeros(3)) / len(hands)
        self.position = self._grabbed_at = middle
        self._fingers = {pointer: hand - middle for pointer, hand in hands.items()}
        self._grabbed_world = self._world()
        self._held_at = held

    def _world(self) -> Floats:
        """The middle of its pointers in the world."""
        places = [self.maps[pointer].to_world(hand) for pointer, hand in self.targets()]
        return np.asarray(sum(places, np.zeros(3)) / len(places))

    def released(self) -> None:
        self.position = None
        self._fingers = {}
        self._moving = None

    def targets(self) -> list[tuple[int, Floats]]:
        """Where each pointer that has a tool is to be."""
        if self.position is None:
            return []
        return [(pointer, self.position + offset) for pointer, offset in self._fingers.items()]

    def begin_move(self, scheduled: Scheduled, move: Move) -> None:
        assert self.position is not None, "the session's reader lets only a holding hand move"
        to = np.array(move.to)
        self._moving = scheduled
        self._from = self.position
        if move.space == "grabbed":
            self._to = self._grabbed_at + to
        elif self.maps[self.pointer].unchanged:
            self._to = self._grabbed_at + (to - self._held_at)
        else:
            held_now = self._held_at + (self._world() - self._grabbed_world)
            self._to = self.position + (to - held_now) / self.maps[self.pointer].scale

    def advance(self, tick: int, moment: float) -> None:
        """Brings the pointers to where they are to be at the end of the tick, which is at `moment`, in ticks."""
        if self._moving is None:
            return
        s = min((moment - self._moving.start) / (self._moving.end - self._moving.start), 1.0)
        done = tick == self._moving.end
        match self._moving.action:
            case Move() as move:
                self.position = self._from + progress_of(move.interpolation, s) * (self._to - self._from)
                if done:
                    self.position = self._to
            case Pinch() as pinch:
                part = 1.0 if done else progress_of("minimum-jerk", s)
                width = pinch.width + part * (pinch.close - pinch.width)
                self._fingers = {pointer: offset * (width / pinch.width) for pointer, offset in self._opened.items()}
        if done:
            self._moving = None
