"""The scenes that the benchmark makes, and the files they go through."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from layfigure_bench.floor_scenes import floor_scenes
from layfigure_bench.scenes import (
    IDENTITY,
    Chain,
    Load,
    Scene,
    conjugate,
    constant_forces,
    exponential,
    hanging,
    joint_rotations,
    load,
    made_scenes,
    product,
    pulled,
    save,
)

STORED = Path(__file__).resolve().parents[1] / "data" / "scenes"


def test_exponential_quarter_turn_is_the_known_quaternion() -> None:
    assert exponential(np.array([0.0, 0.0, np.pi / 2])) == pytest.approx((np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
    assert exponential(np.zeros(3)) == IDENTITY


def test_product_with_the_conjugate_is_the_identity() -> None:
    q = exponential(np.array([0.3, -1.1, 0.7]))
    assert product(q, conjugate(q)) == pytest.approx(IDENTITY)


def test_product_of_turns_about_two_axes_is_not_commutative() -> None:
    x, y = exponential(np.array([1.0, 0.0, 0.0])), exponential(np.array([0.0, 1.0, 0.0]))
    assert product(x, y)[3] == pytest.approx(-product(y, x)[3])
    assert product(x, y)[3] > 0.2


def test_chain_straight_equals_the_stored_scene() -> None:
    stored = load(STORED / "chain-60.json")
    made = hanging("chain-60", Chain(60))
    assert made.gravity == stored.gravity
    for a, b in zip(made.bodies, stored.bodies, strict=True):
        assert (a.parent, a.anchor, a.com, a.mass, a.K, a.D) == (b.parent, b.anchor, b.com, b.mass, b.K, b.D)
        assert a.inertia == pytest.approx(b.inertia)
        assert a.quat0 == b.quat0


def test_chain_bent_has_joints_strained_by_the_bend() -> None:
    scene = hanging("bent", Chain(7, bend=0.3))
    length = 0.3 * np.sqrt(0.3**2 + 1.0)
    for i, rotation in enumerate(joint_rotations(scene)):
        axis = np.array(rotation[1:])
        assert 2.0 * np.arcsin(np.linalg.norm(axis)) == pytest.approx(length)
        assert axis[1] / axis[0] == pytest.approx(np.cos(0.7 * i) / 0.3)


def test_made_scenes_only_the_pulled_ones_flow() -> None:
    scenes = made_scenes()
    assert len({scene.name for scene in scenes}) == len(scenes)
    for scene in scenes:
        assert scene.flows == ("pulled" in scene.name)
        assert bool(scene.loads) == scene.flows


def test_scenes_cover_soft_and_stiff_planar_and_bent() -> None:
    scenes = [*(load(path) for path in STORED.glob("chain-*.json")), *made_scenes()]
    hung = [scene for scene in scenes if not scene.flows]
    assert {len(scene.bodies) for scene in hung} == {20, 60, 200, 1000}

    def kind(scene: Scene) -> tuple[bool, bool]:
        return scene.bodies[0].K > 100.0, scene.bodies[0].quat0 != IDENTITY

    assert {kind(scene) for scene in hung} == {(False, False), (False, True), (True, False), (True, True)}
    assert {scene.law for scene in scenes if scene.flows} == {"paper", "overstress"}


def test_constant_forces_are_those_of_constant_loads_alone() -> None:
    chain = hanging("chain", Chain(2))
    push = Load(index=1, force=(0.0, 2.0, 0.0), start=0.0, end=1.0, shape="constant")
    assert constant_forces(replace(chain, loads=(push, push)))[1] == pytest.approx([0.0, 4.0, 0.0])
    with pytest.raises(ValueError, match="not a constant load"):
        constant_forces(replace(chain, loads=(replace(push, shape="sin2"),)))
    with pytest.raises(ValueError, match="not a constant load"):
        constant_forces(replace(chain, loads=(replace(push, end=0.5),)))


def test_save_and_load_every_made_scene_is_unchanged(tmp_path: Path) -> None:
    floors = floor_scenes(load(STORED / "doll-52.json"))
    for scene in [*made_scenes(), *floors, pulled("p", Chain(3, yield_torque=0.0), "overstress")]:
        save(scene, tmp_path / "scene.json")
        assert load(tmp_path / "scene.json") == scene


@pytest.mark.parametrize(
    "change",
    [
        {"gravity": [0.0, 0.0]},
        {"duration": "long"},
        {"bodies": [{"parent": -1}]},
        {"bodies": 3},
    ],
)
def test_load_broken_scene_names_the_file(tmp_path: Path, change: dict[str, object]) -> None:
    path = tmp_path / "broken.json"
    save(hanging("chain", Chain(2)), path)
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    with pytest.raises(ValueError, match=r"broken\.json"):
        load(path)


def test_load_not_json_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "broken.json"
    path.write_text("{")
    with pytest.raises(ValueError, match=r"broken\.json"):
        load(path)
