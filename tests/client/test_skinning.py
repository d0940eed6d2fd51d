"""The client's skinning against UsdSkel's own, and its boxes against the vertices."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from client_support.motions import FPS, moving_take, wandering

from layfigure import skeleton
from layfigure.protocol import Floats
from layfigure.skinning import Skin, largest
from layfigure.take import Take
from layfigure.usd.reader import SkinnedStage
from layfigure.usd.writer import write_take

FRAMES = 40
FLOAT_TOLERANCE = 3e-6  # [m] USD's single precision along a chain of joints, over a metre


@pytest.fixture(scope="module")
def wild_take() -> Take:
    return moving_take(wandering(FRAMES, seed=1, size=2.0), np.random.default_rng(2).normal(size=(FRAMES, 3)))


def motions(skin: Skin, take: Take) -> Floats:
    return skin.motions(*skeleton.world_poses(take.character, take.root_translations, take.rotations))


def test_skin_equals_that_of_usd_in_every_frame(wild_take: Take, tmp_path: Path) -> None:
    write_take(wild_take, tmp_path / "take.usdc", FPS)
    stage = SkinnedStage(tmp_path / "take.usdc")
    skin = Skin(wild_take.character, wild_take.meshes)
    skinned = skin.skin(motions(skin, wild_take))
    for frame in range(FRAMES):
        by_usd = np.concatenate([mesh.points for mesh in stage.posed(frame)])
        np.testing.assert_allclose(skinned[frame], by_usd, atol=FLOAT_TOLERANCE)


def test_skin_of_two_meshes_is_each_in_turn(wild_take: Take) -> None:
    (mesh,) = wild_take.meshes
    moved = dataclasses.replace(mesh, points=mesh.points + np.float32(0.125))
    both = Skin(wild_take.character, [mesh, moved])
    skinned = both.skin(motions(both, wild_take))
    for index, each in enumerate([mesh, moved]):
        alone = Skin(wild_take.character, [each])
        part = skinned[:, index * len(mesh.points) : (index + 1) * len(mesh.points)]
        np.testing.assert_allclose(part, alone.skin(motions(alone, wild_take)), atol=1e-12)


def test_skin_joint_named_twice_by_a_vertex_counts_with_both_weights(wild_take: Take) -> None:
    (mesh,) = wild_take.meshes
    halves = dataclasses.replace(
        mesh,
        joint_indices=np.concatenate([mesh.joint_indices, mesh.joint_indices], axis=1),
        joint_weights=np.concatenate([mesh.joint_weights, mesh.joint_weights], axis=1) / np.float32(2.0),
    )
    once, twice = Skin(wild_take.character, [mesh]), Skin(wild_take.character, [halves])
    np.testing.assert_allclose(twice.skin(motions(twice, wild_take)), once.skin(motions(once, wild_take)), atol=1e-12)


def test_skin_boxes_are_those_of_the_vertices(wild_take: Take) -> None:
    skin = Skin(wild_take.character, wild_take.meshes)
    skinned = skin.skin(motions(skin, wild_take))
    expected = np.stack([skinned.min(axis=1), skinned.max(axis=1)], axis=1)
    np.testing.assert_allclose(skin.boxes(motions(skin, wild_take)), expected, atol=1e-12)


def test_skin_vertex_without_weight_stays_at_the_origin(wild_take: Take) -> None:
    (mesh,) = wild_take.meshes
    weights = mesh.joint_weights.copy()
    weights[3] = 0.0
    skin = Skin(wild_take.character, [dataclasses.replace(mesh, joint_weights=weights)])
    assert (skin.skin(motions(skin, wild_take))[:, 3] == 0.0).all()


def test_skin_without_meshes_has_no_vertices(wild_take: Take) -> None:
    skin = Skin(wild_take.character, [])
    assert skin.vertex_count == 0
    assert skin.skin(motions(skin, wild_take)).shape == (FRAMES, 0, 3)


def test_largest_finds_the_maximum_and_asks_for_little() -> None:
    generator = np.random.default_rng(3)
    values = generator.normal(size=(200, 30))
    bounds = values + generator.uniform(0.0, 0.5, size=values.shape)
    asked = 0

    def evaluate(column: int, rows: np.ndarray) -> Floats:
        nonlocal asked
        asked += len(rows)
        return np.asarray(values[rows, column], np.float64)

    np.testing.assert_array_equal(largest(bounds, evaluate), values.max(axis=1))
    assert asked < 0.2 * values.size


def test_largest_floor_and_ceiling_are_told_apart_from_what_is_between() -> None:
    values = np.array([[0.1, 0.2], [0.4, 0.9], [0.5, 0.6]])

    def evaluate(column: int, rows: np.ndarray) -> Floats:
        return np.asarray(values[rows, column], np.float64)

    assert (largest(values + 0.01, evaluate, floor=0.55, ceiling=0.55) > 0.55).tolist() == [False, True, True]
