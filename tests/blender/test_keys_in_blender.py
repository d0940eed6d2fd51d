"""Keys, recordings, reduced keys, and the doll's history beside Blender's, on a live doll in Blender.

Each scene is a function of a script of blender_support/in_bpy, in a Blender of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from blender_support.bpy_process import scenes_of

pytestmark = pytest.mark.slow


SCENES = scenes_of("key_scenes.py", "recording_scenes.py", "history_scenes.py", "reduction_scenes.py")


@pytest.mark.parametrize(("script", "scene"), SCENES)
def test_keys(run_in_bpy: Callable[..., str], character: Path, tmp_path: Path, script: str, scene: str) -> None:
    places = {"TMPDIR": str(tmp_path), "XDG_STATE_HOME": str(tmp_path)}
    run_in_bpy(script, scene, tmp_path, LAYFIGURE_TEST_DOLL=str(character), **places)


@pytest.mark.parametrize("rig", ["metarig", "mixamo", "game_engine"])
def test_keys_on_rigs_of_other_makers(
    run_in_bpy: Callable[..., str], make_human_rig: Callable[[str], Path], tmp_path: Path, rig: str
) -> None:
    glb = () if rig == "metarig" else (make_human_rig(rig),)
    print(run_in_bpy("rig_keys.py", rig, *glb, TMPDIR=str(tmp_path), XDG_STATE_HOME=str(tmp_path)))
