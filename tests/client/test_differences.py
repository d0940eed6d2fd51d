"""layfigure diff: what counts as a difference, and what does not."""

import math
from pathlib import Path

import numpy as np
import pytest
from client_support import usd_files
from client_support.cli import Cli, assert_one_line_error
from pxr import Gf, Usd, UsdGeom, UsdSkel

from layfigure.differences import compare
from layfigure.errors import LayfigureError
from layfigure.take import Take
from layfigure.usd.writer import write_take

FIGURE = "/World/figure0"
SKIN_TOLERANCE = 2e-6  # [m] float points in centimetres
ANGLE_TOLERANCE = 1e-6  # [rad] float quaternions


def motion(stage: Usd.Stage) -> UsdSkel.Animation:
    return UsdSkel.Animation(stage.GetPrimAtPath(f"{FIGURE}/rig/motion"))


@pytest.fixture
def figure(tmp_path: Path) -> Path:
    return usd_files.write_figure(tmp_path / "a.usda")


@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("meters_per_unit", [0.01, 1.0, 0.0254])
@pytest.mark.parametrize("skeletons", [1, 2])
def test_compare_other_units_and_axes_are_no_difference(
    tmp_path: Path, up_axis: str, meters_per_unit: float, skeletons: int
) -> None:
    a = usd_files.write_figure(tmp_path / "a.usda", skeletons=skeletons)
    b = usd_files.write_figure(tmp_path / "b.usda", up_axis, meters_per_unit, skeletons)
    differences = compare(a, b)
    assert differences.frames == usd_files.FRAMES
    assert differences.worst_angle.size < ANGLE_TOLERANCE
    assert differences.worst_distance is not None
    assert differences.worst_distance.size < SKIN_TOLERANCE
    assert differences.only_in == ((), ())


def test_compare_turned_joint_tells_angle_distance_joint_and_time(figure: Path, tmp_path: Path) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "b.usda"))
    rotations = motion(stage).GetRotationsAttr()
    value = rotations.Get(7)
    value[0] = Gf.Quatf(math.cos(0.1), 0, math.sin(0.1), 0)  # `lower` by 0.2 rad about its bone
    rotations.Set(value, 7)
    stage.GetRootLayer().Save()
    differences = compare(figure, tmp_path / "b.usda")
    assert differences.worst_angle.name == "lower"
    assert differences.worst_angle.size == pytest.approx(0.2, abs=ANGLE_TOLERANCE)
    assert differences.worst_angle.time_s == pytest.approx(6 / 30)
    assert differences.angle_rms == pytest.approx(0.2 / math.sqrt(3 * usd_files.FRAMES), rel=1e-5)
    assert differences.angles["root"].size < ANGLE_TOLERANCE
    farthest = 2.0 * math.sin(0.1) * math.hypot(usd_files.HALF_WIDTH_M, usd_files.HALF_WIDTH_M)  # of a corner's
    assert differences.worst_distance is not None
    assert differences.worst_distance.size == pytest.approx(farthest, rel=1e-4)
    assert differences.distance_rms < farthest / 4.0


def test_compare_other_rate_of_frames_is_compared_at_the_same_times(figure: Path, tmp_path: Path) -> None:
    """The figure turns evenly: half as many keys at half the rate are the same motion."""
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "b.usda"))
    rotations = motion(stage).GetRotationsAttr()
    kept = {(frame - 1) / 2: rotations.Get(frame) for frame in range(1, 14, 2)}
    rotations.Clear()
    for code, value in kept.items():
        rotations.Set(value, code)
    stage.SetTimeCodesPerSecond(15.0)
    stage.SetFramesPerSecond(15.0)
    stage.SetStartTimeCode(0.0)
    stage.SetEndTimeCode(6.0)
    stage.GetRootLayer().Save()
    differences = compare(figure, tmp_path / "b.usda")
    assert differences.frames == usd_files.FRAMES
    assert differences.durations_s == pytest.approx((0.4, 0.4))
    assert differences.worst_angle.size < ANGLE_TOLERANCE


def test_compare_shorter_take_is_compared_as_long_as_it_lasts(figure: Path, tmp_path: Path) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "b.usda"))
    stage.SetEndTimeCode(7.0)
    stage.GetRootLayer().Save()
    differences = compare(figure, tmp_path / "b.usda")
    assert (differences.frames, differences.duration_s) == (7, pytest.approx(0.2))
    assert differences.durations_s == pytest.approx((0.4, 0.2))


def test_compare_joint_of_one_alone_is_told(figure: Path, tmp_path: Path) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "b.usda"))
    skeleton = UsdSkel.Skeleton(stage.GetPrimAtPath(f"{FIGURE}/rig/skeleton"))
    skeleton.GetJointsAttr().Set(["root", "root/upper", "root/upper/claw"])
    stage.GetRootLayer().Save()
    assert compare(figure, tmp_path / "b.usda").only_in == (("lower",), ("claw",))


def test_compare_skeletons_without_skin_compares_joints_alone(figure: Path, tmp_path: Path) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "b.usda"))
    stage.RemovePrim(f"{FIGURE}/skin")
    stage.GetRootLayer().Save()
    assert compare(tmp_path / "b.usda", tmp_path / "b.usda").worst_distance is None
    with pytest.raises(LayfigureError, match="1 and 0 skinned meshes"):
        compare(figure, tmp_path / "b.usda")


def test_compare_other_mesh_or_other_character_is_refused(figure: Path, take: Take, tmp_path: Path) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "b.usda"))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{FIGURE}/skin"))
    mesh.GetPointsAttr().Set([*mesh.GetPointsAttr().Get(), Gf.Vec3f(0)])
    binding = UsdSkel.BindingAPI(mesh.GetPrim())
    for primvar in (binding.GetJointIndicesPrimvar(), binding.GetJointWeightsPrimvar()):
        values = np.array(primvar.Get())
        primvar.Set([*values.tolist(), *values[:2].tolist()])
    stage.GetRootLayer().Save()
    with pytest.raises(LayfigureError, match="mesh 'skin' has 36 vertices, 'skin' of the other take 37"):
        compare(figure, tmp_path / "b.usda")
    write_take(take, tmp_path / "take.usda", 24.0)
    with pytest.raises(LayfigureError, match="have no joint in common"):
        compare(figure, tmp_path / "take.usda")


def test_cli_diff_exit_codes(cli: Cli, figure: Path, tmp_path: Path) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "b.usda"))
    rotations = motion(stage).GetRotationsAttr()
    rotations.Set([Gf.Quatf(math.cos(0.005), 0, math.sin(0.005), 0), *list(rotations.Get(1))[1:]], 1)  # 0.573 degrees
    stage.GetRootLayer().Save()
    assert cli("diff", "a.usda", "a.usda").returncode == 0
    different = cli("diff", "a.usda", "b.usda")
    assert different.returncode == 1
    assert "joints:   max 0.573 deg at 'lower', 0.000 s" in different.stdout
    assert len(different.stderr.splitlines()) == 1
    assert cli("diff", "a.usda", "b.usda", "--tolerance-deg", "0.6", "--tolerance-mm", "2").returncode == 0
    assert_one_line_error(cli("diff", "a.usda", "b.usda", "--tolerance-mm", "no"), 2, "'no'")
    assert_one_line_error(cli("diff", "a.usda", "none.usda"), 1, "none.usda")
    usd_files.write_prop(tmp_path / "prop.usda")
    assert_one_line_error(cli("diff", "prop.usda", "a.usda"), 1, "'prop.usda' holds no skeleton")
