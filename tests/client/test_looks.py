"""Textures, texture coordinates and normals of a character in USD, whatever its units, and in pictures of it."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from client_support import synthetic
from client_support.cli import Cli
from client_support.gltf_reader import GltfFile
from client_support.looks import (
    FLOAT_TOLERANCE,
    FPS,
    MESH,
    QUARTERS,
    ROOT,
    SAVED_COLOR_TOLERANCE,
    SKIN_TOLERANCE,
    findings,
    picture,
    texture_node,
    textured_meshes,
)
from client_support.takes import make_take_of
from PIL import Image
from pxr import Sdf, Usd, UsdGeom, UsdShade, UsdSkel

from layfigure.export.clip import read_clip
from layfigure.export.gltf import write_gltf
from layfigure.protocol import Floats
from layfigure.take import Take
from layfigure.take_form import Layout, TakeForm
from layfigure.usd.pictures import as_png_or_jpeg
from layfigure.usd.reader import SkinnedStage
from layfigure.usd.units import write_in_units
from layfigure.usd.writer import write_take


@pytest.mark.parametrize("layout", ["layered", "single"])
def test_write_take_picture_of_the_character_is_beside_it_under_a_safe_name(
    painted: Take, tmp_path: Path, layout: Layout
) -> None:
    write_take(painted, tmp_path / "take.usda", FPS, TakeForm(layout=layout))
    files = [str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*.png")]
    assert files == ["take.textures/evil_name.png"]
    assert (tmp_path / files[0]).read_bytes() == picture()
    assert not list(tmp_path.glob(".*"))
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    node = texture_node(stage)
    assert node.GetInput("file").Get().path == "./take.textures/evil_name.png"
    assert Path(node.GetInput("file").Get().resolvedPath) == tmp_path / files[0]
    assert findings(tmp_path / "take.usda") == []


def test_write_take_usdz_holds_the_picture_and_passes_all_checks(painted: Take, tmp_path: Path) -> None:
    write_take(painted, tmp_path / "take.usdz", FPS)
    assert [path.name for path in tmp_path.iterdir()] == ["take.usdz"]
    with zipfile.ZipFile(tmp_path / "take.usdz") as package:
        assert package.read("take.textures/evil_name.png") == picture()
    assert findings(tmp_path / "take.usdz") == []
    (tmp_path / "again").mkdir()
    write_take(painted, tmp_path / "again" / "take.usdz", FPS)
    assert (tmp_path / "again" / "take.usdz").read_bytes() == (tmp_path / "take.usdz").read_bytes()


def test_write_take_material_of_two_meshes_is_one_prim_with_its_texture(painted: Take, tmp_path: Path) -> None:
    write_take(painted, tmp_path / "take.usda", FPS)
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    assert [prim.GetName() for prim in stage.GetPrimAtPath(f"{ROOT}/Materials").GetChildren()] == ["skin"]
    for name in ("arm_mesh", "sleeve"):
        mesh = stage.GetPrimAtPath(f"{ROOT}/Geometry/{name}")
        material, _ = UsdShade.MaterialBindingAPI(mesh).ComputeBoundMaterial()
        assert material.GetPath() == f"{ROOT}/Materials/skin"
    shader = material.ComputeSurfaceSource()[0]
    source = shader.GetInput("diffuseColor").GetConnectedSources()[0][0]
    assert (source.source.GetPath(), source.sourceName) == (f"{ROOT}/Materials/skin/Texture", "rgb")
    node = texture_node(stage)
    assert node.GetIdAttr().Get() == "UsdUVTexture"
    assert node.GetInput("sourceColorSpace").Get() == "sRGB"
    assert (node.GetInput("wrapS").Get(), node.GetInput("wrapT").Get()) == ("repeat", "repeat")
    assert not node.GetInput("scale")
    reader = UsdShade.Shader(node.GetInput("st").GetConnectedSources()[0][0].source.GetPrim())
    assert reader.GetIdAttr().Get() == "UsdPrimvarReader_float2"
    assert reader.GetInput("varname").Get() == "st"


def test_write_take_seams_are_face_varying_and_points_stay_joined(painted: Take, tmp_path: Path) -> None:
    write_take(painted, tmp_path / "take.usda", FPS)
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(MESH))
    source = painted.meshes[0]
    assert source.normals is not None
    assert source.uvs is not None
    assert len(mesh.GetPointsAttr().Get()) == len(source.points) == 104
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    assert (st.GetInterpolation(), st.GetTypeName()) == ("faceVarying", Sdf.ValueTypeNames.TexCoord2fArray)
    np.testing.assert_array_equal(np.array(st.ComputeFlattened()), source.uvs[source.wedges.reshape(-1)])
    assert mesh.GetNormalsInterpolation() == "faceVarying"
    np.testing.assert_array_equal(np.array(mesh.GetNormalsAttr().Get()), source.normals[source.wedges.reshape(-1)])


def test_write_take_without_seams_is_per_vertex(tmp_path: Path) -> None:
    message = textured_meshes(image=picture())
    for mesh in message.meshes:
        mesh.wedge_triangles, mesh.wedge_triangle_count = [], 0
    write_take(make_take_of(message), tmp_path / "take.usda", FPS)
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(MESH))
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    assert (st.GetInterpolation(), mesh.GetNormalsInterpolation()) == ("vertex", "vertex")
    np.testing.assert_array_equal(np.array(st.Get()), np.array(message.meshes[0].uvs[:104], np.float32))
    np.testing.assert_array_equal(
        np.array(mesh.GetNormalsAttr().Get()), np.array(message.meshes[0].normals[:104], np.float32)
    )
    assert findings(tmp_path / "take.usda") == []


def test_write_take_normals_are_skinned_by_usd_as_the_surface(tmp_path: Path) -> None:
    message = textured_meshes()
    for mesh in message.meshes:
        mesh.wedge_triangles, mesh.wedge_triangle_count = [], 0
        mesh.joint_weights = [[1.0, 0.0]] * mesh.vertex_count  # rigid: normals turn with one joint
    write_take(make_take_of(message), tmp_path / "take.usda", FPS)
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    assert UsdSkel.BakeSkinning(UsdSkel.Root(stage.GetDefaultPrim()))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(MESH))
    normals = np.array(mesh.GetNormalsAttr().Get(4.0), np.float64)
    points = np.array(mesh.GetPointsAttr().Get(4.0), np.float64).reshape(synthetic.RINGS, synthetic.SIDES, 3)
    outward = points - points.mean(axis=1, keepdims=True)  # of rings of one joint
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    np.testing.assert_allclose(normals, outward.reshape(-1, 3), atol=SKIN_TOLERANCE)
    assert np.abs(normals - np.array(message.meshes[0].normals[:104])).max() > 0.1  # they did turn


def test_write_take_without_uvs_or_normals_has_smooth_ones_and_a_plain_colour(take: Take, tmp_path: Path) -> None:
    write_take(take, tmp_path / "take.usda", FPS)
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(MESH))
    assert not UsdGeom.PrimvarsAPI(mesh).HasPrimvar("st")
    assert mesh.GetNormalsInterpolation() == "vertex"


def test_write_take_factor_alpha_wrap_and_cutoff_are_those_of_the_material(tmp_path: Path) -> None:
    message = textured_meshes(image=picture())
    material = message.materials[0]
    material.base_color, material.opacity = [0.5, 0.25, 1.0], 0.5
    material.texture_alpha, material.alpha_cutoff = True, 0.25
    material.wrap_u, material.wrap_v = "clamp", "mirror"
    write_take(make_take_of(message), tmp_path / "take.usda", FPS)
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    node = texture_node(stage)
    np.testing.assert_array_equal(node.GetInput("scale").Get(), [0.5, 0.25, 1.0, 0.5])
    assert (node.GetInput("wrapS").Get(), node.GetInput("wrapT").Get()) == ("clamp", "mirror")
    shader = UsdShade.Shader(stage.GetPrimAtPath(f"{ROOT}/Materials/skin/Surface"))
    assert shader.GetInput("opacity").GetConnectedSources()[0][0].sourceName == "a"
    assert shader.GetInput("opacityThreshold").Get() == 0.25
    assert findings(tmp_path / "take.usda") == []


def test_write_take_opacity_without_texture_is_a_value(tmp_path: Path) -> None:
    message = synthetic.meshes_message()
    message.materials[0].opacity = 0.5
    write_take(make_take_of(message), tmp_path / "take.usda", FPS)
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    assert UsdShade.Shader(stage.GetPrimAtPath(f"{ROOT}/Materials/skin/Surface")).GetInput("opacity").Get() == 0.5


@pytest.mark.parametrize("format_name", ["JPEG", "TGA", "BMP", "WEBP", "GIF"])
def test_write_take_pictures_of_other_formats_become_png(tmp_path: Path, format_name: str) -> None:
    data = picture(format_name)
    write_take(make_take_of(textured_meshes(image=data)), tmp_path / "take.usda", FPS)
    (file,) = (tmp_path / "take.textures").iterdir()
    assert file.suffix == (".jpg" if format_name == "JPEG" else ".png")
    assert (file.read_bytes() == data) == (format_name == "JPEG")
    assert Image.open(file).convert("RGB").getpixel((3, 3))[:2] == pytest.approx((255, 255), abs=2)
    assert findings(tmp_path / "take.usda") == []


def test_pictures_of_16_bits_and_with_alpha_are_kept_or_converted() -> None:
    deep = io.BytesIO()
    Image.fromarray(np.full((2, 2), 40000, np.uint16)).save(deep, "PNG")
    assert as_png_or_jpeg(deep.getvalue()) == ("png", deep.getvalue())
    clear = io.BytesIO()
    Image.new("RGBA", (2, 2), (1, 2, 3, 128)).save(clear, "TGA")
    converted = as_png_or_jpeg(clear.getvalue())
    assert converted is not None
    assert Image.open(io.BytesIO(converted[1])).getpixel((0, 0)) == (1, 2, 3, 128)


@pytest.mark.parametrize("data", [b"", b"no picture at all", b"\x89PNG\r\n\x1a\n cut off", picture()[:20]])
@pytest.mark.parametrize("name", ["take.usda", "take.usdz"])
def test_write_take_broken_picture_is_left_out_with_a_warning(
    tmp_path: Path, name: str, data: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    write_take(make_take_of(textured_meshes(image=data)), tmp_path / name, FPS)
    assert "the texture of material 'skin' is left out" in caplog.text
    assert len(caplog.records) == 1  # though two meshes have it
    assert not (tmp_path / "take.textures").exists()
    assert findings(tmp_path / name) == []


def corners(path: Path) -> tuple[Floats, Floats]:
    """Normals, in metres' axes Z up, and texture coordinates of all corners."""
    mesh = SkinnedStage(path).bound()[0]
    assert mesh.normals is not None
    assert mesh.looks is not None
    return mesh.normals, mesh.looks.uvs


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usdz"])
@pytest.mark.parametrize("source", ["take.usda", "take.usdz"])
def test_write_in_units_turns_normals_and_keeps_textures(
    painted: Take, tmp_path: Path, source: str, suffix: str
) -> None:
    write_take(painted, tmp_path / source, FPS)
    (tmp_path / "other").mkdir()
    out = tmp_path / "other" / f"out{suffix}"
    write_in_units(tmp_path / source, out, "Y", 0.01)
    assert findings(out) == []
    before, after = corners(tmp_path / source), corners(out)
    np.testing.assert_allclose(after[0], before[0], atol=FLOAT_TOLERANCE)
    np.testing.assert_array_equal(after[1], before[1])
    stages = [Usd.Stage.Open(str(path)) for path in (tmp_path / source, out)]
    in_file, turned = (np.array(UsdGeom.Mesh(s.GetPrimAtPath(MESH)).GetNormalsAttr().Get()) for s in stages)
    x, y, z = in_file.T
    np.testing.assert_allclose(turned, np.stack([x, z, -y], axis=1), atol=FLOAT_TOLERANCE)
    texture = SkinnedStage(out).bound()[0].looks.looks[1].texture  # type: ignore[union-attr]
    assert texture is not None
    assert texture.data == picture()


