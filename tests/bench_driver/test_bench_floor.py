"""Scenes with a floor: what they are made of, how an engine is judged by its own limit, and the peers on them."""

from __future__ import annotations

import csv
import importlib
import json
import math
from pathlib import Path

import numpy as np
import pytest
from layfigure_bench import plots
from layfigure_bench.engine import Run, StoredScene, Touch
from layfigure_bench.floor import FloorResult, at_rate, measure_floor
from layfigure_bench.floor_scenes import carried, floor_scenes, lifted, limb_of, penetration, pressed, thickness
from layfigure_bench.report import floor_section, write_floor
from layfigure_bench.scenes import IDENTITY, Body, Scene, exponential, load, matrix

DOLL = load(Path(__file__).resolve().parents[1] / "data" / "scenes" / "doll-52.json")
# A box of 0.6 x 0.2 x 0.4 m and 3 kg, joined at one end.
BOX = Body(-1, (0.0, 0.0, 0.0), (0.3, 0.0, 0.0), 3.0, (0.05, 0.13, 0.1), IDENTITY, 1.0, 0.1)


def test_limb_is_as_thin_as_the_box_and_reaches_from_end_to_end() -> None:
    assert thickness(BOX) == pytest.approx(0.1)
    limb = limb_of(0, BOX)
    assert limb.start == pytest.approx((0.1, 0.0, 0.0))
    assert limb.end == pytest.approx((0.5, 0.0, 0.0))
    assert limb.radius == pytest.approx(0.1)


def test_limb_as_thick_as_long_is_a_ball() -> None:
    # Cubes of 0.2 m about a com that is 0.1 m from the joint.
    cube = Body(-1, (0.0, 0.0, 0.0), (0.0, 0.1, 0.0), 3.0, (0.02, 0.02, 0.02), IDENTITY, 1.0, 0.1)
    limb = limb_of(0, cube)
    assert limb.start == limb.end == (0.0, 0.1, 0.0)


def test_lifted_scene_begins_that_high_over_the_floor_whatever_its_turn() -> None:
    for angle in (0.0, 1.0, -2.0):
        turn = exponential(np.array([0.0, angle, 0.0]))
        scene = lifted(Scene("box", (0.0, 0.0, -9.81), 1.0, (BOX,)), turn, 0.25)
        start = np.array([scene.bodies[0].anchor])
        rotations = np.array([matrix(turn)])
        assert penetration(scene, start - [0.0, 0.0, 0.26], rotations) == pytest.approx(0.01)
        assert penetration(scene, start - [0.0, 0.0, 0.24], rotations) == 0.0


def test_floor_scenes_are_the_whole_doll_and_its_hand() -> None:
    whole, hand = floor_scenes(DOLL)
    assert (len(whole.bodies), len(hand.bodies)) == (52, 16)
    assert carried(whole) == pytest.approx(9.81 * sum(body.mass for body in DOLL.bodies))
    assert carried(hand) == pytest.approx(20.0 + 9.81 * sum(body.mass for body in hand.bodies))
    assert [body.parent for body in hand.bodies[:5]] == [-1, 0, 1, 2, 0]


class FloorEngine:
    """Its error is h, its penetration h / 10; it blows up above a step length."""

    def __init__(self, name: str, offset: float = 0.0, unstable_above: float = math.inf) -> None:
        self.name = name
        self.family = name
        self.offset = offset
        self.unstable_above = unstable_above

    def run(self, stored: StoredScene, h: float, limit_s: float) -> Run | None:
        finite = h <= self.unstable_above
        touch = Touch(0.1 * h, 1e-3 if finite else math.nan, carried(stored.scene))
        com = np.full((1, 3), (self.offset + h) / math.sqrt(3.0))
        return Run(h, round(1.0 / h), 1e-3 / h, com, 0.0, finite, touch=touch)


