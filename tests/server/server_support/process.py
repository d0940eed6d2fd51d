"""layfigure-server as a process."""

from __future__ import annotations

import contextlib
import os
import random
import socket
import subprocess
from collections.abc import Callable
from pathlib import Path

TIMEOUT_S = 30.0  # for a machine under load; never waited for in a test that passes
GREETING = "listening on "
NEVER_GIVEN_PORTS = range(20_000, 32_000)  # Linux gives from 32768 on, other systems from 49152


class ServerProcess:
    """A running server; `url` is where it listens. Ends with the `with` block."""

    def __init__(self, command: list[str], environment: dict[str, str] | None = None) -> None:
        self.process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, **(environment or {})},
        )
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line.startswith(GREETING):
            _, error = self.process.communicate(timeout=TIMEOUT_S)
            raise RuntimeError(f"the server did not start: {line}{error}")
        self.url = line.removeprefix(GREETING).strip()

    def __enter__(self) -> ServerProcess:
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()

    def wait(self) -> tuple[int, str]:
        """Exit code and what was written on stderr."""
        _, error = self.process.communicate(timeout=TIMEOUT_S)
        return self.process.returncode, error


def keepable_port() -> int:
    """A free port for a server that is started again on it.

    Not one of those that the kernel gives to others' connections: such a one may have an owner by then.
    """
    with socket.socket() as listener:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        for port in random.sample(NEVER_GIVEN_PORTS, len(NEVER_GIVEN_PORTS)):
            with contextlib.suppress(OSError):
                listener.bind(("127.0.0.1", port))
                return port
    raise RuntimeError("no port is free")


StartServer = Callable[..., ServerProcess]  # (option, ...)


def run_server(binary: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    """For a command line that ends by itself."""
    command = [str(binary), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
