"""The extension as an add-on of the old kind, for a Blender that is older than extensions.

What differs: a `bl_info` is appended to the package, and the wheels are unzipped where such a Blender looks for
modules. All else is the very package that goes into the extension.
"""

from __future__ import annotations

import shutil
import tomllib
import zipfile
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parents[4]
PACKAGE = REPOSITORY / "plugins/blender/layfigure_blender"
MODULE = "layfigure_blender"
OLDEST_BLENDER = (3, 4, 0)


def extension() -> Path:
    """Where ./run test builds the extension."""
    return REPOSITORY / f"build/blender/layfigure-{_manifest()['version']}.zip"


def install(scripts: Path, modules: Path) -> None:
    """Installs it into a folder of user scripts, $BLENDER_USER_SCRIPTS. It is still to be enabled."""
    manifest = _manifest()
    addon = scripts / "addons" / MODULE
    shutil.copytree(PACKAGE, addon, ignore=shutil.ignore_patterns("__pycache__", "wheels"))
    information = {
        "name": manifest["name"],
        "version": tuple(map(int, manifest["version"].split("."))),
        "blender": OLDEST_BLENDER,
        "category": manifest["tags"][0],
    }
    with (addon / "__init__.py").open("a") as module:
        module.write(f"\nbl_info = {information!r}\n")
    (scripts / "addons/modules").symlink_to(modules)  # which Blender puts on its path


def unzip_wheels(modules: Path, python_tag: str) -> bool:
    """Unzips the wheels of the extension for a Python, such as cp311. Tells whether it has any that are only for it."""
    of_the_python = 0
    with zipfile.ZipFile(extension()) as packed:
        for name in packed.namelist():
            if name.endswith(".whl") and ("-py3-" in name or f"-{python_tag}-" in name):
                of_the_python += "-py3-" not in name
                with packed.open(name) as wheel, zipfile.ZipFile(wheel) as unpacked:
                    unpacked.extractall(modules)
    return of_the_python > 0


def _manifest() -> dict[str, Any]:
    return tomllib.loads((PACKAGE / "blender_manifest.toml").read_text())
