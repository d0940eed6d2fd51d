"""Sessions in Blender: what they take, what they leave alone, and what may happen to them.

Each scene is a function of a script of blender_support/in_bpy, in a Blender of its own.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from blender_support.bpy_process import REPOSITORY, scenes_of

pytestmark = pytest.mark.slow

WITHOUT_BPY = (
    "background",
    "doll_inspection",
    "joint_sender",
    "joint_settings",
    "joint_values",
    "link",
    "pushing",
    "rig",
    "server",
    "settings_file",
    "transfer",
)


SCENES = scenes_of("start_scenes.py", "session_scenes.py", "fault_scenes.py")


@pytest.mark.parametrize(("script", "scene"), SCENES)
def test_session(run_in_bpy: Callable[..., str], tmp_path: Path, script: str, scene: str) -> None:
    run_in_bpy(script, scene, tmp_path, TMPDIR=str(tmp_path))


def test_two_blenders_have_a_doll_each(run_in_bpy: Callable[..., str], tmp_path: Path) -> None:
    scene = "pose_mode_and_object_mode_are_alike"
    with ThreadPoolExecutor() as pool:
        both = [pool.submit(run_in_bpy, "session_scenes.py", scene, tmp_path) for _ in range(2)]
        for each in both:
            each.result()


@pytest.mark.parametrize("module", WITHOUT_BPY)
def test_modules_that_threads_run_do_not_import_bpy(module: str) -> None:
    source = REPOSITORY / f"plugins/blender/layfigure_blender/{module}.py"
    imported = set()
    for node in ast.walk(ast.parse(source.read_text())):
        if isinstance(node, ast.Import):
            imported |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            own = {alias.name for alias in node.names} if node.module is None else {node.module.partition(".")[0]}
            imported |= own
    assert not imported & {"bpy", "bmesh", "mathutils", "gpu"}
    own_modules = {path.stem for path in source.parent.glob("*.py")}
    assert imported & own_modules <= set(WITHOUT_BPY)