def test_write_take_in_other_units_turns_normals(painted: Take, tmp_path: Path) -> None:
    write_take(painted, tmp_path / "z.usda", FPS)
    write_take(painted, tmp_path / "y.usda", FPS, TakeForm(up_axis="Y", meters_per_unit=0.01))
    np.testing.assert_allclose(corners(tmp_path / "y.usda")[0], corners(tmp_path / "z.usda")[0], atol=FLOAT_TOLERANCE)
    assert findings(tmp_path / "y.usda") == []


def quarter_colors(v: Floats) -> Floats:
    return np.asarray(QUARTERS[np.minimum((4.0 * v).astype(int), 3)] / 255.0)


def test_reader_finds_the_picture_right_side_up(painted: Take, tmp_path: Path) -> None:
    """The arm's root is at v = 0, the picture's lower edge."""
    write_take(painted, tmp_path / "take.usda", FPS)
    mesh = SkinnedStage(tmp_path / "take.usda").posed(0.0)[0]
    middles = mesh.looks.uvs.mean(axis=1)
    np.testing.assert_allclose(mesh.colors, quarter_colors(middles[:, 1]), atol=SAVED_COLOR_TOLERANCE)
    root = painted.character.joints[0].bind_translation
    nearest = np.argmin(np.linalg.norm(mesh.points[mesh.triangles].mean(axis=1) - root, axis=1))
    assert mesh.colors[nearest].tolist() == [1.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("wrap", "inside"),
    [
        ("repeat", lambda v: v % 1.0),
        ("clamp", lambda v: np.clip(v, 0.0, 1.0)),
        ("mirror", lambda v: np.where(v < 1.0, v, 2.0 - v)),
    ],
)
def test_reader_goes_on_outside_of_the_picture_as_the_texture_says(
    tmp_path: Path, wrap: str, inside: Callable[[Floats], Floats]
) -> None:
    message = textured_meshes(image=picture())
    message.meshes[0].uvs = [[u, 1.9 * v] for u, v in message.meshes[0].uvs]
    message.materials[0].wrap_v = wrap
    write_take(make_take_of(message), tmp_path / "take.usda", FPS)
    mesh = SkinnedStage(tmp_path / "take.usda").posed(0.0)[0]
    middles = mesh.looks.uvs.mean(axis=1)[:, 1]
    assert middles.max() > 1.5
    np.testing.assert_allclose(mesh.colors, quarter_colors(inside(middles)), atol=SAVED_COLOR_TOLERANCE)