def measured() -> FloorResult:
    engines = [FloorEngine("Layfigure order 1"), FloorEngine("DART", offset=1.0, unstable_above=0.01)]
    engines.append(FloorEngine("MuJoCo RK4", unstable_above=0.0))
    return measure_floor(pressed(DOLL), engines, [1.0 / 60.0, 1.0 / 240.0], limit_s=10.0)


def test_engine_is_judged_by_its_own_limit() -> None:
    result = measured()
    own = [p for p in result.points if p.engine == "Layfigure order 1"]
    assert [p.error for p in own] == pytest.approx([1.0 / 60.0 - 1.0 / 480.0, 1.0 / 480.0])
    assert own[0].support == pytest.approx(1.0)
    peer = [p for p in result.points if p.engine == "DART"]
    assert peer[0].error == math.inf
    assert peer[1].error == pytest.approx(own[1].error)
    assert result.limits == pytest.approx({"Layfigure order 1": 0.0, "DART": 1.0})


def test_engine_without_any_limit_is_told_as_such() -> None:
    result = measured()
    assert all(p.error == math.inf for p in result.points if p.engine == "MuJoCo RK4")
    assert "MuJoCo RK4" not in result.limits
    section = floor_section(result)
    assert "| MuJoCo RK4 | 0.0167 | 60 | 1e+03 | blew up |" in section
    assert "| DART | 0.00417 |" in section
    assert "| DART | 1.0e+00 |" in section


def test_at_rate_finds_the_runs_of_that_many_steps() -> None:
    assert [p.engine for p in at_rate(measured(), 240.0)] == ["Layfigure order 1", "DART", "MuJoCo RK4"]
    assert at_rate(measured(), 1000.0) == []


def test_written_floor_is_json_without_infinities_csv_and_a_picture(tmp_path: Path) -> None:
    result = measured()
    write_floor([result], tmp_path)
    data = json.loads((tmp_path / "floor.json").read_text(), parse_constant=lambda name: pytest.fail(name))
    assert data[0]["points"][2]["error"] is None
    rows = list(csv.DictReader((tmp_path / "floor.csv").open()))
    assert len(rows) == len(result.points)
    assert float(rows[0]["penetration_m"]) == pytest.approx(0.1 / 60.0)
    plots.draw_floor([result, result], tmp_path / "floor.png")
    assert (tmp_path / "floor.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("module", "package", "engine", "h"),
    [("mujoco_peer", "mujoco", "MuJoCo discrete", 2e-3), ("dart_peer", "dartpy", "DART", 2e-3)],
)
class TestPeer:
    """Needs the peers' packages, which are optional."""

    def run(self, module: str, package: str, engine: str, h: float, scene: Scene) -> Run:
        pytest.importorskip(package)
        engines = {e.name: e for e in importlib.import_module(f"layfigure_bench.{module}").engines()}
        told = engines[engine].run(StoredScene(scene, Path("unused.json")), h, 30.0)
        assert told is not None
        assert told.touch is not None
        return told

    def test_hand_under_a_press_is_carried(self, module: str, package: str, engine: str, h: float) -> None:
        scene = pressed(DOLL)
        told = self.run(module, package, engine, h, scene)
        assert told.touch.support == pytest.approx(carried(scene), rel=1e-3)
        assert told.touch.kinetic < 1e-5
        assert told.touch.penetration < 0.02

    def test_doll_in_the_air_falls_freely(self, module: str, package: str, engine: str, h: float) -> None:
        scene = lifted(Scene("box", (0.0, 0.0, -9.81), 0.1, (BOX,)), exponential(np.array([0.3, 0.2, 0.1])), 1.0)
        told = self.run(module, package, engine, h, scene)
        start = np.array(scene.bodies[0].anchor) + matrix(scene.bodies[0].quat0) @ np.array(BOX.com)
        assert told.com[0] == pytest.approx(start - [0.0, 0.0, 0.5 * 9.81 * 0.1**2], abs=2e-3)
        assert told.touch.support == 0.0
