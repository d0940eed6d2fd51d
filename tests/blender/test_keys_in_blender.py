"""Keys, recordings, reduced keys, and the doll's history beside Blender's, on a live doll in Blender.

Each scene is a function of blender_support/in_bpy/key_scenes.py, in a Blender of its own.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path

import pytest
from blender_support.bpy_process import SCRIPTS

pytestmark = pytest.mark.slow


def scenes() -> list[str]:
    """All functions that take a folder alone."""
    script = ast.parse((SCRIPTS / "key_scenes.py").read_text())
    return [
        node.name
        for node in script.body
        if isinstance(node, ast.FunctionDef)
        and [ast.unparse(argument.annotation) for argument in node.args.args if argument.annotation] == ["Path"]
    ]


@pytest.mark.parametrize("scene", scenes())
def test_keys(run_in_bpy: Callable[..., str], character: Path, tmp_path: Path, scene: str) -> None:
    places = {"TMPDIR": str(tmp_path), "XDG_STATE_HOME": str(tmp_path)}
    run_in_bpy("key_scenes.py", scene, tmp_path, LAYFIGURE_TEST_DOLL=str(character), **places)
