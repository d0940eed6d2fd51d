# SPDX-License-Identifier: GPL-3.0-or-later
"""The doll on its way to where Blender wants it: the armature's pose, or a place of its history. No bpy."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Literal, NamedTuple

import layfigure

from .link import Link, Sample
from .pushing import PosePush
from .rig import BoneMap, Floats


class Arrival(NamedTuple):
    way: Literal["push", "travel"]
    error: BaseException | None  # why it has ended without having got there


class Transfer:
    """Call step() while something is under way: until it is over, the doll's poses are not those that are wanted."""

    def __init__(self) -> None:
        self._push: PosePush | None = None
        self._travel: Future[layfigure.Reply] | None = None
        self._arrived_us = 0  # at a place, in the simulation's time: older poses are of before

    @property
    def under_way(self) -> bool:
        return self._push is not None or self._travel is not None

    def push(self, link: Link, bones: BoneMap, matrices: Floats) -> Future[None]:
        """To the pose of `matrices` (B, 4, 4), bone -> armature; the future is done when the doll has it."""
        self._push = PosePush(link, bones, matrices)
        return self._push.future

    def travel(self, link: Link, place: int) -> None:
        """To a place of the server's history."""
        self._travel = link.send("history", action="go", place=place)

    def step(self) -> Arrival | None:
        """Goes on as far as it can without waiting; what has ended by that."""
        if self._push is not None:
            self._push.step()
            if self._push.done:
                error = self._push.future.exception()
                self._push = None
                return Arrival("push", error)
        elif self._travel is not None and self._travel.done():
            travel, self._travel = self._travel, None
            error = travel.exception()
            if error is None:
                self._arrived_us = travel.result().time_us
            return Arrival("travel", error)
        return None

    def is_over_before(self, sample: Sample) -> bool:
        """Whether a pose is of the time since the doll was where it was to be."""
        return not self.under_way and sample.pose.time_us >= self._arrived_us

    def forget(self) -> None:
        self._push = self._travel = None

    def meet_another_run(self) -> None:
        """A server that was started anew counts its time from zero."""
        self.forget()
        self._arrived_us = 0
