"""Fixtures of all tests that run the real server."""

from __future__ import annotations

import gc
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
DEFAULT_BINARY = REPOSITORY / "build/release/server/app/layfigure-server"


@pytest.fixture(scope="session", autouse=True)
def cache_of_the_tests(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What the server caches and keeps stays out of the user's own folders, and begins empty."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(scope="session")
def binary() -> Path:
    """The server: named by LAYFIGURE_SERVER, else where ./run test builds it."""
    path = Path(os.environ.get("LAYFIGURE_SERVER", DEFAULT_BINARY))
    assert path.is_file(), f"no server at {path}: build it, or name it in LAYFIGURE_SERVER"
    return path


@pytest.fixture(scope="session")
def character(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project's own small doll."""
    path = tmp_path_factory.mktemp("character") / "doll.glb"
    subprocess.run([sys.executable, REPOSITORY / "assets/make_doll.py", path], check=True)
    return path


@pytest.fixture(scope="session")
def own_network() -> tuple[str, ...]:
    """What a command begins with that runs in a network namespace of its own. Skips where there can be none."""
    if shutil.which("ip") is None:
        pytest.skip("needs the command ip, of iproute2")
    isolate = ("unshare", "-n" if os.geteuid() == 0 else "-rn")
    if subprocess.run([*isolate, "true"], capture_output=True, check=False).returncode != 0:
        pytest.skip("this machine does not allow network namespaces")
    return isolate


@pytest.fixture(autouse=True, scope="module")
def collected_garbage() -> Iterator[None]:
    """Subscribers and their buses are cycles, whose sockets stay open until they are collected."""
    yield
    gc.collect()
