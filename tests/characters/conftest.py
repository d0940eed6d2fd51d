"""Fixtures of the tests on whole characters of many formats."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / "assets"))


@pytest.fixture(scope="session")
def doll_stand(binary: Path) -> Path:
    """The program that lets a character's doll stand, built beside the server."""
    path = binary.parents[2] / "tests/characters/doll_stand"
    assert path.is_file(), f"no {path}: build the target doll_stand"
    return path
