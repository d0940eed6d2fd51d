"""How long somebody else is waited for."""

from __future__ import annotations

import time

from layfigure.bus.bus import Bus

_LONGEST = 10.0  # times the seconds of a limit


class TimeLimit:
    """`seconds`, in which what this client does itself with the messages that come does not count.

    To take in a large mesh may need longer than a server may need to answer. Who gets more messages than it can handle
    comes to an end as well: after ten times the seconds by the wall clock.
    """

    def __init__(self, bus: Bus, seconds: float) -> None:
        self.seconds = seconds
        self._bus = bus
        self._end_s = self._waited_s() + seconds
        self._latest_s = time.monotonic() + _LONGEST * seconds

    @property
    def remaining_s(self) -> float:
        """At least 0."""
        return max(min(self._end_s - self._waited_s(), self._latest_s - time.monotonic()), 0.0)

    def _waited_s(self) -> float:
        return time.monotonic() - self._bus.handling_s
