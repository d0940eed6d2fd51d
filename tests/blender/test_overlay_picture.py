"""What is drawn over a view, as triangles."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from blender_support.views import front_view, orthographic
from layfigure_blender import overlay_picture as overlay
from layfigure_blender import strokes
from layfigure_blender.overlay_picture import (
    LEAST_FORCE,
    Hand,
    Measures,
    force_arrow,
    force_text,
    hands_of,
    look_alike,
    picture,
)
from layfigure_blender.strokes import FEATHER, Triangles

from layfigure import Device, Force

VIEW = front_view()
PLACE = np.array([0.1, 0.0, 1.1])
NO_PINS = np.zeros((0, 3))
NO_BONES = (np.zeros((0, 3)), np.zeros((0, 3)))
COLOR = (0.2, 0.4, 0.6, 0.8)
WEIGHT = 50.0  # [N]


def areas(triangles: Triangles) -> np.ndarray:
    a, b, c = np.moveaxis(triangles.points.reshape(-1, 3, 2), 1, 0)
    u, v = b - a, c - a
    return np.asarray(0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]))


def painted(triangles: Triangles) -> float:
    """The area, each part weighted by its alpha."""
    return float(areas(triangles) @ triangles.colors[:, 3].reshape(-1, 3).mean(axis=1))


def hand(force: list[float], target: np.ndarray | None = PLACE) -> Hand:
    return Hand(PLACE, target, np.array(force))


def force_message(pointer: int, attached: bool) -> Force:
    zero = np.zeros(3)
    return Force(0, 1, 0, pointer, "grab" if attached else "none", attached, attached, 0, PLACE, 2 * PLACE, *[zero] * 4)


def device(pointer: int) -> Device:
    return Device("spidar-g6", pointer, "ok", "", 0, 1.0, 0.0, 0.0, 0.0, 1e3, 1e3, 0, 1.0, 1.0, 1.0, False)


# --- strokes --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("width", [1.0, 2.5, 8.0])
def test_line_paints_its_length_times_its_width_and_fades_at_its_edges(width: float) -> None:
    triangles = strokes.lines([[10.0, 20.0]], [[40.0, 60.0]], width, COLOR)
    assert painted(triangles) == pytest.approx(50.0 * width * COLOR[3])
    along = np.array([0.6, 0.8])
    aside = np.abs((triangles.points - [10.0, 20.0]) @ [-along[1], along[0]])
    assert aside.max() == pytest.approx(0.5 * (width + FEATHER))
    np.testing.assert_allclose(triangles.colors[aside == aside.max(), 3], 0.0)
    assert triangles.colors[:, 3].max() == pytest.approx(COLOR[3])
    np.testing.assert_allclose(triangles.colors[:, :3], np.tile(COLOR[:3], (len(triangles.colors), 1)))


def test_lines_without_length_or_place_are_left_out() -> None:
    starts = [[0.0, 0.0], [1.0, 1.0], [np.nan, 0.0], [5.0, 5.0]]
    ends = [[3.0, 4.0], [1.0, 1.0], [1.0, 0.0], [5.0, np.nan]]
    triangles = strokes.lines(starts, ends, 2.0, COLOR)
    np.testing.assert_array_equal(triangles.points, strokes.lines(starts[:1], ends[:1], 2.0, COLOR).points)
    assert len(strokes.lines(np.zeros((0, 2)), np.zeros((0, 2)), 2.0, COLOR).points) == 0


def test_disc_and_ring_paint_their_areas() -> None:
    polygon = 0.5 * strokes.SIDES * np.sin(2.0 * np.pi / strokes.SIDES)  # of radius 1
    disc = strokes.disc([50.0, 50.0], 20.0, COLOR)
    assert painted(disc) == pytest.approx(polygon * 20.0**2 * COLOR[3], rel=1e-3)
    ring = strokes.ring([50.0, 50.0], 20.0, 4.0, COLOR)
    assert painted(ring) == pytest.approx(polygon * (22.0**2 - 18.0**2) * COLOR[3], rel=1e-3)
    for shape in (disc, ring):
        np.testing.assert_allclose(shape.points.mean(axis=0), [50.0, 50.0], atol=1e-9)
    assert len(strokes.disc([np.nan, 0.0], 20.0, COLOR).points) == 0


@pytest.mark.parametrize("length", [100.0, 9.0, 0.5])
def test_arrow_ends_at_its_tip_however_short_it_is(length: float) -> None:
    triangles = strokes.arrow([0.0, 0.0], [length, 0.0], 4.0, COLOR)
    assert np.isfinite(triangles.points).all()
    assert triangles.points[:, 0].max() == pytest.approx(length, abs=FEATHER)
    assert triangles.points[:, 0].min() == pytest.approx(0.0, abs=FEATHER)
    assert len(strokes.arrow([3.0, 3.0], [3.0, 3.0], 4.0, COLOR).points) == 0


# --- forces ---------------------------------------------------------------------------------------------------------


def test_force_arrow_points_along_the_force_and_grows_with_it() -> None:
    lengths = []
    for size in (1.0, WEIGHT, 1e5):
        start, end = force_arrow(VIEW, PLACE, np.array([0.0, 0.0, size]), WEIGHT)
        np.testing.assert_allclose(start, VIEW.pixels(PLACE))
        assert end[0] == pytest.approx(start[0], abs=1e-9)
        lengths.append(end[1] - start[1])
    assert 0.0 < lengths[0] < lengths[1] < lengths[2] < overlay.LONGEST_ARROW
    assert lengths[1] == pytest.approx(0.5 * overlay.LONGEST_ARROW)


def test_force_arrow_is_as_long_in_flat_views_and_on_fine_screens() -> None:
    force = np.array([WEIGHT, 0.0, 0.0])
    flat = dataclasses.replace(VIEW, window_matrix=orthographic(800, 600, seen=30.0))
    fine = dataclasses.replace(VIEW, width=1600.0, height=1200.0, scale=2.0)
    for view, length in ((VIEW, 60.0), (flat, 60.0), (fine, 120.0)):
        start, end = force_arrow(view, PLACE, force, WEIGHT)
        assert end - start == pytest.approx(np.array([length, 0.0]), abs=1e-6)


def test_force_arrow_towards_the_eye_is_short_and_none_is_no_arrow() -> None:
    start, end = force_arrow(VIEW, PLACE, np.array([0.0, -WEIGHT, 0.0]), WEIGHT)
    assert np.linalg.norm(end - start) < 0.2 * overlay.LONGEST_ARROW
    start, end = force_arrow(VIEW, PLACE, np.zeros(3), WEIGHT)
    np.testing.assert_array_equal(start, end)


def test_force_is_told_in_newtons() -> None:
    assert [force_text(f) for f in (0.26, 3.04, 42.0, 99.96, 1234.5)] == ["0.3 N", "3.0 N", "42.0 N", "100 N", "1234 N"]


# --- the whole ------------------------------------------------------------------------------------------------------


def test_nothing_to_show_is_an_empty_picture() -> None:
    empty = picture(VIEW, [], NO_PINS, NO_BONES, WEIGHT)
    assert (len(empty.triangles.points), len(empty.triangles.colors), empty.labels) == (0, 0, ())


def test_hand_is_drawn_from_the_held_point_to_its_pointer_with_its_force() -> None:
    target = PLACE + np.array([0.2, 0.0, 0.1])
    drawn = picture(VIEW, [hand([20.0, 0.0, 10.0], target)], NO_PINS, NO_BONES, WEIGHT)
    points = drawn.triangles.points
    for place in (PLACE, target):
        assert np.linalg.norm(points - VIEW.pixels(place), axis=-1).min() < 10.0
    colors = {tuple(color[:3]) for color in drawn.triangles.colors}
    assert colors == {overlay.HAND[:3], overlay.FORCE[:3], overlay.BACKGROUND[:3]}
    (label,) = drawn.labels
    assert label.text == "22.4 N"
    assert np.linalg.norm(label.place - VIEW.pixels(PLACE)) < 30.0


def test_label_keeps_clear_of_the_arrow() -> None:
    at = VIEW.pixels(PLACE)
    for up in (1.0, -1.0):
        (label,) = picture(VIEW, [hand([0.0, 0.0, up * 20.0])], NO_PINS, NO_BONES, WEIGHT).labels
        assert (label.place[1] - at[1]) * up < 0.0


def test_hand_that_holds_nothing_is_a_ring_without_a_label() -> None:
    drawn = picture(VIEW, [hand([0.0, 0.0, 0.0], None)], NO_PINS, NO_BONES, WEIGHT)
    distances = np.linalg.norm(drawn.triangles.points - VIEW.pixels(PLACE), axis=-1)
    assert 5.0 < distances.min() <= distances.max() < 13.0
    assert drawn.labels == ()


def test_pins_and_yielding_bones_are_drawn_where_they_are() -> None:
    pins = np.array([[0.3, 0.0, 1.0], [-0.3, 0.0, 1.0]])
    drawn = picture(VIEW, [], pins, NO_BONES, WEIGHT)
    for pin in pins:
        assert np.linalg.norm(drawn.triangles.points - VIEW.pixels(pin), axis=-1).min() < 1.0
    head, tail = np.array([[0.0, 0.0, 0.5]]), np.array([[0.0, 0.0, 0.9]])
    points = picture(VIEW, [], NO_PINS, (head, tail), WEIGHT).triangles.points
    low, high = VIEW.pixels(head)[0], VIEW.pixels(tail)[0]
    assert [points[:, 1].min(), points[:, 1].max()] == pytest.approx([low[1], high[1]])
    assert np.abs(points[:, 0] - low[0]).max() < 5.0


def test_all_that_is_behind_the_eye_is_left_out() -> None:
    behind = np.array([0.0, -6.0, 1.0])
    bones = (behind[None], behind[None] + [0.0, 0.0, 0.1])
    away = Hand(behind, behind, np.array([5.0, 0.0, 0.0]))
    drawn = picture(VIEW, [away, dataclasses.replace(away, target=None)], behind[None], bones, WEIGHT)
    assert len(drawn.triangles.points) == 0
    assert drawn.labels == ()


def test_bone_through_the_eye_is_drawn_as_far_as_it_is_seen() -> None:
    bones = (np.array([[0.1, -6.0, 1.0]]), np.array([[0.1, 2.0, 1.0]]))
    triangles = picture(VIEW, [], NO_PINS, bones, WEIGHT).triangles
    assert len(triangles.points) > 0
    assert np.isfinite(triangles.points).all()


def test_hands_are_those_with_a_tool_and_those_of_devices() -> None:
    forces = [force_message(0, False), force_message(3, True), force_message(15, False)]
    seen = hands_of(forces, [device(0), device(1)])
    assert [shown.target is not None for shown in seen] == [False, True]
    np.testing.assert_array_equal(seen[1].target, 2 * PLACE)
    assert hands_of([], [device(0)]) == []


# --- whether to draw anew -------------------------------------------------------------------------------------------

DOLL = Measures(size=1.7, weight=WEIGHT)
PIXEL = 1.7 / 500.0  # [m], where the doll is 500 pixels high


@pytest.mark.parametrize(
    ("moved", "alike"),
    [
        ({}, True),
        ({"place": PLACE + 0.1 * PIXEL}, True),
        ({"place": PLACE + PIXEL}, False),
        ({"target": PLACE - 0.1 * PIXEL}, True),
        ({"target": PLACE - PIXEL}, False),
        ({"target": None}, False),
        ({"force": np.array([0.0, 0.0, 3.0 + 0.2 * LEAST_FORCE])}, True),
        ({"force": np.array([0.0, 0.0, 3.1])}, False),
    ],
)
def test_hands_are_drawn_anew_when_it_can_be_seen(moved: dict[str, np.ndarray], alike: bool) -> None:
    before = hand([0.0, 0.0, 3.0])
    assert look_alike([before], [dataclasses.replace(before, **moved)], DOLL) is alike
    assert not look_alike([before], [], DOLL)
    assert not look_alike([], [before], DOLL)
