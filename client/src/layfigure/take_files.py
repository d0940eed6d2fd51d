"""The files of a take while it is recorded, and what becomes of them.

    OUT.recording.lcmlog   every message as it was received; becomes OUT.lcmlog when the take is finished
    OUT.recording.usdc     the take so far, saved now and then; gone when the take is finished

Those that a killed recorder left behind are set aside as OUT.cut-off-1.lcmlog and OUT.cut-off-1.usdc, or under the next
free number, never overwritten.
"""

from __future__ import annotations

import itertools
import logging
from collections.abc import Iterator
from pathlib import Path

from layfigure.bus import EventLogWriter, is_being_written

_DIGITS = 3

_logger = logging.getLogger(__name__)


def open_log(out: Path) -> EventLogWriter:
    """The log that grows beside `out`. Raises LayfigureError if another recorder is writing it."""
    path = out.with_name(f"{out.stem}.recording.lcmlog")
    if path.is_file() and path.stat().st_size > 0 and not is_being_written(path):
        aside = _first_free(out)
        path.rename(aside)
        if working_path(out).is_file():
            working_path(out).rename(aside.with_suffix(".usdc"))
        _logger.warning("an earlier recording was cut off: what it had received is kept as '%s'", aside)
    return EventLogWriter(path)


def _first_free(out: Path) -> Path:
    logs = (out.with_name(f"{out.stem}.cut-off-{number}.lcmlog") for number in itertools.count(1))
    return next(log for log in logs if not log.exists() and not log.with_suffix(".usdc").exists())


def finish_log(log: EventLogWriter, out: Path) -> Path:
    """Closes the log and gives it its final name, OUT.lcmlog."""
    log.close()
    return log.path.rename(out.with_suffix(".lcmlog"))


def working_path(out: Path) -> Path:
    return out.with_name(f"{out.stem}.recording.usdc")


def numbered(out: Path) -> Iterator[Path]:
    """OUT_001.usda, OUT_002.usda, ... without those of which there is a take or a log.

    Not OUT.001.usda: programs take such names for the frames of one sequence.
    """
    for number in itertools.count(1):
        path = out.with_name(f"{out.stem}_{number:0{_DIGITS}d}{out.suffix}")
        if not path.exists() and not path.with_suffix(".lcmlog").exists():
            yield path
