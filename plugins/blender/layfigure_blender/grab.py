# SPDX-License-Identifier: GPL-3.0-or-later
"""One hold of the mouse on the doll, from pressing the button to letting go.

Ring 1: no bpy, no window. What the operator hears becomes calls of a Grab, which sends commands and pointers and never
waits: poll() takes what has come back. Times are monotonic seconds that the caller gives.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

import layfigure
from layfigure import rotation
from layfigure.protocol import Floats

from .drag import Drag
from .link import Link
from .pins import PinList
from .replies import exactly, numbers
from .view import View

MOST_POINTERS = 16  # of a server
HOLD_AFTER_S = 0.25  # a button that is down for so long takes hold, though the mouse has not moved
SOFT = 0.2  # of the yield torques, while what is held is softened
FIRM = 1.0
# Of the joint's own stiffness: it turns by four fifths of what the mouse says, until it yields. By default a grip turns
# as hard as it pulls, on a lever of the body's size, which bends no joint of a small one.
TURNING = 4.0

Way = Mapping[str, Any]
"""The arguments of a grab: a bone and a point of it, or the ray of a pixel."""


class Phase(enum.Enum):
    PRESSED = enum.auto()  # and nothing else yet: it may become a click
    ASKED = enum.auto()  # for the grab
    HOLDING = enum.auto()
    LETTING_GO = enum.auto()
    ENDED = enum.auto()


class Outcome(enum.Enum):
    CLICKED = enum.auto()  # nothing was held
    MISSED = enum.auto()  # there was nothing to hold
    RELEASED = enum.auto()  # the doll may be another one
    CANCELLED = enum.auto()  # the doll is as it was before
    LOST = enum.auto()  # the server, or the sense of what it answers


def free_pointer(status: layfigure.Status | None, forces: Mapping[int, layfigure.Force]) -> int | None:
    """The number of a pointer that no device moves and that holds nothing; None if there is none.

    From the highest down: programs that script hands begin with the lowest.
    """
    taken = {device.pointer for device in status.devices} if status is not None else set()
    taken |= {number for number, force in forces.items() if force.attached}
    return next((number for number in reversed(range(MOST_POINTERS)) if number not in taken), None)


class Grab:
    """Takes hold when the mouse has moved, or the button was down for a while: a mere click holds nothing.

    Whatever comes while the server has not answered is done when it has. Once `phase` is ENDED, `outcome` tells how it
    ended, and `note` why.
    """

    def __init__(
        self,
        link: Link,
        pins: PinList,
        pointer: int,
        ways: Sequence[Way],
        mouse: ArrayLike,
        now: float,
        *,
        click_radius: float,
        why_no_way: str = "",
    ) -> None:
        """The button goes down at the pixel `mouse`; the `ways` to take hold there are tried one after the other. The
        mouse moves within `click_radius` [pixels] in a click. Without ways it may be a click as well, and holds nothing
        else, which `why_no_way` tells."""
        self.phase = Phase.PRESSED
        self.outcome: Outcome | None = None
        self.note = ""  # one line, "" if there is nothing to say
        self.pointer = pointer
        self.joint: int | None = None  # that is held
        self.softened = False
        self.holds_rotation = False
        self._link = link
        self._pins = pins
        self._ways = list(ways)
        self._why_no_way = why_no_way
        self._pressed_at, self._pressed_mouse = now, np.array(mouse, np.float64)
        self._click_radius = click_radius
        self._later: list[Callable[[], None]] = []  # to be done when it is held
        self._place_before: Future[layfigure.Reply] | None = None
        self._asked: Future[layfigure.Reply] | None = None
        self._unanswered: list[Future[layfigure.Reply]] = []  # of commands whose refusal is to be told
        self._is_felt = False  # the server has told of a force
        self._drag: Drag | None = None
        self._held = self._pointer_then = np.zeros(3)
        self._pointer_rotation_then = np.array([1.0, 0.0, 0.0, 0.0])
        self._point: Floats = np.zeros(3)  # in the held joint's frame

    @property
    def target(self) -> Floats | None:
        """Where the held point is to be, in the world; None while nothing is held."""
        return self._drag.position if self._drag is not None else None

    @property
    def pinned(self) -> bool:
        return self.joint is not None and bool(self._pins.of_joint(self.joint))

    # ------------------------------------------------------------------ what the hand does

    def mouse(self, view: View, at: ArrayLike, *, slow: bool = False, turn: bool = False) -> None:
        pixel = np.array(at, np.float64)
        if self.phase is Phase.PRESSED and np.linalg.norm(pixel - self._pressed_mouse) >= self._click_radius:
            self._take_hold()
        self._when_held(lambda: self._move(lambda drag: drag.move(view, pixel, slow=slow, turn=turn), turn))

    def wheel(self, view: View, notches: float, *, slow: bool = False, turn: bool = False) -> None:
        self._take_hold()
        self._when_held(lambda: self._move(lambda drag: drag.wheel(view, notches, slow=slow, turn=turn), turn))

    def pin(self) -> None:
        """Pins what is held where it is now, and with it its rotation if that is held."""
        self._take_hold()
        self._when_held(self._pin)

    def unpin(self) -> None:
        """Takes the pins off the bone that is held."""
        self._take_hold()
        self._when_held(self._unpin)

    def unpin_all(self) -> None:
        self._take_hold()
        self._when_held(self._unpin_all)

    def soften(self) -> None:
        """Softens the doll while it is held, or makes it firm again."""
        self._take_hold()
        self._when_held(self._soften)

    def release(self) -> None:
        if self.phase is Phase.PRESSED:
            self._end(Outcome.CLICKED)
        else:
            self._when_held(self._let_go)

    def cancel(self) -> None:
        if self.phase is Phase.PRESSED:
            self._end(Outcome.CANCELLED)
        else:
            self._when_held(self._go_back)

    def poll(self, now: float) -> None:
        """To be called often: takes the server's answers."""
        if self.phase is Phase.ENDED:
            return
        if self._link.state != "live":
            self._end(Outcome.LOST, self._link.message)
        elif self.phase is Phase.PRESSED:
            if now - self._pressed_at >= HOLD_AFTER_S:
                self._take_hold()
        elif self.phase is Phase.ASKED:
            self._take_answer()
        elif self.phase is Phase.HOLDING:
            self._watch_hold()
        elif self.phase is Phase.LETTING_GO:
            self._take_last_answer()
        self._note_refusals()

    # ------------------------------------------------------------------ taking hold

    def _take_hold(self) -> None:
        if self.phase is not Phase.PRESSED:
            return
        if not self._ways:
            self._end(Outcome.MISSED, self._why_no_way)
            return
        self.phase = Phase.ASKED
        self._place_before = self._link.send("history")
        self._pins.ask()
        self._try_next_way()

    def _try_next_way(self) -> None:
        self._asked = self._link.send("grab", pointer=self.pointer, **self._ways.pop(0))

    def _take_answer(self) -> None:
        assert self._asked is not None
        if not self._asked.done():
            return
        try:
            self._begin_to_hold(self._asked.result())
        except layfigure.RefusedError as refusal:
            if self._ways:
                self._try_next_way()
            else:
                self._end(Outcome.MISSED, str(refusal))
        except layfigure.LayfigureError as error:
            self._link.send("release", pointer=self.pointer)  # it may have taken hold all the same
            self._end(Outcome.LOST, str(error))

    def _begin_to_hold(self, reply: layfigure.Reply) -> None:
        """Raises ProtocolError."""
        joint = self._checked_joint(int(exactly(reply, "joint", 1)[0]))
        self._held = np.array(exactly(reply, "position", 3))
        self._point = np.array(exactly(reply, "point", 3))
        pointer = np.array(exactly(reply, "pointer", 7))
        self._pointer_then, self._pointer_rotation_then = pointer[:3], pointer[3:]
        self.joint = joint
        self.phase = Phase.HOLDING
        self._drag = Drag(self._held, self._pressed_mouse)
        later, self._later = self._later, []
        for action in later:
            self._when_held(action)

    def _checked_joint(self, joint: int) -> int:
        assert self._link.character is not None
        count = len(self._link.character.joints)
        if not 0 <= joint < count:
            raise layfigure.ProtocolError(f"the server says that joint {joint} is held, expected 0 to {count - 1}")
        return joint

    def _when_held(self, action: Callable[[], None]) -> None:
        if self.phase is Phase.ASKED:
            self._later.append(action)
        elif self.phase is Phase.HOLDING:
            action()

    # ------------------------------------------------------------------ while it is held

    def _move(self, motion: Callable[[Drag], None], turn: bool) -> None:
        assert self._drag is not None
        if turn and not self.holds_rotation:
            self.holds_rotation = True
            self._send("set", pointer=self.pointer, mode="6dof", angular_stiffness=self._turning_stiffness())
        motion(self._drag)
        # What is held follows the pointer from where both were when it was taken.
        self._link.move_pointer(
            self.pointer,
            self._pointer_then + self._drag.position - self._held,
            rotation.multiply(self._drag.turned, self._pointer_rotation_then),
        )

    def _turning_stiffness(self) -> float | None:
        """[N m/rad]; the server's own for what has no joint to turn against: a root, or what rides on its parent."""
        stiffness = self._held_joint().stiffness
        return TURNING * stiffness if stiffness > 0.0 else None

    def _pin(self) -> None:
        self._remove_pins()
        mode = "6dof" if self.holds_rotation else "3dof"
        self._send("pin", bone=self._held_joint().name, point=self._point, mode=mode)
        self._pins.ask()

    def _unpin(self) -> None:
        self._remove_pins()
        self._pins.ask()

    def _remove_pins(self) -> None:
        assert self.joint is not None
        for pin in self._pins.of_joint(self.joint):
            self._send("unpin", pin=pin.number)

    def _unpin_all(self) -> None:
        self._send("unpin")
        self._pins.ask()

    def _soften(self) -> None:
        self.softened = not self.softened
        self._send("set", softness=SOFT if self.softened else FIRM)

    def _held_joint(self) -> layfigure.Joint:
        assert self._link.character is not None
        assert self.joint is not None
        return self._link.character.joints[self.joint]

    def _send(self, name: str, **arguments: Any) -> None:
        self._unanswered.append(self._link.send(name, **arguments))

    def _note_refusals(self) -> None:
        waiting = []
        for future in self._unanswered:
            if not future.done():
                waiting.append(future)
            elif not future.cancelled() and (error := future.exception()) is not None:
                self.note = str(error)
        self._unanswered = waiting

    def _watch_hold(self) -> None:
        """An undo, or another program, may have taken it out of the hand."""
        force = self._link.forces.get(self.pointer)
        if force is None:
            return
        if force.attached:
            self._is_felt = True
        elif self._is_felt:
            self._end(Outcome.RELEASED, "the doll was let go by an undo, a reset or another program")

    # ------------------------------------------------------------------ letting go

    def _let_go(self) -> None:
        self.phase = Phase.LETTING_GO
        self.outcome = Outcome.RELEASED
        self._asked = self._link.send("release", pointer=self.pointer)
        if self.softened:
            self._asked = self._link.send("set", softness=FIRM)

    def _go_back(self) -> None:
        assert self._place_before is not None
        if (error := self._place_before.exception()) is not None:  # was answered before the grab was
            self._let_go()
            self.note = str(error)
            return
        self.phase = Phase.LETTING_GO
        self.outcome = Outcome.CANCELLED
        place = numbers(self._place_before.result(), "place")
        self._asked = self._link.send("history", action="go", place=place)
        self._pins.ask()

    def _take_last_answer(self) -> None:
        assert self._asked is not None
        assert self.outcome is not None
        if not self._asked.done():
            return
        try:
            reply = self._asked.result()
        except layfigure.LayfigureError as error:
            self._link.send("release", pointer=self.pointer)  # whatever happened: nothing stays in a hand that is gone
            self._end(Outcome.RELEASED, str(error))
            return
        if self.outcome is Outcome.CANCELLED and self.pointer not in numbers(reply, "released"):
            # The grab was no step of its own, as another hand took hold right before: the way back is that hand's.
            self._link.send("release", pointer=self.pointer)
        self._end(self.outcome, self.note)

    def _end(self, outcome: Outcome, note: str = "") -> None:
        self.phase = Phase.ENDED
        self.outcome = outcome
        self.note = note
