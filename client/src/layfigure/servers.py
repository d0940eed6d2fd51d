"""Which server is on the bus: a restarted one is followed, a second one at the same time is refused.

A client that has chosen one of several servers hears that one alone, see Bus.
"""

from __future__ import annotations

import struct
import time
from collections.abc import Callable

from layfigure.errors import TwoServersError

CONFIRMED_AFTER_S = 0.3  # three heartbeats, in which a server that was only thought gone would have spoken
SILENT_AFTER_S = 2.0  # a server sends a heartbeat ten times a second
_HEAD = struct.Struct(">qiqq")  # how messages begin: fingerprint, protocol_version, time_us, server_id
_WHICHEVER = 0  # what a command is addressed to that is for the only server


def is_server_id(number: int) -> bool:
    return 0 < number < 1 << 63


def concerns(data: bytes, server_id: int) -> bool:
    """Whether a message is from that server, for it, or for whichever there is.

    One that is too short to tell is left to its decoder, which says what is wrong with it.
    """
    return len(data) < _HEAD.size or _HEAD.unpack_from(data)[3] in (server_id, _WHICHEVER)


class ServerWatch:
    """Follows the random id that each run of a server puts into its messages.

    A new id means that the server was restarted: the old run is over. When an id that was left behind speaks again,
    both are alive.
    """

    def __init__(self, chosen: int | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        """`chosen` is the only server that will be heard; None: whichever there is."""
        self._clock = clock
        self._former: set[int] = set()
        self._heard_at = clock()
        self._changed_at = clock()
        self.current = chosen

    def hear(self, server_id: int) -> None:
        """Takes note of a message from `server_id`. Raises TwoServersError."""
        self._heard_at = self._clock()
        if server_id == self.current:
            return
        if server_id in self._former:
            raise TwoServersError(
                f"two servers speak on this bus, {self.current} and {server_id}: choose one with --server ID, in "
                "Python connect(server=ID), stop the other, or give each its own --lcm-url or --channel-prefix"
            )
        if self.current is not None:
            self._former.add(self.current)
            self._changed_at = self._clock()
        self.current = server_id

    @property
    def unconfirmed_s(self) -> float:
        """How long the former server has to be listened for yet, before the present one is taken for its successor."""
        if not self._former:
            return 0.0
        return max(self._changed_at + CONFIRMED_AFTER_S - self._clock(), 0.0)

    @property
    def silent(self) -> bool:
        """Nothing was heard for so long that the server must be gone."""
        return self._clock() - self._heard_at > SILENT_AFTER_S
