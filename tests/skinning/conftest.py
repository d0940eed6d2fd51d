"""Fixtures of the tests of skinning, with the real server and what it says of a character."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
DEFAULT_SKIN_DUMP = REPOSITORY / "build/release/tests/skinning/skin_dump"

sys.path.append(str(REPOSITORY / "assets"))  # scripts, not a package
sys.path.append(str(REPOSITORY / "tests/server"))  # one way to start a server for all tests


@pytest.fixture(scope="session")
def skin_dump() -> Path:
    """The program of skin_dump.cpp: named by LAYFIGURE_SKIN_DUMP, else where ./run test builds it."""
    path = Path(os.environ.get("LAYFIGURE_SKIN_DUMP", DEFAULT_SKIN_DUMP))
    assert path.is_file(), f"no skin_dump at {path}: build it, or name it in LAYFIGURE_SKIN_DUMP"
    return path
