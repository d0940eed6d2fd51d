"""Fixtures of the client's tests: all on in-process buses or 127.0.0.1, none needs a server."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from client_support.broker import Broker
from client_support.cli import Cli, cli_command, cli_environment
from client_support.looks import picture, textured_meshes
from client_support.scripted_server import ScriptedServer
from client_support.takes import make_builder, make_take, make_take_of

from layfigure.bus import Bus
from layfigure.take import Take, TakeBuilder

CLI_TIMEOUT_S = 60.0


@pytest.fixture(scope="session")
def take() -> Take:
    return make_take()


@pytest.fixture
def painted() -> Take:
    """Its texture is a picture of the character's file."""
    return make_take_of(textured_meshes(image=picture()))


@pytest.fixture
def builder() -> TakeBuilder:
    return make_builder()


@pytest.fixture
def bus() -> Iterator[Bus]:
    with Bus("memq://") as bus:
        yield bus


@pytest.fixture
def server(bus: Bus) -> ScriptedServer:
    """On the same in-process bus as the client: it answers inside the client's own polls."""
    return ScriptedServer(bus)


@pytest.fixture
def broker() -> Iterator[Broker]:
    with Broker() as broker:
        yield broker


@pytest.fixture
def cli(tmp_path: Path) -> Cli:
    """Runs `layfigure` with its arguments in a folder of its own."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            cli_command(*arguments),
            cwd=tmp_path,
            env=cli_environment(),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=CLI_TIMEOUT_S,
            check=False,
        )

    return run
