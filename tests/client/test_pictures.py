import sys
from argparse import ArgumentTypeError
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from client_support import synthetic, usd_files
from client_support.takes import make_take
from PIL import Image
from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade, UsdSkel, Vt

from layfigure.cli.pictures import frame_list, picture_size
from layfigure.errors import LayfigureError, UsageError
from layfigure.loads import loads_of_take
from layfigure.plots import write_force_plot
from layfigure.preview import write_animated_gif, write_contact_sheet
from layfigure.protocol import Floats
from layfigure.render.camera import View, frame_points, picture_aspect, view_axes
from layfigure.render.scene import Ground, Renderer, Surface, from_srgb, to_srgb
from layfigure.render.shapes import arrow, ball
from layfigure.take import Take
from layfigure.usd.reader import SkinnedStage
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


GROUND = Ground(height=0.0, centre=np.array([0.0, 0.0, 1.0]), radius=2.0)


def render(*surfaces: Surface, size: int = 64) -> Floats:
    camera = frame_points(box().points * [3.0, 3.0, 1.0], 1.0, View())
    with Renderer(size, size) as renderer:
        return np.asarray(renderer.render([*surfaces], camera, GROUND), np.float64)


def test_renderer_red_box_is_red_in_the_middle_and_grey_around() -> None:
    picture = render(box())
    middle, corner = picture[32, 32], picture[0, 0]
    assert middle[0] > 2.0 * middle[1]
    assert np.ptp(corner) < 15


def test_renderer_box_throws_a_shadow_on_the_ground() -> None:
    empty, shadowed = render(), render(box())
    grey = np.ptp(shadowed, axis=2) < 20
    assert (empty[grey] - shadowed[grey]).max() > 25


def test_renderer_sides_are_shaded_differently() -> None:
    picture = render(box(), size=200)
    red = picture[..., 0] > 2.0 * picture[..., 1]
    assert np.ptp(picture[red][:, 0]) > 40


def test_renderer_colours_of_triangles_and_of_vertices_are_seen() -> None:
    surface = box()
    blue_vertices = np.tile([0.0, 0.0, 0.8], (8, 1))
    green_triangles = np.tile([0.0, 0.8, 0.0], (12, 1))
    by_vertex = render(replace(surface, color=blue_vertices, of_vertices=True))[32, 32]
    by_triangle = render(replace(surface, color=green_triangles))[32, 32]
    assert by_vertex.argmax() == 2
    assert by_triangle.argmax() == 1


def test_renderer_draws_one_picture_after_the_other() -> None:
    camera = frame_points(box().points, 1.0, View())
    with Renderer(64, 64) as renderer:
        pictures = [np.asarray(renderer.render(surfaces, camera, GROUND)) for surfaces in ([box()], [], [box()])]
    np.testing.assert_array_equal(pictures[0], pictures[2])
    assert np.abs(pictures[0].astype(int) - pictures[1]).max() > 50


def test_renderer_hand_inside_of_a_body_shines_through_it_and_a_body_does_not() -> None:
    middle = box().points.mean(axis=0)
    hand = ball(middle, 0.2, np.array([0.0, 0.0, 1.0]))
    alone, hidden, shining = render(box()), render(box(), replace(hand, shines_through=False)), render(box(), hand)
    np.testing.assert_array_equal(hidden[32, 32], alone[32, 32])
    assert shining[32, 32, 2] > alone[32, 32, 2] + 30.0
    assert shining[32, 32, 0] > 0.4 * alone[32, 32, 0]  # faintly
    np.testing.assert_array_equal(shining[0, 0], alone[0, 0])


def test_renderer_without_egl_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("layfigure.render.scene._EGL", "libNoSuchThing.so.1")
    with pytest.raises(LayfigureError, match="apt-get install libegl1 libgl1-mesa-dri"):
        Renderer(64, 64)


def test_renderer_without_vtk_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "layfigure.render.vtk_parts", raising=False)
    monkeypatch.delattr("layfigure.render.vtk_parts", raising=False)
    monkeypatch.setitem(sys.modules, "vtkmodules.vtkRenderingCore", None)
    with pytest.raises(LayfigureError, match=r"pip install 'layfigure\[preview\]'"):
        Renderer(64, 64)


def test_from_srgb_undoes_to_srgb() -> None:
    levels = np.arange(256)
    np.testing.assert_array_equal(to_srgb(from_srgb(levels / 255.0)), levels)


