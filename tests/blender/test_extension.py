"""The extension as it is built: what is in the zip, and that Blender installs, enables, disables and removes it."""

from __future__ import annotations

import ast
import json
import subprocess
import tomllib
import zipfile
from pathlib import Path
from typing import Any

import pytest
from blender_support.bpy_process import BpyPython

REPOSITORY = Path(__file__).resolve().parents[2]
INSTALL_SCRIPT = Path(__file__).parent / "blender_support/install_extension.py"
LONGEST_REASON = 64  # letters that Blender shows of a permission's reason, and of a tagline
TIMEOUT_S = 300.0  # for a machine under load; never waited for in a test that passes

Installation = dict[str, dict[str, Any]]


@pytest.fixture(scope="module")
def extension() -> Path:
    manifest = tomllib.loads((REPOSITORY / "plugins/blender/layfigure_blender/blender_manifest.toml").read_text())
    path = REPOSITORY / f"build/blender/{manifest['id']}-{manifest['version']}.zip"
    if not path.is_file():
        pytest.skip(f"no {path}: ./run test builds it, with plugins/blender/build_extension.py")
    return path


@pytest.fixture(scope="module")
def installation(bpy_python: BpyPython, extension: Path, tmp_path_factory: pytest.TempPathFactory) -> Installation:
    """What a Blender that never saw it before has, step by step."""
    folder = tmp_path_factory.mktemp("install")
    (folder / "resources").mkdir()
    environment = {"BLENDER_USER_RESOURCES": str(folder / "resources"), "PATH": "/usr/bin:/bin"}
    command = [bpy_python.path, INSTALL_SCRIPT, extension, folder / "states.json"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    states: Installation = json.loads((folder / "states.json").read_text())
    return states


def test_zip_has_the_package_its_licence_and_wheels_and_nothing_else(extension: Path) -> None:
    with zipfile.ZipFile(extension) as packed:
        names = set(packed.namelist())
        manifest = tomllib.loads(packed.read("blender_manifest.toml").decode())
        assert "GNU GENERAL PUBLIC LICENSE" in packed.read("LICENSE").decode()
    package = REPOSITORY / "plugins/blender/layfigure_blender"
    modules = {path.relative_to(package).as_posix() for path in package.rglob("*.py")}
    wheels = {wheel.removeprefix("./") for wheel in manifest["wheels"]}
    assert names == modules | wheels | {"blender_manifest.toml", "LICENSE"}


def test_no_operator_is_called_in_a_context_that_python_lends() -> None:
    """Blender up to 5.0, with Python 3.11, crashes so beside a thread that runs Python, as each link has one: while an
    operator is called under temp_override(), the context is asked of Python without the interpreter's lock."""
    modules = (REPOSITORY / "plugins/blender/layfigure_blender").rglob("*.py")
    calls = [
        node for path in modules for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Attribute)
    ]
    assert {"ops", "record_watch"} <= {node.attr for node in calls}
    assert "temp_override" not in {node.attr for node in calls}


def test_manifest_says_what_it_needs_in_the_letters_that_blender_shows(extension: Path) -> None:
    with zipfile.ZipFile(extension) as packed:
        manifest = tomllib.loads(packed.read("blender_manifest.toml").decode())
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"]
    assert manifest["platforms"] == ["linux-x64"]
    assert set(manifest["permissions"]) == {"files", "network"}
    for text in (manifest["tagline"], *manifest["permissions"].values()):
        assert len(text) <= LONGEST_REASON
        assert text[-1].isalnum()


def test_wheels_are_for_the_pythons_of_all_blenders(extension: Path) -> None:
    with zipfile.ZipFile(extension) as packed:
        manifest = tomllib.loads(packed.read("blender_manifest.toml").decode())
    tags = [wheel.rsplit("/", 1)[-1].removesuffix(".whl").split("-")[-3:] for wheel in manifest["wheels"]]
    assert {python for python, _, _ in tags} == {"py3", "cp311", "cp313"}
    for _, _, platform in tags:
        assert platform == "any" or platform.endswith("_x86_64")


def test_package_imports_its_own_modules_by_relative_names_alone() -> None:
    """It is installed as bl_ext.user_default.layfigure; another name finds it nowhere but in a checkout."""
    package = REPOSITORY / "plugins/blender/layfigure_blender"
    for path in package.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) and node.level == 0 else []
            assert not [name for name in names if name.partition(".")[0] == "layfigure_blender"], path


def test_installing_enables_it_with_its_wheels(installation: Installation) -> None:
    before, installed = installation["before"], installation["installed"]
    assert before["types"] == []
    assert before["modules"] == []
    assert installed["enabled"] == [True, True]
    assert "LAYFIGURE_OT_start" in installed["types"]
    assert installed["on_objects"]
    assert {"layfigure", "lcm"} <= set(installed["modules"])
    assert ".local/lib/python3.11/site-packages/layfigure/" in installed["layfigure"]


def test_disabling_leaves_nothing_behind_and_enabling_brings_it_back(installation: Installation) -> None:
    disabled = installation["disabled"]
    assert disabled["enabled"] == [False, False]
    assert disabled["types"] == []
    assert not disabled["on_objects"]
    assert disabled["modules"] == []
    assert installation["enabled"]["types"] == installation["installed"]["types"]


def test_removing_it_takes_its_files_away(installation: Installation) -> None:
    removed = installation["removed"]
    assert removed["types"] == []
    assert removed["files"] == []
    assert removed["modules"] == []
