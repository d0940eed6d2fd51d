"""Where a take finds and puts the textures of its character that are files."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from client_support.looks import FPS, findings, picture, texture_node, textured_meshes
from client_support.takes import make_take_of
from pxr import Usd

from layfigure.usd.textures import texture_path
from layfigure.usd.writer import write_take


def put_texture(folder: Path, name: str = "maps/skin.png", data: bytes | None = None) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data if data is not None else picture())
    return path


def test_write_take_texture_in_a_file_is_named_from_the_take(tmp_path: Path) -> None:
    file = put_texture(tmp_path / "characters")
    (tmp_path / "takes").mkdir()
    out = tmp_path / "takes" / "take.usda"
    write_take(make_take_of(textured_meshes("maps/skin.png"), str(tmp_path / "characters")), out, FPS)
    stage = Usd.Stage.Open(str(out))
    asset = texture_node(stage).GetInput("file").Get()
    assert asset.path == "../characters/maps/skin.png"
    assert Path(asset.resolvedPath).samefile(file)
    assert findings(out) == []
    assert not (tmp_path / "takes" / "take.textures").exists()


@pytest.mark.parametrize("texture", ["D:/art/maps/skin.png", "/art/maps/skin.png", "../../elsewhere/skin.png"])
def test_write_take_texture_of_another_machine_is_found_beside_the_character(tmp_path: Path, texture: str) -> None:
    put_texture(tmp_path, "skin.png")
    write_take(make_take_of(textured_meshes(texture), str(tmp_path)), tmp_path / "take.usda", FPS)
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    assert texture_node(stage).GetInput("file").Get().path == "./skin.png"


@pytest.mark.parametrize(
    ("texture", "folder", "expected"),
    [
        ("skin.png", "/characters", "../characters/skin.png"),
        ("../maps/skin.png", "/characters/doll", "../characters/maps/skin.png"),
        ("skin.png", "", "./skin.png"),
        ("/art/skin.png", "/characters", "/art/skin.png"),
        ("D:/art/skin.png", "/characters", "D:/art/skin.png"),
        ("https://example.org/skin.png", "/characters", "https://example.org/skin.png"),
    ],
)
def test_texture_path_of_missing_files_is_where_they_are_expected(texture: str, folder: str, expected: str) -> None:
    take = make_take_of(textured_meshes(texture), folder)
    material = take.meshes[0].material
    assert material is not None
    assert texture_path(material, take.character, Path("/takes/take.usda")) == expected


def test_check_missing_texture_is_one_finding(tmp_path: Path) -> None:
    write_take(make_take_of(textured_meshes("none.png"), str(tmp_path)), tmp_path / "take.usda", FPS)
    (finding,) = findings(tmp_path / "take.usda")
    assert "needs the file" in finding
    assert "none.png" in finding


def test_write_take_usdz_packs_textures_of_files(tmp_path: Path) -> None:
    put_texture(tmp_path / "characters")
    out = tmp_path / "take.usdz"
    write_take(make_take_of(textured_meshes("maps/skin.png"), str(tmp_path / "characters")), out, FPS)
    assert "take.textures/skin.png" in zipfile.ZipFile(out).namelist()
    assert findings(out) == []


def put_link(folder: Path) -> str:
    (folder / "link.png").symlink_to(put_texture(folder.parent, "private.png"))
    return "link.png"


def put_secret(folder: Path) -> str:
    put_texture(folder, "secret.png", b"-----BEGIN PRIVATE KEY-----")
    return "secret.png"


def put_outside(folder: Path) -> str:
    put_texture(folder.parent, "private.png")
    return "../private.png"


@pytest.mark.parametrize("put", [put_link, put_secret, put_outside, lambda folder: "none.png", lambda folder: "."])
def test_write_take_usdz_packs_nothing_but_pictures_of_the_characters_folder(
    tmp_path: Path, put: Callable[[Path], str], caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "characters"
    folder.mkdir()
    out = tmp_path / "take.usdz"
    write_take(make_take_of(textured_meshes(put(folder)), str(folder)), out, FPS)
    assert "is left out of the package" in caplog.text
    assert not any("textures" in name for name in zipfile.ZipFile(out).namelist())
    assert findings(out) == []
