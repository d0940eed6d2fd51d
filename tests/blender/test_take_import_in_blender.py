"""Takes of `layfigure record` on armatures in Blender: see blender_support/in_bpy/take_scenes.py."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from server_support.process import ServerProcess

import layfigure
from layfigure.take_form import TakeForm
from layfigure.usd.writer import write_take

pytestmark = pytest.mark.slow

FRAMES = 150
POSE_HZ = 50.0  # a pose falls on each frame, so that frames are poses and nothing is between them


@pytest.fixture(scope="module")
def takes(binary: Path, character: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of one take in several forms, and what the doll did."""
    folder = tmp_path_factory.mktemp("takes")
    command = [binary, character, "--clock", "lockstep", "--broker", "0", "--pose-hz", POSE_HZ]
    with ServerProcess(list(map(str, command))) as server, layfigure.connect(server.url) as doll:
        places = layfigure.world_poses(doll.character, doll.pose())[1]
        hand = places[doll.joint("hand.L")]
        doll.move_pointer(0, hand)
        doll.command("grab", pointer=0, bone="hand.L", point=[0.0, 0.0, 0.0])
        with doll.record(folder / "take.lcmlog") as recording:
            for frame in range(1, FRAMES):
                turn = 2.0 * np.pi * frame / 100.0
                doll.next_pose({0: hand + 0.1 * np.array([0.2 * np.sin(turn), np.cos(turn) - 1.0, np.sin(turn)])})
    take = recording.take
    layfigure.write_usd(take, folder / "take_layered.usda", fps=POSE_HZ)
    layfigure.write_usd(take, folder / "take_zipped.usdz", fps=POSE_HZ)
    layfigure.write_usd(take, folder / "take_y_up.usda", fps=POSE_HZ, up_axis="Y", meters_per_unit=0.01)
    write_take(take, folder / "take_single.usdc", POSE_HZ, TakeForm(layout="single"))
    joints = take.character.joints
    np.savez(
        folder / "poses.npz",
        names=[joint.name for joint in joints],
        parents=[joint.parent for joint in joints],
        places=[joint.rest_translation for joint in joints],
        turns=[joint.rest_rotation for joint in joints],
        bind_places=[joint.bind_translation for joint in joints],
        bind_turns=[joint.bind_rotation for joint in joints],
        roots=take.root_translations,
        rotations=take.rotations,
        seconds=1e-6 * (take.times_us - take.times_us[0]),
    )
    return folder


@pytest.mark.parametrize("scene", ["imports_match_what_the_doll_did", "what_is_no_take_is_refused_in_one_line"])
def test_take(run_in_bpy: Callable[..., str], character: Path, takes: Path, scene: str) -> None:
    run_in_bpy("take_scenes.py", scene, takes, LAYFIGURE_TEST_DOLL=str(character))


def test_take_of_a_live_doll(run_in_bpy: Callable[..., str], character: Path, tmp_path: Path) -> None:
    scene = "record_of_a_live_doll_matches_its_preview"
    run_in_bpy("take_scenes.py", scene, tmp_path, LAYFIGURE_TEST_DOLL=str(character), TMPDIR=str(tmp_path))