def by_gltf(file: GltfFile, mesh: int) -> tuple[Floats, Floats]:
    """By the format's description: the middles of triangles in the bind pose, Y up, and their colours there."""
    (primitive,) = file.gltf.meshes[mesh].primitives
    material = file.gltf.materials[primitive.material]
    texture = file.gltf.textures[material.pbrMetallicRoughness.baseColorTexture.index]
    image = np.asarray(Image.open(io.BytesIO(file.picture(texture.source))).convert("RGB")) / 255.0
    triangles = file.values(primitive.indices).astype(int).reshape(-1, 3)
    middles = file.values(primitive.attributes.TEXCOORD_0)[triangles].mean(axis=1)
    row = np.minimum((middles[:, 1] * len(image)).astype(int), len(image) - 1)  # glTF counts from the top
    column = np.minimum((middles[:, 0] * image.shape[1]).astype(int), image.shape[1] - 1)
    return file.values(primitive.attributes.POSITION)[triangles].mean(axis=1), image[row, column]


@pytest.mark.parametrize("suffix", [".glb", ".gltf"])
def test_gltf_has_the_same_colours_at_the_same_places(painted: Take, tmp_path: Path, suffix: str) -> None:
    write_take(painted, tmp_path / "take.usda", FPS)
    write_gltf(read_clip(tmp_path / "take.usda"), tmp_path / f"take{suffix}")
    file = GltfFile(tmp_path / f"take{suffix}")
    for number, mesh in enumerate(SkinnedStage(tmp_path / "take.usda", up_axis="Y").bound()):
        places, colors = by_gltf(file, number)
        expected = mesh.points[mesh.triangles].mean(axis=1)
        np.testing.assert_allclose(places, expected, atol=2e-6)
        np.testing.assert_allclose(colors, mesh.colors, atol=SAVED_COLOR_TOLERANCE)
    assert len(file.gltf.images) == len(file.gltf.materials) == 1  # though two meshes have it
    assert file.gltf.materials[0].name == "skin"
    assert file.picture(0) == picture()


