"""The project's own doll: a whole, deterministic, well-formed skinned GLB."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from glb_reader import Glb, read_glb

import make_doll


@pytest.fixture(scope="module")
def doll(tmp_path_factory: pytest.TempPathFactory) -> Glb:
    out = tmp_path_factory.mktemp("doll") / "doll.glb"
    make_doll.make_doll(out)
    return read_glb(out)


def test_doll_made_twice_has_same_bytes(tmp_path: Path) -> None:
    make_doll.make_doll(tmp_path / "a.glb")
    make_doll.make_doll(tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.glb", "b.glb"]


def test_doll_is_a_lay_figure_of_30_centimetres(doll: Glb) -> None:
    points = np.concatenate([doll.array(p["primitives"][0]["attributes"]["POSITION"]) for p in doll.json["meshes"]])
    assert 0.29 < np.ptp(points[:, 1]) < 0.31
    assert 2000 <= len(points) <= 4000
    np.testing.assert_allclose(np.sort(points[:, 0]), np.sort(-points[:, 0]), atol=1e-7)  # mirrored


def test_doll_bind_matrices_are_the_inverses_of_its_nodes(doll: Glb) -> None:
    skin = doll.json["skins"][0]
    world = doll.world_of_nodes()
    inverse_binds = doll.array(skin["inverseBindMatrices"])
    assert len(inverse_binds) == len(skin["joints"])
    for index, joint in enumerate(skin["joints"]):
        np.testing.assert_allclose(inverse_binds[index].reshape(4, 4).T @ world[joint], np.eye(4), atol=1e-6)


def test_doll_vertices_weigh_one_on_one_bone(doll: Glb) -> None:
    for mesh in doll.json["meshes"]:
        attributes = mesh["primitives"][0]["attributes"]
        weights = doll.array(attributes["WEIGHTS_0"])
        np.testing.assert_array_equal(weights, np.tile([1.0, 0.0, 0.0, 0.0], (len(weights), 1)))
        assert doll.array(attributes["JOINTS_0"]).max() < len(doll.json["skins"][0]["joints"])


def test_doll_parts_are_closed_and_face_outwards(doll: Glb) -> None:
    by_bone: dict[int, list[np.ndarray]] = {}
    for mesh in doll.json["meshes"]:
        primitive = mesh["primitives"][0]
        points = doll.array(primitive["attributes"]["POSITION"]).astype(float)
        bones = doll.array(primitive["attributes"]["JOINTS_0"])[:, 0]
        for triangle in doll.array(primitive["indices"]).reshape(-1, 3):
            by_bone.setdefault(int(bones[triangle[0]]), []).append(points[triangle])
    assert len(by_bone) == len(doll.json["skins"][0]["joints"])
    for triangles in by_bone.values():
        corners = np.array(triangles)
        edges: Counter[tuple[bytes, bytes]] = Counter()
        for triangle in corners:
            for k in range(3):
                a, b = triangle[k].tobytes(), triangle[(k + 1) % 3].tobytes()
                edges[min(a, b), max(a, b)] += 1 if a < b else -1
        assert not any(edges.values())
        assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0.0


def test_command_without_a_place_to_write_fails_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    script = Path(make_doll.__file__)
    result = subprocess.run(
        [sys.executable, script, tmp_path / "file" / "doll.glb"], capture_output=True, text=True, check=False
    )
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1
