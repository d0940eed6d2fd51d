# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps the joints of a live doll as they are asked to be: the newest wish wins, a refused one is kept with its reason.

Without Blender. One thread alone may use a sender.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any, Protocol

from layfigure import LayfigureError, ProtocolError, RefusedError, Reply

from .joint_settings import JointSettings
from .joint_values import Change, DollValues, JointValues, asked, changes, replied

MOST_IN_FLIGHT = 16
"""Bones whose commands are under way at once: the server makes its scene anew for each, and has poses to send."""


class Commands(Protocol):
    """What a sender needs of link.Link."""

    def send(self, name: str, /, **arguments: Any) -> Future[Reply]: ...


@dataclass
class _Flight:
    """Commands for one bone that are not answered yet, and what is so if they are carried out."""

    wish: JointSettings
    target: JointValues
    waiting: list[tuple[Change, Future[Reply]]]
    refusals: list[str] = field(default_factory=list)


class JointSender:
    """For one server's doll: a restarted server needs another one."""

    def __init__(self, link: Commands, names: Mapping[int, str], own: DollValues | None = None) -> None:
        """`names` of the bones by their indices; `own`: what is chosen for the doll, else the server is asked."""
        self._link = link
        self._names = names
        self.own = own
        self.trouble = ""  # why nothing can be sent, one line
        self._now: dict[str, JointValues] = {}
        self._held: set[str] = set()  # bones that were asked to be otherwise than chosen, and are to be put back
        self._flights: dict[str, _Flight] = {}
        self._refused: dict[str, tuple[JointSettings, str]] = {}
        self._asked_own: Future[Reply] | None = None
        self._asked_now: Future[Reply] | None = None
        self._is_lost = False  # an answer: what the server has is not known
        self.look_again()

    @property
    def is_ready(self) -> bool:
        """Whether it is known how the joints are."""
        return self.own is not None and self._asked_now is None and not self.trouble

    @property
    def is_idle(self) -> bool:
        return self.is_ready and not self._flights

    def choose(self, own: DollValues) -> None:
        """What is chosen for the doll is otherwise now: joints that are as was chosen before are to be so."""
        before, self.own = self.own, own
        if before is not None:
            known = (bone for bone in before.joints if bone in self._now)
            self._held |= {bone for bone in known if not changes(self._now[bone], before.joints[bone])}

    def look_again(self) -> None:
        """The joints may have changed otherwise: by undo, or a reset."""
        self._is_lost = False
        if self.own is None and self._asked_own is None:
            self._asked_own = self._link.send("get_joints", of="chosen")
        self._asked_now = self._link.send("get_joints")

    def refusal(self, bone: str) -> str:
        """Why the server does not do what is asked of the bone, or ""."""
        return self._refused[bone][1] if bone in self._refused else ""

    def now(self, bone: str) -> JointValues | None:
        """The joint as the server has it, as far as is known."""
        return self._now.get(bone)

    def update(self, wishes: Mapping[str, JointSettings]) -> bool:
        """Takes answers in and sends what is not yet as wished, to be called again and again. Returns whether anything
        that people see has changed: a reason, or what the doll's own values are.
        """
        seen = self._take_answers()
        if self._is_lost and self._asked_now is None:
            self.look_again()
        if not self.is_ready:
            return seen
        assert self.own is not None
        for bone in self.own.joints:
            if len(self._flights) >= MOST_IN_FLIGHT:
                break
            seen |= self._update_bone(bone, wishes.get(bone, JointSettings()))
        return seen

    def _update_bone(self, bone: str, wish: JointSettings) -> bool:
        assert self.own is not None
        if bone in self._flights or bone not in self._now:
            return False
        seen = False
        if bone in self._refused:
            if self._refused[bone][0] == wish:
                return False
            del self._refused[bone]
            seen = True
        if wish.is_about_joint:
            self._held.add(bone)
        elif bone not in self._held:
            return seen  # as others have made it
        target = asked(self.own.joints[bone], wish)
        waiting = [(change, self._send(bone, change)) for change in changes(self._now[bone], target)]
        if waiting:
            self._flights[bone] = _Flight(wish, target, waiting)
        elif not wish.is_about_joint:
            self._held.discard(bone)
        return seen

    def _send(self, bone: str, change: Change) -> Future[Reply]:
        return self._link.send(change.command, bone=bone, **dict(change.arguments))

    # --- answers ---

    def _take_answers(self) -> bool:
        seen = False
        if self._asked_own is not None and self._asked_own.done():
            future, self._asked_own = self._asked_own, None
            joints = self._joints_of(future)
            if joints is not None:
                self.own = self._doll_of(joints)
                seen = True
        if self._asked_now is not None and self._asked_now.done() and not self._flights:
            future, self._asked_now = self._asked_now, None
            self._now = self._joints_of(future) or self._now
        for bone in list(self._flights):
            seen |= self._land(bone)
        return seen

    def _doll_of(self, joints: dict[str, JointValues]) -> DollValues:
        riders = [name for name in self._names.values() if name not in joints]
        return DollValues(joints, riders=dict.fromkeys(riders, "no joint of its own: it moves with its parent"))

    def _joints_of(self, future: Future[Reply]) -> dict[str, JointValues] | None:
        try:
            self.trouble = ""
            return replied(future.result(), self._names)
        except LayfigureError as error:
            self.trouble = f"the doll's joints are not known: {error}"
            self._is_lost = not isinstance(error, RefusedError | ProtocolError)
        return None

    def _land(self, bone: str) -> bool:
        flight = self._flights[bone]
        answered = [(change, future) for change, future in flight.waiting if future.done()]
        flight.waiting = [entry for entry in flight.waiting if not entry[1].done()]
        for change, future in answered:
            self._take(bone, flight, change, future)
        if flight.waiting:
            return False
        del self._flights[bone]
        if not flight.refusals:
            self._now[bone] = flight.target
            return False
        if self._is_lost:
            return False
        self._refused[bone] = (flight.wish, "; ".join(flight.refusals))
        self.look_again()  # what of it was carried out
        return True

    def _take(self, bone: str, flight: _Flight, change: Change, future: Future[Reply]) -> None:
        try:
            future.result()
        except RefusedError as error:
            parts = change.apart()
            if len(parts) > 1:  # those that are not to blame
                flight.waiting += [(part, self._send(bone, part)) for part in parts]
            else:
                flight.refusals.append(str(error))
        except LayfigureError as error:
            flight.refusals.append(str(error))
            self._is_lost = True
