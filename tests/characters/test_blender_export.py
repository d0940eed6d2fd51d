"""An FBX that Blender wrote becomes the doll that the glTF becomes which Blender read."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BLENDER_FBX = Path(__file__).resolve().parents[1] / "data/characters/lay_figure_blender.fbx"
ROUNDING = 1e-5  # of single precision, in sums over a mesh

Numbers = dict[str, Any]


def inspect(binary: Path, path: Path) -> Numbers:
    command = [binary, "--inspect", path, "--json", "--geometry"]
    result: Numbers = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
    return result


@pytest.fixture(scope="module")
def dolls(binary: Path, character: Path) -> tuple[Numbers, Numbers]:
    """Of the glTF that Blender read, and of the FBX that it wrote: see tests/data/characters."""
    return inspect(binary, character), inspect(binary, BLENDER_FBX)


def test_blender_fbx_has_the_same_bodies(dolls: tuple[Numbers, Numbers]) -> None:
    original, exported = dolls
    assert [b["name"] for b in exported["bodies"]] == [b["name"] for b in original["bodies"]]
    assert [b["parent"] for b in exported["bodies"]] == [b["parent"] for b in original["bodies"]]
    assert exported["bones"] > original["bones"]  # Blender's leaf bones, which ride
    assert exported["warnings"] == original["warnings"]


def test_blender_fbx_has_the_same_masses_sections_and_laws(dolls: tuple[Numbers, Numbers]) -> None:
    for a, b in zip(dolls[0]["bodies"], dolls[1]["bodies"], strict=True):
        for number in ("mass", "stiffness", "damping", "yield_torque"):
            if a[number] is not None:
                assert b[number] == pytest.approx(a[number], rel=ROUNDING), (a["name"], number)
        assert b["inertia"] == pytest.approx(a["inertia"], rel=ROUNDING), a["name"]
        assert b["section"]["area"] == pytest.approx(a["section"]["area"], rel=ROUNDING), a["name"]


def test_blender_fbx_stands_where_the_original_does(dolls: tuple[Numbers, Numbers]) -> None:
    for a, b in zip(dolls[0]["geometry"]["bodies"], dolls[1]["geometry"]["bodies"], strict=True):
        assert np.linalg.norm(np.subtract(a["com"], b["com"])) < ROUNDING
