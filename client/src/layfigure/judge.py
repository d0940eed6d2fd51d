"""Judges what a session expects while it is played.

Once in each tick the newest pose becomes a sample, which every expectation looks at: no history is kept, so that a
session may last for hours.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from layfigure import codec, hand_motion
from layfigure.bus import Bus
from layfigure.bus.bus import Handler
from layfigure.errors import LayfigureError
from layfigure.expectation import (
    RATED_CHANNELS,
    WALL_CLOCK_CHANNELS,
    Answer,
    Contact,
    Expectation,
    Force,
    Moment,
    Rate,
    Yielded,
)
from layfigure.expectation_file import references
from layfigure.measures import Reference, Sample, Seen, measure
from layfigure.protocol import FORCE_CHANNEL, Character, Pose, Reply
from layfigure.protocol import Force as ForceMessage
from layfigure.session import Expect, Mark, Session

NOT_REACHED = Seen(math.nan, "the session did not get there")
FORCE_TIMEOUT_S = 1.0  # a force message comes behind its pose; one that is lost is told as missing


@dataclass(frozen=True)
class Verdict:
    expectation: Expectation
    fulfilled: bool
    seen: Seen
    excess: float = math.nan  # how far outside the bounds; NaN: there is no such number
    time_s: float | None = None  # of what was seen; None: it was not judged


class Judge:
    """Of one session on the server of `bus`."""

    def __init__(self, bus: Bus, session: Session) -> None:
        self._bus = bus
        self._session = session
        self._character: Character | None = None
        self._pose: Pose | None = None
        self._before: Pose | None = None
        self._forces: dict[int, ForceMessage] = {}
        self._messages = dict.fromkeys(RATED_CHANNELS, 0)
        self._monitors: list[_Monitor] = []
        self._answers: dict[Expectation, Verdict] = {}
        quantities = [expectation.quantity for expectation in session.all_expectations]
        self._uses_forces = any(
            isinstance(quantity, Force | Contact) or quantity == Rate(FORCE_CHANNEL) for quantity in quantities
        )
        bus.subscribe(FORCE_CHANNEL, self._on_force)
        for channel in {quantity.channel for quantity in quantities if isinstance(quantity, Rate)}:
            bus.subscribe(channel, self._counter(channel))

    def begin(self, character: Character, joints: Mapping[str, int]) -> None:
        """Raises LayfigureError for what the server cannot tell."""
        self._character = character
        rate = character.pose_hz
        marks, steps = _ticks(self._session, rate)

        def tick(moment: Moment) -> int:
            return marks[moment] if isinstance(moment, str) else round(moment * rate)

        for expectation in self._session.all_expectations:
            quantity, window = expectation.quantity, expectation.window
            if isinstance(quantity, Answer):
                continue
            if isinstance(quantity, Rate):
                _check_rate(expectation.place, quantity, character)
            first, last = (tick(window.first), tick(window.last)) if window else (steps[expectation],) * 2
            since = [tick(moment) for moment in references(quantity)]
            if isinstance(quantity, Rate):  # counts from the window's beginning, and is judged at its end
                since, first = [first], max(last, first + 1)
                last = first
            every = window is None or window.every
            self._monitors.append(_Monitor(expectation, joints, first, last, every, since[0] if since else None))

    def observe(self, tick: int, pose: Pose, pointers: set[int]) -> None:
        """`pointers`: those that the server has heard of, each of which has a force message behind the pose."""
        assert self._character is not None
        if self._pose is not None and pose.time_us != self._pose.time_us:
            self._before = self._pose
        self._pose = pose
        lockstep = self._character.clock == "lockstep"
        if lockstep and self._uses_forces:
            self._bus.wait_until(
                lambda: all(self._forces_of(pose, known) for known in pointers | set(self._forces)), FORCE_TIMEOUT_S
            )
        forces = {p: force for p, force in self._forces.items() if not lockstep or force.sequence == pose.sequence}
        sample = Sample(tick, self._character, pose, self._before, forces, dict(self._messages))
        for monitor in self._monitors:
            monitor.observe(sample)

    def answered(self, expectation: Expectation, reply: Reply, time_s: float) -> None:
        """The reply to a command, refused or not."""
        answer = expectation.quantity
        assert isinstance(answer, Answer)
        said = Seen(float(reply.accepted), "it was accepted" if reply.accepted else f"it was refused: {reply.reason}")
        if answer.refused is not None:
            fulfilled = not reply.accepted and answer.refused in reply.reason
            verdict = Verdict(expectation, fulfilled, said, time_s=time_s)
        elif answer.result is None or not reply.accepted:
            verdict = Verdict(expectation, reply.accepted, said, time_s=time_s)
        else:
            values = [result.values[0] for result in reply.results if result.name == answer.result and result.values]
            seen = Seen(values[0]) if values else Seen(math.nan, f"the reply holds no '{answer.result}'")
            excess = expectation.bounds.excess(seen.value)
            verdict = Verdict(expectation, excess == 0.0, seen, excess, time_s)
        self._answers[expectation] = verdict

    def verdicts(self) -> list[Verdict]:
        """Of all expectations, in the file's order; what was not reached is not fulfilled."""
        judged = self._answers | {monitor.expectation: monitor.verdict() for monitor in self._monitors}
        return [
            judged.get(expectation, Verdict(expectation, False, NOT_REACHED))
            for expectation in self._session.all_expectations
        ]

    def _forces_of(self, pose: Pose, pointer: int) -> bool:
        return pointer in self._forces and self._forces[pointer].sequence >= pose.sequence

    def _on_force(self, data: bytes) -> None:
        force = codec.decode_force(data)
        self._forces[force.pointer] = force

    def _counter(self, channel: str) -> Handler:
        def count(_: bytes) -> None:
            self._messages[channel] += 1

        return count


