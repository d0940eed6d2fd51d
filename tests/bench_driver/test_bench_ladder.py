"""Which steps an engine is run with, and how the reference is found."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from layfigure_bench.engine import LocalEngine, Run, StoredScene
from layfigure_bench.ladder import climb, make_reference, rms, rms_angle, step_lengths
from layfigure_bench.scenes import Array, Chain, Limb, Scene, hanging

STORED = StoredScene(hanging("chain", Chain(2)), Path("unused.json"))


class FakeEngine:
    """Its error is h^order plus a floor that rounding sets, its cost a second for each 1000 steps."""

    name = "fake"
    family = "fake"

    def __init__(self, order: int = 2, rounding: float = 0.0, unstable_above: float = math.inf) -> None:
        self.order = order
        self.rounding = rounding
        self.unstable_above = unstable_above
        self.asked: list[float] = []

    def run(self, stored: StoredScene, h: float, limit_s: float) -> Run | None:
        self.asked.append(h)
        cpu_s = 1e-3 / h
        if cpu_s > limit_s:
            return None
        noise = self.rounding / h * (-1) ** len(self.asked)
        com = np.full((2, 3), h**self.order + noise)
        return Run(h, round(1.0 / h), cpu_s, com, 0.0, finite=h <= self.unstable_above)


def test_step_lengths_begin_at_the_longest_and_shrink_by_the_factor() -> None:
    assert step_lengths(3, 4.0) == pytest.approx([1.0, 0.25, 0.0625])


def test_climb_leaves_out_steps_longer_than_the_scene() -> None:
    short = StoredScene(hanging("chain", Chain(2), duration=0.5), Path("unused.json"))
    engine = FakeEngine()
    climb(engine, short, [1.0, 0.5, 0.25], limit_s=1.0)
    assert engine.asked == [0.5, 0.25]


def test_climb_stops_before_the_step_that_would_take_too_long() -> None:
    engine = FakeEngine()
    runs = climb(engine, STORED, [0.1, 0.05, 0.025, 0.0125], limit_s=0.05)
    assert [run.h for run in runs] == [0.1, 0.05, 0.025]
    assert engine.asked == [0.1, 0.05, 0.025]


def test_climb_engine_that_gives_up_ends_it() -> None:
    assert climb(FakeEngine(), STORED, [0.1, 0.05], limit_s=0.001) == []


def test_climb_goes_on_below_steps_that_blew_up() -> None:
    runs = climb(FakeEngine(unstable_above=0.03), STORED, [0.1, 0.05, 0.025], limit_s=1.0)
    assert [run.finite for run in runs] == [False, False, True]


def test_reference_halves_until_the_change_is_negligible() -> None:
    reference = make_reference(FakeEngine(order=4), STORED, longest=0.01, limit_s=100.0)
    assert reference.change <= 1e-11
    assert reference.run.h >= 1e-4


def test_reference_stops_where_rounding_takes_over() -> None:
    reference = make_reference(FakeEngine(rounding=1e-11), STORED, longest=0.01, limit_s=1e6)
    assert 1e-11 < reference.change < 1e-5
    assert reference.run.h > 1e-6


def test_reference_out_of_time_says_how_well_it_is_known() -> None:
    reference = make_reference(FakeEngine(order=1), STORED, longest=0.01, limit_s=1.0)
    assert reference.run.cpu_s <= 1.0
    assert reference.change == pytest.approx(reference.run.h * math.sqrt(3.0))


def test_reference_that_blows_up_is_an_error() -> None:
    with pytest.raises(RuntimeError, match="chain: no reference"):
        make_reference(FakeEngine(unstable_above=1e-9), STORED, longest=0.01, limit_s=1.0)


def test_rms_of_rows() -> None:
    assert rms(np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 0.0]])) == pytest.approx(math.sqrt(12.5))


def test_rms_angle_signs_of_quaternions_do_not_count() -> None:
    q = np.array([[math.cos(0.05), math.sin(0.05), 0.0, 0.0]])
    identity = np.array([[1.0, 0.0, 0.0, 0.0]])
    assert rms_angle(q, identity) == pytest.approx(0.1)
    assert rms_angle(-q, identity) == pytest.approx(0.1)
    assert rms_angle(q, q) == 0.0


class FakeSimulation:
    """Blows up after a number of steps."""

    def __init__(self, life: int) -> None:
        self.life = life
        self.done = 0
        self.lives: list[int] = []

    def restart(self) -> None:
        self.lives.append(self.done)
        self.done = 0

    def advance(self, steps: int) -> None:
        self.done += steps

    def com(self) -> Array:
        return np.full((2, 3), np.nan if self.done >= self.life else 0.5)

    def energy(self) -> float:
        return 1.0

    def frames(self) -> tuple[Array, Array]:
        return np.zeros((2, 3)), np.broadcast_to(np.eye(3), (2, 3, 3))

    def kinetic(self) -> float:
        return 0.5

    def support(self) -> float:
        return 3.0

    def call_cost_s(self) -> float:
        return 0.0


def test_local_engine_steps_to_the_end_of_the_scene() -> None:
    simulation = FakeSimulation(life=10_000)

    def build(scene: Scene, h: float) -> FakeSimulation:
        assert h == pytest.approx(scene.duration / 333)
        return simulation

    run = LocalEngine("fake", "fake", build).run(STORED, 0.003, 10.0)
    assert run is not None
    assert run.steps == simulation.done == 333
    assert run.finite
    assert simulation.lives == [0, 333, 333, 333, 333]


def test_local_engine_that_blows_up_is_stopped_and_told() -> None:
    simulation = FakeSimulation(life=100)
    run = LocalEngine("fake", "fake", lambda scene, h: simulation).run(STORED, 0.001, 10.0)
    assert run is not None
    assert not run.finite
    assert simulation.done < 200


def test_local_engine_tells_of_the_floor_where_there_is_one() -> None:
    limbs = (Limb(0, (0.0, 0.0, 0.05), (0.0, 0.0, 0.2), 0.06), Limb(1, (0.0, 0.0, 0.2), (0.0, 0.0, 0.2), 0.1))
    scene = replace(STORED.scene, limbs=limbs, floor=0.5)
    engine = LocalEngine("fake", "fake", lambda scene, h: FakeSimulation(1000))
    run = engine.run(StoredScene(scene, STORED.path), 0.1, 10.0)
    assert run is not None
    assert run.touch is not None
    assert run.touch.penetration == pytest.approx(0.01)
    assert (run.touch.kinetic, run.touch.support) == (0.5, 3.0)
    bare = engine.run(STORED, 0.1, 10.0)
    assert bare is not None
    assert bare.touch is None


def test_local_engine_scene_too_large_is_left_out() -> None:
    engine = LocalEngine("fake", "fake", lambda scene, h: FakeSimulation(1), most_bodies=1)
    assert engine.run(STORED, 0.1, 1.0) is None
