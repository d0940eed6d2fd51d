"""Records what a server publishes: each message to an event log first, then into a take.

A log begins with the character and the chunks of its meshes, each once, and holds from then on all that is said.
"""

from __future__ import annotations

import functools
import logging
import time
from collections.abc import Callable

from layfigure import codec
from layfigure.bus import Bus, Event, EventLogWriter
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
    Mesh,
)
from layfigure.take import TakeBuilder
from layfigure.take_collector import TakeCollector

_DESCRIBING_CHANNELS = (CHARACTER_CHANNEL, MESH_CHANNEL)
_MOVING_CHANNELS = (
    POSE_CHANNEL,
    FORCE_CHANNEL,
    POINTER_CHANNEL,
    COMMAND_CHANNEL,
    REPLY_CHANNEL,
    STATUS_CHANNEL,
)
POLL_S = 0.1
RECONNECT_EVERY_S = 0.5

_logger = logging.getLogger(__name__)


class Recorder:
    """Records from `bus` into `log`. Subscribes at once; start() makes it ready, run() does the work.

    After pause() nothing is recorded until resume() begins another take.
    """

    def __init__(self, bus: Bus, log: EventLogWriter) -> None:
        self._bus = bus
        self.log = log
        self._paused = False
        self._description: dict[object, Event] = {}  # the character and its meshes, once each
        self._collector = TakeCollector(log.path.parent)  # a disk that has room for the log has it for the poses
        self._waited_s = 0.0
        for channel in _DESCRIBING_CHANNELS:  # before anything else sees the message
            bus.subscribe(channel, functools.partial(self._receive_description, channel))
        for channel in _MOVING_CHANNELS:
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

    @property
    def character(self) -> Character:
        assert self._collector.character is not None, "start() comes first"
        return self._collector.character

    @property
    def meshes(self) -> tuple[Mesh, ...]:
        return self._collector.meshes

    @property
    def server_left(self) -> bool:
        return self._collector.server_left

    def start(self) -> Character:
        """Fetches the character. Raises NoReplyError without a server, TwoServersError with more than one."""
        character = self._connection.fetch_character()
        self._connection.fetch_meshes(character)
        self._connection.listen_for_rivals()
        return character

    def drop_rival(self) -> None:
        """After a TwoServersError that came out of somebody else's poll."""
        self._collector.drop_rival()

    def pause(self) -> None:
        """The take ends. Its log is the caller's."""
        self._paused = True

    def resume(self, log: EventLogWriter) -> None:
        """Another take begins, in a log of its own."""
        self.log = log
        self._collector.begin_take()
        for event in self._description.values():
            log.write(event)
        self._waited_s = 0.0
        self._paused = False

    def wait(self, stop: Callable[[], bool]) -> None:
        """Listens while it is paused, until `stop()` or the server's leave."""
        self._listen(lambda: stop() or self.server_left, lambda: None)

    def run(self, stop: Callable[[], bool], duration_s: float, progress: Callable[[TakeBuilder], None]) -> None:
        """Until `stop()`, the server's leave or `duration_s`, through losses of the server.

        Raises TwoServersError or, when the character changes, LayfigureError; the take so far stays good.
        """

        def ended() -> bool:
            return stop() or self.server_left or self.elapsed_s >= duration_s

        self._listen(ended, lambda: progress(self.builder))

    def _listen(self, ended: Callable[[], bool], progress: Callable[[], None]) -> None:
        try:
            while not ended():
                if not self._poll():
                    self._wait_for_server(ended)
                progress()
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

    def _receive_description(self, channel: str, data: bytes) -> None:
        """Servers repeat it again and again: it is logged once, and when it tells of a change of servers."""
        key: object
        if channel == CHARACTER_CHANNEL:
            character = codec.decode_character(data)
            key = character.content_hash
            known = key in self._description and character.server_id == self._collector.watch.current
        else:
            chunk = codec.decode_mesh_chunk(data)
            key = (chunk.content_hash, chunk.index)
            known = key in self._description
        if not known and not self._paused:
            event = _event(channel, data)
            self.log.write(event)
            self._description.setdefault(key, event)
        self._collector.feed(channel, data)

    def _receive(self, channel: str, data: bytes) -> None:
        if self._collector.builder is not None and not self._paused:
            self.log.write(_event(channel, data))
        if not self._paused or channel == STATUS_CHANNEL:
            self._collector.feed(channel, data)


def _event(channel: str, data: bytes) -> Event:
    return Event(time.time_ns() // 1000, channel, data)
