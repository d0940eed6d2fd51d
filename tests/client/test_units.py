"""Takes in other units and with another axis up: the same motion in every combination."""

from pathlib import Path

import numpy as np
import pytest
from client_support import usd_files
from client_support.cli import Cli, assert_one_line_error
from pxr import Sdf, Usd, UsdGeom, UsdSkel

from layfigure.differences import compare
from layfigure.errors import LayfigureError
from layfigure.take import Take
from layfigure.take_form import Layout, TakeForm, UpAxis
from layfigure.usd.checks import check
from layfigure.usd.reader import SkinnedStage
from layfigure.usd.units import change_units, write_in_units
from layfigure.usd.writer import write_take

SKIN_TOLERANCE = 2e-6  # [m] a few roundings of floats over two metres
ANGLE_TOLERANCE = 1e-6  # [rad]
ROOT = "/Synthetic_arm"


@pytest.fixture
def usd(take: Take, tmp_path: Path) -> Path:
    write_take(take, tmp_path / "take.usda", 24.0, TakeForm(custom_data=True))
    return tmp_path / "take.usda"


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usdz"])
@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("meters_per_unit", [1.0, 0.01, 0.0254])
def test_write_in_units_is_the_same_motion_and_passes_all_checks(
    usd: Path, tmp_path: Path, suffix: str, up_axis: UpAxis, meters_per_unit: float
) -> None:
    out = tmp_path / f"out{suffix}"
    write_in_units(usd, out, up_axis, meters_per_unit)
    stage = Usd.Stage.Open(str(out))
    assert UsdGeom.GetStageUpAxis(stage) == up_axis
    assert UsdGeom.GetStageMetersPerUnit(stage) == meters_per_unit
    assert [*map(str, check(out).findings)] == []
    differences = compare(usd, out)
    assert differences.frames == 25
    assert differences.worst_angle.size < ANGLE_TOLERANCE
    assert differences.worst_distance is not None
    assert differences.worst_distance.size < SKIN_TOLERANCE
    assert not list(tmp_path.glob(".*"))


def test_write_in_units_centimetres_y_up_has_the_numbers_that_such_files_have(usd: Path, tmp_path: Path) -> None:
    write_in_units(usd, tmp_path / "out.usda", "Y", 0.01)
    before, after = (Usd.Stage.Open(str(path)) for path in (usd, tmp_path / "out.usda"))

    def values(stage: Usd.Stage, prim: str, name: str) -> np.ndarray:
        return np.array(stage.GetPrimAtPath(f"{ROOT}/{prim}").GetAttribute(name).Get(7.0), np.float64)

    def y_up(vectors: np.ndarray) -> np.ndarray:
        return np.stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1)

    mesh = "Geometry/arm_mesh"
    points = values(before, mesh, "points")
    np.testing.assert_allclose(values(after, mesh, "points"), 100.0 * y_up(points), atol=1e-4)
    np.testing.assert_allclose(values(after, mesh, "normals"), y_up(values(before, mesh, "normals")), atol=1e-6)
    offsets = values(before, "Animation", "translations")
    expected = 100.0 * np.concatenate([y_up(offsets[:1]), offsets[1:]])  # the root's is in the world
    np.testing.assert_allclose(values(after, "Animation", "translations"), expected, atol=1e-4)
    np.testing.assert_array_equal(
        values(after, "Animation", "rotations")[1:], values(before, "Animation", "rotations")[1:]
    )
    np.testing.assert_array_equal(
        values(after, mesh, "primvars:skel:jointWeights"), values(before, mesh, "primvars:skel:jointWeights")
    )
    np.testing.assert_array_equal(
        values(after, "Animation", "layfigure:torques"), values(before, "Animation", "layfigure:torques")
    )


def test_write_in_units_there_and_back_gives_the_take_again(usd: Path, tmp_path: Path) -> None:
    write_in_units(usd, tmp_path / "there.usdc", "Y", 0.01)
    write_in_units(tmp_path / "there.usdc", tmp_path / "back.usdc", "Z", 1.0)
    before, after = (Usd.Stage.Open(str(path)) for path in (usd, tmp_path / "back.usdc"))
    for name in ("bindTransforms", "restTransforms"):
        binds = [
            np.array(stage.GetPrimAtPath(f"{ROOT}/Skeleton").GetAttribute(name).Get()) for stage in (before, after)
        ]
        np.testing.assert_allclose(*binds, atol=1e-12)


def test_write_in_units_without_a_choice_keeps_both(tmp_path: Path, usd: Path) -> None:
    write_in_units(usd, tmp_path / "out.usda", None, None)
    stage = Usd.Stage.Open(str(tmp_path / "out.usda"))
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == ("Z", 1.0)


