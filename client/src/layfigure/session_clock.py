"""How a session's ticks pass on a server: ordered step by step, or waited for."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from fractions import Fraction
from typing import Protocol

from layfigure.connection import REPLY_TIMEOUT_S, RESEND_AFTER_S, Connection
from layfigure.errors import LayfigureError, NoReplyError, RefusedError
from layfigure.protocol import Argument, Character, Pose

PointerMessages = list[tuple[int, int]]  # pointer, sequence number of the message sent
STEP_ATTEMPTS = 5
# How long the step waits for the pointer messages sent before it, attempt by attempt [s]: a lost one is sent again at
# once, one that the step overtook needs no more than a network's delay.
POINTER_PATIENCE_S = (0.0, *(0.001 * 2**k for k in range(9)))


def wait_for_step(connection: Connection, newest: Callable[[], Pose | None], step: int) -> None:
    """Until `newest()` is of that step or a later one.

    A pose may come behind the reply to the step that made it; one that was lost on the way is sent again.
    """
    bus = connection.bus
    for _ in range(STEP_ATTEMPTS):
        if bus.wait_until(lambda: (pose := newest()) is not None and pose.step >= step, RESEND_AFTER_S):
            return
        connection.command("get_character")
    raise NoReplyError(f"the pose of step {step} did not arrive from '{bus.url}'")


class SessionClock(Protocol):
    def end_of_tick(self) -> float:
        """When the coming tick ends, in pose periods since the session's start."""

    def tick(self, send_pointers: Callable[[], PointerMessages]) -> None:
        """Sends the pointers to where they are to be at the tick's end, and lets the tick pass."""

    def stepped(self, steps_done: int) -> None:
        """The session has ordered steps itself, up to that number."""


class LockstepClock:
    """A tick is the steps up to the server's next pose: pose k comes after step ceil(k physics_hz / pose_hz)."""

    def __init__(self, connection: Connection, character: Character, steps_done: int) -> None:
        self._connection = connection
        self._steps_per_pose = Fraction(character.physics_hz) / Fraction(character.pose_hz)
        self._first_step = self._steps_done = steps_done

    def end_of_tick(self) -> float:
        """Not a whole number where pose_hz does not divide physics_hz: a hand that ignored that would move in jerks."""
        return float((self._next_pose_step() - self._first_step) / self._steps_per_pose)

    def _next_pose_step(self) -> int:
        next_pose = math.floor(self._steps_done / self._steps_per_pose) + 1
        return math.ceil(next_pose * self._steps_per_pose)

    @property
    def steps_done(self) -> int:
        return self._steps_done

    @property
    def steps_to_next_pose(self) -> int:
        return self._next_pose_step() - self._steps_done

    @property
    def newest_pose_step(self) -> int:
        """The step after which the newest pose that there is was made."""
        return math.ceil(math.floor(self._steps_done / self._steps_per_pose) * self._steps_per_pose)

    def tick(self, send_pointers: Callable[[], PointerMessages]) -> None:
        self.advance(self.steps_to_next_pose, send_pointers)

    def advance(
        self, steps: int, send_pointers: Callable[[], PointerMessages], timeout_s: float = REPLY_TIMEOUT_S
    ) -> None:
        """Orders so many steps, the first of which has the pointers that are sent."""
        for patience_s in POINTER_PATIENCE_S:
            count = Argument("count", values=(float(steps),))
            sent = send_pointers()
            self._connection.bus.wait_until(lambda: False, patience_s)
            try:
                reply = self._connection.command("step", count, *_named(sent), timeout_s=timeout_s)
                break
            except RefusedError:  # a pointer message was lost on the way, or overtaken
                if not sent or patience_s == POINTER_PATIENCE_S[-1]:
                    raise
        self._steps_done = int(reply.values("steps")[0])

    def stepped(self, steps_done: int) -> None:
        self._steps_done = steps_done


def _named(sent: PointerMessages) -> list[Argument]:
    """The argument of `step` that names the messages it must not come before."""
    return [Argument("pointer_sequence", values=tuple(float(n) for pair in sent for n in pair))] if sent else []


class RealtimeClock:
    """A tick is a pose period of wall-clock time, counted from the start: lateness does not add up."""

    def __init__(self, connection: Connection, character: Character) -> None:
        self._connection = connection
        self._period_s = 1.0 / character.pose_hz
        self._start_s = time.monotonic()
        self._ticks = 0

    def end_of_tick(self) -> float:
        return self._ticks + 1.0

    def tick(self, send_pointers: Callable[[], PointerMessages]) -> None:
        send_pointers()
        self._ticks += 1
        remaining = self._start_s + self._ticks * self._period_s - time.monotonic()
        self._connection.bus.wait_until(lambda: False, remaining)
        if self._connection.watch.silent:
            raise LayfigureError(f"lost the server at '{self._connection.bus.url}'")

    def stepped(self, steps_done: int) -> None:
        """A server in realtime refuses steps."""
