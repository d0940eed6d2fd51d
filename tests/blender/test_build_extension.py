"""What build_extension.py refuses to pack: one line that names what is off. No Blender and no network are needed."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
SCRIPT = Path("plugins/blender/build_extension.py")
TIMEOUT_S = 120.0


@pytest.fixture(scope="module")
def build_extension() -> ModuleType:
    specification = importlib.util.spec_from_file_location("build_extension", REPOSITORY / SCRIPT)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of what is read before anything is built."""
    left_out = shutil.ignore_patterns("__pycache__")
    shutil.copytree(REPOSITORY / "plugins/blender", tmp_path / "plugins/blender", ignore=left_out)
    (tmp_path / "client").mkdir()
    shutil.copy(REPOSITORY / "client/pyproject.toml", tmp_path / "client")
    return tmp_path


def refusal(checkout: Path, bpy_python: str = sys.executable) -> str:
    """The line on stderr of a build that fails."""
    command = [sys.executable, checkout / SCRIPT, bpy_python]
    result = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    assert result.returncode == 1
    assert result.stdout == ""
    assert not list(checkout.rglob("*.zip"))
    [line] = result.stderr.splitlines()
    return line


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_version_that_is_not_the_clients_is_refused(checkout: Path) -> None:
    edit(checkout / "plugins/blender/layfigure_blender/blender_manifest.toml", 'version = "0.1.0"', 'version = "0.0.9"')
    line = refusal(checkout)
    assert "blender_manifest.toml: version is 0.0.9, that of client/pyproject.toml 0.1.0" in line


def test_manifest_that_is_no_toml_is_refused_with_its_line(checkout: Path) -> None:
    edit(checkout / "plugins/blender/layfigure_blender/blender_manifest.toml", 'id = "layfigure"', "id = layfigure")
    line = refusal(checkout)
    assert "plugins/blender/layfigure_blender/blender_manifest.toml: " in line
    assert "line 3" in line


def test_python_without_bpy_is_refused_with_the_mend(checkout: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "bare"], check=True)
    assert "no package bpy of Blender 4.2 or later; install it: pip install" in refusal(
        checkout, str(tmp_path / "bare/bin/python")
    )


def test_python_that_is_not_there_is_refused(checkout: Path) -> None:
    line = refusal(checkout, "/no/such/python")
    assert "looking for bpy in /no/such/python" in line
    assert "No such file" in line


def test_wheel_with_other_content_is_refused(
    build_extension: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of the right name, but not what PyPI has."""
    monkeypatch.setenv("PIP_NO_INDEX", "1")  # it is not to be downloaded instead
    wheels, cache = tmp_path / "wheels", tmp_path / "cache"
    wheels.mkdir()
    cache.mkdir()
    (cache / "lcm-1.5.3-cp311-cp311-manylinux_2_28_x86_64.whl").write_bytes(b"PK\x05\x06" + bytes(18))  # an empty zip
    with pytest.raises(build_extension.BuildError, match=r"^downloading wheels for Python 3.11: .+"):
        build_extension.add_bundled_wheels(wheels, cache)
    assert not list(wheels.iterdir())


def test_wheels_that_the_manifest_does_not_name_are_refused(build_extension: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "layfigure-0.2.0-py3-none-any.whl").touch()
    manifest = {"wheels": ["./wheels/layfigure-0.1.0-py3-none-any.whl"]}
    expected = (
        r"wheels that are not there: layfigure-0\.1\.0-py3-none-any\.whl; "
        r"wheels that it does not name: layfigure-0\.2\.0-py3-none-any\.whl"
    )
    with pytest.raises(build_extension.BuildError, match=expected):
        build_extension.check_wheels(manifest, tmp_path)
