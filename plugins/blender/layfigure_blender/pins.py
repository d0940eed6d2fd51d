# SPDX-License-Identifier: GPL-3.0-or-later
"""The pins of a server's doll, as far as they are known. Ring 1: no bpy."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass

import numpy as np

import layfigure
from layfigure.protocol import Floats

from .link import Link
from .replies import numbers


@dataclass(frozen=True, eq=False)
class Pin:
    number: int
    joint: int
    position: Floats  # (3) in the world, where it holds


class PinList:
    """Asks the server for its pins and remembers what it answered: others set pins too, and undo brings old ones back.

    Never waits. Belongs to one thread.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self._asked: Future[layfigure.Reply] | None = None
        self._known: tuple[Pin, ...] = ()

    def ask(self) -> None:
        """Commands are carried out in their order: what was sent before this is in the answer."""
        self._asked = self._link.send("pin", action="list")

    @property
    def known(self) -> tuple[Pin, ...]:
        """As of the newest answer."""
        if self._asked is not None and self._asked.done():
            if not self._asked.cancelled() and self._asked.exception() is None:
                self._known = _pins(self._asked.result())
            self._asked = None
        return self._known

    def of_joint(self, joint: int) -> tuple[Pin, ...]:
        return tuple(pin for pin in self.known if pin.joint == joint)


def _pins(reply: layfigure.Reply) -> tuple[Pin, ...]:
    """None of a server that tells them otherwise, as one of another version may."""
    pins, joints, places = (numbers(reply, name) for name in ("pin", "joint", "position"))
    if not len(pins) == len(joints) == len(places) / 3:
        return ()
    positions = np.reshape(places, (-1, 3))
    return tuple(
        Pin(int(pin), int(joint), position) for pin, joint, position in zip(pins, joints, positions, strict=True)
    )
