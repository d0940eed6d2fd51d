"""Reduced keys: few enough, and good enough in the eyes of USD itself."""

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest
from client_support.motions import FPS, moving_take, wandering
from client_support.skinned import farthest_by_usd
from pxr import Usd, UsdSkel

from layfigure import key_reduction, skeleton
from layfigure.animation import animate
from layfigure.errors import LayfigureError
from layfigure.key_error import SkinDistance
from layfigure.key_reduction import KeySearch, reduced_keys
from layfigure.resample import resample
from layfigure.skinning import Skin
from layfigure.take import Take
from layfigure.take_form import TakeForm
from layfigure.usd.checks import check
from layfigure.usd.writer import write_take

TOLERANCE_M = 0.5e-3
MISSED_SHARE = 0.6  # of the keys between, that fits may need: the skin does not bend to one side all the time
REDUCED = TakeForm(keys="reduced", tolerance_m=TOLERANCE_M)


def distance_of(take: Take) -> SkinDistance:
    return SkinDistance.of_frames(take.character, Skin(take.character, take.meshes), resample(take, FPS))


def keys_of(take: Take, tolerance_m: float = TOLERANCE_M) -> list[int]:
    return reduced_keys(distance_of(take), tolerance_m).tolist()


def fewest_by_trying_all(distance: SkinDistance, tolerance_m: float) -> int:
    """Dynamic programming over every pair of frames."""
    count = len(distance)
    fewest = [1] + [count] * (count - 1)
    for last in range(1, count):
        for first in range(last):
            between = np.arange(first + 1, last)
            ends = np.full_like(between, first), np.full_like(between, last)
            if not distance.exceeds(*ends, between, tolerance_m).any():
                fewest[last] = min(fewest[last], fewest[first] + 1)
    return fewest[-1]


@pytest.mark.parametrize("seed", [1, 2])
def test_reduced_keys_every_vertex_is_within_the_tolerance_by_usd(tmp_path: Path, seed: int) -> None:
    take = moving_take(wandering(200, seed, size=0.03), np.cumsum(wandering(200, seed + 10, 1e-4)[:, :3], axis=0))
    write_take(take, tmp_path / "every.usdc", FPS)
    animation = write_take(take, tmp_path / "reduced.usdc", FPS, REDUCED)
    assert 2 < len(animation.keys) < 100
    farthest = farthest_by_usd(tmp_path / "every.usdc", tmp_path / "reduced.usdc")
    assert 0.5 * TOLERANCE_M < farthest <= TOLERANCE_M
    assert check(tmp_path / "reduced.usdc").findings == ()


def test_fitted_keys_are_fewer_than_recorded_poses_and_hold_the_tolerance(tmp_path: Path) -> None:
    take = moving_take(wandering(200, 1, size=0.03))
    write_take(take, tmp_path / "every.usdc", FPS)
    animation = write_take(take, tmp_path / "reduced.usdc", FPS, REDUCED)
    assert len(animation.keys) < len(keys_of(take))
    assert farthest_by_usd(tmp_path / "every.usdc", tmp_path / "reduced.usdc") <= TOLERANCE_M
    for end in (0, -1):
        np.testing.assert_array_equal(animation.values.rotations[end], animation.frames.rotations[end])


@pytest.mark.parametrize(("seed", "size"), [(1, 0.03), (2, 0.1), (3, 0.05)])
def test_fitted_keys_come_close_to_the_fewest_of_twice_the_tolerance(seed: int, size: float) -> None:
    """Which are a bound where the skin bends to one side: what is moved by half of its error has half of it."""
    take = moving_take(wandering(200, seed, size))
    fitted = len(animate(take, FPS, REDUCED).keys)
    recorded, loosest = len(keys_of(take)), len(keys_of(take, 2.0 * TOLERANCE_M))
    assert loosest <= fitted < recorded
    assert fitted - loosest <= MISSED_SHARE * (recorded - loosest)


def test_key_search_with_less_tolerance_here_and_there_finds_as_few_as_one_anew() -> None:
    take = moving_take(wandering(150, 3, size=0.1))
    distance = distance_of(take)
    search = KeySearch(distance, TOLERANCE_M)
    tolerances = np.full(150, 2.0 * TOLERANCE_M)
    counts = [len(search.keys(tolerances))]
    for part in (slice(40, 60), slice(50, 90), slice(0, 150)):
        tolerances = tolerances.copy()
        tolerances[part] = np.maximum(0.6 * tolerances[part], TOLERANCE_M)
        keys = search.keys(tolerances)
        counts.append(len(keys))
        for first, last in itertools.pairwise(keys):
            between = np.arange(first + 1, last)
            ends = np.full_like(between, first), np.full_like(between, last)
            assert not distance.exceeds(*ends, between, tolerances[between]).any()
        assert len(keys) == len(KeySearch(distance, TOLERANCE_M).keys(tolerances))
    assert counts == sorted(counts)
    assert counts[-1] > counts[0]


