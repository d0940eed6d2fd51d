"""How the mouse moves what is held: the same pixels in every view."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from blender_support.views import front_view, looking, orthographic, perspective, random_view, shifted
from layfigure_blender.drag import NOTCH, SLOW, TURN, Drag
from layfigure_blender.view import View

from layfigure import rotation

PIXEL_TOLERANCE = 1e-6  # of pixels: rounding in matrices with coordinates up to 1e3
SEEDS = range(50)


def point_in_front(view: View, rng: np.random.Generator) -> np.ndarray:
    pixel = rng.uniform(0.0, [view.width, view.height])
    return view.point_under(pixel, rng.uniform(0.5, 10.0))


def random_view_and_drag(seed: int) -> tuple[np.random.Generator, View, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    view = random_view(rng)
    point = point_in_front(view, rng)
    return rng, view, point, view.pixels(point)


# --- views ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_point_under_its_own_pixel_at_its_depth_is_the_point(seed: int) -> None:
    _, view, point, pixel = random_view_and_drag(seed)
    np.testing.assert_allclose(view.point_under(pixel, view.depth(point)), point, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_ray_of_a_pixel_passes_through_all_that_the_pixel_shows(seed: int) -> None:
    _, view, point, pixel = random_view_and_drag(seed)
    origin, direction = view.ray(pixel)
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert direction @ view.back < 0.0
    aside = np.linalg.norm(np.cross(point - origin, direction))
    assert aside < 1e-9 * max(1.0, np.linalg.norm(point - origin))


def test_ray_begins_where_the_view_begins_to_draw() -> None:
    near = 0.3
    view = dataclasses.replace(front_view(), window_matrix=perspective(800, 600, near=near))
    assert view.depth(view.ray([123.0, 456.0])[0]) == pytest.approx(near)
    flat = dataclasses.replace(front_view(), window_matrix=orthographic(800, 600))
    assert flat.depth(flat.ray([123.0, 456.0])[0]) == pytest.approx(-1000.0)


def test_ray_keeps_its_direction_though_near_and_far_plane_are_worlds_apart() -> None:
    """As of a view with clip distances of 1 mm and 1000 km, in single precision as Blender has it."""
    window = perspective(800, 600, near=1e-3)
    far = 1e6
    window[2, 2], window[2, 3] = -(far + 1e-3) / (far - 1e-3), -2.0 * far * 1e-3 / (far - 1e-3)
    view = dataclasses.replace(front_view(), window_matrix=window.astype(np.float32).astype(np.float64))
    origin, direction = view.ray([400.0, 300.0])
    np.testing.assert_allclose(direction, [0.0, 1.0, 0.0], atol=1e-12)
    assert 0.0 <= view.depth(origin) < 0.1


def test_axes_are_those_of_the_screen() -> None:
    view = front_view()
    np.testing.assert_allclose([view.right, view.up, view.back], [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-15)
    assert view.pixels([0.0, 0.0, 1.0]).tolist() == [400.0, 300.0]
    assert view.pixels([0.1, 0.0, 1.1]) == pytest.approx(np.array([420.0, 320.0]))


def test_what_is_behind_the_eye_has_no_pixel_in_perspective_only() -> None:
    view = front_view()
    assert np.isnan(view.pixels([0.0, -5.0, 1.0])).all()
    flat = dataclasses.replace(view, window_matrix=orthographic(800, 600))
    assert flat.pixels([0.0, -5.0, 1.0]).tolist() == [400.0, 300.0]


@pytest.mark.parametrize("scale", [1.0, 0.01, 30.0])
@pytest.mark.parametrize("window", [perspective(800, 600), orthographic(800, 600)])
def test_pixel_size_is_the_length_of_one_pixel_in_the_world(window: np.ndarray, scale: float) -> None:
    view = View(front_view().view_matrix @ np.diag([scale, scale, scale, 1.0]), window, 800, 600)
    point = np.array([0.2, 0.1, 0.9]) / scale
    above = point + view.pixel_size(point) * view.up
    assert view.pixels(above) - view.pixels(point) == pytest.approx(np.array([0.0, 1.0]), abs=1e-9)


# --- moving ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_held_point_stays_under_the_mouse_at_its_depth(seed: int) -> None:
    rng, view, point, pixel = random_view_and_drag(seed)
    drag = Drag(point, pixel)
    for mouse in rng.uniform(-100.0, 3000.0, (20, 2)):
        drag.move(view, mouse)
        np.testing.assert_allclose(view.pixels(drag.position), mouse, atol=PIXEL_TOLERANCE)
    assert view.depth(drag.position) == pytest.approx(view.depth(point), rel=1e-9)
    np.testing.assert_array_equal(drag.turned, [1, 0, 0, 0])


@pytest.mark.parametrize("seed", SEEDS)
def test_way_back_ends_where_it_began(seed: int) -> None:
    rng, view, point, pixel = random_view_and_drag(seed)
    drag = Drag(point, pixel)
    for mouse in [*rng.uniform(0.0, 1000.0, (20, 2)), pixel]:
        drag.move(view, mouse)
    np.testing.assert_allclose(drag.position, point, atol=1e-9)


def test_point_that_was_taken_beside_the_mouse_keeps_its_distance_on_the_screen() -> None:
    view, point = front_view(), np.array([0.3, 0.0, 1.2])
    pixel = view.pixels(point)
    drag = Drag(point, shifted(pixel, 5.0, -3.0))
    drag.move(view, shifted(pixel, 105.0, 47.0))
    np.testing.assert_allclose(view.pixels(drag.position), shifted(pixel, 100.0, 50.0), atol=PIXEL_TOLERANCE)


@pytest.mark.parametrize("seed", SEEDS)
def test_wheel_moves_along_the_line_of_sight_and_back(seed: int) -> None:
    rng, view, point, pixel = random_view_and_drag(seed)
    drag = Drag(point, pixel)
    notches = rng.integers(1, 30)
    before = view.depth(point)
    for _ in range(notches):
        drag.wheel(view, 1.0)
        np.testing.assert_allclose(view.pixels(drag.position), pixel, atol=PIXEL_TOLERANCE)
        assert view.depth(drag.position) > before
        before = view.depth(drag.position)
    for _ in range(notches):
        drag.wheel(view, -1.0)
    np.testing.assert_allclose(drag.position, point, atol=1e-8)


def test_notch_of_the_wheel_is_a_share_of_the_distance_or_of_what_is_seen() -> None:
    view, point = front_view(), np.array([0.3, 0.5, 1.2])
    drag = Drag(point, view.pixels(point))
    drag.wheel(view, 1.0)
    assert view.depth(drag.position) == pytest.approx((1.0 + NOTCH) * 4.5)
    for seen in (0.1, 50.0):
        flat = dataclasses.replace(view, window_matrix=orthographic(800, 600, seen=seen))
        drag = Drag(point, flat.pixels(point))
        drag.wheel(flat, 2.0)
        np.testing.assert_allclose(drag.position - point, [0.0, 2.0 * NOTCH * seen * 600 / 800, 0.0], atol=1e-12)


def test_wheel_towards_the_eye_never_reaches_it() -> None:
    view, point = front_view(), np.array([0.3, 0.0, 1.2])
    drag = Drag(point, view.pixels(point))
    for _ in range(150):
        drag.wheel(view, -1.0)
    assert 0.0 < view.depth(drag.position) < 0.01
    np.testing.assert_allclose(view.pixels(drag.position), view.pixels(point), atol=1e-3)


# --- slowly ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_slow_is_a_share_of_the_way_and_does_not_jump_when_pressed_or_released(seed: int) -> None:
    _, view, point, pixel = random_view_and_drag(seed)
    drag = Drag(point, pixel)
    drag.move(view, shifted(pixel, 100.0, 0.0))
    for slow in (True, False, True, False):  # keys alone, the mouse rests
        drag.move(view, shifted(pixel, 100.0, 0.0), slow=slow)
    np.testing.assert_allclose(view.pixels(drag.position), shifted(pixel, 100.0, 0.0), atol=PIXEL_TOLERANCE)
    drag.move(view, shifted(pixel, 100.0, 40.0), slow=True)
    np.testing.assert_allclose(view.pixels(drag.position), shifted(pixel, 100.0, 40.0 * SLOW), atol=PIXEL_TOLERANCE)
    drag.move(view, shifted(pixel, 90.0, 40.0))
    np.testing.assert_allclose(view.pixels(drag.position), shifted(pixel, 90.0, 40.0 * SLOW), atol=PIXEL_TOLERANCE)


def test_slow_wheel_is_a_share_of_a_notch() -> None:
    view, point = front_view(), np.array([0.3, 0.0, 1.2])
    fast, slow = Drag(point, view.pixels(point)), Drag(point, view.pixels(point))
    fast.wheel(view, 1.0)
    for _ in range(round(1.0 / SLOW)):
        slow.wheel(view, 1.0, slow=True)
    np.testing.assert_allclose(slow.position, fast.position, atol=1e-12)


# --- turning --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", SEEDS)
def test_turning_leaves_the_place_and_rolls_the_front_along_with_the_mouse(seed: int) -> None:
    rng, view, point, pixel = random_view_and_drag(seed)
    drag = Drag(point, pixel)
    way = rng.uniform(-30.0, 30.0, 2)
    drag.move(view, pixel + way, turn=True)
    np.testing.assert_array_equal(drag.position, point)
    assert np.linalg.norm(rotation.to_vector(drag.turned)) == pytest.approx(TURN * np.linalg.norm(way))
    front = rotation.rotate(drag.turned, view.back)
    moved = np.array([front @ view.right, front @ view.up])
    assert moved @ way == pytest.approx(np.linalg.norm(moved) * np.linalg.norm(way))


@pytest.mark.parametrize("seed", SEEDS)
def test_moving_after_turning_goes_on_without_a_jump(seed: int) -> None:
    _, view, point, pixel = random_view_and_drag(seed)
    drag = Drag(point, pixel)
    drag.move(view, shifted(pixel, 50.0, 20.0), turn=True)
    turned = drag.turned
    drag.move(view, shifted(pixel, 53.0, 20.0))
    np.testing.assert_allclose(view.pixels(drag.position), shifted(pixel, 3.0, 0.0), atol=PIXEL_TOLERANCE)
    np.testing.assert_array_equal(drag.turned, turned)


def test_wheel_turns_about_the_line_of_sight() -> None:
    view, point = front_view(), np.array([0.3, 0.0, 1.2])
    drag = Drag(point, view.pixels(point))
    drag.wheel(view, 2.0, turn=True)
    np.testing.assert_array_equal(drag.position, point)
    right = rotation.rotate(drag.turned, view.right)
    assert right @ view.up > 0.1  # counter-clockwise
    np.testing.assert_allclose(rotation.rotate(drag.turned, view.back), view.back, atol=1e-12)


def test_turning_stays_a_rotation_after_very_many_motions() -> None:
    rng, view = np.random.default_rng(5), front_view()
    drag = Drag(np.array([0.0, 0.0, 1.0]), [400.0, 300.0])
    for mouse in rng.uniform(0.0, 800.0, (5000, 2)):
        drag.move(view, mouse, turn=True)
    assert np.linalg.norm(drag.turned) == pytest.approx(1.0, abs=1e-14)


def test_screen_of_high_resolution_turns_as_much_for_the_same_way_of_the_hand() -> None:
    view = front_view()
    fine = dataclasses.replace(view, width=1600, height=1200, scale=2.0)
    coarse_drag, fine_drag = (Drag([0.0, 0.0, 1.0], [0.0, 0.0]) for _ in range(2))
    coarse_drag.move(view, [30.0, 10.0], turn=True)
    fine_drag.move(fine, [60.0, 20.0], turn=True)
    np.testing.assert_allclose(fine_drag.turned, coarse_drag.turned, atol=1e-15)


# --- the view changes -----------------------------------------------------------------------------------------------


def test_camera_that_moves_during_the_drag_does_not_take_along_what_is_held() -> None:
    rng = np.random.default_rng(3)
    view, point = front_view(), np.array([0.3, 0.0, 1.2])
    mouse = view.pixels(point)
    drag = Drag(point, mouse)
    for _ in range(20):
        eye = np.array([0.0, -4.0, 1.0]) + rng.normal(0.0, 0.5, 3)
        view = dataclasses.replace(view, view_matrix=looking(eye, np.array([0.0, 0.0, 1.0])))
        drag.move(view, mouse)
        np.testing.assert_allclose(drag.position, point, atol=1e-12)
    before = view.pixels(drag.position)
    drag.move(view, shifted(mouse, 7.0, -2.0))
    np.testing.assert_allclose(view.pixels(drag.position) - before, [7.0, -2.0], atol=PIXEL_TOLERANCE)


def test_eye_that_has_passed_what_is_held_leaves_it_where_it_is() -> None:
    view = front_view()
    behind = np.array([0.3, -5.0, 1.2])
    drag = Drag(behind, [400.0, 300.0])
    drag.move(view, [500.0, 300.0])
    drag.wheel(view, 3.0)
    np.testing.assert_array_equal(drag.position, behind)
    drag.move(view, [510.0, 300.0], turn=True)
    assert drag.turned[0] < 1.0
