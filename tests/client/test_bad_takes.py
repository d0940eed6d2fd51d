"""What commands are given that is no take, or only a part of one: one line each that names what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest
from client_support.cli import Cli, assert_one_line_error

from layfigure.take import Take
from layfigure.usd.writer import write_take

FPS = 24.0


@pytest.mark.parametrize(
    "arguments",
    [
        ["preview", "take.usda", "-o", "sheet.png"],
        ["preview", "take.usda", "-o", "moving.gif"],
        ["plot", "take.usda", "-o", "plot.png"],
        ["diff", "take.usda", "whole.usdc"],
        ["diff", "whole.usdc", "take.usda"],
        ["convert", "take.usda", "take.glb"],
        ["convert", "take.usda", "take.bvh"],
        ["convert", "take.usda", "centimetres.usdc", "--meters-per-unit", "0.01"],
    ],
    ids=lambda arguments: " ".join(arguments[:3]),
)
@pytest.mark.parametrize("missing", ["take.anim.usdc", "take.character.usdc"])
def test_take_without_a_layer_is_refused_by_its_name(
    take: Take, tmp_path: Path, cli: Cli, missing: str, arguments: list[str]
) -> None:
    """Half of a take is never drawn or converted without a word."""
    write_take(take, tmp_path / "take.usda", FPS)
    write_take(take, tmp_path / "whole.usdc", FPS)
    (tmp_path / missing).unlink()
    before = sorted(path.name for path in tmp_path.iterdir())
    assert_one_line_error(cli(*arguments), 1, f"'take.usda' needs the file '{tmp_path / missing}', which is missing")
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_take_with_a_broken_layer_is_refused_by_its_name(take: Take, tmp_path: Path, cli: Cli) -> None:
    write_take(take, tmp_path / "take.usda", FPS)
    layer = tmp_path / "take.anim.usdc"
    layer.write_bytes(layer.read_bytes()[:100])
    assert_one_line_error(cli("preview", "take.usda", "-o", "sheet.png"), 1, f"needs the file '{layer}', which is")
    checked = cli("check", "take.usda")
    assert checked.returncode == 1
    assert f"error: take.usda: needs the file '{layer}', which is missing or cannot be read" in checked.stdout


def test_output_whose_folder_of_pictures_is_a_file_is_refused_before_the_work(tmp_path: Path, cli: Cli) -> None:
    (tmp_path / "take.textures").write_text("notes")
    (tmp_path / "take.lcmlog").touch()
    commands = (["export", "take.lcmlog", "take.usda"], ["record", "take.usda"], ["convert", "a.usda", "take.usdc"])
    for command in commands:
        assert_one_line_error(cli(*command), 2, "'take.textures' is a file")
    assert (tmp_path / "take.textures").read_text() == "notes"