def test_arrow_reaches_from_start_to_tip() -> None:
    start, vector = np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, -2.0])
    points = arrow(start, vector, 0.05, np.ones(3)).points
    np.testing.assert_allclose([points[:, 2].max(), points[:, 2].min()], [3.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(np.ptp(points[:, :2], axis=0), 2.0 * 2.4 * 0.05, rtol=0.1)


def test_arrow_short_one_is_not_longer_than_its_vector() -> None:
    points = arrow(np.zeros(3), np.array([1e-3, 0.0, 0.0]), 0.05, np.ones(3)).points
    assert (points[:, 0].min(), points[:, 0].max()) == pytest.approx((0.0, 1e-3))


def test_ball_has_its_radius_everywhere() -> None:
    points = ball(np.ones(3), 0.2, np.ones(3)).points
    np.testing.assert_allclose(np.linalg.norm(points - 1.0, axis=1), 0.2)


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


@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("meters_per_unit", [0.01, 1.0])
def test_contact_sheet_other_units_and_axes_give_the_same_picture(
    tmp_path: Path, up_axis: str, meters_per_unit: float
) -> None:
    sheets = []
    for number, layout in enumerate([("Y", 0.01), (up_axis, meters_per_unit)]):
        file = usd_files.write_figure(tmp_path / f"{number}.usda", *layout, skeletons=2)
        write_contact_sheet(file, tmp_path / f"{number}.png", [13.0], (120, 160))
        sheets.append(np.asarray(Image.open(tmp_path / f"{number}.png")).astype(float))
    assert np.abs(sheets[0] - sheets[1]).mean() < 1.0


def test_contact_sheet_size_is_that_of_each_picture(tmp_path: Path) -> None:
    file = usd_files.write_figure(tmp_path / "f.usda")
    write_contact_sheet(file, tmp_path / "f.png", [1.0, 13.0], (200, 100))
    width, height = Image.open(tmp_path / "f.png").size
    assert width in (208 + 8, 2 * 208 + 8)
    assert height > 100


def test_contact_sheet_shows_blend_shapes(tmp_path: Path) -> None:
    sheets = []
    for blend_shape in (False, True):
        file = usd_files.write_figure(tmp_path / f"{blend_shape}.usda", blend_shape=blend_shape)
        stage = SkinnedStage(file)
        sheets.append(stage.posed(13.0)[0].points)
    widened = (sheets[1] - sheets[0])[[0, 1, 4, 5]]
    np.testing.assert_allclose(np.linalg.norm(widened, axis=1), 0.2, atol=1e-6)  # at full weight, carried by the root


def test_contact_sheet_hidden_mesh_is_not_drawn(tmp_path: Path) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "f.usda"))
    UsdGeom.Imageable(stage.GetPrimAtPath("/World/figure0/skin")).MakeInvisible()
    stage.GetRootLayer().Save()
    with pytest.raises(LayfigureError, match="holds no skinned mesh"):
        write_contact_sheet(tmp_path / "f.usda", tmp_path / "f.png")


BREAKS: list[Callable[[UsdGeom.Mesh], Any]] = [
    lambda mesh: mesh.GetPrim().RemoveProperty("points"),
    lambda mesh: mesh.GetFaceVertexIndicesAttr().Set([999] * 136),
    lambda mesh: mesh.GetFaceVertexCountsAttr().Set([5] * 34),
    lambda mesh: UsdSkel.BindingAPI(mesh.GetPrim()).GetJointIndicesPrimvar().Set([9] * 72),
    lambda mesh: UsdSkel.BindingAPI(mesh.GetPrim()).CreateJointsAttr(["root", "nobody"]),
]


@pytest.mark.parametrize("damage", BREAKS)
def test_skinned_stage_broken_mesh_is_refused_in_one_line(
    tmp_path: Path, damage: Callable[[UsdGeom.Mesh], Any], capfd: pytest.CaptureFixture[str]
) -> None:
    stage = usd_files.edit(usd_files.write_figure(tmp_path / "f.usda"))
    damage(UsdGeom.Mesh(stage.GetPrimAtPath("/World/figure0/skin")))
    stage.GetRootLayer().Save()
    capfd.readouterr()
    with pytest.raises(LayfigureError, match=r"^'/World/figure0/skin' .*: run 'layfigure check'$"):
        SkinnedStage(tmp_path / "f.usda").bound()
    assert capfd.readouterr().err == ""


