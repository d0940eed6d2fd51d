"""Scripts that run inside Blender's own Python, which has the package bpy."""

from __future__ import annotations

import ast
import os
import subprocess
import tempfile
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[3]
SCRIPTS = Path(__file__).parent / "in_bpy"
RUN_SCRIPT = Path(__file__).parent / "run_script.py"
TIMEOUT_S = 900.0  # for a machine under load; never waited for in a test that passes


def bpy_pythons() -> list[Path]:
    """Those that LAYFIGURE_BPY_PYTHON names, with colons between them."""
    return [Path(path) for path in os.environ.get("LAYFIGURE_BPY_PYTHON", "").split(os.pathsep) if path]


def scenes_of(*scripts: str) -> list[tuple[str, str]]:
    """Script and function of all scenes of these scripts: functions that take a folder alone."""
    return [
        (script, node.name)
        for script in scripts
        for node in ast.parse((SCRIPTS / script).read_text()).body
        if isinstance(node, ast.FunctionDef)
        and [ast.unparse(argument.annotation) for argument in node.args.args if argument.annotation] == ["Path"]
    ]


class BpyPython:
    """A Python with bpy; `server` is what the extension finds as layfigure-server."""

    def __init__(self, path: Path, server: Path) -> None:
        self.path = path
        self._server = server

    def has(self, *modules: str) -> bool:
        command = [self.path, "-c", f"import {', '.join(modules)}"]
        return subprocess.run(command, capture_output=True, check=False).returncode == 0

    def run(self, script: str, *arguments: object, **environment: str) -> str:
        """Runs a script of in_bpy, in which client and extension can be imported. Returns what it printed.

        A script that fails, or hangs, is an AssertionError with all that it said.
        """
        paths = (REPOSITORY / "client/src", REPOSITORY / "plugins/blender", SCRIPTS)
        command = [str(self.path), str(RUN_SCRIPT), str(SCRIPTS / script), *map(str, arguments)]
        with tempfile.TemporaryDirectory() as folder:
            surroundings = {
                **os.environ,
                "PATH": f"{self._server.parent}{os.pathsep}{os.environ['PATH']}",
                "PYTHONPATH": os.pathsep.join(map(str, paths)),
                "TMPDIR": folder,
                **environment,
            }
            done = subprocess.run(
                command, env=surroundings, capture_output=True, text=True, timeout=TIMEOUT_S, check=False
            )
        assert done.returncode == 0, f"{script} {arguments}:\n{done.stdout}\n{done.stderr}"
        return done.stdout
