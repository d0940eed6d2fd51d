"""The wheel of client/, built and installed without the network, in an environment of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
BUILD_TIMEOUT_S = 300.0
OFFLINE = ("--no-deps", "--no-index", "--disable-pip-version-check", "--quiet")


def run(*command: object, **environment: str) -> str:
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    result = subprocess.run(
        list(map(str, command)),
        env={**clean, **environment},
        capture_output=True,
        text=True,
        timeout=BUILD_TIMEOUT_S,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy of what it takes, so that the checkout stays as it is."""
    checkout = tmp_path_factory.mktemp("checkout")
    left_out = shutil.ignore_patterns("messages", "build", "*.egg-info", "__pycache__")
    shutil.copytree(REPOSITORY / "client", checkout / "client", ignore=left_out)
    shutil.copytree(REPOSITORY / "server/messaging/types", checkout / "server/messaging/types")
    build = (sys.executable, "-m", "pip", "wheel", "--no-build-isolation", *OFFLINE)
    run(*build, "--wheel-dir", checkout / "wheels", checkout / "client")
    [wheel] = (checkout / "wheels").iterdir()
    return wheel


def test_wheel_holds_the_types_the_messages_and_the_commands(wheel: Path) -> None:
    assert wheel.name.startswith("layfigure-")
    names = zipfile.ZipFile(wheel).namelist()
    for name in ("py.typed", "doll.py", "usd/writer.py", "messages/pose_t.py"):
        assert f"layfigure/{name}" in names
    assert not [name for name in names if name.startswith(("tests", "examples"))]


def test_wheel_in_a_fresh_environment_gives_command_and_package(wheel: Path, tmp_path: Path) -> None:
    """What it depends on is taken from the environment of the tests."""
    run(sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv")
    python = tmp_path / "venv/bin/python"
    run(sys.executable, "-m", "pip", "--python", python, "install", *OFFLINE, wheel)
    dependencies = sysconfig.get_path("platlib")
    where = run(python, "-c", "import layfigure; print(layfigure.__file__)", PYTHONPATH=dependencies)
    assert where.startswith(str(tmp_path))
    command = tmp_path / "venv/bin/layfigure"
    assert run(command, "--version", PYTHONPATH=dependencies) == "layfigure 0.1.0\n"
    assert "layfigure record take.usda" in run(command, "record", "--help", PYTHONPATH=dependencies)
    run(python, "-c", "import layfigure.codec, layfigure.usd.writer", PYTHONPATH=dependencies)
