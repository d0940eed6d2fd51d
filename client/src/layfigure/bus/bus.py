"""The message bus: LCM, made to fail in one line, never to block for good, and to be reconnectable.

A Bus belongs to one thread.
"""

from __future__ import annotations

import contextlib
import logging
import os
import re
import select
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from types import TracebackType

import lcm

from layfigure.errors import BusError, ProtocolError
from layfigure.servers import concerns

Handler = Callable[[bytes], None]

_FALLBACK_URL = "udpm://239.255.76.67:7667?ttl=0"  # ttl=0: stays on this machine
_QUEUE_CAPACITY = 10_000  # udpm drops the newest message when a queue is full
_CONNECT_TIMEOUT_S = 2.0
_TCPQ_HELLO = struct.pack(">II", 0x287617FB, 0x0100)
_TCPQ_SERVER_MAGIC = 0x287617FA
_MAX_BATCH = 1000  # messages handled by one poll before the caller gets its turn
_LOG_INTERVAL_S = 1.0

_logger = logging.getLogger(__name__)


def default_url() -> str:
    return os.environ.get("LCM_DEFAULT_URL") or _FALLBACK_URL


class Bus:
    """A connection to `url` whose channel names all start with `prefix`.

    With `server_id` only that server is heard, of several on one bus, and what is for it: all other messages are passed
    over unread. It is for channels whose messages name a server, LAYFIGURE_*. A server that is started again has
    another id.
    """

    def __init__(self, url: str | None = None, prefix: str = "", server_id: int | None = None) -> None:
        """Connects at once. Raises BusError if nothing answers at `url` or the URL is not one of LCM's."""
        self.url = url or default_url()
        self.server_id = server_id
        self._prefix = prefix
        self._handlers: list[tuple[str, Handler]] = []
        self._subscriptions: list[lcm.LCMSubscription] = []  # those of the handlers, while it is connected
        self._inbox: list[tuple[Handler, bytes]] = []
        self._postponed: dict[Handler, bytes] = {}
        self._last_complaint_s = float("-inf")
        self.bad_messages = 0  # that a handler could not decode
        self.problem = ""  # with the newest message, if it is one of them
        self.handling_s = 0.0  # how long handlers have been at work in all
        self._lcm: lcm.LCM | None = None
        self._socket: socket.socket | None = None  # lcm's own, if it is a TCP one
        self._loss = ""  # how the connection was lost, until the caller has been told
        _warn_of_network(self.url)
        self.connect()

    def __enter__(self) -> Bus:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def connected(self) -> bool:
        return self._lcm is not None

    def connect(self) -> None:
        """(Re)connects and subscribes again; lcm's own reconnecting never receives again, so its object is new."""
        self.close()
        self._loss = ""
        if self.url.startswith("tcpq://"):
            _probe_tcpq(self.url)
        try:
            with _silenced_stderr():
                self._lcm = lcm.LCM(self.url)
        except RuntimeError as error:
            raise BusError(f"no LCM bus at '{self.url}': check the URL and that its network exists") from error
        if self._lcm.fileno() < 0:
            self.close()
            raise BusError(f"lost the connection to '{self.url}'")
        if self.url.startswith("tcpq://"):
            self._socket = socket.socket(fileno=os.dup(self._lcm.fileno()))
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)  # else a round trip takes 50 to 90 ms
        for channel, handler in self._handlers:
            self._subscribe(self._lcm, channel, handler)

    def fileno(self) -> int:
        """What becomes readable when there is something to poll() for; another one after connect(). Raises BusError."""
        if self._lcm is None:
            raise BusError(self._loss or f"not connected to '{self.url}'")
        return int(self._lcm.fileno())

    def close(self) -> None:
        with _silenced_stderr():  # lcm tries to reconnect when it is destroyed, and says so
            self._lcm = None
            self._subscriptions.clear()
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def subscribe(self, channel: str, handler: Handler) -> None:
        """Calls `handler` with the bytes of each message of `channel`, from inside poll().

        A ProtocolError that it raises is counted and logged, at most once a second; any other comes out of poll().
        """
        self._handlers.append((channel, handler))
        if self._lcm is not None:
            self._subscribe(self._lcm, channel, handler)

    @contextlib.contextmanager
    def temporary_subscriptions(self) -> Iterator[None]:
        """Whatever is subscribed in the `with` block ends with it."""
        kept = len(self._handlers)
        try:
            yield
        finally:
            del self._handlers[kept:]
            if self._lcm is not None:
                for subscription in self._subscriptions[kept:]:
                    self._lcm.unsubscribe(subscription)
                del self._subscriptions[kept:]

    def publish(self, channel: str, data: bytes) -> None:
        """Raises BusError if the connection is lost."""
        if self._lcm is None:
            raise BusError(self._loss or f"not connected to '{self.url}'")
        try:
            with _silenced_stderr(), _in_one_piece(self._socket):
                self._lcm.publish(self._prefix + channel, data)
        except (OSError, RuntimeError) as error:
            self.close()
            raise BusError(f"lost the connection to '{self.url}'") from error

    def poll(self, timeout_s: float) -> None:
        """Waits up to `timeout_s` for a message, then handles all that are there.

        Raises BusError if the connection is lost; connect() then tries again. A loss that comes right behind a message
        is raised by the next call, so that the caller sees the message first: the answer of a server that then leaves.
        """
        if self._lcm is None:
            raise BusError(self._loss or f"not connected to '{self.url}'")
        try:
            self._handle_what_comes(timeout_s)
        finally:
            postponed, self._postponed = self._postponed, {}
            for handler, data in postponed.items():
                self._dispatch(handler, data)

    def postpone(self, handler: Handler, data: bytes) -> None:
        """For handlers: calls `handler`, as if it were one, once poll() has handled all that is there; of what one
        `handler` is to be called with, with the newest alone. What is costly to read and outdated at once is read once.
        """
        self._postponed[handler] = data

    def _handle_what_comes(self, timeout_s: float) -> None:
        """Keeps no reference to the connection: one that is lost has to go at once, or LCM tries it again, loudly."""
        for handled in range(_MAX_BATCH):
            if self._lcm is None or not _is_readable(self._lcm.fileno(), 0.0 if handled else timeout_s):
                return
            try:
                self._handle_one()
            except BusError as error:
                if not handled:
                    raise
                self._loss = str(error)
                return

    def wait_until(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Handles messages until `condition` holds; False after `timeout_s` seconds without it."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            remaining = deadline - time.monotonic()
            if remaining <= 0:
                return False
            self.poll(min(remaining, 0.1))
        return True

    def _handle_one(self) -> None:
        assert self._lcm is not None
        try:
            with _silenced_stderr():
                self._lcm.handle()
        except (OSError, RuntimeError) as error:
            self.close()
            raise BusError(f"lost the connection to '{self.url}'") from error
        messages, self._inbox = self._inbox, []
        for handler, data in messages:
            self._dispatch(handler, data)

    def _dispatch(self, handler: Handler, data: bytes) -> None:
        start_s = time.monotonic()
        try:
            handler(data)
            self.problem = ""
        except ProtocolError as error:
            self.bad_messages += 1
            self.problem = str(error)
            if time.monotonic() - self._last_complaint_s >= _LOG_INTERVAL_S:
                self._last_complaint_s = time.monotonic()
                _logger.warning("bad message left out: %s", error)
        finally:
            self.handling_s += time.monotonic() - start_s

    def _subscribe(self, connection: lcm.LCM, channel: str, handler: Handler) -> None:
        def collect(_: str, data: bytes) -> None:  # only collects, so that nothing is raised through lcm's C code
            if self.server_id is None or concerns(data, self.server_id):
                self._inbox.append((handler, data))

        subscription = connection.subscribe(re.escape(self._prefix + channel), collect)
        subscription.set_queue_capacity(_QUEUE_CAPACITY)
        self._subscriptions.append(subscription)


def _warn_of_network(url: str) -> None:
    """LCM has no way to tell who sends: whoever is reached can join in."""
    ttl = re.search(r"^udpm:[^?]*\?(?:.*&)?ttl=(\d+)", url)
    if ttl is not None and int(ttl[1]) > 0:
        _logger.warning("'%s' has ttl=%s: messages leave this machine; ttl=0 keeps them here", url, ttl[1])


def _is_readable(file_descriptor: int, timeout_s: float) -> bool:
    """Waits for it. By poll(): select() knows no descriptor above 1023, which a program with many open files has."""
    poller = select.poll()
    poller.register(file_descriptor, select.POLLIN)
    return bool(poller.poll(1e3 * timeout_s))


def _probe_tcpq(url: str) -> None:
    """Shakes hands with a tcpq server once, with a time limit: lcm waits for ever for a peer that does not answer."""
    host, port = _tcpq_address(url)
    try:
        with socket.create_connection((host, port), _CONNECT_TIMEOUT_S) as probe:
            probe.sendall(_TCPQ_HELLO)
            answer = probe.recv(8, socket.MSG_WAITALL)
    except OSError as error:
        reason = error.strerror or "no answer"
        raise BusError(
            f"no server at '{url}' ({reason.lower()}): start layfigure-server with --broker {port}"
        ) from error
    if len(answer) < 8 or struct.unpack(">I", answer[:4])[0] != _TCPQ_SERVER_MAGIC:
        raise BusError(f"what listens at '{url}' is not an LCM broker: check the port")


def _tcpq_address(url: str) -> tuple[str, int]:
    match = re.fullmatch(r"tcpq://(?P<host>[^:?/]*)(?::(?P<port>\d{1,5}))?", url)
    if match is None or int(match["port"] or 0) > 65535:
        raise BusError(f"'{url}' is not a tcpq URL: expected tcpq://HOST:PORT")
    return match["host"] or "127.0.0.1", int(match["port"] or 7700)


@contextlib.contextmanager
def _in_one_piece(connection: socket.socket | None) -> Iterator[None]:
    """lcm writes a message in five pieces, each of which would be a packet of its own that wakes the broker up."""
    if connection is None or not hasattr(socket, "TCP_CORK"):
        yield
        return
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_CORK, 1)
    try:
        yield
    finally:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_CORK, 0)


class _StderrSilencer:
    """Leads the process's stderr away while any thread is in lcm's C code."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._threads = 0
        self._kept = -1

    def __enter__(self) -> None:
        with self._lock:
            if self._threads == 0:
                self._kept = os.dup(2)
                sink = os.open(os.devnull, os.O_WRONLY)
                os.dup2(sink, 2)
                os.close(sink)
            self._threads += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._threads -= 1
            if self._threads == 0:
                os.dup2(self._kept, 2)
                os.close(self._kept)


_stderr_silencer = _StderrSilencer()


def _silenced_stderr() -> contextlib.AbstractContextManager[None]:
    """Keeps lcm's C code from writing to the terminal: what it has to say is raised, in one line, by the caller."""
    return _stderr_silencer
