from pathlib import Path

import numpy as np
import pytest
from client_support.takes import make_take
from PIL import Image

from layfigure.errors import LayfigureError, UsageError
from layfigure.plots import write_force_plot
from layfigure.preview import write_contact_sheet
from layfigure.protocol import Floats
from layfigure.render.camera import View, frame_points, picture_aspect, view_axes
from layfigure.render.scene import Scene, Surface, to_srgb
from layfigure.take import Take
from layfigure.usd.writer import write_take

RANDOM = np.random.default_rng(3)


@pytest.fixture
def usd(take: Take, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("layfigure.preview._PANEL_PIXELS", 40_000)  # smaller than a user's, for speed
    write_take(take, tmp_path / "take.usda", 24.0)
    return tmp_path / "take.usda"


def project(points: Floats, view: View, aspect: float) -> tuple[Floats, Floats]:
    camera = frame_points(points, aspect, view)
    relative = points - camera.position
    depth = relative @ camera.forward
    assert depth.min() > 0.0
    x = relative @ camera.right / depth / camera.tan_half_width
    return x, relative @ camera.up / depth / camera.tan_half_height


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_frame_points_sees_all_of_them_and_no_more_than_needed(aspect: float) -> None:
    points = RANDOM.normal(size=(200, 3)) * [0.5, 0.3, 2.0] + [5.0, -3.0, 1.0]
    x, y = project(points, View(), aspect)
    limit = 1.0 / View().margin
    assert max(np.abs(x).max(), np.abs(y).max()) == pytest.approx(limit, rel=1e-9)


def test_view_axes_are_orthonormal_and_right_handed() -> None:
    right, up, forward = view_axes(View())
    np.testing.assert_allclose(np.cross(right, up), -forward, atol=1e-15)
    assert up[2] > 0.9
    assert right @ np.array([1.0, 0.0, 0.0]) > 0.8  # a character's left is on the picture's right


def test_picture_aspect_flat_and_tall_points_stay_in_bounds() -> None:
    tall = np.array([[0, 0, 0], [0, 0, 9.0]])
    flat = np.array([[0, 0, 0], [9.0, 0, 0]])
    assert picture_aspect(tall, View(), 0.5, 2.0) == 0.5
    assert picture_aspect(flat, View(), 0.5, 2.0) == 2.0


def box() -> Surface:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (0, 2)], np.float64)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))], np.int32)
    return Surface(corners, triangles, np.array([0.7, 0.1, 0.1]))


def render_box(seed: int = 0) -> Floats:
    surface = box()
    camera = frame_points(surface.points, 1.0, View())
    return Scene([surface], floor=0.0, centre=np.array([0, 0, 1.0]), radius=2.0).render(camera, 64, 64, 4, seed)


def test_scene_red_box_is_red_in_the_middle_and_grey_around() -> None:
    picture = render_box()
    middle, corner = picture[32, 32], picture[0, 0]
    assert middle[0] > 2.0 * middle[1]
    assert np.ptp(corner) < 0.05
    assert picture.min() >= 0.0
    assert picture.max() <= 1.0


def test_scene_floor_is_darker_where_the_box_keeps_the_light_off() -> None:
    surface = box()
    camera = frame_points(surface.points * [3.0, 3.0, 1.0], 1.0, View())
    lit = Scene([], floor=0.0, centre=np.zeros(3), radius=2.0).render(camera, 64, 64, 4)
    shadowed = Scene([surface], floor=0.0, centre=np.zeros(3), radius=2.0).render(camera, 64, 64, 4)
    grey = np.ptp(shadowed, axis=2) < 0.03
    assert (lit[grey] - shadowed[grey]).max() > 0.1


def test_scene_rendered_twice_gives_equal_pictures() -> None:
    np.testing.assert_array_equal(render_box(), render_box())


def test_to_srgb_ends_and_middle_follow_the_curve() -> None:
    assert to_srgb(np.array([-1.0, 0.0, 0.0021404, 0.214041, 1.0, 7.0])).tolist() == [0, 0, 7, 127, 255, 255]


def test_contact_sheet_shows_six_frames_that_differ(usd: Path, tmp_path: Path) -> None:
    frames = write_contact_sheet(usd, tmp_path / "sheet.png")
    assert frames == [0.0, 5.0, 10.0, 14.0, 19.0, 24.0]
    sheet = np.asarray(Image.open(tmp_path / "sheet.png"))
    height, width, _ = sheet.shape
    assert width > 400
    first, second = sheet[: height // 2, : width // 3], sheet[: height // 2, width // 3 : 2 * (width // 3)]
    assert first.std() > 5.0
    assert np.abs(first.astype(int) - second).max() > 50


def test_contact_sheet_same_file_gives_equal_bytes(usd: Path, tmp_path: Path) -> None:
    for name in ("a.png", "b.png"):
        write_contact_sheet(usd, tmp_path / name, [3.0])
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize("frames", [[-1.0], [0.0, 25.0]])
def test_contact_sheet_frame_outside_the_take_is_a_usage_error(usd: Path, tmp_path: Path, frames: list[float]) -> None:
    with pytest.raises(UsageError, match="outside the take: 0 to 24"):
        write_contact_sheet(usd, tmp_path / "sheet.png", frames)
    assert not (tmp_path / "sheet.png").exists()


def test_contact_sheet_too_many_frames_are_a_usage_error(usd: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="61, at most 60"):
        write_contact_sheet(usd, tmp_path / "sheet.png", [1.0] * 61)


def test_contact_sheet_file_without_skinned_mesh_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.usda").write_text('#usda 1.0\ndef Xform "A" {}\n')
    with pytest.raises(LayfigureError, match="holds no skinned mesh"):
        write_contact_sheet(tmp_path / "empty.usda", tmp_path / "sheet.png")


def test_force_plot_draws_forces_and_joints(take: Take, tmp_path: Path) -> None:
    write_force_plot(take, tmp_path / "plot.png")
    plot = np.asarray(Image.open(tmp_path / "plot.png").convert("RGB"))
    assert plot.shape[1] > 1000
    blue = (plot[..., 2].astype(int) - plot[..., 0]) > 100
    assert blue[: len(blue) // 2].sum() > 500  # the force above, a joint's torque below
    assert blue[len(blue) // 2 :].sum() > 500


def test_force_plot_take_without_pointers_is_drawn(tmp_path: Path) -> None:
    from dataclasses import replace

    write_force_plot(replace(make_take(5), pointers=()), tmp_path / "plot.png")
    assert Image.open(tmp_path / "plot.png").size[0] > 1000
