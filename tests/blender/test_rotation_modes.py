"""A bone's rotation in the numbers of its mode: there and back, and without jumps between keys."""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

from layfigure import rotation

sys.path.append(str(Path(__file__).resolve().parents[2] / "plugins/blender"))
from layfigure_blender import rotation_modes

EULER_MODES = ["".join(axes) for axes in itertools.permutations("XYZ")]
MODES = ["QUATERNION", "AXIS_ANGLE", *EULER_MODES]
ROUNDING = 1e-12  # [rad] of double precision, away from a middle angle of 90 degrees
ROUNDING_AT_LOCK = 1e-6  # [rad] beside it, where angles lose half of their digits


@pytest.fixture
def rotations() -> np.ndarray:
    return rotation.normalized(np.random.default_rng(3).normal(size=(400, 4)))


def beside_nothing(mode: str, count: int) -> np.ndarray:
    return np.broadcast_to(rotation_modes.neutral(mode), (count, len(rotation_modes.neutral(mode))))


@pytest.mark.parametrize("mode", MODES)
def test_numbers_are_the_rotation(mode: str, rotations: np.ndarray) -> None:
    numbers = rotation_modes.nearest(mode, rotations, beside_nothing(mode, len(rotations)))
    back = rotation_modes.to_rotations(mode, numbers)
    assert rotation.angle_between(back, rotations).max() < ROUNDING


@pytest.mark.parametrize("mode", EULER_MODES)
def test_euler_angles_turn_in_the_order_of_the_name(mode: str) -> None:
    angles = np.array([0.3, -0.5, 0.8])
    expected = np.array([1.0, 0.0, 0.0, 0.0])
    for axis in mode:
        vector = np.zeros(3)
        vector["XYZ".index(axis)] = angles["XYZ".index(axis)]
        expected = rotation.multiply(rotation.from_vector(vector), expected)
    assert rotation.angle_between(rotation_modes.to_rotations(mode, angles), expected) < ROUNDING


@pytest.mark.parametrize("mode", MODES)
def test_motion_that_goes_round_and_round_has_no_jumps(mode: str) -> None:
    seconds = np.linspace(0.0, 20.0, 4001)
    turns = np.stack([seconds, 0.4 * np.sin(seconds), 0.3 * np.cos(1.7 * seconds)], axis=1)
    rotations = rotation.from_vector(np.concatenate([turns[:, :1], np.zeros((len(turns), 2))], axis=1))
    rotations = rotation.multiply(rotations, rotation.from_vector(turns * [0.0, 1.0, 1.0]))
    random_signs = np.random.default_rng(1).choice([-1.0, 1.0], size=(len(turns), 1))
    numbers = rotation_modes.continuous(mode, (rotations * random_signs)[:, None])[:, 0]
    assert rotation.angle_between(rotation_modes.to_rotations(mode, numbers), rotations).max() < ROUNDING_AT_LOCK
    assert np.abs(np.diff(numbers, axis=0)).max() < 1.0  # a jump is half a turn; beside gimbal lock angles are quick
    if mode in EULER_MODES and mode[1] != "X":
        assert np.ptp(numbers[:, 0]) > 6.0 * np.pi  # three turns, wound up


@pytest.mark.parametrize("mode", EULER_MODES)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gimbal_lock_keeps_the_last_angle(mode: str, sign: float) -> None:
    dice = np.random.default_rng(2)
    angles, before = dice.uniform(-3.0, 3.0, (50, 3)), dice.uniform(-3.0, 3.0, (50, 3))
    angles[:, "XYZ".index(mode[1])] = sign * np.pi / 2.0
    rotations = rotation_modes.to_rotations(mode, angles)
    numbers = rotation_modes.nearest(mode, rotations, before)
    assert rotation.angle_between(rotation_modes.to_rotations(mode, numbers), rotations).max() < ROUNDING_AT_LOCK
    last = "XYZ".index(mode[2])
    np.testing.assert_allclose(numbers[:, last], before[:, last], atol=1e-9)


@pytest.mark.parametrize("mode", MODES)
def test_numbers_follow_the_key_before(mode: str, rotations: np.ndarray) -> None:
    shifted = rotation_modes.nearest(mode, rotations, beside_nothing(mode, len(rotations))).copy()
    if mode == "QUATERNION":
        shifted *= -1.0
    elif mode == "AXIS_ANGLE":
        shifted[:, 0] += 4.0 * np.pi
    else:
        shifted += 2.0 * np.pi * np.array([1.0, -2.0, 3.0])
    numbers = rotation_modes.nearest(mode, rotations, shifted)
    np.testing.assert_allclose(numbers, shifted, atol=1e-9)


def test_axis_of_a_bone_that_has_not_turned_yet_is_the_one_it_will_turn_about() -> None:
    angles = np.array([0.0, 0.0, 0.2, 0.4, 0.0])
    axis = np.array([0.6, 0.0, 0.8])
    numbers = rotation_modes.continuous("AXIS_ANGLE", rotation.from_vector(angles[:, None] * axis)[:, None])[:, 0]
    np.testing.assert_allclose(numbers[:, 0], angles, atol=1e-12)
    np.testing.assert_allclose(numbers[:, 1:], np.tile(axis, (5, 1)), atol=1e-12)


def test_quaternion_without_a_direction_is_no_rotation() -> None:
    np.testing.assert_array_equal(rotation_modes.to_rotations("QUATERNION", np.zeros(4)), [1.0, 0.0, 0.0, 0.0])
    np.testing.assert_array_equal(
        rotation_modes.to_rotations("AXIS_ANGLE", np.array([1.0, 0.0, 0.0, 0.0])), [1.0, 0.0, 0.0, 0.0]
    )
