"""The mouse in Blender's views, without a window: scenes are functions of grab_scenes.py and device_scenes.py
in blender_support/in_bpy."""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path

import pytest
from blender_support.bpy_process import REPOSITORY, SCRIPTS

pytestmark = pytest.mark.slow

SCRIPTS_OF_SCENES = ("grab_scenes.py", "device_scenes.py")
WITHOUT_BPY = ("view", "drag", "picking", "pins", "replies", "grab", "strokes", "overlay_picture")


def scenes() -> list[tuple[str, str]]:
    return [
        (script, node.name)
        for script in SCRIPTS_OF_SCENES
        for node in ast.parse((SCRIPTS / script).read_text()).body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("scene_")
    ]


@pytest.mark.parametrize(("script", "scene"), scenes())
def test_grab(run_in_bpy: Callable[..., str], tmp_path: Path, script: str, scene: str) -> None:
    run_in_bpy(script, scene, TMPDIR=str(tmp_path))


@pytest.mark.parametrize("module", WITHOUT_BPY)
def test_modules_that_are_tried_without_blender_do_not_need_it(module: str) -> None:
    source = (REPOSITORY / f"plugins/blender/layfigure_blender/{module}.py").read_text()
    for node in ast.walk(ast.parse(source)):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
        assert not {name.partition(".")[0] for name in names} & {"bpy", "bpy_extras", "mathutils", "gpu", "blf"}
