"""Limits of joints that an FBX file states become the doll's, whatever the axes that they are measured in."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from character_support.creature import tube
from character_support.fbx import FREE, Angles, Bound, Joint, angles_of, euler, write_fbx

from glb import Array, Bone, Mesh, rigid

LENGTH = 0.4  # [m] of each bone
ROUNDING_DEG = 1e-3  # the reader has single precision
LEAST_DEG = 5.0  # that a limit is away from the neutral pose

Numbers = dict[str, Any]

BENT: Angles = (10.0, -20.0, 15.0)
HINGE = Joint(lower=(0.0, -150.0, 0.0), upper=(0.0, 10.0, 0.0))


def arm(folder: Path, joints: dict[str, Joint], turn: Array | None = None) -> Path:
    """A tube along x of the bones upper, middle, lower, whose frames are `turn`ed beside each other."""
    frame = np.eye(3)
    bones = []
    for index, name in enumerate(["upper", "middle", "lower"]):
        bones.append(Bone(name, index - 1, rigid(frame, np.array([LENGTH * index, 0.0, 0.0]))))
        frame = frame @ (np.eye(3) if turn is None else turn)
    points, triangles, along = tube(np.zeros(3), np.array([3.0 * LENGTH, 0.0, 0.0]), (0.05, 0.04), 61)
    weights = np.zeros((len(points), 3))
    weights[np.arange(len(points)), np.clip((3.0 * along).astype(int), 0, 2)] = 1.0
    path = folder / "arm.fbx"
    write_fbx(path, bones, [Mesh("skin", (0.5, 0.5, 0.5), points, triangles, weights)], joints)
    return path


def inspect(binary: Path, path: Path, *options: str | Path) -> Numbers:
    command = [binary, "--inspect", path, "--json", *options]
    result: Numbers = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
    return result


def body(doll: Numbers, name: str) -> Numbers:
    found: Numbers = next(b for b in doll["bodies"] if b["name"] == name)
    return found


def matrix(quaternion: list[float]) -> Array:
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def slack_deg(limits: Numbers, rotation: Array) -> float:
    """How far R_PB is inside the limits, negative beyond them; exact while it turns about one of their axes alone."""
    r = (matrix(limits["reference"]) @ matrix(limits["axes"])).T @ rotation @ matrix(limits["axes"])
    w = np.sqrt(max(0.0, 1.0 + np.trace(r))) / 2.0
    vector = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) / (4.0 * w)
    angles = np.degrees(2.0 * np.arctan2(vector, w))
    slack = np.inf
    for angle, name in zip(angles, ["twist", "swing_y", "swing_z"], strict=True):
        lower, upper = limits[name]
        slack = min(slack, np.inf if lower is None else angle - np.degrees(lower))
        slack = min(slack, np.inf if upper is None else np.degrees(upper) - angle)
    return float(slack)


@pytest.mark.parametrize("pre", [(0.0, 0.0, 0.0), (90.0, 0.0, 0.0), (30.0, -50.0, 70.0)])
@pytest.mark.parametrize("post", [(0.0, 0.0, 0.0), (0.0, 0.0, 90.0), (-20.0, 35.0, 10.0)])
@pytest.mark.parametrize("turned", [(0.0, 0.0, 0.0), BENT])
def test_limits_hold_in_the_file_s_own_axes(
    binary: Path, tmp_path: Path, pre: Angles, post: Angles, turned: Angles
) -> None:
    lower, upper = (-40.0, -75.0, -20.0), (25.0, 60.0, 95.0)
    turn = euler(pre) @ euler(turned) @ euler(post).T  # so that the rest pose is inside, by its three angles
    path = arm(tmp_path, {"lower": Joint(lower, upper, pre, post)}, turn)
    joint = body(inspect(binary, path), "lower")
    for axis in range(3):
        for bound, beyond in ((lower[axis], -1.0), (upper[axis], 1.0)):
            angles = [0.0, 0.0, 0.0]
            angles[axis] = bound
            rotation = euler(pre) @ euler((angles[0], angles[1], angles[2])) @ euler(post).T
            assert slack_deg(joint["limits"], rotation) == pytest.approx(0.0, abs=ROUNDING_DEG)
            angles[axis] += beyond
            rotation = euler(pre) @ euler((angles[0], angles[1], angles[2])) @ euler(post).T
            assert slack_deg(joint["limits"], rotation) == pytest.approx(-1.0, abs=ROUNDING_DEG)
    for axis in ("twist", "swing_y", "swing_z"):
        assert joint["reasons"]["limits"][axis] == "limits of the character's file"


def test_twist_is_about_the_axis_along_the_limb(binary: Path, tmp_path: Path) -> None:
    joint = body(inspect(binary, arm(tmp_path, {"lower": Joint((-10.0, -20.0, -30.0), (11.0, 21.0, 31.0))})), "lower")
    degrees = {axis: np.degrees(joint["limits"][axis]).tolist() for axis in ("twist", "swing_y", "swing_z")}
    assert degrees["twist"] == pytest.approx([-10.0, 11.0])
    assert degrees["swing_y"] == pytest.approx([-20.0, 21.0])
    assert degrees["swing_z"] == pytest.approx([-30.0, 31.0])


def test_hinge_keeps_a_little_room_about_its_fixed_axes(binary: Path, tmp_path: Path) -> None:
    limits = body(inspect(binary, arm(tmp_path, {"middle": HINGE})), "middle")["limits"]
    assert np.degrees(limits["swing_y"]) == pytest.approx([-150.0, 10.0])
    assert np.degrees(limits["twist"]) == pytest.approx([-LEAST_DEG, LEAST_DEG])
    assert np.degrees(limits["swing_z"]) == pytest.approx([-LEAST_DEG, LEAST_DEG])


def test_range_that_excludes_zero_is_measured_from_its_middle(binary: Path, tmp_path: Path) -> None:
    file = {"lower": Joint((None, 20.0, None), (None, 80.0, None))}
    doll = inspect(binary, arm(tmp_path, file, euler((0.0, 50.0, 0.0))))
    limits = body(doll, "lower")["limits"]
    bounded = [limits[axis] for axis in ("twist", "swing_y", "swing_z") if limits[axis] != [None, None]]
    assert len(bounded) == 1
    assert np.degrees(bounded[0]) == pytest.approx([-30.0, 30.0])
    assert slack_deg(limits, euler((0.0, 19.0, 0.0))) == pytest.approx(-1.0, abs=ROUNDING_DEG)
    assert slack_deg(limits, euler((0.0, 79.0, 0.0))) == pytest.approx(1.0, abs=ROUNDING_DEG)
    assert not [warning for warning in doll["warnings"] if "limits" in warning]


def test_rest_pose_beyond_the_limits_widens_them_and_is_told(binary: Path, tmp_path: Path) -> None:
    file = {"lower": Joint((-5.0, -5.0, -5.0), (5.0, 5.0, 5.0))}
    doll = inspect(binary, arm(tmp_path, file, euler((0.0, 40.0, 0.0))))
    assert "'lower': its rest pose is beyond the limits that the file states" in " ".join(doll["warnings"])
    assert slack_deg(body(doll, "lower")["limits"], euler((0.0, 40.0, 0.0))) >= LEAST_DEG - ROUNDING_DEG


@pytest.mark.parametrize(
    "joint",
    [Joint(FREE, FREE), Joint((-10.0, -10.0, -10.0), (10.0, 10.0, 10.0), active=False)],
    ids=["no flags", "not active"],
)
def test_limits_that_are_switched_off_are_none(binary: Path, tmp_path: Path, joint: Joint) -> None:
    reasons = body(inspect(binary, arm(tmp_path, {"lower": joint})), "lower")["reasons"]["limits"]
    assert reasons["twist"] == "range of an unknown part"


@pytest.mark.parametrize(
    ("lower", "upper"),
    [((30.0, -5.0, -5.0), (-30.0, 50.0, 50.0)), ((float("nan"), -5.0, -5.0), (10.0, 50.0, 50.0))],
    ids=["crossed", "not a number"],
)
def test_senseless_bounds_are_left_out_and_told(binary: Path, tmp_path: Path, lower: Bound, upper: Bound) -> None:
    doll = inspect(binary, arm(tmp_path, {"lower": Joint(lower, upper)}))
    assert [w for w in doll["warnings"] if "'lower': its lower limit about x is above the upper one" in w]
    limits = body(doll, "lower")["limits"]
    assert limits["twist"] == [None, None]
    assert np.degrees(limits["swing_y"]) == pytest.approx([-5.0, 50.0])


def test_limits_are_measured_from_the_body_that_the_parent_rides_on(binary: Path, tmp_path: Path) -> None:
    """The bone between is merged, and turned beside the body that it rides on."""
    file = {"lower": Joint((-40.0, -40.0, -40.0), (40.0, 40.0, 40.0))}
    path = arm(tmp_path, file, euler(BENT))
    settings = tmp_path / "merge.toml"
    settings.write_text("[joints.middle]\nmerge = true\n")
    limits = body(inspect(binary, path, "--doll", settings), "lower")["limits"]
    for axis in range(3):
        angles = [0.0, 0.0, 0.0]
        angles[axis] = 41.0
        rotation = euler(BENT) @ euler((angles[0], angles[1], angles[2]))
        assert slack_deg(limits, rotation) == pytest.approx(-1.0, abs=ROUNDING_DEG)


def test_settings_come_before_the_file_and_are_written_back(binary: Path, tmp_path: Path) -> None:
    path = arm(tmp_path, {"lower": Joint((-10.0, -20.0, -30.0), (11.0, 21.0, 31.0))})
    settings = tmp_path / "arm.doll.toml"
    settings.write_text("[joints.lower]\nlimits = {twist = [-60, 70]}\n")
    doll = inspect(binary, path)
    limits, reasons = body(doll, "lower")["limits"], body(doll, "lower")["reasons"]["limits"]
    assert np.degrees(limits["twist"]) == pytest.approx([-60.0, 70.0])
    assert np.degrees(limits["swing_y"]) == pytest.approx([-20.0, 21.0])
    assert (reasons["twist"], reasons["swing_y"]) == ("line 2 of the settings", "limits of the character's file")
    written = tmp_path / "written.toml"
    subprocess.run([binary, "--inspect", path, "--write-settings", written], capture_output=True, check=True)
    assert "deg, limits of the character's file" in written.read_text()
    assert body(inspect(binary, path, "--doll", written), "lower")["limits"] == limits


def test_table_marks_limits_of_the_file(binary: Path, tmp_path: Path) -> None:
    path = arm(tmp_path, {"lower": Joint((-10.0, -20.0, -30.0), (11.0, 21.0, 31.0))})
    table = subprocess.run([binary, "--inspect", path], capture_output=True, check=True, text=True).stdout
    row = next(line for line in table.splitlines() if line.startswith("lower "))
    assert "-10..11~" in row
    assert "~ by the character's file" in table


def test_writer_of_these_files_inverts_its_angles() -> None:
    assert angles_of(euler(BENT)) == pytest.approx(BENT)