def test_gltf_splits_seams_and_keeps_normals(painted: Take, tmp_path: Path) -> None:
    write_take(painted, tmp_path / "take.usda", FPS)
    write_gltf(read_clip(tmp_path / "take.usda"), tmp_path / "take.glb")
    file = GltfFile(tmp_path / "take.glb")
    (primitive,) = file.gltf.meshes[0].primitives
    normals = file.values(primitive.attributes.NORMAL)
    assert len(normals) == 104 + 13
    triangles = file.values(primitive.indices).astype(int).reshape(-1, 3)
    expected = SkinnedStage(tmp_path / "take.usda", up_axis="Y").bound()[0].normals
    np.testing.assert_allclose(normals[triangles], expected, atol=FLOAT_TOLERANCE)


@pytest.mark.parametrize(("cutoff", "mode"), [(0.0, "BLEND"), (0.25, "MASK")])
def test_gltf_has_alpha_wrap_and_factor(tmp_path: Path, cutoff: float, mode: str) -> None:
    message = textured_meshes(image=picture(mode="RGBA"))
    material = message.materials[0]
    material.base_color, material.opacity = [0.5, 0.25, 1.0], 0.5
    material.texture_alpha, material.alpha_cutoff, material.wrap_u = True, cutoff, "mirror"
    write_take(make_take_of(message), tmp_path / "take.usda", FPS)
    write_gltf(read_clip(tmp_path / "take.usda"), tmp_path / "take.glb")
    gltf = GltfFile(tmp_path / "take.glb").gltf
    assert gltf.materials[0].alphaMode == mode
    assert gltf.materials[0].pbrMetallicRoughness.baseColorFactor == [0.5, 0.25, 1.0, 0.5]
    assert (gltf.samplers[0].wrapS, gltf.samplers[0].wrapT) == (33648, 10497)


def test_preview_shows_the_texture(tmp_path: Path, cli: Cli) -> None:
    """In stripes that are finer than the triangles, pixels of each colour."""
    pixels = np.tile(np.repeat(QUARTERS, 2, axis=0), (8, 1))[:, None]
    data = io.BytesIO()
    Image.fromarray(np.repeat(pixels, 8, axis=1)).save(data, "PNG")
    write_take(make_take_of(textured_meshes(image=data.getvalue())), tmp_path / "take.usda", FPS)
    result = cli("preview", "take.usda", "-o", "sheet.png", "--frames", "0", "--size", "300x300")
    assert (result.returncode, result.stderr) == (0, "")
    pixels = np.asarray(Image.open(tmp_path / "sheet.png").convert("RGB"), np.int64)
    for color in QUARTERS:
        difference = pixels - pixels.max(axis=2, keepdims=True) * (color > 0)
        saturated = (np.abs(difference).max(axis=2) < 70) & (pixels.max(axis=2) > 100)
        assert saturated.sum() > 30, color
