"""The command `layfigure` as a process."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable

Cli = Callable[..., "subprocess.CompletedProcess[str]"]


def cli_command(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "layfigure", *map(str, arguments)]


def cli_environment() -> dict[str, str]:
    """Without a bus by default: a test that forgets its URL must not find somebody else's server."""
    return {**os.environ, "LCM_DEFAULT_URL": "memq://", "MPLBACKEND": "Agg"}


def assert_one_line_error(result: subprocess.CompletedProcess[str], code: int, *words: str) -> None:
    """The error is one line that holds `words`, nothing is on stdout, and no traceback is anywhere."""
    assert result.returncode == code, result.stderr
    assert result.stdout == ""
    assert len(result.stderr.splitlines()) == 1, result.stderr
    for word in words:
        assert word in result.stderr
