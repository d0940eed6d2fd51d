# SPDX-License-Identifier: GPL-3.0-or-later
"""The connection to a server, on a thread of its own. No bpy: nothing of Blender may be touched off its main thread."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import threading
import time
from collections import deque
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

import layfigure
from layfigure import BusError, Character, Doll, Force, LayfigureError, Pose, RefusedError, Reply, Status, UsageError

State = Literal["connecting", "live", "lost", "refused", "closed"]

CONNECT_TIMEOUT_S = 1.5  # of one attempt; below the 2 s in which close() expects the thread to end
RETRY_S = 0.2
IDLE_S = 0.1  # the longest wait, after which it is seen whether the server has fallen silent
NO_FILE = -1
# A message takes 0.1 to 0.5 ms to the server, which takes it in with its next step; what it moves is seen to move after
# another one.
ON_THE_WAY_US = 2000
MOST_QUEUED = 1000  # commands and pointers; more than a server that answers ever lets wait


@dataclass(frozen=True, eq=False)
class Sample:
    """A pose as it came."""

    pose: Pose
    received_at: float  # time.monotonic() [s]


@dataclass(eq=False)
class _Command:
    name: str
    arguments: dict[str, Any]
    future: Future[Reply]


@dataclass(eq=False)
class _Move:
    pointer: int
    where: np.ndarray  # (3) or (7)


class Link:
    """Keeps the newest pose of the server at `url`, sends commands and pointers, connects again when it is lost.

    A server that was restarted with the same character is the same; one with another character is refused, until the
    right one is there. Every attribute may be read and every method called from any thread; none waits, but close() and
    wait_for_effect().
    """

    def __init__(self, url: str, prefix: str = "") -> None:
        self.url = url
        self.prefix = prefix
        self.newest: Sample | None = None
        self.character: Character | None = None
        self.status: Status | None = None
        self.forces: Mapping[int, Force] = MappingProxyType({})
        self.state: State = "connecting"
        self.message = f"connecting to {url}"
        self.failed_attempts = 0  # to connect, since it was live
        self._queue: deque[_Command | _Move] = deque()
        self._lock = threading.Lock()  # of the queue and of `_closing`
        self._came = threading.Condition()  # a pose
        self._closing = False
        self._wake_reader, self._wake_writer = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._thread = threading.Thread(target=self._run, name=f"layfigure {url}", daemon=True)

    def start(self) -> None:
        """Starts the thread."""
        self._thread.start()

    def close(self, timeout_s: float = 2.0) -> None:
        """Ends the thread; commands that were not answered get an exception. May be called again."""
        with self._lock:
            self._closing = True
            self._wake()
        if self._thread.ident is None:
            self._close_pipe()
        elif threading.current_thread() is not self._thread:
            self._thread.join(timeout_s)
        self.state = "closed"
        self._drop_queue(UsageError("the connection was closed"))

    def send(self, name: str, /, **arguments: ArrayLike | None) -> Future[Reply]:
        """A command of the server; commands are carried out in their order.

        The future's exception is a layfigure.LayfigureError: RefusedError with the server's reason, NoReplyError,
        BusError if the connection is lost before the answer.
        """
        future: Future[Reply] = Future()
        if not self._put(_Command(name, dict(arguments), future)):
            future.set_exception(BusError(f"'{name}' was not sent: {self.message}"))
        return future

    def move_pointer(self, pointer: int, position: ArrayLike, rotation: ArrayLike | None = None) -> None:
        """Where a pointer is to be: position (3) [m], rotation w x y z, in the server's world. The newest counts.

        It does not overtake commands that were given before. Raises ValueError for other than finite numbers.
        """
        where = np.asarray(position, np.float64)
        if rotation is not None:
            where = np.concatenate([where, np.asarray(rotation, np.float64)])
        is_placement = where.shape in ((3,), (7,)) and np.isfinite(where).all()
        if not is_placement or (rotation is not None and not where[3:].any()):
            raise ValueError(f"pointer {pointer} is sent to {position!r}, {rotation!r}: expected finite x y z, w x y z")
        self._put(_Move(pointer, where))

    def wait_for_effect(self, timeout_s: float) -> bool:
        """Waits until the newest pose is of a time at which what was sent by now has reached the doll: whether it came.

        The server's time now is told from the newest pose and the time since, which holds while it keeps up with the
        clock; one that does not, or steps by commands, is waited for until the timeout.
        """
        before = self.newest
        if before is None:
            return False
        since_us = 1e6 * (time.monotonic() - before.received_at)
        then_us = before.pose.time_us + since_us + ON_THE_WAY_US
        with self._came:
            return self._came.wait_for(
                lambda: self.newest is not None and self.newest.pose.time_us >= then_us, timeout_s
            )

    def _put(self, item: _Command | _Move) -> bool:
        """False if nobody will send it."""
        with self._lock:
            if self._closing or self.state != "live":
                return False
            self._forget_older_move(item)
            if len(self._queue) >= MOST_QUEUED:
                return False
            self._queue.append(item)
            self._wake()
        return True

    def _forget_older_move(self, item: _Command | _Move) -> None:
        """Up to the newest command: what it was to do depends on where the pointers are."""
        if not isinstance(item, _Move):
            return
        for queued in reversed(self._queue):
            if isinstance(queued, _Command):
                return
            if queued.pointer == item.pointer:
                self._queue.remove(queued)
                return

    def _wake(self) -> None:
        with contextlib.suppress(BlockingIOError, OSError):  # full: it will wake up; closed: it has ended
            os.write(self._wake_writer, b"\0")

    # --- the thread ---

    def _run(self) -> None:
        # A server that goes while something is written to it is an error, and not the end of a program that leaves the
        # signal to its default, as those do that have Python inside.
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGPIPE})
        try:
            while not self._closing:
                try:
                    self._connect_and_serve()
                except LayfigureError as error:
                    self._lose(error)
                    self._wait(None, RETRY_S)
        except BaseException as error:
            self._lose(BusError(f"the connection has ended by a mistake, see the console: {error}"))
            raise
        finally:
            self._close_pipe()

    def _close_pipe(self) -> None:
        with self._lock:
            self._closing = True
            for end in {self._wake_reader, self._wake_writer} - {NO_FILE}:
                os.close(end)
            self._wake_reader = self._wake_writer = NO_FILE

    def _connect_and_serve(self) -> None:
        with layfigure.connect(self.url, prefix=self.prefix, timeout_s=CONNECT_TIMEOUT_S) as doll:
            known = self.character
            if known is not None and doll.character.content_hash != known.content_hash:
                raise RefusedError(
                    f"the server at {self.url} has another character now, '{doll.character.name}' in place of "
                    f"'{known.name}': stop, and start again"
                )
            self.character = doll.character
            self._take_news(doll, None)
            with self._lock:
                self.state, self.message = "live", f"connected to {self.url}"
                self.failed_attempts = 0
            self._serve(doll)

    def _serve(self, doll: Doll) -> None:
        asked: tuple[_Command, layfigure.PendingReply] | None = None
        last: Pose | None = None
        try:
            while not self._closing:
                asked = self._send_queued(doll, asked)
                self._wait(doll, IDLE_S if asked is None else min(asked[1].due_in_s, IDLE_S))
                last = self._take_news(doll, last)
                asked = _answer(asked)
                _check_presence(doll)
        except LayfigureError as error:
            if asked is not None:
                asked[0].future.set_exception(error)
            raise
        if asked is not None:
            asked[0].future.set_exception(UsageError("the connection was closed before the answer came"))

    def _send_queued(
        self, doll: Doll, asked: tuple[_Command, layfigure.PendingReply] | None
    ) -> tuple[_Command, layfigure.PendingReply] | None:
        """All that may be sent now, in order: a command waits for the answer to the one before."""
        while True:
            with self._lock:
                if not self._queue or (asked is not None and isinstance(self._queue[0], _Command)):
                    return asked
                item = self._queue.popleft()
            if isinstance(item, _Move):
                doll.move_pointer(item.pointer, item.where)
                continue
            if not item.future.set_running_or_notify_cancel():
                continue
            try:
                asked = item, doll.begin(item.name, **item.arguments)
                asked[1].send_if_due()
            except LayfigureError as error:
                asked = None
                item.future.set_exception(error)
                if not isinstance(error, UsageError):
                    raise

    def _take_news(self, doll: Doll, last: Pose | None) -> Pose:
        pose = doll.pose()
        self.forces = MappingProxyType(doll.forces)
        self.status = doll.newest_status
        if pose is not last:
            with self._came:
                self.newest = Sample(pose, time.monotonic())
                self._came.notify_all()
        return pose

    def _wait(self, doll: Doll | None, timeout_s: float) -> None:
        """For messages, something to send, or the end."""
        poller = select.poll()
        poller.register(self._wake_reader, select.POLLIN)
        if doll is not None:
            poller.register(doll.fileno(), select.POLLIN)
        poller.poll(1e3 * timeout_s)
        with contextlib.suppress(BlockingIOError):
            os.read(self._wake_reader, 4096)

    def _lose(self, error: LayfigureError) -> None:
        refused = isinstance(error, RefusedError | layfigure.TwoServersError)
        with self._lock:
            if refused:
                self.state = "refused"
            elif self.state in ("live", "lost", "refused"):
                self.state = "lost"
            self.message = str(error)
            self.failed_attempts += 1
        self._drop_queue(error)

    def _drop_queue(self, error: LayfigureError) -> None:
        with self._lock:
            items = list(self._queue)
            self._queue.clear()
        for item in items:
            if isinstance(item, _Command) and item.future.set_running_or_notify_cancel():
                item.future.set_exception(error)


def _answer(
    asked: tuple[_Command, layfigure.PendingReply] | None,
) -> tuple[_Command, layfigure.PendingReply] | None:
    """What is still asked."""
    if asked is None:
        return None
    command, pending = asked
    try:
        pending.send_if_due()
    except layfigure.NoReplyError as error:
        command.future.set_exception(error)
        return None
    if pending.reply is None:
        return asked
    if pending.reply.accepted:
        command.future.set_result(pending.reply)
    else:
        command.future.set_exception(RefusedError(pending.reply.reason))
    return None


def _check_presence(doll: Doll) -> None:
    """Raises BusError if the server has gone without the connection's telling."""
    status = doll.newest_status
    if (status is not None and status.state == "leaving") or doll.silent:
        raise BusError("the server has left: start it again")