def unjudged(session: Session) -> list[Verdict]:
    """Of a session that was not played."""
    return [Verdict(expectation, False, NOT_REACHED) for expectation in session.all_expectations]


def _check_rate(place: str, rate: Rate, character: Character) -> None:
    if rate.channel in WALL_CLOCK_CHANNELS and character.clock == "lockstep":
        raise LayfigureError(
            f"{place}: {rate.channel} comes by wall-clock time, which a server in lockstep does not keep: start "
            "the server with --clock realtime, or rate another channel"
        )


def _ticks(session: Session, rate_hz: float) -> tuple[dict[str, int], dict[Expectation, int]]:
    """At which tick each mark is made, and each expectation of a hand's list judged."""
    marks: dict[str, int] = {}
    steps: dict[Expectation, int] = {}
    for hand in session.hands:
        for scheduled in hand_motion.schedule(hand, rate_hz):
            match scheduled.action:
                case Mark(name):
                    marks[name] = scheduled.start
                case Expect(expectation):
                    steps[expectation] = scheduled.start
    return marks, steps


class _Monitor:
    """Looks at every sample for one expectation, from tick `first` to `last`; `since`: the tick it compares with."""

    def __init__(
        self,
        expectation: Expectation,
        joints: Mapping[str, int],
        first: int,
        last: int,
        every: bool,
        since: int | None,
    ) -> None:
        self.expectation = expectation
        self._joints = joints
        self._first = first
        self._last = last
        self._every = every
        self._since = since
        self._reference: Reference | None = None
        self._complete = False
        self._telling: Verdict | None = None  # the worst of every sample, or the best if one is enough

    def observe(self, sample: Sample) -> None:
        if sample.tick > self._last:
            return
        if self._reference is not None:
            if isinstance(self.expectation.quantity, Yielded):
                self._reference.yielded |= sample.pose.yielded
        elif sample.tick == self._since:
            self._reference = Reference(sample, sample.pose.yielded & False)
        if sample.tick >= self._first:
            self._judge(sample)
        self._complete = sample.tick == self._last

    def verdict(self) -> Verdict:
        told = self._telling
        if told is None:
            return Verdict(self.expectation, False, NOT_REACHED)
        decided = told.fulfilled != self._every  # once is enough to fail where all must hold, and the other way round
        return told if self._complete or decided else Verdict(self.expectation, False, NOT_REACHED)

    def _judge(self, sample: Sample) -> None:
        seen = measure(self.expectation.quantity, sample, self._joints, self._reference)
        excess = self.expectation.bounds.excess(seen.value)
        verdict = Verdict(self.expectation, excess == 0.0, seen, excess, sample.tick / sample.character.pose_hz)
        if self._telling is None or self._tells_more(verdict, self._telling):
            self._telling = verdict

    def _tells_more(self, new: Verdict, old: Verdict) -> bool:
        return _size(new) > _size(old) if self._every else _size(new) < _size(old)


def _size(verdict: Verdict) -> float:
    return math.inf if math.isnan(verdict.excess) else abs(verdict.excess)
