"""layfigure inspect: from what the server tells of a doll to a picture."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from client_support.cli import Cli, assert_one_line_error
from client_support.inspections import make_description, write_inspector, write_program
from PIL import Image

from layfigure.cli.main import main
from layfigure.doll_picture import body_colors, ellipsoid, slab, write_doll_picture
from layfigure.errors import LayfigureError, ProtocolError
from layfigure.inspection import find_server, inspect_character, parse_inspection
from layfigure.protocol import Floats
from layfigure.render.polygon import triangulate

Spoil = Callable[[dict[str, Any]], Any]


def area(polygon: Floats, triangles: Any) -> float:
    a, b, c = (polygon[triangles[:, k]] for k in range(3))
    return float(np.sum((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2.0)


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        ([(0, 0), (2, 0), (2, 1), (0, 1)], 2.0),
        ([(0, 1), (2, 1), (2, 0), (0, 0)], 2.0),  # clockwise
        ([(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (0, 1)], 5.0),  # an L
        ([(0, 0), (4, 0), (4, 3), (3, 3), (3, 1), (1, 1), (1, 3), (0, 3)], 8.0),  # a U
        ([(0, 0), (1, 0), (1, 0), (2, 0), (2, 1), (0, 1)], 2.0),  # a corner twice, one on a straight edge
    ],
)
def test_triangulate_fills_the_polygon(corners: list[tuple[float, float]], expected: float) -> None:
    polygon = np.array(corners, np.float64)
    triangles = triangulate(polygon)
    assert triangles.shape == (len(polygon) - 2, 3)
    assert area(polygon, triangles) == pytest.approx(expected)


def test_triangulate_star_has_no_triangle_outside() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 20, endpoint=False)
    radius = np.where(np.arange(20) % 2, 1.0, 0.3)
    star = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    triangles = triangulate(star)
    sizes = [area(star, triangle[None]) for triangle in triangles]
    assert min(sizes) >= 0.0
    assert sum(sizes) == pytest.approx(20 * 0.5 * 0.3 * np.sin(2.0 * np.pi / 20))


def test_triangulate_polygon_that_crosses_itself_ends() -> None:
    bow = np.array([(0, 0), (1, 1), (1, 0), (0, 1)], np.float64)
    assert triangulate(bow).shape == (2, 3)


def test_ellipsoid_reaches_its_semi_axes() -> None:
    body = parse_inspection(json.dumps(make_description())).bodies[1]
    surface = ellipsoid(body, np.ones(3))
    np.testing.assert_allclose(np.ptp(surface.points, axis=0) / 2.0, [0.25, 0.25, 0.6], rtol=1e-3)
    np.testing.assert_allclose(surface.points.mean(axis=0), body.com, atol=1e-9)


def test_slab_is_as_thick_as_asked_and_a_little_larger_than_the_outline() -> None:
    body = parse_inspection(json.dumps(make_description())).bodies[1]
    surface = slab(body.section, 0.1)
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    assert high[2] - low[2] == pytest.approx(0.1)
    assert 0.4 < high[0] - low[0] < 0.45
    assert surface.triangles.max() < len(surface.points)


def test_body_colors_neighbours_differ() -> None:
    colors = body_colors(60)
    assert colors.shape == (60, 3)
    assert np.linalg.norm(np.diff(colors, axis=0), axis=1).min() > 0.2
    assert body_colors(0).shape == (0, 3)


def test_parse_inspection_reads_bodies_and_geometry() -> None:
    doll = parse_inspection(json.dumps(make_description()))
    assert (doll.name, doll.mass, doll.settings) == ("boxes", 3.0, "")
    assert [body.name for body in doll.bodies] == ["lower", "upper"]
    assert [len(body.section) for body in doll.bodies] == [0, 4]
    assert doll.vertices.shape == (16, 3)
    assert doll.body_of_triangle.tolist() == [0] * 12 + [1] * 12


SPOILED: list[Spoil] = [
    lambda d: d.pop("geometry"),
    lambda d: d.pop("bodies"),
    lambda d: d["bodies"].pop(),
    lambda d: d["geometry"]["vertices"].append([0.0, 1.0]),
    lambda d: d["geometry"]["vertices"].append([0.0, 1.0, None]),
    lambda d: d["geometry"]["triangles"].append([0, 1, 16]),
    lambda d: d["geometry"]["triangles"].append([0, 1, 2]),
    lambda d: d["geometry"]["body_of_triangle"].__setitem__(0, 2),
    lambda d: d["geometry"]["bodies"][0]["semi_axes"].pop(),
    lambda d: d.__setitem__("mass", "heavy"),
    lambda d: d.__setitem__("settings", None),
]


@pytest.mark.parametrize("spoil", SPOILED)
def test_parse_inspection_other_json_is_refused(spoil: Spoil) -> None:
    description = make_description()
    spoil(description)
    with pytest.raises(ProtocolError, match="no doll that can be drawn"):
        parse_inspection(json.dumps(description))


@pytest.mark.parametrize("text", ["", "listening on tcpq://", "[]", "null", "3"])
def test_parse_inspection_other_text_is_refused(text: str) -> None:
    with pytest.raises(ProtocolError, match="no doll that can be drawn"):
        parse_inspection(text)


def test_doll_picture_shows_both_bodies_their_section_and_a_legend(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("layfigure.doll_picture._PANEL_HEIGHT", 240)  # smaller than a user's, for speed
    doll = parse_inspection(json.dumps(make_description()))
    drawn: list[tuple[int, int]] = []
    write_doll_picture(doll, tmp_path / "doll.png", lambda done, whole: drawn.append((done, whole)))
    assert drawn == [(0, 2), (1, 2)]
    picture = np.asarray(Image.open(tmp_path / "doll.png").convert("RGB")).astype(int)
    panel = picture[60:300, 16:110]  # of the front
    chroma = panel - panel.mean(axis=2, keepdims=True)
    upper, lower = chroma[60:110].reshape(-1, 3).mean(axis=0), chroma[150:200].reshape(-1, 3).mean(axis=0)
    assert np.abs(upper - lower).max() > 15  # of different colours
    brightness = panel.max(axis=2)[:, 20:60].min(axis=1)
    assert brightness[110:140].min() < brightness[60:100].min() - 25  # the section is dark
    legend = picture[60:220, 260:]
    assert (legend.min(axis=(0, 2)) < 200).sum() > 50  # text


def test_doll_picture_same_doll_gives_equal_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("layfigure.doll_picture._PANEL_HEIGHT", 100)
    doll = parse_inspection(json.dumps(make_description()))
    for name in ("a.png", "b.png"):
        write_doll_picture(doll, tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_doll_picture_into_a_folder_that_is_not_there_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("layfigure.doll_picture._PANEL_HEIGHT", 50)
    with pytest.raises(LayfigureError, match="cannot write"):
        write_doll_picture(parse_inspection(json.dumps(make_description())), tmp_path / "none" / "doll.png")


def test_inspect_character_passes_character_and_settings_on(tmp_path: Path) -> None:
    program = write_inspector(tmp_path / "server", "layfigure-server: a remark\n")
    doll, remarks = inspect_character(str(program), Path("a.glb"), Path("soft.toml"))
    assert doll.name == "boxes"
    assert remarks == "layfigure-server: a remark\n"
    arguments = (tmp_path / "server.arguments").read_text()
    assert arguments == repr(["--inspect", "a.glb", "--json", "--geometry", "--doll", "soft.toml"])


def test_find_server_not_there_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(LayfigureError, match="no layfigure-server in PATH: name it with --server"):
        find_server(None)
    with pytest.raises(LayfigureError, match="is no program"):
        find_server(tmp_path)
    program = write_inspector(tmp_path / "layfigure-server")
    assert find_server(None) == str(program)
    assert find_server(program) == str(program)


def test_main_inspect_draws_and_passes_remarks_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("layfigure.doll_picture._PANEL_HEIGHT", 100)
    monkeypatch.chdir(tmp_path)
    program = write_inspector(tmp_path / "server", "layfigure-server: using the settings beside the character: x\n")
    assert main(["inspect", "a.glb", "-o", "doll.png", "--server-program", str(program)]) == 0
    output = capsys.readouterr()
    assert output.out == "doll.png: 2 bodies, 3 kg\n"
    assert output.err == "layfigure-server: using the settings beside the character: x\n"
    assert Image.open(tmp_path / "doll.png").size[1] > 100


def test_cli_inspect_servers_refusal_is_the_clients(cli: Cli, tmp_path: Path) -> None:
    program = write_program(tmp_path / "server", "", "layfigure-server: a.glb: no such file\n", exit_code=1)
    result = cli("inspect", "a.glb", "-o", "doll.png", "--server-program", program)
    assert_one_line_error(result, 1, "layfigure: a.glb: no such file")
    assert not (tmp_path / "doll.png").exists()


def test_cli_inspect_silent_failure_tells_the_exit_code(cli: Cli, tmp_path: Path) -> None:
    program = write_program(tmp_path / "server", "", exit_code=7)
    assert_one_line_error(cli("inspect", "a.glb", "-o", "doll.png", "--server-program", program), 1, "exit code 7")


def test_cli_inspect_program_that_is_no_server_fails_in_one_line(cli: Cli, tmp_path: Path) -> None:
    program = write_program(tmp_path / "server", "hello\n")
    assert_one_line_error(
        cli("inspect", "a.glb", "-o", "d.png", "--server-program", program), 1, "no doll that can be drawn"
    )
    (tmp_path / "text").write_text("no program\n")
    (tmp_path / "text").chmod(0o755)
    assert_one_line_error(
        cli("inspect", "a.glb", "-o", "d.png", "--server-program", tmp_path / "text"), 1, "cannot be run"
    )
