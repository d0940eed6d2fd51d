"""A character with a texture through server, recorder and converter: the same colours at the same places."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from client_support.gltf_reader import GltfFile
from e2e_support import RunClient
from PIL import Image
from server_support.process import ServerProcess

import layfigure
from layfigure.protocol import Floats
from layfigure.usd.checks import check
from layfigure.usd.reader import BoundMesh, SkinnedStage

PLACE_TOLERANCE = 1e-5  # [m] float positions, and matrices of bones on the way
NORMAL_TOLERANCE = 1e-5
COLOR_TOLERANCE = 0.01  # linear, of 8-bit sRGB
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # from glTF's axes, on columns
CELLS = 8


def chequers() -> bytes:
    """A picture whose every cell has a colour of its own, from full and empty channels: sRGB and linear agree."""
    steps = np.array([0, 255], np.uint8)
    row, column = np.indices((CELLS, CELLS))
    cells = np.stack([steps[row // 4], steps[row // 2 % 2], steps[(row + column) % 2]], axis=2)
    data = io.BytesIO()
    Image.fromarray(np.repeat(np.repeat(cells, 8, axis=0), 8, axis=1)).save(data, "PNG")
    return data.getvalue()


def add_array(gltf: pygltflib.GLTF2, blob: bytearray, array: np.ndarray) -> int:
    blob.extend(b"\0" * (-len(blob) % 4))
    view = pygltflib.BufferView(buffer=0, byteOffset=len(blob), byteLength=array.nbytes)
    blob.extend(array.tobytes())
    gltf.bufferViews.append(view)
    gltf.accessors.append(
        pygltflib.Accessor(
            bufferView=len(gltf.bufferViews) - 1, componentType=pygltflib.FLOAT, count=len(array), type="VEC2"
        )
    )
    return len(gltf.accessors) - 1


def paint(character: Path, out: Path, uri: str | None = None) -> Path:
    """Gives the doll one texture, in its file or in the one at `uri`, and texture coordinates that follow its front."""
    file = GltfFile(character)
    gltf, blob = file.gltf, bytearray(file.gltf.binary_blob())
    for mesh in gltf.meshes:
        for primitive in mesh.primitives:
            x, y, _ = file.values(primitive.attributes.POSITION).T
            uvs = np.stack([4.0 * x + 0.5, 4.0 * y], axis=1).astype(np.float32)
            primitive.attributes.TEXCOORD_0 = add_array(gltf, blob, uvs)
            primitive.material = 0
    material = pygltflib.Material(name="paint", alphaCutoff=None)
    material.pbrMetallicRoughness = pygltflib.PbrMetallicRoughness(baseColorTexture=pygltflib.TextureInfo(index=0))
    gltf.materials = [material]
    gltf.textures = [pygltflib.Texture(source=0)]
    picture = chequers()
    if uri is None:
        blob.extend(b"\0" * (-len(blob) % 4))
        gltf.bufferViews.append(pygltflib.BufferView(buffer=0, byteOffset=len(blob), byteLength=len(picture)))
        blob.extend(picture)
        image = pygltflib.Image(name="chequers", mimeType="image/png", bufferView=len(gltf.bufferViews) - 1)
    else:
        image = pygltflib.Image(uri=uri)
    gltf.images = [image]
    gltf.buffers = [pygltflib.Buffer(byteLength=len(blob))]
    gltf.set_binary_blob(bytes(blob))
    out.write_bytes(b"".join(gltf.save_to_bytes()))
    return out


def record(binary: Path, character: Path, out: Path) -> Path:
    command = [binary, character, "--clock", "lockstep", "--broker", "0"]
    with ServerProcess(list(map(str, command))) as server, layfigure.connect(server.url) as doll:
        with doll.record(out.with_suffix(".lcmlog")) as recording:
            for _ in range(5):
                doll.next_pose()
        layfigure.write_usd(recording.take, out)
    return out


def by_gltf(path: Path) -> tuple[Floats, Floats, Floats]:
    """By the format's description: of all triangles the middles in the bind pose, Z up, the normals of the corners, and
    the colours in the middles."""
    file = GltfFile(path)
    image = np.asarray(Image.open(io.BytesIO(chequers())).convert("RGB")) / 255.0
    middles, normals, colors = [], [], []
    for mesh in file.gltf.meshes:
        (primitive,) = mesh.primitives
        triangles = file.values(primitive.indices).astype(int).reshape(-1, 3)
        middles.append(file.values(primitive.attributes.POSITION)[triangles].mean(axis=1) @ Z_UP.T)
        normals.append(file.values(primitive.attributes.NORMAL)[triangles] @ Z_UP.T)
        uv = file.values(primitive.attributes.TEXCOORD_0)[triangles].mean(axis=1)
        wrapped = uv - np.floor(uv)
        row, column = (wrapped[:, ::-1] * image.shape[:2]).astype(int).T  # glTF counts rows from the top
        colors.append(image[row, column])
    return np.concatenate(middles), np.concatenate(normals), np.concatenate(colors)


def assert_looks_alike(source: Path, meshes: list[BoundMesh]) -> None:
    """The same triangles, in any order, with the same normals and colours; a few middles are on a border of cells."""
    middles, normals, colors = by_gltf(source)
    own = np.concatenate([mesh.points[mesh.triangles].mean(axis=1) for mesh in meshes])
    assert len(own) == len(middles)
    same = np.array([np.argmin(((middles - place) ** 2).sum(axis=1)) for place in own])
    assert np.linalg.norm(middles[same] - own, axis=1).max() < PLACE_TOLERANCE
    own_normals = np.concatenate([mesh.normals for mesh in meshes])  # type: ignore[arg-type]
    np.testing.assert_allclose(np.sort(own_normals, axis=1), np.sort(normals[same], axis=1), atol=NORMAL_TOLERANCE)
    differs = np.abs(np.concatenate([mesh.colors for mesh in meshes]) - colors[same]).max(axis=1) > COLOR_TOLERANCE
    assert differs.mean() < 0.01
    assert len(np.unique(colors, axis=0)) > 4


@pytest.mark.parametrize("uri", [None, "maps/che%20quers.png"])
@pytest.mark.parametrize("name", ["take.usda", "take.usdz"])
def test_texture_of_the_character_is_on_the_take(
    binary: Path, character: Path, tmp_path: Path, name: str, uri: str | None
) -> None:
    (tmp_path / "characters").mkdir()
    (tmp_path / "takes").mkdir()
    if uri is not None:
        (tmp_path / "characters/maps").mkdir()
        (tmp_path / "characters/maps/che quers.png").write_bytes(chequers())
    painted = paint(character, tmp_path / "characters/doll.glb", uri)
    out = record(binary, painted, tmp_path / "takes" / name)
    assert check(out).findings == ()
    assert_looks_alike(painted, SkinnedStage(out).bound())


def test_texture_goes_on_to_gltf_and_is_drawn(binary: Path, character: Path, tmp_path: Path, client: RunClient) -> None:
    painted = paint(character, tmp_path / "doll.glb")
    take = record(binary, painted, tmp_path / "take.usda")
    for arguments in (["convert", take, "take.glb"], ["preview", take, "-o", "sheet.png", "--frames", "0"]):
        result = client(*arguments)
        assert (result.returncode, result.stderr) == (0, "")
    colors = np.asarray(Image.open(tmp_path / "sheet.png").convert("RGB"), np.int64).reshape(-1, 3)
    assert (np.ptp(colors, axis=1) > 100).sum() > 1000  # there is no other colour in it
    again = record(binary, tmp_path / "take.glb", tmp_path / "again.usda")
    assert check(again).findings == ()
    assert_looks_alike(painted, SkinnedStage(again).bound())
