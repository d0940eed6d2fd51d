"""A Blender with a window on a display of its own, with the extension installed but not enabled."""

from __future__ import annotations

import contextlib
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from window_support import legacy_addon
from window_support.display import Display
from window_support.window import BlenderWindow, OpenBlender, missing_tools

SCREENSHOTS = Path(__file__).resolve().parents[3] / "build/blender/screenshots"
VERSION_TIMEOUT_S = 120.0  # for a machine under load; never waited for in a test that passes
SHOW_VERSION = "import sys; print('Python', *sys.version_info[:2])"


@pytest.fixture(scope="session")
def modules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What the extension bundles, unzipped for the Python of this machine's Blender."""
    if missing := missing_tools():
        pytest.skip(f"needs the Debian packages blender, xvfb and xdotool: there is no {', '.join(missing)}")
    command = ["blender", "--background", "--factory-startup", "--python-expr", SHOW_VERSION]
    shown = subprocess.run(command, capture_output=True, text=True, timeout=VERSION_TIMEOUT_S, check=True).stdout
    python = next(line.split()[1:] for line in shown.splitlines() if line.startswith("Python "))
    if not legacy_addon.extension().is_file():
        pytest.skip(f"needs {legacy_addon.extension()}: ./run test builds it")
    folder = tmp_path_factory.mktemp("modules")
    if not legacy_addon.unzip_wheels(folder, "cp" + "".join(python)):
        pytest.skip(f"the extension has no wheels for Blender's Python {'.'.join(python)}")
    return folder


@pytest.fixture
def open_blender(modules: Path, binary: Path, tmp_path: Path) -> Iterator[OpenBlender]:
    """Opens as many as are asked for, each with display and settings of its own; they find the server on PATH.

    A test fails if one of them ended, or printed a traceback.
    """
    windows: list[BlenderWindow] = []
    environment = {"PATH": f"{binary.parent}{os.pathsep}{os.environ['PATH']}"}
    with contextlib.ExitStack() as stack:

        def open_one() -> BlenderWindow:
            folder = tmp_path / f"blender_{len(windows)}"
            legacy_addon.install(folder / "scripts", modules)
            display = stack.enter_context(Display(folder))
            window = stack.enter_context(BlenderWindow(display, folder, SCREENSHOTS, environment))
            windows.append(window)
            return window

        yield open_one
        for window in windows:
            print(window.log())
            assert window.ask("True")
            assert "Traceback" not in window.log()


@pytest.fixture
def blender(open_blender: OpenBlender) -> BlenderWindow:
    return open_blender()
