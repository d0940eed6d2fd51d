"""A load that takes long says on a terminal what it is doing, and leaves the terminal as it was."""

from __future__ import annotations

import errno
import os
import pty
import subprocess
from pathlib import Path

import pytest
from character_support.many_bones import FORMATS

BONES = 20_000  # which assimp's reader of SMD takes many seconds for, its time growing with the square; told after one
START_OF_LINE = b"\r\x1b[K"  # and wipe it


@pytest.fixture
def slow_file(tmp_path: Path) -> Path:
    return FORMATS["smd"](tmp_path, BONES)


def read_all(terminal: int) -> bytes:
    """What was written to a terminal whose other end is closed by now, or will be."""
    text = b""
    while True:
        try:
            block = os.read(terminal, 4096)
        except OSError as error:
            if error.errno != errno.EIO:  # Linux: all writers have gone
                raise
            return text
        if not block:
            return text
        text += block


def test_long_load_is_told_on_a_terminal(binary: Path, slow_file: Path) -> None:
    ours, theirs = pty.openpty()
    process = subprocess.Popen([binary, "--inspect", slow_file], stdout=subprocess.DEVNULL, stderr=theirs)
    os.close(theirs)
    text = read_all(ours)
    os.close(ours)
    assert process.wait() == 1
    lines = text.split(START_OF_LINE)
    assert lines[0] == b""
    assert lines[1] == b"reading bones.smd, 1 s"
    assert lines[-2].startswith(b"reading bones.smd, ")
    assert lines[-1].startswith(b"layfigure-server: character ")  # on the line that was wiped
    assert lines[-1].count(b"\n") == 1


def test_long_load_is_not_told_to_a_pipe(binary: Path, slow_file: Path) -> None:
    done = subprocess.run([binary, "--inspect", slow_file], capture_output=True, check=False)
    assert done.returncode == 1
    assert b"reading" not in done.stderr
    assert done.stderr.count(b"\n") == 1
