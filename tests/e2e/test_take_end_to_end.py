"""A session played on the real server in lockstep, recorded and judged."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from client_support.skinned import farthest_by_usd
from e2e_support import ClientProcess, RunClient
from pxr import Usd, UsdGeom, UsdSkel
from server_support.process import ServerProcess

from layfigure import skeleton
from layfigure.analysis import JointSummary, summarize
from layfigure.skinning import Skin
from layfigure.take import Take
from layfigure.take_collector import read_take
from layfigure.usd.checks import check
from layfigure.usd.reader import SkinnedStage
from layfigure.usd.writer import write_take

SESSION_S = 5.0
USD_FILES = ("take.usda", "take.anim.usdc", "take.character.usdc")
FLOAT_TOLERANCE = 2e-7  # a few roundings of values near 1 to float
SKIN_TOLERANCE = 1e-6  # [m] roundings along a chain of joints, over 0.3 m


def record_session(
    binary: Path,
    character: Path,
    session: Path,
    out: Path,
    *options: object,
    recorder_options: Sequence[str] = (),
) -> None:
    """As a user would: a server, a recorder, a player, and the command that ends it all."""
    command = [binary, character, "--clock", "lockstep", "--broker", "0", *options]
    with ServerProcess(list(map(str, command))) as server:
        url = ("--lcm-url", server.url)
        with ClientProcess(out.parent, ["record", out.name, *url, *recorder_options]) as recorder:
            assert recorder.error_line().startswith("recording 'doll' (17 joints)")
            for arguments in (["play", session, *url], ["shutdown", *url]):
                with ClientProcess(out.parent, arguments) as client:
                    code, _, errors = client.finish()
                assert (code, errors) == (0, "")
            code, _, errors = recorder.finish()
            assert (code, errors) == (0, "")
        assert server.wait()[0] == 0


@pytest.fixture(scope="module")
def folder(binary: Path, character: Path, session: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("take")
    record_session(binary, character, session, folder / "take.usda")
    return folder


@pytest.fixture(scope="module")
def take(folder: Path) -> Take:
    return read_take(folder / "take.lcmlog")


def joint(take: Take, name: str) -> JointSummary:
    return next(summary for summary in summarize(take) if summary.name == name)


def test_take_has_every_pose_and_frame(folder: Path, take: Take) -> None:
    assert take.lost_poses == 0
    assert len(take.times_us) == SESSION_S * 60 + 1
    assert take.times_us[-1] == SESSION_S * 1e6
    assert Usd.Stage.Open(str(folder / "take.usda")).GetEndTimeCode() == SESSION_S * 24


def test_take_passes_all_checks(folder: Path, client: RunClient) -> None:
    assert check(folder / "take.usda").findings == ()
    result = client("check", folder / "take.usda")
    assert result.returncode == 0
    assert "take.usda: good (30 USD validators" in result.stdout


def test_take_arm_stays_where_it_was_put_and_trunk_comes_back(take: Take) -> None:
    arm = joint(take, "upper_arm.L")
    assert arm.yielded
    assert arm.rest_after_deg > 5.0
    assert arm.moved_deg == pytest.approx(arm.rest_after_deg, abs=3.0)  # it hangs by its weight from there
    for name in ("abdomen", "chest"):
        trunk = joint(take, name)
        assert trunk.largest_torque > 0.3 * trunk.yield_torque
        assert not trunk.yielded
        assert trunk.rest_after_deg == pytest.approx(0.0, abs=1e-9)
        assert trunk.moved_deg < 1.0


def test_take_both_hands_are_recorded_while_they_hold(take: Take) -> None:
    left, right = take.pointers
    assert (left.pointer, right.pointer) == (0, 1)
    held = [take.character.joints[index].name for index in {*left.joints[left.attached], *right.joints[right.attached]}]
    assert sorted(held) == ["chest", "hand.L"]
    times = left.times_us[left.attached] * 1e-6
    assert (times.min(), times.max()) == (pytest.approx(0.25, abs=0.02), pytest.approx(1.5, abs=0.02))


def test_take_bones_keep_their_lengths_and_rotations_are_unit(folder: Path) -> None:
    stage = Usd.Stage.Open(str(folder / "take.usda"))
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/doll/Animation"))
    frames = range(int(stage.GetEndTimeCode()) + 1)
    translations = np.array([np.array(animation.GetTranslationsAttr().Get(frame)) for frame in frames])
    assert np.ptp(translations[:, 1:], axis=0).max() == 0.0
    for frame in frames:
        lengths = [quaternion.GetLength() for quaternion in animation.GetRotationsAttr().Get(frame)]
        np.testing.assert_allclose(lengths, 1.0, atol=FLOAT_TOLERANCE)


def test_take_skin_by_usd_matches_blending_of_the_messages(folder: Path, take: Take) -> None:
    stage = SkinnedStage(folder / "take.usda")
    rotations, positions = skeleton.world_poses(take.character, take.root_translations, take.rotations)
    skin = Skin(take.character, take.meshes)
    for frame in (0, 24, 48, 120):
        pose = round(frame / 24 * 60)  # at exactly the time of a pose: nothing is interpolated
        posed = stage.posed(frame)
        assert len(posed) == len(take.meshes) > 0
        blended = skin.skin(skin.motions(rotations[pose : pose + 1], positions[pose : pose + 1]))[0]
        np.testing.assert_allclose(np.concatenate([mesh.points for mesh in posed]), blended, atol=SKIN_TOLERANCE)


def test_take_log_alone_gives_the_same_usd(folder: Path, take: Take) -> None:
    (folder / "again").mkdir()
    write_take(take, folder / "again" / "take.usda", 24.0)
    for name in USD_FILES:
        assert (folder / "again" / name).read_bytes() == (folder / name).read_bytes(), name


def test_take_skin_moves_with_the_arm(folder: Path) -> None:
    stage = SkinnedStage(folder / "take.usda")
    before, after = stage.posed(0), stage.posed(120)
    moved = max(float(np.linalg.norm(a.points - b.points, axis=1).max()) for a, b in zip(before, after, strict=True))
    assert 0.02 < moved < 0.3
    opened = Usd.Stage.Open(str(folder / "take.usda"))
    box = UsdGeom.Boundable(opened.GetDefaultPrim()).GetExtentAttr().Get(120)
    points = np.concatenate([mesh.points for mesh in after])
    np.testing.assert_allclose(np.array(box), [points.min(axis=0), points.max(axis=0)], atol=SKIN_TOLERANCE)


def test_take_same_session_again_gives_equal_bytes(
    folder: Path, binary: Path, character: Path, session: Path, tmp_path: Path
) -> None:
    record_session(binary, character, session, tmp_path / "take.usda")
    for name in USD_FILES:
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes(), name


@pytest.mark.parametrize(("physics_hz", "pose_hz"), [(1000, 240), (700, 33.3)])
def test_take_other_rates_end_at_the_same_pose(
    binary: Path, character: Path, session: Path, tmp_path: Path, physics_hz: float, pose_hz: float
) -> None:
    rates = ("--physics-hz", physics_hz, "--pose-hz", pose_hz)
    record_session(binary, character, session, tmp_path / "take.usdz", *rates)
    take = read_take(tmp_path / "take.lcmlog")
    assert take.lost_poses == 0
    assert take.duration_s == pytest.approx(SESSION_S, abs=1.5 / pose_hz)
    assert joint(take, "upper_arm.L").rest_after_deg == pytest.approx(24.0, abs=2.0)
    assert check(tmp_path / "take.usdz").findings == ()


def test_take_reduced_keys_hold_their_tolerance_by_usd(folder: Path, tmp_path: Path, client: RunClient) -> None:
    """At the rate of the poses: what was recorded, and not what lies between."""
    log, tolerance_mm = folder / "take.lcmlog", 0.5
    for name, options in (("every", ()), ("reduced", ("--keys", "reduced", "--tolerance-mm", tolerance_mm))):
        result = client("export", log, f"{name}.usdc", "--fps", 60, "--layout", "single", *options)
        assert (result.returncode, result.stderr) == (0, "")
    stage = Usd.Stage.Open(str(tmp_path / "reduced.usdc"))
    keys = UsdSkel.Animation(stage.GetPrimAtPath("/doll/Animation")).GetRotationsAttr().GetNumTimeSamples()
    assert 2 < keys <= 0.2 * (SESSION_S * 60 + 1)
    assert farthest_by_usd(tmp_path / "every.usdc", tmp_path / "reduced.usdc") <= tolerance_mm * 1e-3
    assert check(tmp_path / "reduced.usdc").findings == ()


def test_take_marks_are_the_keys_that_the_session_sets(binary: Path, character: Path, tmp_path: Path) -> None:
    session = tmp_path / "keys.toml"
    session.write_text(
        """
        [[hand]]
        pointer = 0
        do = [
          { grab = "hand.L" }, { move = [0.0, 0.0, 0.1], over = 0.5 }, { key = true },
          { move = [0.0, -0.1, 0.1], over = 0.25 }, { key = true }, { release = true },
        ]
        """
    )
    record_session(binary, character, session, tmp_path / "take.usda", recorder_options=("--keys", "marked"))
    marks_s = read_take(tmp_path / "take.lcmlog").marks_us * 1e-6
    assert marks_s.tolist() == [pytest.approx(0.5, abs=0.01), pytest.approx(0.75, abs=0.01)]
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/doll/Animation"))
    assert animation.GetRotationsAttr().GetTimeSamples() == [12.0, 18.0]
    assert check(tmp_path / "take.usda").findings == ()


def test_take_export_of_the_log_equals_what_was_recorded(folder: Path, tmp_path: Path, client: RunClient) -> None:
    assert client("export", folder / "take.lcmlog", "take.usda").returncode == 0
    for name in USD_FILES:
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes(), name
