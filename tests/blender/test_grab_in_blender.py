"""The mouse in Blender's views, without a window: each scene is a function of blender_support/in_bpy/grab_scenes.py."""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path

import pytest
from blender_support.bpy_process import REPOSITORY, SCRIPTS

pytestmark = pytest.mark.slow

SCRIPT = "grab_scenes.py"
WITHOUT_BPY = ("view", "drag", "picking", "pins", "replies", "grab", "strokes", "overlay_picture")


def scenes() -> list[str]:
    functions = [node for node in ast.parse((SCRIPTS / SCRIPT).read_text()).body if isinstance(node, ast.FunctionDef)]
    return [function.name for function in functions if function.name.startswith("scene_")]


@pytest.mark.parametrize("scene", scenes())
def test_grab(run_in_bpy: Callable[..., str], tmp_path: Path, scene: str) -> None:
    run_in_bpy(SCRIPT, scene, TMPDIR=str(tmp_path))


@pytest.mark.parametrize("module", WITHOUT_BPY)
def test_modules_that_are_tried_without_blender_do_not_need_it(module: str) -> None:
    source = (REPOSITORY / f"plugins/blender/layfigure_blender/{module}.py").read_text()
    for node in ast.walk(ast.parse(source)):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
        assert not {name.partition(".")[0] for name in names} & {"bpy", "bpy_extras", "mathutils", "gpu", "blf"}
