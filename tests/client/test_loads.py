"""What is plotted: torques and forces from an event log and from USD."""

from pathlib import Path

import numpy as np
import pytest
from client_support import usd_files
from client_support.cli import Cli, assert_one_line_error
from PIL import Image

from layfigure.errors import LayfigureError, UsageError
from layfigure.loads import Loads, choose_joints, loads_of_take
from layfigure.take import Take
from layfigure.take_form import TakeForm
from layfigure.usd.loads_reader import loads_of_usd
from layfigure.usd.writer import write_take

TORQUE_TOLERANCE = 1e-6  # [N m]: USD keeps floats


@pytest.fixture(scope="module")
def loads(take: Take) -> Loads:
    return loads_of_take(take)


@pytest.fixture
def usd(take: Take, tmp_path: Path) -> Path:
    """Every pose is a frame, torques and forces are in it."""
    write_take(take, tmp_path / "take.usda", 60.0, TakeForm(custom_data=True))
    return tmp_path / "take.usda"


def test_loads_of_take_are_of_joints_with_body_and_parent(loads: Loads) -> None:
    assert [joint.name for joint in loads.joints] == ["mixamorig:LeftArm", "mixamorig:LeftHand"]
    arm = loads.joints[0]
    assert arm.yield_torque == 5.0
    assert arm.torques[60] == pytest.approx(np.hypot(0.1, 5.0 * np.sin(1.0)))
    assert np.flatnonzero(arm.flows).tolist() == list(range(10, 20))
    assert loads.hands[0].joint_names[30] == "mixamorig:LeftHand"


def test_loads_of_usd_are_those_of_the_log(loads: Loads, usd: Path) -> None:
    """Of the three poses in 0.05 s one is at the time of a frame: nothing is interpolated there."""
    read = loads_of_usd(usd)
    assert len(read.times_s) == len(loads.times_s)
    for from_usd, from_log in zip(read.joints, loads.joints, strict=True):
        assert (from_usd.name, from_usd.yield_torque) == (from_log.name, from_log.yield_torque)
        np.testing.assert_allclose(from_usd.torques[::3], from_log.torques[::3], atol=TORQUE_TOLERANCE)
        assert from_usd.rest_moved_deg == pytest.approx(from_log.rest_moved_deg, abs=1e-3)
        np.testing.assert_array_equal(from_usd.flows[11:19], from_log.flows[11:19])
        assert abs(int(from_usd.flows.sum()) - int(from_log.flows.sum())) <= 2  # a frame at either end
    np.testing.assert_allclose(read.hands[0].forces[::3], loads.hands[0].forces[::3], atol=TORQUE_TOLERANCE)
    assert read.hands[0].holds[6:].all()  # it grabs in the pose after frame 5
    assert not read.hands[0].holds[:5].any()


def test_loads_of_usd_without_torques_says_to_plot_the_log(tmp_path: Path) -> None:
    with pytest.raises(LayfigureError, match="holds no torques of joints: plot the event log"):
        loads_of_usd(usd_files.write_figure(tmp_path / "f.usda"))


@pytest.mark.parametrize(
    ("patterns", "names"),
    [
        ([], ["mixamorig:LeftHand", "mixamorig:LeftArm"]),  # the most loaded first
        (["LeftArm"], ["mixamorig:LeftArm"]),
        (["mixamorig:*"], ["mixamorig:LeftArm", "mixamorig:LeftHand"]),
        (["*Hand", "Left*m"], ["mixamorig:LeftArm", "mixamorig:LeftHand"]),
    ],
)
def test_choose_joints_by_pattern_or_load(loads: Loads, patterns: list[str], names: list[str]) -> None:
    assert [joint.name for joint in choose_joints(loads, patterns, 6)] == names


def test_choose_joints_pattern_without_joint_is_a_usage_error(loads: Loads) -> None:
    with pytest.raises(UsageError, match=r"no joint of 'Synthetic arm' matches --joints 'leg\*'"):
        choose_joints(loads, ["LeftArm", "leg*"], 6)
    with pytest.raises(UsageError, match="matches 2 joints, at most 1"):
        choose_joints(loads, ["*"], 1)


def test_cli_plot_draws_usd_and_refuses_what_has_no_torques(cli: Cli, usd: Path, tmp_path: Path) -> None:
    result = cli("plot", usd.name, "-o", "plot.png", "--joints", "LeftArm")
    assert (result.returncode, result.stdout, result.stderr) == (0, "plot.png: 1 joints\n", "")
    assert Image.open(tmp_path / "plot.png").size[0] > 1000
    usd_files.write_figure(tmp_path / "f.usda")
    assert_one_line_error(cli("plot", "f.usda", "-o", "f.png"), 1, "holds no torques")
