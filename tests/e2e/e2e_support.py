"""The command `layfigure` as a process."""

from __future__ import annotations

import contextlib
import importlib.util
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType

from layfigure.errors import LayfigureError
from layfigure.take import Take
from layfigure.take_collector import read_take

REPOSITORY = Path(__file__).resolve().parents[2]
LCM_DEVICE = REPOSITORY / "assets/lcm_device.py"
TIMEOUT_S = 60.0  # for a machine under load; never waited for in a test that passes


def client_command(arguments: Sequence[object]) -> list[str]:
    return [sys.executable, "-m", "layfigure", *map(str, arguments)]


# Without a bus by default: a test that forgets its URL must not find somebody else's server.
NO_DEFAULT_BUS = {"LCM_DEFAULT_URL": "memq://"}


class ClientProcess:
    """A running client. Ends with the `with` block."""

    def __init__(
        self, folder: Path, arguments: Sequence[object], environment: Mapping[str, str] = NO_DEFAULT_BUS
    ) -> None:
        self.process = subprocess.Popen(
            client_command(arguments),
            cwd=folder,
            env={**os.environ, **environment},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> ClientProcess:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def error_line(self) -> str:
        """The next line on stderr."""
        assert self.process.stderr is not None
        return str(self.process.stderr.readline())

    def finish(self, number: int | None = None) -> tuple[int, str, str]:
        """Exit code, stdout and the rest of stderr, after a signal if one is given."""
        if number is not None:
            self.process.send_signal(number)
        output, errors = self.process.communicate(timeout=TIMEOUT_S)
        return self.process.returncode, output, errors


def wait_for_poses(log: Path, count: int) -> None:
    """Until the take in a recorder's log has `count` poses."""
    _wait_for(log, lambda take: len(take.times_us) >= count)


def wait_for_hold(log: Path, holds: bool) -> None:
    """Until the newest force in a recorder's log is that of a pointer that holds something, or does not."""
    _wait_for(log, lambda take: bool(take.pointers) and take.pointers[0].attached[-1] == holds)


def _wait_for(log: Path, condition: Callable[[Take], bool]) -> None:
    deadline = time.monotonic() + TIMEOUT_S
    while time.monotonic() < deadline:
        with contextlib.suppress(LayfigureError):  # the log is not there, or holds no pose yet
            if condition(read_take(log)):
                return
        time.sleep(0.05)
    raise AssertionError(f"{log.name} did not get there")


StartClient = Callable[..., ClientProcess]  # (argument, ...)
RunClient = Callable[..., "subprocess.CompletedProcess[str]"]  # (argument, ...)


def load_lcm_device() -> ModuleType:
    """The example of a device on the bus, as a module."""
    specification = importlib.util.spec_from_file_location("lcm_device", LCM_DEVICE)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module
