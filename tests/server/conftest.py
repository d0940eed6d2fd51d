"""Fixtures of the server's tests: the real binary on 127.0.0.1."""

from __future__ import annotations

import importlib
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType

import pytest
from server_support.client import Client, Connect
from server_support.process import ServerProcess, StartServer

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def messages(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    """The message types as lcm-gen makes them, in a package of their own beside the client's."""
    folder = tmp_path_factory.mktemp("messages")
    types = sorted((REPOSITORY / "server/messaging/types").glob("*.lcm"))
    generator = Path(sys.executable).parent / "lcm-gen"
    subprocess.run([generator, "-p", "--package-prefix", "generated", "--ppath", folder, *types], check=True)
    sys.path.insert(0, str(folder))
    return importlib.import_module("generated.layfigure")


@pytest.fixture
def start_server(binary: Path, character: Path) -> Iterator[StartServer]:
    """Starts a server with its own broker on a free port, unless options say otherwise."""
    with ExitStack() as stack:

        def start(*options: object) -> ServerProcess:
            bus = () if "--lcm-url" in options else ("--broker", "0")
            command = [str(binary), str(character), *bus, *map(str, options)]
            return stack.enter_context(ServerProcess(command))

        yield start


@pytest.fixture
def connect(messages: ModuleType) -> Connect:
    def connect_to(server: ServerProcess | str, prefix: str = "") -> Client:
        return Client(messages, server if isinstance(server, str) else server.url, prefix)

    return connect_to