@pytest.mark.parametrize("seed", range(4))
def test_reduced_keys_are_as_few_as_can_be(seed: int) -> None:
    distance = distance_of(moving_take(wandering(45, seed, size=0.2)))
    keys = reduced_keys(distance, TOLERANCE_M)
    assert len(keys) == fewest_by_trying_all(distance, TOLERANCE_M)
    assert (keys[0], keys[-1]) == (0, 44)


def test_reduced_keys_interval_behind_one_that_fails_is_found() -> None:
    """A bump spoils an interval that ends in it, but not a longer one that passes it within the tolerance."""
    angles = np.zeros((30, 4))
    angles[:, 1] = 0.01 * np.arange(30)  # a steady turn
    angles[10, 1] += 1.5e-3  # [rad], less than 0.5 mm at the arm's length
    assert keys_of(moving_take(angles), 1e-3) == [0, 29]


def test_reduced_keys_steady_turn_needs_two() -> None:
    angles = np.outer(0.02 * np.arange(100), [1.0, 0.0, 0.0, 0.0])  # 2 rad of the root alone: a slerp
    assert keys_of(moving_take(angles)) == [0, 99]


def test_reduced_keys_turn_of_more_than_half_is_cut_where_slerp_would_go_the_other_way() -> None:
    angles = np.outer(0.05 * np.arange(100), [1.0, 0.0, 0.0, 0.0])  # 5 rad
    assert len(keys_of(moving_take(angles))) == 3


def test_reduced_keys_rest_is_one_key_and_a_default_value(tmp_path: Path) -> None:
    animation = write_take(moving_take(np.zeros((300, 4))), tmp_path / "take.usdc", FPS, REDUCED)
    assert animation.keys.tolist() == [0]
    stage = Usd.Stage.Open(str(tmp_path / "take.usdc"))
    written = UsdSkel.Animation(stage.GetPrimAtPath("/Synthetic_arm/Animation"))
    for attribute in (written.GetRotationsAttr(), written.GetTranslationsAttr()):
        assert attribute.GetNumTimeSamples() == 0
        assert len(attribute.Get()) == 4
    assert check(tmp_path / "take.usdc").findings == ()


def test_reduced_keys_long_rest_between_motions_costs_no_keys() -> None:
    move = 0.5 * np.sin(np.linspace(0.0, 0.5 * np.pi, 40))[:, None] * np.ones(4)
    pauses = [np.concatenate([move, np.repeat(move[-1:], rest, axis=0), move[::-1]]) for rest in (30, 3000)]
    short, long = (keys_of(moving_take(angles)) for angles in pauses)
    assert len(long) <= len(short) + 1
    assert max(np.diff(long)) > key_reduction.MAX_SPAN


@pytest.mark.parametrize("count", [1, 2, 3])
def test_reduced_keys_shortest_takes(count: int) -> None:
    angles = 0.3 * np.arange(count)[:, None] ** 2 * np.ones(4)
    assert keys_of(moving_take(angles)) == list(range(count))


def test_reduced_keys_tolerance_below_roundings_keeps_every_frame() -> None:
    assert keys_of(moving_take(wandering(30, 5, size=0.3)), 1e-9) == list(range(30))


def test_reduced_keys_more_tolerance_needs_no_more_keys() -> None:
    take = moving_take(wandering(150, 6, size=0.3))
    counts = [len(keys_of(take, tolerance_m)) for tolerance_m in (1e-4, 5e-4, 2e-3, 1e-2, 10.0)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > 4 * counts[-1]


def test_reduced_keys_search_that_gave_up_earlier_is_no_better(monkeypatch: pytest.MonkeyPatch) -> None:
    take = moving_take(wandering(150, 7, size=0.2))
    thorough = len(keys_of(take))
    monkeypatch.setattr(key_reduction, "LOOKAHEAD", 1)
    assert len(keys_of(take)) >= thorough


def test_path_lengths_bound_how_far_the_skin_moves() -> None:
    take = moving_take(wandering(60, 8, size=0.5), np.cumsum(wandering(60, 9, 1e-2)[:, :3], axis=0))
    skin, frames = Skin(take.character, take.meshes), resample(take, FPS)
    lengths = SkinDistance.of_frames(take.character, skin, frames).path_lengths()
    posed = skeleton.world_poses(take.character, frames.root_translations, frames.rotations)
    skinned = skin.skin(skin.motions(*posed))
    moved = np.linalg.norm(skinned[:, None] - skinned[None], axis=-1).max(axis=-1)
    assert (moved <= np.abs(lengths[:, None] - lengths[None]) + 1e-6).all()


def test_reduced_keys_without_mesh_are_refused() -> None:
    take = dataclasses.replace(moving_take(wandering(10, 1, 0.1)), meshes=())
    with pytest.raises(LayfigureError, match=r"'Synthetic arm' has no mesh .* choose other --keys"):
        animate(take, FPS, REDUCED)
    assert len(animate(take, FPS, TakeForm()).keys) == 10
