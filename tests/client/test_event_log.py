import os
import signal
import subprocess
import sys
from pathlib import Path

import lcm
import pytest

from layfigure.bus import Event, EventLogWriter, is_being_written, read_events
from layfigure.errors import LayfigureError

EVENTS = [Event(10, "A", b""), Event(20, "LAYFIGURE_POSE", bytes(range(256))), Event(30, "B", b"x" * 100_000)]


def write(path: Path) -> EventLogWriter:
    log = EventLogWriter(path)
    for event in EVENTS:
        log.write(event)
    return log


def test_event_log_written_is_read_by_lcm(tmp_path: Path) -> None:
    write(tmp_path / "a.lcmlog").close()
    events = [(e.eventnum, e.timestamp, e.channel, e.data) for e in lcm.EventLog(str(tmp_path / "a.lcmlog"))]
    assert events == [(number, e.time_us, e.channel, e.data) for number, e in enumerate(EVENTS)]


def test_event_log_written_by_lcm_is_read(tmp_path: Path) -> None:
    log = lcm.EventLog(str(tmp_path / "a.lcmlog"), "w")
    for event in EVENTS:
        log.write_event(event.time_us, event.channel, event.data)
    log.close()
    assert list(read_events(tmp_path / "a.lcmlog")) == EVENTS


def test_event_log_every_truncation_reads_the_whole_events(tmp_path: Path) -> None:
    write(tmp_path / "a.lcmlog").close()
    whole = (tmp_path / "a.lcmlog").read_bytes()
    second_end = len(whole) - (28 + 1 + 100_000)
    for length in (0, 1, 27, 28, 29, 30, second_end - 1, second_end, second_end + 5, len(whole) - 1):
        (tmp_path / "b.lcmlog").write_bytes(whole[:length])
        expected = (length >= 29) + (length >= second_end)
        assert list(read_events(tmp_path / "b.lcmlog")) == EVENTS[:expected], length


def test_event_log_of_a_killed_process_is_whole(tmp_path: Path) -> None:
    code = (
        "import os, sys; from pathlib import Path; from layfigure.bus import Event, EventLogWriter\n"
        "log = EventLogWriter(Path(sys.argv[1]))\n"
        "for n in range(100): log.write(Event(n, 'A', b'x' * n))\n"
        f"os.kill(os.getpid(), {int(signal.SIGKILL)})"
    )
    path = tmp_path / "a.lcmlog"
    killed = subprocess.run([sys.executable, "-c", code, str(path)], check=False, timeout=60)
    assert killed.returncode == -signal.SIGKILL
    assert [len(event.data) for event in read_events(path)] == list(range(100))


def test_event_log_lock_tells_a_living_writer(tmp_path: Path) -> None:
    log = write(tmp_path / "a.lcmlog")
    assert is_being_written(tmp_path / "a.lcmlog")
    log.close()
    assert not is_being_written(tmp_path / "a.lcmlog")


def test_event_log_replaces_a_longer_earlier_one(tmp_path: Path) -> None:
    write(tmp_path / "a.lcmlog").close()
    EventLogWriter(tmp_path / "a.lcmlog").close()
    assert list(read_events(tmp_path / "a.lcmlog")) == []


@pytest.mark.parametrize("path", ["missing/a.lcmlog", "."])
def test_event_log_impossible_path_is_refused(tmp_path: Path, path: str) -> None:
    with pytest.raises(LayfigureError, match="cannot write"):
        EventLogWriter(tmp_path / path)


def test_event_log_full_disk_is_reported() -> None:
    if not os.path.exists("/dev/full"):  # noqa: PTH110
        pytest.skip("needs /dev/full")
    log = EventLogWriter.__new__(EventLogWriter)
    log.path = Path("/dev/full")
    log._file, log._count = os.open("/dev/full", os.O_WRONLY), 0
    with pytest.raises(LayfigureError, match=r"cannot write '/dev/full': No space left"):
        log.write(EVENTS[1])
    log.close()
