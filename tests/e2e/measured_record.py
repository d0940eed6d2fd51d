"""`layfigure record`, that tells in JSON what it cost.

    python measured_record.py FIGURES.json RECORD_ARGUMENT...

`appends` to the working file, its `saves`, and `export`, of the USD files in the end: each of wall-clock and of CPU
time [s].
`memory_kb`: what is resident after each append, `poses`: how many there were, `peak_kb`: the most memory that ever was.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from layfigure.cli import main, record
from layfigure.take import TakeBuilder
from layfigure.usd.working_file import WorkingFile


def resident_kb() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() // 1024


def timed(function: Callable[..., Any], costs: list[tuple[float, float]], after: Callable[..., None]) -> Any:
    """`after` is told the arguments."""

    def call(*arguments: Any) -> Any:
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            return function(*arguments)
        finally:
            costs.append((time.perf_counter() - wall, time.process_time() - cpu))
            after(*arguments)

    return call


def run(figures: Path, arguments: list[str]) -> int:
    appends: list[tuple[float, float]] = []
    saves: list[tuple[float, float]] = []
    exports: list[tuple[float, float]] = []
    memory: list[int] = []
    poses: list[int] = []

    def note(_: WorkingFile, builder: TakeBuilder) -> None:
        memory.append(resident_kb())
        poses.append(builder.pose_count)

    WorkingFile._append = timed(WorkingFile._append, appends, note)  # type: ignore[method-assign]
    WorkingFile._save = timed(WorkingFile._save, saves, lambda _: None)  # type: ignore[method-assign]
    record.write = timed(record.write, exports, lambda *_: None)
    code = main.main(["record", *arguments])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    told = {
        "appends": appends,
        "saves": saves,
        "export": exports[-1] if exports else None,
        "memory_kb": memory,
        "poses": poses,
        "peak_kb": peak,
    }
    figures.write_text(json.dumps(told))
    return code


if __name__ == "__main__":
    sys.exit(run(Path(sys.argv[1]), sys.argv[2:]))
