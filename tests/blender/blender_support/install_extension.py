"""Runs inside Blender's own Python (package bpy): installs an extension as dropping it into the window does.

    BLENDER_USER_RESOURCES=AN_EMPTY_FOLDER python install_extension.py EXTENSION.zip OUT.json

OUT.json tells what Blender has after each step: "installed", "disabled", "enabled", "removed".
"""

import importlib
import json
import sys
from pathlib import Path

import bpy  # before addon_utils, which it makes importable

import addon_utils  # isort: skip

REPOSITORY = "user_default"
MODULE = f"bl_ext.{REPOSITORY}.layfigure"


def state() -> dict:
    own = [name for name in dir(bpy.types) if "layfigure" in name.lower()]
    folder = Path(bpy.utils.user_resource("EXTENSIONS"))
    modules = sorted(path.name for path in folder.glob(".local/lib/python*/site-packages/*"))
    default, loaded = addon_utils.check(MODULE)
    return {
        "enabled": [default, loaded],
        "types": own,
        "on_objects": hasattr(bpy.types.Object, "layfigure"),
        "modules": modules,
        "files": sorted(path.name for path in (folder / REPOSITORY / "layfigure").glob("*")),
    }


def origin(module: str) -> str:
    return str(importlib.import_module(module).__file__)


def main(extension: str, out: str) -> None:
    states = {"before": state()}
    bpy.ops.extensions.package_install_files(filepath=extension, repo=REPOSITORY, enable_on_install=True)
    states["installed"] = {**state(), "layfigure": origin("layfigure"), "lcm": origin("lcm")}
    bpy.ops.preferences.addon_disable(module=MODULE)
    states["disabled"] = state()
    bpy.ops.preferences.addon_enable(module=MODULE)
    states["enabled"] = state()
    bpy.ops.extensions.package_uninstall(repo_index=repository_index(), pkg_id="layfigure")
    states["removed"] = state()
    Path(out).write_text(json.dumps(states, indent=2))


def repository_index() -> int:
    return [repository.module for repository in bpy.context.preferences.extensions.repos].index(REPOSITORY)


main(*sys.argv[-2:])
