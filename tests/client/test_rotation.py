import math

import numpy as np
import pytest
from client_support import synthetic

from layfigure import rotation

RANDOM = np.random.default_rng(7)


def random_rotations(count: int) -> np.ndarray:
    return rotation.normalized(RANDOM.normal(size=(count, 4)))


def test_multiply_two_rotations_equals_product_of_matrices() -> None:
    a, b = random_rotations(20), random_rotations(20)
    expected = rotation.to_matrix(a) @ rotation.to_matrix(b)
    np.testing.assert_allclose(rotation.to_matrix(rotation.multiply(a, b)), expected, atol=1e-14)


def test_to_matrix_random_rotations_equals_textbook_formula() -> None:
    for q in random_rotations(20):
        np.testing.assert_allclose(rotation.to_matrix(q), synthetic.matrix(q, np.zeros(3))[:3, :3], atol=1e-14)


def test_rotate_vectors_equals_matrix_product() -> None:
    q, v = random_rotations(20), RANDOM.normal(size=(20, 3))
    np.testing.assert_allclose(rotation.rotate(q, v), np.einsum("nij,nj->ni", rotation.to_matrix(q), v), atol=1e-14)


def test_slerp_halfway_splits_the_angle() -> None:
    a, b = random_rotations(20), random_rotations(20)
    middle = rotation.slerp(a, b, np.full(20, 0.5))
    whole = rotation.angle_between(a, b)
    np.testing.assert_allclose(rotation.angle_between(a, middle), whole / 2, atol=1e-12)
    np.testing.assert_allclose(rotation.angle_between(middle, b), whole / 2, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3])
def test_slerp_nearly_equal_rotations_stays_exact(angle: float) -> None:
    a, b = synthetic.quaternion((0, 0, 1), 0.2), synthetic.quaternion((0, 0, 1), 0.2 + angle)
    third = rotation.slerp(a[None], b[None], np.array([1 / 3]))[0]
    expected = synthetic.quaternion((0, 0, 1), 0.2 + angle / 3)
    np.testing.assert_allclose(third, expected, atol=1e-15)


def test_slerp_opposite_signs_takes_the_short_way() -> None:
    a, b = synthetic.quaternion((0, 0, 1), 0.0), -synthetic.quaternion((0, 0, 1), 0.4)
    middle = rotation.slerp(a[None], b[None], np.array([0.5]))[0]
    assert rotation.angle_between(middle, synthetic.quaternion((0, 0, 1), 0.2)) < 1e-12


def test_angle_between_q_and_minus_q_is_zero() -> None:
    q = random_rotations(5)
    np.testing.assert_allclose(rotation.angle_between(q, -q), 0.0, atol=1e-7)


def test_in_one_hemisphere_full_turn_has_no_sign_jump() -> None:
    angles = np.linspace(0.0, 4.0 * math.pi, 100)
    turns = np.array([[synthetic.quaternion((1, 1, 0), angle % (2 * math.pi))] for angle in angles])
    smooth = rotation.in_one_hemisphere(turns)
    assert np.min(np.sum(smooth[1:] * smooth[:-1], axis=-1)) > 0.9
    np.testing.assert_array_equal(np.abs(smooth), np.abs(turns))
