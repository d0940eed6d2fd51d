"""Records what a server publishes: each message to an event log first, then into a take.

The log grows as OUT.recording.lcmlog and becomes OUT.lcmlog when the take is finished. One that was left behind by a
recorder that was killed is set aside under the next free name, never overwritten.
"""

from __future__ import annotations

import functools
import itertools
import logging
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from layfigure.bus import Bus, Event, EventLogWriter, is_being_written
from layfigure.connection import Connection
from layfigure.errors import BusError, TwoServersError
from layfigure.protocol import (
    CHARACTER_CHANNEL,
    COMMAND_CHANNEL,
    FORCE_CHANNEL,
    MESH_CHANNEL,
    POINTER_CHANNEL,
    POSE_CHANNEL,
    REPLY_CHANNEL,
    STATUS_CHANNEL,
    Character,
)
from layfigure.take import TakeBuilder
from layfigure.take_collector import TakeCollector

LOGGED_CHANNELS = (
    CHARACTER_CHANNEL,
    MESH_CHANNEL,
    POSE_CHANNEL,
    FORCE_CHANNEL,
    POINTER_CHANNEL,
    COMMAND_CHANNEL,
    REPLY_CHANNEL,
    STATUS_CHANNEL,
)
POLL_S = 0.1
RECONNECT_EVERY_S = 0.5
LISTEN_FOR_RIVALS_S = 0.3  # three heartbeats

_logger = logging.getLogger(__name__)


class Recorder:
    """Records from `bus` into `log`. Subscribes at once; start() makes it ready, run() does the work."""

    def __init__(self, bus: Bus, log: EventLogWriter) -> None:
        self._bus = bus
        self.log = log
        self._collector = TakeCollector()
        self._waited_s = 0.0
        for channel in LOGGED_CHANNELS:  # before anything else sees the message
            bus.subscribe(channel, functools.partial(self._receive, channel))
        self._connection = Connection(bus)

    @property
    def builder(self) -> TakeBuilder:
        assert self._collector.builder is not None, "start() comes first"
        return self._collector.builder

    @property
    def has_poses(self) -> bool:
        return self._collector.builder is not None and self.builder.pose_count > 0

    @property
    def elapsed_s(self) -> float:
        """Simulation time recorded, and wall-clock time without a server."""
        return self.builder.duration_s + self._waited_s

    def start(self) -> Character:
        """Fetches the character. Raises NoReplyError without a server, TwoServersError with more than one."""
        character = self._connection.fetch_character()
        self._connection.fetch_meshes(character)
        self._bus.wait_until(lambda: False, LISTEN_FOR_RIVALS_S)
        return character

    def run(self, stop: Callable[[], bool], duration_s: float, progress: Callable[[TakeBuilder], None]) -> None:
        """Until `stop()`, the server's leave or `duration_s`, through losses of the server.

        Raises TwoServersError or, when the character changes, LayfigureError; the take so far stays good.
        """

        def ended() -> bool:
            return stop() or self._collector.server_left or self.elapsed_s >= duration_s

        try:
            while not ended():
                if not self._poll():
                    self._wait_for_server(ended)
                progress(self.builder)
        except TwoServersError:
            self._collector.drop_rival()
            raise

    def _poll(self) -> bool:
        """False if the server is lost."""
        try:
            self._bus.poll(POLL_S)
        except BusError:
            return False
        return not self._collector.watch.silent

    def _wait_for_server(self, ended: Callable[[], bool]) -> None:
        if ended():
            return
        _logger.warning("lost the server: waiting for it at '%s'; Ctrl-C ends the take", self._bus.url)
        start = time.monotonic()
        waited_before = self._waited_s
        while not ended():
            self._waited_s = waited_before + time.monotonic() - start
            if not self._bus.connected:
                self._try_to_connect()
            elif self._poll():
                _logger.warning("the server is back: the take goes on")
                return

    def _try_to_connect(self) -> None:
        try:
            self._bus.connect()
        except BusError:
            time.sleep(RECONNECT_EVERY_S)

    def _receive(self, channel: str, data: bytes) -> None:
        self.log.write(Event(time.time_ns() // 1000, channel, data))
        self._collector.feed(channel, data)


def open_log(out: Path) -> EventLogWriter:
    """The log that grows beside `out`. Raises LayfigureError if another recorder is writing it."""
    path = out.with_name(f"{out.stem}.recording.lcmlog")
    if path.is_file() and path.stat().st_size > 0 and not is_being_written(path):
        aside = _first_free(out.with_name(f"{out.stem}.cut-off-{number}.lcmlog") for number in itertools.count(1))
        path.rename(aside)
        _logger.warning("an earlier recording was cut off: what it had received is kept as '%s'", aside)
    return EventLogWriter(path)


def _first_free(paths: Iterable[Path]) -> Path:
    return next(path for path in paths if not path.exists())


def finish_log(log: EventLogWriter, out: Path) -> Path:
    """Closes the log and gives it its final name, OUT.lcmlog."""
    log.close()
    return log.path.rename(out.with_suffix(".lcmlog"))
