"""Fingertips, pins and softness, played on the real server in lockstep, recorded and judged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from e2e_support import REPOSITORY, ClientProcess
from server_support.process import ServerProcess

from layfigure import skeleton
from layfigure.analysis import JointSummary, summarize
from layfigure.protocol import Floats
from layfigure.take import PointerTrack, Take
from layfigure.take_collector import read_take

TOUCH_SESSION = REPOSITORY / "assets/sessions/touch.toml"
PINCHED_S = 0.75  # when the pinch has closed
RELEASED_S = 2.25


def played(binary: Path, character: Path, session: Path | str, folder: Path) -> Take:
    """The take of a session, a file or its text, on a fresh server."""
    if isinstance(session, str):
        (folder / "session.toml").write_text(session)
        session = folder / "session.toml"
    command = [binary, character, "--clock", "lockstep", "--broker", "0"]
    with ServerProcess(list(map(str, command))) as server:
        url = ("--lcm-url", server.url)
        with ClientProcess(folder, ["record", "take.usda", *url]) as recorder:
            assert recorder.error_line().startswith("recording 'doll'")
            for arguments in (["play", session, *url], ["shutdown", *url]):
                with ClientProcess(folder, arguments) as client:
                    code, _, errors = client.finish()
                assert (code, errors) == (0, "")
            assert recorder.finish()[0] == 0
        assert server.wait()[0] == 0
    return read_take(folder / "take.lcmlog")


def path_of(take: Take, bone: str) -> Floats:
    _, positions = skeleton.world_poses(take.character, take.root_translations, take.rotations)
    names = [joint.name for joint in take.character.joints]
    return np.asarray(positions[:, names.index(bone)])


def at(take: Take, time_s: float) -> int:
    return int(np.argmin(np.abs(take.times_us * 1e-6 - time_s)))


def joint(take: Take, name: str) -> JointSummary:
    return next(summary for summary in summarize(take) if summary.name == name)


def track(take: Take, pointer: int) -> PointerTrack:
    return next(track for track in take.pointers if track.pointer == pointer)


@pytest.fixture(scope="module")
def touch(binary: Path, character: Path, tmp_path_factory: pytest.TempPathFactory) -> Take:
    return played(binary, character, TOUCH_SESSION, tmp_path_factory.mktemp("touch"))


def test_touch_arm_pushed_past_its_yield_stays_pushed(touch: Take) -> None:
    arm = joint(touch, "upper_arm.R")
    assert arm.yielded
    assert arm.rest_after_deg > 5.0
    hand = path_of(touch, "hand.R")
    assert hand[-1][1] - hand[at(touch, 0.25)][1] > 0.01


def test_touch_pinched_forearm_is_lifted_and_does_not_slip(touch: Take) -> None:
    hand = path_of(touch, "hand.L")
    lifted = hand[at(touch, RELEASED_S - 0.05)] - hand[at(touch, PINCHED_S)]
    assert lifted[2] > 0.03
    _, positions = skeleton.world_poses(touch.character, touch.root_translations, touch.rotations)
    names = [joint.name for joint in touch.character.joints]
    elbow, wrist = positions[:, names.index("forearm.L")], positions[:, names.index("hand.L")]
    for pointer in (0, 2):
        finger = track(touch, pointer)
        poses = np.searchsorted(touch.times_us, finger.times_us)
        bone = wrist[poses] - elbow[poses]
        along = np.einsum("ij,ij->i", finger.positions - elbow[poses], bone) / np.einsum("ij,ij->i", bone, bone)
        times_s = finger.times_us * 1e-6
        held = (times_s >= PINCHED_S) & (times_s < RELEASED_S - 0.05)
        assert np.ptp(along[held]) < 0.1  # 5 mm: the balls roll while the forearm turns, they do not slide off
        bones = {touch.character.joints[index].name for index in finger.joints[held]}
        assert bones == {"forearm.L"}


def test_touch_forces_end_with_the_tools(touch: Take) -> None:
    for pointer in (0, 1, 2):
        forces = track(touch, pointer)
        assert forces.attached.any()
        assert not forces.attached[-1]
        assert not forces.forces[~forces.attached].any()


def test_touch_session_played_twice_gives_the_same_poses(
    touch: Take, binary: Path, character: Path, tmp_path: Path
) -> None:
    again = played(binary, character, TOUCH_SESSION, tmp_path)
    np.testing.assert_array_equal(again.rotations, touch.rotations)
    np.testing.assert_array_equal(again.rest_rotations, touch.rest_rotations)
    np.testing.assert_array_equal(again.root_translations, touch.root_translations)


PINS = """
[[hand]]
pointer = 0
do = [
  { wait = 0.5 },
  { pin = "hand.L", point = [0.0, 0.0, 0.0], hold = "HOLD" },
  { pin = "hand.R", point = [0.0, 0.0, 0.0], hold = "HOLD" },
  { grab = "chest", stiffness = 300, damping = 3 },
  { move = [0.01, -0.03, 0.0], over = 0.5 },
  { move = [-0.01, 0.03, 0.01], over = 0.75 },
  { move = [0.0, 0.0, 0.0], over = 0.5 },
  { release = true },
  { unpin = "hand.L" },
  { unpin = true },
  { wait = 0.5 },
]
"""


# [m] A stiff pin gives by the pull over its stiffness: some newtons by 23 kN/m here. A rigid one by rounding, and by
# what a turning bone's point leaves its line in a step.
@pytest.mark.parametrize(("hold", "give"), [("stiff", 5e-4), ("rigid", 1e-5)])
def test_pins_both_hands_stay_while_the_trunk_is_dragged(
    hold: str, give: float, binary: Path, character: Path, tmp_path: Path
) -> None:
    take = played(binary, character, PINS.replace("HOLD", hold), tmp_path)
    pinned = slice(at(take, 0.55), at(take, 2.2))
    chest = path_of(take, "chest")[pinned]
    assert np.ptp(chest[:, 1]) > 0.01
    for bone in ("hand.L", "hand.R"):
        path = path_of(take, bone)[pinned]
        assert np.linalg.norm(path - path[0], axis=1).max() < give
    assert np.abs(take.rotations).max() <= 1.0


SOFT = """
[[hand]]
pointer = 0
do = [
  { wait = 0.25 },
  { softness = SOFTNESS },
  { grab = "hand.L", point = [0.0, 0.0, 0.0], stiffness = 100, damping = 1 },
  { move = [0.0, 0.03, 0.0], over = 0.5 },
  { wait = 0.25 },
  { release = true },
  { wait = 1.0 },
]
"""


def test_softness_lets_a_small_pull_stay(binary: Path, character: Path, tmp_path: Path) -> None:
    rests = {}
    for softness in ("1", "0.5"):
        folder = tmp_path / softness
        folder.mkdir()
        take = played(binary, character, SOFT.replace("SOFTNESS", softness), folder)
        rests[softness] = joint(take, "upper_arm.L").rest_after_deg
    assert rests["1"] == pytest.approx(0.0, abs=1e-6)
    assert rests["0.5"] > 2.0


SCALED = """
[[hand]]
pointer = 0
do = [
  { scale = 0.5 },
  { grab = "hand.L", point = [0.0, 0.0, 0.0], stiffness = 100, damping = 1 },
  { move = [0.0, 0.04, 0.0], over = 0.5 },
  { clutch = true },
  { move = [0.0, -0.04, 0.0], over = 0.25 },
  { clutch = false },
  { move = [0.0, 0.0, 0.0], over = 0.5 },
  { wait = 0.25 },
  { release = true },
]
"""


def test_scale_and_clutch_move_the_doll_by_the_scaled_strokes(binary: Path, character: Path, tmp_path: Path) -> None:
    take = played(binary, character, SCALED, tmp_path)
    hand = path_of(take, "hand.L")
    # 2 cm by the first stroke, nothing under the clutch, 2 cm more by the second; the grip's spring gives a little.
    steps = np.diff(hand[:, 1])
    assert np.abs(steps).max() < 2e-3  # no jump
    during = hand[at(take, 0.55) : at(take, 0.75), 1]
    assert np.ptp(during) < 3e-3
    assert hand[at(take, 1.4)][1] - hand[0][1] == pytest.approx(0.04, abs=0.01)
