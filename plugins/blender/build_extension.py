#!/usr/bin/env python3
"""Builds the Blender extension, build/blender/layfigure-VERSION.zip, to be dropped into Blender's window.

    build/venv/bin/python plugins/blender/build_extension.py build/bpy/bin/python

The argument is a Python with the package bpy, whose own tool for extensions, blender_ext.py, validates and packs; no
Blender is run. The environment that runs this script needs pip, setuptools and lcm, as build/venv has them.

What is packed: layfigure_blender/ and the wheels that its manifest names. Those of bundled_wheels.txt come from PyPI,
once, and are packed as they are, which their hashes prove; the client's is built from client/. If anything is off, the
exit code is 1 with one line on stderr, and nothing is written.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

PLUGIN = Path(__file__).resolve().parent
REPOSITORY = PLUGIN.parents[1]
PACKAGE = PLUGIN / "layfigure_blender"
MANIFEST = "blender_manifest.toml"
BUNDLED_WHEELS = PLUGIN / "bundled_wheels.txt"
BLENDER_PYTHONS = ("3.11", "3.13")  # 4.2 to 5.0, and from 5.1 on
PLATFORM = "manylinux_2_28_x86_64"
TIMEOUT_S = 600.0  # of one step; a download takes the longest

PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")


class BuildError(Exception):
    """What is off, in one line."""


def run(what: str, *command: str | Path) -> str:
    """The output of a command. Raises BuildError with the last line of its complaints."""
    try:
        result = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise BuildError(f"{what}: {error}") from error
    if result.returncode != 0:
        lines = [line.strip() for line in (result.stderr or result.stdout).splitlines() if line.strip()]
        raise BuildError(f"{what}: {lines[-1] if lines else f'exit code {result.returncode}'}")
    return result.stdout


def read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text())
    except (OSError, tomllib.TOMLDecodeError) as error:
        raise BuildError(f"{path.relative_to(REPOSITORY)}: {error}") from error


def checked_manifest() -> dict[str, Any]:
    """The manifest, whose version is the client's: they speak the same protocol and are released together."""
    manifest = read_toml(PACKAGE / MANIFEST)
    client = read_toml(REPOSITORY / "client/pyproject.toml")["project"]["version"]
    if manifest.get("version") != client:
        raise BuildError(f"{MANIFEST}: version is {manifest.get('version')}, that of client/pyproject.toml {client}")
    return manifest


def find_blender_tool(bpy_python: Path) -> Path:
    """blender_ext.py of the package bpy, which is found without importing it."""
    program = "import importlib.util as u; s = u.find_spec('bpy'); print(s.submodule_search_locations[0] if s else '')"
    folder = run(f"looking for bpy in {bpy_python}", bpy_python, "-c", program).strip()
    tools = sorted(Path(folder).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")) if folder else []
    if not tools:
        raise BuildError(f"{bpy_python}: no package bpy of Blender 4.2 or later; install it: pip install bpy==5.0.1")
    return tools[-1]


def add_bundled_wheels(wheels: Path, cache: Path) -> None:
    """Copies the wheels from PyPI, which pip checks against their hashes; what the cache lacks is downloaded."""
    for version in BLENDER_PYTHONS:
        download: tuple[str | Path, ...] = (
            *(*PIP, "download", "--no-deps", "--require-hashes", "--only-binary", ":all:"),
            *("--platform", PLATFORM, "--python-version", version, "--requirement", BUNDLED_WHEELS),
        )
        from_cache = ("--no-index", "--find-links", cache, "--dest", wheels)
        try:
            run(f"taking wheels from {cache}", *download, *from_cache)
        except BuildError:
            run(f"downloading wheels for Python {version}", *download, "--dest", cache)
            run(f"taking wheels from {cache}", *download, *from_cache)


def add_client_wheel(wheels: Path) -> None:
    """Builds client/ from a copy of what it takes, so that neither the checkout nor what is left in it matters."""
    left_out = shutil.ignore_patterns("messages", "build", "*.egg-info", "__pycache__")
    with tempfile.TemporaryDirectory() as folder:
        checkout = Path(folder)
        shutil.copytree(REPOSITORY / "client", checkout / "client", ignore=left_out)
        shutil.copytree(REPOSITORY / "server/messaging/types", checkout / "server/messaging/types")
        offline = ("--no-deps", "--no-index", "--no-build-isolation")
        run("building client/", *PIP, "wheel", *offline, "--wheel-dir", wheels, checkout / "client")


def check_wheels(manifest: dict[str, Any], wheels: Path) -> None:
    """The wheels that are there are those that the manifest names: Blender packs only these, and installs no others."""
    named = {Path(wheel).name for wheel in manifest.get("wheels", [])}
    there = {wheel.name for wheel in wheels.iterdir()}
    if named != there:
        missing = ", ".join(sorted(named - there)) or "none"
        unnamed = ", ".join(sorted(there - named)) or "none"
        raise BuildError(f"{MANIFEST}: wheels that are not there: {missing}; wheels that it does not name: {unnamed}")


def build(bpy_python: Path, out: Path, cache: Path) -> Path:
    """Builds and validates the extension in the folder `out` and returns it; downloads are kept in `cache`."""
    manifest = checked_manifest()
    tool = find_blender_tool(bpy_python)
    with tempfile.TemporaryDirectory() as folder:
        stage, packed = Path(folder) / "layfigure", Path(folder) / "packed"
        shutil.copytree(PACKAGE, stage, ignore=shutil.ignore_patterns("__pycache__", "wheels"))
        for new in (stage / "wheels", packed, cache, out):
            new.mkdir(parents=True, exist_ok=True)
        add_bundled_wheels(stage / "wheels", cache)
        add_client_wheel(stage / "wheels")
        check_wheels(manifest, stage / "wheels")
        blender_ext = (sys.executable, tool)
        run("validating the manifest", *blender_ext, "validate", stage)
        run("packing the extension", *blender_ext, "build", "--source-dir", stage, "--output-dir", packed)
        [extension] = packed.glob("*.zip")
        run("validating the extension", *blender_ext, "validate", extension)
        return Path(shutil.move(extension, out / extension.name))


def main() -> int:
    parser = argparse.ArgumentParser(description=str(__doc__).partition("\n")[0])
    parser.add_argument("bpy_python", type=Path, help="a Python with the package bpy of Blender 4.2 or later")
    parser.add_argument("--out", type=Path, default=REPOSITORY / "build/blender", help="folder of the zip")
    parser.add_argument(
        "--cache", type=Path, default=REPOSITORY / "build/downloads/blender-wheels", help="folder of what is downloaded"
    )
    given = parser.parse_args()
    try:
        print(build(given.bpy_python.absolute(), given.out, given.cache))
    except (BuildError, OSError) as error:
        print(f"{Path(sys.argv[0]).name}: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
