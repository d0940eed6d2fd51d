"""A recorded take as glTF, read by the server's own import."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from e2e_support import RunClient
from test_take_end_to_end import record_session

MASS_TOLERANCE = 1e-5  # relative: vertices went through floats, metres and axes


def inspect(binary: Path, character: Path) -> dict[str, Any]:
    command = [binary, "--inspect", character, "--json"]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def test_converted_take_is_the_same_doll_to_the_server(
    binary: Path, character: Path, session: Path, tmp_path: Path, client: RunClient
) -> None:
    record_session(binary, character, session, tmp_path / "take.usda")
    assert client("convert", tmp_path / "take.usda", tmp_path / "take.glb").returncode == 0
    original, converted = inspect(binary, character), inspect(binary, tmp_path / "take.glb")
    assert [body["name"] for body in converted["bodies"]] == [body["name"] for body in original["bodies"]]
    for before, after in zip(original["bodies"], converted["bodies"], strict=True):
        assert after["mass"] == pytest.approx(before["mass"], rel=MASS_TOLERANCE)
