"""What of an armature is under the mouse."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from blender_support.views import front_view, orthographic, random_view, shifted
from layfigure_blender.picking import BONE_RADIUS, POINT_RADIUS, nearest_bone, point_under

VIEW = front_view()


def bones(*segments: tuple[list[float], list[float]]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([a for a, _ in segments], float), np.array([b for _, b in segments], float)


def test_bone_is_hit_along_its_whole_length_and_not_beyond() -> None:
    heads, tails = bones(([-0.5, 0, 1], [0.5, 0, 1]))
    left, right = VIEW.pixels(heads)[0], VIEW.pixels(tails)[0]
    for share in (0.0, 0.3, 1.0):
        pixel = (1 - share) * left + share * right
        hit = nearest_bone(VIEW, shifted(pixel, 0.0, 3.0), heads, tails)
        assert hit is not None
        assert hit.distance == pytest.approx(3.0)
        np.testing.assert_allclose(hit.point, [share - 0.5, 0.0, 1.0], atol=1e-9)
    beyond = nearest_bone(VIEW, shifted(right, 20.0, 0.0), heads, tails)
    assert beyond is not None
    assert beyond.distance == pytest.approx(20.0)
    assert beyond.distance > BONE_RADIUS
    np.testing.assert_allclose(beyond.point, tails[0], atol=1e-9)


@pytest.mark.parametrize("seed", range(30))
def test_point_on_the_bone_is_the_one_that_is_drawn_nearest_to_the_mouse(seed: int) -> None:
    rng = np.random.default_rng(seed)
    view = random_view(rng)
    ends = [view.point_under(rng.uniform(0, 1000, 2), rng.uniform(0.5, 20.0)) for _ in range(2)]
    mouse = rng.uniform(0, 1000, 2)
    hit = nearest_bone(view, mouse, ends[0][None], ends[1][None])
    assert hit is not None
    shares = np.linspace(0.0, 1.0, 2001)[:, None]
    distances = np.linalg.norm(view.pixels(ends[0] + shares * (ends[1] - ends[0])) - mouse, axis=-1)
    assert hit.distance <= distances.min() + 1e-6
    assert np.linalg.norm(view.pixels(hit.point) - mouse) == pytest.approx(hit.distance, abs=1e-6)
    along = ends[1] - ends[0]
    assert np.linalg.norm(np.cross(hit.point - ends[0], along)) < 1e-6 * (along @ along)


def test_nearest_bone_on_the_screen_wins_and_of_crossing_ones_the_front_one() -> None:
    heads, tails = bones(([-1, 0, 1.0], [1, 0, 1.0]), ([-1, 0, 1.05], [1, 0, 1.05]), ([0, -1, 0.5], [0, -1, 1.5]))
    between = VIEW.pixels([0.8, 0.0, 1.04])
    assert nearest_bone(VIEW, between, heads, tails).index == 1  # type: ignore[union-attr]
    crossing = VIEW.pixels([0.0, 0.0, 1.0])
    assert nearest_bone(VIEW, crossing, heads, tails).index == 2  # type: ignore[union-attr]
    order = [2, 1, 0]
    assert nearest_bone(VIEW, crossing, heads[order], tails[order]).index == 0  # type: ignore[union-attr]


def test_bone_through_the_eye_is_hit_where_it_is_seen() -> None:
    heads, tails = bones(([0.1, -6.0, 1.0], [0.1, 2.0, 1.0]))
    hit = nearest_bone(VIEW, VIEW.pixels([0.1, 1.0, 1.0]), heads, tails)
    assert hit is not None
    assert hit.distance < 1e-6
    np.testing.assert_allclose(hit.point, [0.1, 1.0, 1.0], atol=1e-6)


def test_bones_behind_the_eye_are_not_there_and_no_bone_is_no_hit() -> None:
    assert nearest_bone(VIEW, [400.0, 300.0], *bones(([0, -5, 1], [0, -6, 1]))) is None
    assert nearest_bone(VIEW, [400.0, 300.0], np.zeros((0, 3)), np.zeros((0, 3))) is None
    flat = dataclasses.replace(VIEW, window_matrix=orthographic(800, 600))
    assert nearest_bone(flat, [400.0, 300.0], *bones(([0, -5, 1], [0, -6, 1]))) is not None


def test_bone_without_length_is_a_point() -> None:
    hit = nearest_bone(VIEW, [404.0, 303.0], *bones(([0, 0, 1], [0, 0, 1])))
    assert hit is not None
    assert hit.distance == pytest.approx(5.0)
    np.testing.assert_array_equal(hit.point, [0, 0, 1])


def test_distance_is_told_in_points_of_the_screen() -> None:
    fine = dataclasses.replace(VIEW, width=1600.0, height=1200.0, scale=2.0)
    hit = nearest_bone(fine, [800.0, 610.0], *bones(([-1, 0, 1], [1, 0, 1])))
    assert hit is not None
    assert hit.distance == pytest.approx(5.0)


def test_marker_is_hit_within_its_radius() -> None:
    points = np.array([[0.0, 0.0, 1.0], [0.05, 0.0, 1.0], [0.0, -9.0, 1.0]])
    second = VIEW.pixels(points[1])
    assert point_under(VIEW, shifted(second, 4.0, 0.0), points) == 1
    assert point_under(VIEW, shifted(second, -8.0, 0.0), points) == 0
    assert point_under(VIEW, shifted(second, POINT_RADIUS + 0.1, 0.0), points) is None
    assert point_under(VIEW, second, points[2:]) is None
    assert point_under(VIEW, second, np.zeros((0, 3))) is None
