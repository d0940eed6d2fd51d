"""LCM event logs (.lcmlog): what lcm-logger writes and lcm-logplayer plays.

The writer is our own, because a message must be in the file, and not in a buffer, before anything else is done with
it: lcm's writer cannot be flushed from Python, and a killed recorder would lose what it holds.
"""

from __future__ import annotations

import fcntl
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import lcm

from layfigure.errors import LayfigureError

_SYNC_WORD = 0xEDA1DA01
_HEADER = struct.Struct(">IqqII")  # sync word, event number, time [us], length of channel, length of data


@dataclass(frozen=True)
class Event:
    time_us: int  # of arrival, microseconds since the Unix epoch
    channel: str
    data: bytes


class EventLogWriter:
    """A new log at `path`; an earlier file of that name is replaced, unless a living writer holds it.

    Each event is handed to the operating system by one write before write() returns, so it outlives the process. One
    for which there is no room is left out whole.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._count = 0
        self._size = 0
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise LayfigureError(f"cannot write '{path}': {error.strerror}") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(self._file)
            raise LayfigureError(f"'{path}' is being written by another recorder: choose another name") from error
        os.ftruncate(self._file, 0)

    def write(self, event: Event) -> None:
        channel = event.channel.encode()
        header = _HEADER.pack(_SYNC_WORD, self._count, event.time_us, len(channel), len(event.data))
        record = header + channel + event.data
        try:
            if os.write(self._file, record) != len(record):
                os.ftruncate(self._file, self._size)
                os.lseek(self._file, self._size, os.SEEK_SET)
                raise LayfigureError(f"cannot write '{self.path}': the disk is full")
        except OSError as error:
            raise LayfigureError(f"cannot write '{self.path}': {error.strerror}") from error
        self._count += 1
        self._size += len(record)

    def close(self) -> None:
        os.close(self._file)

    def discard(self) -> None:
        """Closes and removes the log."""
        self.close()
        self.path.unlink()


def is_being_written(path: Path) -> bool:
    """Whether a living writer holds the log at `path`."""
    with path.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return True
    return False


def read_events(path: Path) -> Iterator[Event]:
    """The events of a log, in order; one that was cut off at its end is read up to there."""
    if not path.is_file():
        raise LayfigureError(f"no event log '{path}': check the name")
    try:
        log = lcm.EventLog(str(path), "r")
    except (OSError, ValueError) as error:
        raise LayfigureError(f"cannot read '{path}' as an LCM event log") from error
    try:
        while (event := log.read_next_event()) is not None:
            yield Event(event.timestamp, event.channel, event.data)
    finally:
        log.close()
