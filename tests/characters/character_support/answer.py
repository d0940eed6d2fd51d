"""What the server says to a file, within bounded time and memory."""

from __future__ import annotations

import os
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

MOST_SECONDS = 120.0  # of CPU: the import's own limit is 20 s and some for the file's size; a bomb would take hours
MOST_KILOBYTES = 5 << 20  # the import's own limit is 4 GB


@dataclass(frozen=True)
class Answer:
    code: int
    stderr: str
    seconds: float  # of CPU
    kilobytes: int  # at most in memory


def inspect(binary: Path, file: Path) -> Answer:
    """Runs --inspect and checks what holds of every answer: one line that names the file, little time and memory."""
    before = time.monotonic()
    process = subprocess.Popen([binary, "--inspect", file], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    assert process.stderr is not None
    text = process.stderr.read().decode(errors="strict")
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    seconds = usage.ru_utime + usage.ru_stime
    assert seconds < MOST_SECONDS, f"{seconds:.0f} s of CPU, {time.monotonic() - before:.0f} s"
    assert usage.ru_maxrss < MOST_KILOBYTES
    if process.returncode != 0:
        assert process.returncode == 1, text
        assert text.count("\n") == 1, text
        assert str(file) in text
    return Answer(process.returncode, text, seconds, usage.ru_maxrss)
