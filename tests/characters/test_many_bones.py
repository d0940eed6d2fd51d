"""Files of more bones than a character can have, in every format whose text can name them: refused with one line."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from character_support.answer import inspect
from character_support.many_bones import FORMATS

FEW = 20_000  # more than the 16 384 that a character may have
# A million takes most readers minutes: LAYFIGURE_BONES=1000000.
MANY = int(os.environ.get("LAYFIGURE_BONES", "100000"))


def check_refused(binary: Path, make: Callable[[Path, int], Path], folder: Path, count: int) -> None:
    answer = inspect(binary, make(folder, count))
    assert answer.code == 1
    print(f"\n{answer.seconds:.1f} s of CPU, {answer.kilobytes / 1024:.0f} MB: {answer.stderr.strip()}")


@pytest.mark.parametrize("name", FORMATS)
def test_more_bones_than_a_character_has_are_refused(binary: Path, tmp_path: Path, name: str) -> None:
    check_refused(binary, FORMATS[name], tmp_path, FEW)


@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_many_more_bones_are_refused(binary: Path, tmp_path: Path, name: str) -> None:
    check_refused(binary, FORMATS[name], tmp_path, MANY)
