"""Poses as they come, for a loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from layfigure.protocol import Pose

_CAPACITY = 4096  # poses that wait: a minute at 60 Hz, some 20 MB of 60 joints

Wait = Callable[[Callable[[], bool]], None]  # until a condition holds; raises LayfigureError if that takes too long


class PoseStream:
    """An iterator over the poses that come from its making on, in their order; made by Doll.poses(), for its thread.

    It ends when the server leaves. Raises NoReplyError if no pose comes in time.
    """

    def __init__(self, wait: Wait, drain: Callable[[], None], left: Callable[[], bool], *, newest: bool) -> None:
        self.skipped = 0  # poses between those that were given: lost on the way, or left out
        self._wait = wait
        self._drain = drain
        self._left = left
        self._newest = newest
        self._queue: deque[Pose] = deque(maxlen=1 if newest else _CAPACITY)
        self._last: Pose | None = None

    def __iter__(self) -> PoseStream:
        return self

    def __next__(self) -> Pose:
        if self._newest:
            self._drain()
        self._wait(lambda: bool(self._queue) or self._left())
        if not self._queue:
            raise StopIteration
        pose = self._queue.popleft()
        if self._last is not None and pose.server_id == self._last.server_id:
            self.skipped += pose.sequence - self._last.sequence - 1
        self._last = pose
        return pose

    def add(self, pose: Pose) -> None:
        """Takes a pose that has come; one that came before is left out."""
        known = self._queue[-1] if self._queue else self._last
        if known is None or pose.server_id != known.server_id or pose.sequence > known.sequence:
            self._queue.append(pose)
