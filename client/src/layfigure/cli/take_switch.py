"""Lines on the standard input as a switch."""

from __future__ import annotations

import os
import select
import sys


class TakeSwitch:
    """Is thrown by each line that comes, by Enter on a terminal. One that has been closed is never thrown."""

    def __init__(self) -> None:
        self._open = True

    def thrown(self) -> bool:
        """Whether it was thrown since the last call; does not wait."""
        if not self._open or not select.select([sys.stdin], [], [], 0.0)[0]:
            return False
        data = os.read(sys.stdin.fileno(), 4096)
        self._open = bool(data)
        return data.count(b"\n") % 2 == 1
