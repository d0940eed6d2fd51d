"""Joint properties inside Blender's Python, without and with a live doll: each check of in_bpy/joint_checks.py and
in_bpy/joint_live_checks.py is a test here.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from blender_support.bpy_process import SCRIPTS

STILL, LIVE = "joint_checks.py", "joint_live_checks.py"
Results = dict[str, str]  # what checks raised, by their names

pytestmark = pytest.mark.slow


def names_of(script: str) -> list[str]:
    return re.findall(r"^@check\ndef (\w+)", (SCRIPTS / script).read_text(), re.MULTILINE)


def results_of(run: Callable[..., str], script: str, folder: Path, *arguments: Path) -> Results:
    out = folder / "results.json"
    run(script, out, folder, *arguments, TMPDIR=str(folder))
    results: Results = json.loads(out.read_text())
    return results


@pytest.fixture(scope="session")
def still(run_in_bpy: Callable[..., str], tmp_path_factory: pytest.TempPathFactory) -> Results:
    return results_of(run_in_bpy, STILL, tmp_path_factory.mktemp("joints"))


@pytest.fixture(scope="session")
def live(run_in_bpy: Callable[..., str], character: Path, tmp_path_factory: pytest.TempPathFactory) -> Results:
    return results_of(run_in_bpy, LIVE, tmp_path_factory.mktemp("live_joints"), character)


@pytest.mark.parametrize("name", [*names_of(STILL), "nothing_is_left_behind"])
def test_in_blender(name: str, still: Results) -> None:
    assert still[name] == ""


@pytest.mark.parametrize("name", names_of(LIVE))
def test_with_a_live_doll(name: str, live: Results) -> None:
    assert live[name] == ""
