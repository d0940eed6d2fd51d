"""Fixtures of the end-to-end tests: the real server and the real client as processes, on 127.0.0.1."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from e2e_support import NO_DEFAULT_BUS, REPOSITORY, ClientProcess, RunClient, StartClient, client_command

sys.path.append(str(REPOSITORY / "tests/server"))  # one way to start a server for all tests
sys.path.append(str(REPOSITORY / "tests/client"))  # and to compare takes
from server_support.process import ServerProcess, StartServer


@pytest.fixture(scope="session")
def session() -> Path:
    return REPOSITORY / "assets/sessions/doll.toml"


@pytest.fixture
def start_server(binary: Path, character: Path) -> Iterator[StartServer]:
    """Starts a server of the doll with its own broker on a free port, unless other options say otherwise."""
    with ExitStack() as stack:

        def start(*options: object) -> ServerProcess:
            bus = [] if "--broker" in options or "--lcm-url" in options else ["--broker", "0"]
            return stack.enter_context(ServerProcess([str(binary), str(character), *bus, *map(str, options)]))

        yield start


@pytest.fixture
def start_client(tmp_path: Path) -> Iterator[StartClient]:
    """Starts `layfigure` in the test's folder."""
    with ExitStack() as stack:
        yield lambda *arguments: stack.enter_context(ClientProcess(tmp_path, arguments))


@pytest.fixture
def client(tmp_path: Path) -> RunClient:
    """Runs `layfigure` in the test's folder to its end."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            client_command(arguments),
            cwd=tmp_path,
            env={**os.environ, **NO_DEFAULT_BUS},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )

    return run
