"""Armature -> doll -> armature within 1e-5 m and 1e-5 rad, for rigs of several makers, however they are placed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("rig", ["metarig", "basic_metarig"])
def test_rigify_metarig_goes_to_the_doll_and_back(run_in_bpy: Callable[..., str], rig: str) -> None:
    print(run_in_bpy("round_trip.py", rig))


def test_doll_of_the_project_goes_to_the_doll_and_back(run_in_bpy: Callable[..., str], character: Path) -> None:
    print(run_in_bpy("round_trip.py", "doll", character))


@pytest.mark.parametrize("rig", ["mixamo", "game_engine"])
def test_make_human_rig_goes_to_the_doll_and_back(
    run_in_bpy: Callable[..., str], make_human_rig: Callable[[str], Path], rig: str
) -> None:
    print(run_in_bpy("round_trip.py", rig, make_human_rig(rig)))