def test_change_units_each_layer_of_a_take_by_itself_gives_the_same_motion(
    usd: Path, take: Take, tmp_path: Path
) -> None:
    (tmp_path / "copy").mkdir()
    write_take(take, tmp_path / "copy" / "take.usda", 24.0)
    for path in sorted((tmp_path / "copy").iterdir()):
        layer = Sdf.Layer.FindOrOpen(str(path))
        change_units(layer, "Y", 0.01)
        layer.Save()
    assert check(tmp_path / "copy" / "take.usda").findings == ()
    differences = compare(usd, tmp_path / "copy" / "take.usda")
    assert differences.worst_distance is not None
    assert differences.worst_distance.size < SKIN_TOLERANCE
    assert differences.worst_angle.size < ANGLE_TOLERANCE


@pytest.mark.parametrize("layout", ["layered", "single"])
@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usdz"])
@pytest.mark.parametrize(("up_axis", "meters_per_unit"), [("Y", 1.0), ("Z", 0.01), ("Y", 0.01)])
def test_write_take_in_units_is_the_same_take(
    usd: Path, take: Take, tmp_path: Path, layout: Layout, suffix: str, up_axis: UpAxis, meters_per_unit: float
) -> None:
    form = TakeForm(layout=layout, custom_data=True, up_axis=up_axis, meters_per_unit=meters_per_unit)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write_take(take, tmp_path / name / f"take{suffix}", 24.0, form)
    out = tmp_path / "a" / f"take{suffix}"
    stage = Usd.Stage.Open(str(out))
    assert (UsdGeom.GetStageUpAxis(stage), UsdGeom.GetStageMetersPerUnit(stage)) == (up_axis, meters_per_unit)
    assert [*map(str, check(out).findings)] == []
    differences = compare(usd, out)
    assert differences.worst_angle.size < ANGLE_TOLERANCE
    assert differences.worst_distance is not None
    assert differences.worst_distance.size < SKIN_TOLERANCE
    for path in (tmp_path / "a").iterdir():  # equal takes give equal bytes
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()


def test_write_take_in_units_in_layers_says_nothing(
    take: Take, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Each layer is rewritten by itself: USD is not to look for those that it names."""
    write_take(take, tmp_path / "take.usda", 24.0, TakeForm(up_axis="Y", meters_per_unit=0.01))
    assert capfd.readouterr() == ("", "")


def test_write_in_units_turns_what_hands_did(usd: Path, tmp_path: Path) -> None:
    write_in_units(usd, tmp_path / "out.usdc", "Y", 0.01)
    before, after = (SkinnedStage(path).pulls(12.0) for path in (usd, tmp_path / "out.usdc"))
    assert len(before) == len(after) == 1
    assert np.linalg.norm(before[0].force) > 1.0
    np.testing.assert_allclose(after[0].point, before[0].point, atol=1e-6)
    np.testing.assert_allclose(after[0].force, before[0].force, atol=1e-5)


def test_write_in_units_file_of_another_tool_is_refused(tmp_path: Path) -> None:
    file = usd_files.write_figure(tmp_path / "f.usda")
    with pytest.raises(LayfigureError, match="places a prim: only takes of 'layfigure record'"):
        write_in_units(file, tmp_path / "out.usda", "Z", 1.0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["f.usda"]


def test_cli_convert_to_usd_and_its_usage_errors(cli: Cli, usd: Path, tmp_path: Path) -> None:
    result = cli("convert", usd.name, "out.usdc", "--up-axis", "Y", "--meters-per-unit", "0.01")
    assert (result.returncode, result.stdout, result.stderr) == (0, "out.usdc\n", "")
    assert cli("diff", usd.name, "out.usdc").returncode == 0
    assert_one_line_error(cli("convert", usd.name, "a.glb", "--up-axis", "Z"), 2, "are for USD")
    assert_one_line_error(cli("convert", usd.name, "a.usda", "--up-axis", "X"), 2, "'X'")
    assert_one_line_error(cli("convert", usd.name, "a.usda", "--meters-per-unit", "0"), 2, "'0'")
    assert not (tmp_path / "a.usda").exists()


def test_write_in_units_skel_animation_stays_readable_by_usd(usd: Path, tmp_path: Path) -> None:
    write_in_units(usd, tmp_path / "out.usdc", "Y", 0.01)
    stage = Usd.Stage.Open(str(tmp_path / "out.usdc"))
    animation = UsdSkel.Animation(stage.GetPrimAtPath(f"{ROOT}/Animation"))
    assert str(animation.GetRotationsAttr().GetTypeName()) == "quatf[]"
    assert len(animation.GetRotationsAttr().GetTimeSamples()) == 25