def paint(stage: Usd.Stage, folder: Path, texture_name: str = "red_green.png") -> None:
    """Red on the picture's left, green on its right; u follows x, and the material holds for all faces."""
    pixels = np.zeros((4, 8, 3), np.uint8)
    pixels[:, :4, 0] = pixels[:, 4:, 1] = 255
    Image.fromarray(pixels).save(folder / "red_green.png")
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/figure0/skin"))
    points = np.array(mesh.GetPointsAttr().Get())
    uv = np.stack([(points[:, 0] > 0) * 0.8 + 0.1, np.full(len(points), 0.5)], axis=1)
    st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("map1", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex)
    st.Set(Vt.Vec2fArray.FromNumpy(uv.astype(np.float32)))
    material = UsdShade.Material.Define(stage, "/World/paint")
    surface = UsdShade.Shader.Define(stage, "/World/paint/surface")
    surface.CreateIdAttr("UsdPreviewSurface")
    texture = UsdShade.Shader.Define(stage, "/World/paint/texture")
    texture.CreateIdAttr("UsdUVTexture")
    texture.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(f"./{texture_name}")
    reader = UsdShade.Shader.Define(stage, "/World/paint/reader")
    reader.CreateIdAttr("UsdPrimvarReader_float2")
    reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("map1")
    result = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    texture.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(result)
    rgb = texture.CreateOutput("rgb", Sdf.ValueTypeNames.Float3)
    surface.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).ConnectToSource(rgb)
    material.CreateSurfaceOutput().ConnectToSource(surface.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    stage.GetRootLayer().Save()


def test_skinned_stage_textures_colour_the_triangles(tmp_path: Path) -> None:
    paint(usd_files.edit(usd_files.write_figure(tmp_path / "f.usda")), tmp_path)
    mesh = SkinnedStage(tmp_path / "f.usda").posed(1.0)[0]
    middle = mesh.points[mesh.triangles].mean(axis=1)
    assert (mesh.colors[middle[:, 0] < -0.09].argmax(axis=1) == 0).all()
    assert (mesh.colors[middle[:, 0] > 0.09].argmax(axis=1) == 1).all()


def test_skinned_stage_missing_texture_is_grey(tmp_path: Path) -> None:
    paint(usd_files.edit(usd_files.write_figure(tmp_path / "f.usda")), tmp_path, "none.png")
    assert np.ptp(SkinnedStage(tmp_path / "f.usda").posed(1.0)[0].colors) == 0.0


def test_skinned_stage_take_has_its_materials_colour(usd: Path) -> None:
    np.testing.assert_allclose(SkinnedStage(usd).posed(0.0)[0].colors, [[0.8, 0.5, 0.3]] * 192, atol=1e-6)


def test_skinned_stage_joint_that_yields_marks_what_it_moves(usd: Path) -> None:
    """LeftArm flows in the poses 10 to 19 of 60 a second: frames 4 to 7.6."""
    stage = SkinnedStage(usd)
    assert stage.posed(0.0)[0].flowing.max() == 0.0
    assert stage.posed(9.0)[0].flowing.max() == 0.0
    flowing = stage.posed(6.0)[0].flowing
    assert flowing[: usd_tube_ring(0)].max() == 0.0
    assert flowing.max() == 1.0


def usd_tube_ring(number: int) -> int:
    return (number + 1) * synthetic.SIDES


def add_pulls(stage: Usd.Stage) -> None:
    prim = next(prim for prim in stage.Traverse() if prim.IsA(UsdSkel.Animation))
    types = Sdf.ValueTypeNames
    prim.CreateAttribute("layfigure:heldPoints", types.Point3fArray).Set([Gf.Vec3f(0, 100, 30), Gf.Vec3f(0, 0, 0)])
    prim.CreateAttribute("layfigure:forces", types.Vector3fArray).Set([Gf.Vec3f(0, 20, 0), Gf.Vec3f(0, 0, 0)])
    prim.CreateAttribute("layfigure:heldJoints", types.IntArray).Set([1, -1])
    prim.CreateAttribute("layfigure:pointers", types.IntArray).Set([2, 4])
    stage.GetRootLayer().Save()


def test_skinned_stage_pulls_are_in_metres_and_newtons_in_the_world(tmp_path: Path) -> None:
    add_pulls(usd_files.edit(usd_files.write_figure(tmp_path / "f.usda")))
    (pull,) = SkinnedStage(tmp_path / "f.usda").pulls(1.0)
    assert pull.pointer == 2
    np.testing.assert_allclose(pull.point, [0.0, -0.3, 1.0], atol=1e-9)
    np.testing.assert_allclose(pull.force, [0.0, 0.0, 20.0], atol=1e-9)


def test_contact_sheet_hand_and_its_force_are_drawn(tmp_path: Path) -> None:
    bare = usd_files.write_figure(tmp_path / "bare.usda")
    add_pulls(usd_files.edit(usd_files.write_figure(tmp_path / "pulled.usda")))
    counts = []
    for file in (bare, tmp_path / "pulled.usda"):
        write_contact_sheet(file, tmp_path / "f.png", [1.0], (200, 300))
        pixels = np.asarray(Image.open(tmp_path / "f.png"))[:300].astype(int)
        coloured = pixels.max(axis=2) - pixels.min(axis=2) > 60  # the figure is grey
        counts.append(int(coloured.sum()))
    assert counts[0] == 0
    assert counts[1] > 50


def test_animated_gif_plays_as_fast_as_the_take(tmp_path: Path) -> None:
    file = usd_files.write_figure(tmp_path / "f.usda")  # 12 frames of 1/30 s
    frames = write_animated_gif(file, tmp_path / "f.gif", size=(60, 80), fps=15.0)
    assert frames == [1.0, 3.0, 5.0, 7.0, 9.0, 11.0, 13.0]
    gif = Image.open(tmp_path / "f.gif")
    durations = []
    for index in range(gif.n_frames):
        gif.seek(index)
        durations.append(gif.info["duration"])
    assert len(durations) == 7
    assert sum(durations) == pytest.approx(7 / 15 * 1000, abs=10)
    assert gif.info["loop"] == 0
    gif.seek(0)
    first = np.asarray(gif.convert("RGB")).astype(int)
    gif.seek(6)
    assert np.abs(np.asarray(gif.convert("RGB")) - first).max() > 50


@pytest.mark.parametrize(("frames", "fps", "words"), [([99.0], 10.0, "outside"), (None, 51.0, "too fast for a GIF")])
def test_animated_gif_bad_choice_is_a_usage_error(
    tmp_path: Path, frames: list[float] | None, fps: float, words: str
) -> None:
    file = usd_files.write_figure(tmp_path / "f.usda")
    with pytest.raises(UsageError, match=words):
        write_animated_gif(file, tmp_path / "f.gif", frames, (60, 80), fps)
    assert not (tmp_path / "f.gif").exists()


@pytest.mark.parametrize(
    ("text", "frames"),
    [("3", [3]), ("0,24.5", [0, 24.5]), ("1:4", [1, 2, 3, 4]), ("0:10:4,-2", [0, 4, 8, -2]), ("5:5", [5])],
)
def test_frame_list_lists_and_ranges_are_read(text: str, frames: list[float]) -> None:
    assert frame_list(text) == frames


@pytest.mark.parametrize("text", ["", "a", "1,,2", "4:1", "0:4:0", "0:4:-1", "1:2:3:4", "nan", "0:inf", "0:1e9"])
def test_frame_list_others_are_refused(text: str) -> None:
    with pytest.raises(ArgumentTypeError, match="is not a list of frames"):
        frame_list(text)


@pytest.mark.parametrize("text", ["", "100", "0x10", "5000x100", "ax100", "100x100x100", "-5x30"])
def test_picture_size_others_are_refused(text: str) -> None:
    with pytest.raises(ArgumentTypeError, match="is not a size"):
        picture_size(text)


def test_force_plot_draws_forces_and_joints(take: Take, tmp_path: Path) -> None:
    write_force_plot(loads_of_take(take), tmp_path / "plot.png")
    plot = np.asarray(Image.open(tmp_path / "plot.png").convert("RGB"))
    assert plot.shape[1] > 1000
    blue = (plot[..., 2].astype(int) - plot[..., 0]) > 100
    assert blue[: len(blue) // 2].sum() > 500  # the force above, a joint's torque below
    assert blue[len(blue) // 2 :].sum() > 500


def test_force_plot_take_without_pointers_is_drawn(tmp_path: Path) -> None:
    write_force_plot(loads_of_take(replace(make_take(5), pointers=())), tmp_path / "plot.png")
    assert Image.open(tmp_path / "plot.png").size[0] > 1000
