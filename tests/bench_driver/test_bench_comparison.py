"""The least work for an error, the ratios and the tables made of them."""

from __future__ import annotations

import csv
import importlib
import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from layfigure_bench import cost, plots
from layfigure_bench.comparison import Point, agreement, compare, front, least_work, point_of
from layfigure_bench.cost import CostPoint, slopes
from layfigure_bench.engine import Run, StoredScene
from layfigure_bench.ladder import Reference
from layfigure_bench.programs import OWN, run_of
from layfigure_bench.report import Results, SceneResult, scene_section, write_results, write_tables
from layfigure_bench.scenes import Chain, Scene, exponential, hanging


def point(family: str, cpu_s: float, error: float, h: float = 0.01) -> Point:
    return Point(f"{family} engine", family, h, 100, cpu_s, error, None, 1.0)


POINTS = [
    point(OWN, 1e-3, 1e-2, h=0.1),
    point(OWN, 1e-2, 1e-5, h=0.01),
    point("Peer", 5e-4, math.inf, h=0.1),
    point("Peer", 2e-2, 5e-2, h=0.01),
    point("Peer", 2e-1, 5e-3, h=0.001),
]


def run(com: float, *, finite: bool = True, rest: float | None = None) -> Run:
    angles = None if rest is None else np.array([[math.cos(rest / 2), math.sin(rest / 2), 0.0, 0.0]])
    return Run(0.01, 100, 0.5, np.full((1, 3), com), 2.0, finite, angles)


def test_point_of_measures_position_and_residual_pose() -> None:
    p = point_of("e", OWN, run(1.0, rest=0.3), Reference(run(0.0, rest=0.1), 0.0))
    assert p.error == pytest.approx(math.sqrt(3.0))
    assert p.rest_error == pytest.approx(0.2)
    assert p.own


def test_point_of_a_run_that_blew_up_is_infinitely_wrong() -> None:
    assert point_of("e", "Peer", run(1.0, finite=False), Reference(run(0.0), 0.0)).error == math.inf


def test_least_work_is_the_cheapest_that_is_accurate_enough() -> None:
    found = least_work(POINTS, 1e-2)
    assert found is not None
    assert found.cpu_s == 1e-3
    assert least_work(POINTS, 1e-6) is None


def test_least_work_never_takes_a_run_that_blew_up() -> None:
    found = least_work(POINTS, 1e9)
    assert found is not None
    assert found.cpu_s == 1e-3


def test_compare_gives_the_ratio_where_both_get_there() -> None:
    table = {c.error: c for c in compare(POINTS, change=1e-7)}
    assert table[1e-1].ratio == pytest.approx(20.0)
    assert table[1e-2].ratio == pytest.approx(200.0)
    assert table[1e-4].ratio is None
    assert table[1e-4].own is not None
    assert table[1e-4].peer is None


def test_compare_leaves_out_what_the_reference_cannot_judge() -> None:
    assert min(c.error for c in compare(POINTS, change=1e-7)) == pytest.approx(1e-6)
    assert len(compare(POINTS, change=0.0)) == 10


def test_front_holds_what_nothing_beats() -> None:
    assert [(p.cpu_s, p.error) for p in front(POINTS)] == [(1e-3, 1e-2), (1e-2, 1e-5)]
    cheap = point("Peer", 1e-4, 1.0)
    assert front([*POINTS, cheap])[0] == cheap


def test_agreement_finds_the_least_error_and_the_order() -> None:
    own, peer = agreement(POINTS)
    assert own.least_error == 1e-5
    assert own.order == pytest.approx(3.0)
    assert peer.order == pytest.approx(1.0)
    assert agreement([point("Peer", 1.0, math.inf)]) == []
    assert agreement([point("Peer", 1.0, 0.1)])[0].order is None


def test_slopes_of_a_linear_and_a_quadratic_cost() -> None:
    costs = [CostPoint(f"chain-{n}", n, name, n**p) for n in (10, 100, 1000) for name, p in (("a", 1), ("b", 2))]
    assert slopes([*costs, CostPoint("doll-52", 52, "a", 1e9)]) == pytest.approx({"a": 1.0, "b": 2.0})


@dataclass
class TurningEngine:
    """Each run takes longer than the last."""

    name: str
    order: list[str]
    family: str = OWN

    def run(self, stored: StoredScene, h: float, limit_s: float) -> Run | None:
        self.order.append(self.name)
        return Run(h, 1000, 1e-3 * len(self.order) ** 2, np.zeros((2, 3)), 0.0, finite=True)


def test_costs_are_medians_of_rounds_in_which_all_take_turns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    turns: list[str] = []
    monkeypatch.setattr(cost, "own_engine", lambda _programs, order: TurningEngine(f"order {order}", turns))
    monkeypatch.setattr(cost, "pinocchio_timer", lambda _scene: {"peer": lambda: 7.0})
    costs = cost.measure_costs([hanging("chain", Chain(2))], tmp_path, tmp_path)
    assert turns == ["order 1", "order 4"] * cost.ROUNDS
    middle = 2 * (cost.ROUNDS // 2)
    assert [(c.scene, c.bodies, c.engine) for c in costs] == [("chain", 2, e) for e in ("order 1", "order 4", "peer")]
    assert [c.us_per_step for c in costs] == pytest.approx([(middle + 1) ** 2, (middle + 2) ** 2, 7.0])


def test_cost_of_an_engine_that_gives_up_is_an_error(tmp_path: Path) -> None:
    class Slow(TurningEngine):
        def run(self, stored: StoredScene, h: float, limit_s: float) -> Run | None:
            return None

    stored = StoredScene(hanging("chain", Chain(2)), tmp_path / "scene.json")
    with pytest.raises(RuntimeError, match="chain: slow took too long"):
        cost.us_per_step(Slow("slow", []), stored)


def test_run_of_null_is_not_finite() -> None:
    item = {"h": 0.1, "steps": 10, "cpu_s": 0.5, "com": [[None, 0.0, 0.0]], "energy": None, "finite": True}
    told = run_of(item)
    assert not told.finite
    assert math.isnan(told.energy)


def result(points: list[Point]) -> SceneResult:
    return SceneResult("scene", 3, 1.0, 1e-4, 1e-7, tuple(points))


def test_scene_section_shows_the_ratios_and_no_point_lost() -> None:
    section = scene_section(result(POINTS))
    assert "| 1e-02 | 1 | Layfigure engine, h = 0.1 s | 200 | Peer engine, h = 0.001 s | 200 |" in section
    assert "| 1e-05 | 10 | Layfigure engine, h = 0.01 s | not reached |  |  |" in section
    assert "a peer holds: none" in section


def test_scene_section_names_the_peer_that_holds_a_point() -> None:
    assert "a peer holds: Peer engine (h = 0.01 s)" in scene_section(result([*POINTS, point("Peer", 1e-4, 1.0)]))


def test_written_results_are_json_without_infinities_and_csv_with_every_run(tmp_path: Path) -> None:
    write_results([result(POINTS)], {"peer": "1.0"}, tmp_path)
    data = json.loads((tmp_path / "results.json").read_text(), parse_constant=lambda name: pytest.fail(name))
    assert data["peers"] == {"peer": "1.0"}
    assert data["scenes"][0]["points"][2]["error"] is None
    assert data["scenes"][0]["ratios"][1]["ratio"] == pytest.approx(200.0)
    rows = list(csv.DictReader((tmp_path / "results.csv").open()))
    assert len(rows) == len(POINTS)
    assert rows[1]["error_m"] == "1e-05"


def test_tables_have_the_cost_and_its_growth(tmp_path: Path) -> None:
    costs = [CostPoint("chain-10", 10, "e", 1.0), CostPoint("chain-100", 100, "e", 10.0)]
    write_tables(Results([result(POINTS)], [], costs, {}), tmp_path)
    text = (tmp_path / "table.md").read_text()
    assert "| chain-100 | 100 | e | 10 | 0.1 |" in text
    assert "e: p = 1.000" in text


def test_plots_draw_runs_that_blew_up_and_scenes_without_peers(tmp_path: Path) -> None:
    styled = [replace(p, engine="DART" if p.family == "Peer" else "Layfigure order 2") for p in POINTS]
    alone = [p for p in styled if p.own]
    plots.draw_work_precision([result(styled), result(alone)], tmp_path / "panels.png")
    plots.draw_cost([CostPoint(f"chain-{n}", n, "Pinocchio ABA", n) for n in (10, 100)], [], tmp_path / "cost.png")
    for name in ("panels.png", "cost.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_plotted_leaves_out_what_a_logarithmic_axis_cannot_show() -> None:
    assert plots.plotted(POINTS) == [p for p in POINTS if math.isfinite(p.error)]
    assert plots.plotted([point(OWN, 1.0, 0.0)]) == []


@pytest.mark.parametrize(("module", "package"), [("mujoco_peer", "mujoco"), ("dart_peer", "dartpy")])
class TestPeer:
    """Needs the peers' packages, which are optional."""

    def test_every_engine_has_a_style(self, module: str, package: str) -> None:
        pytest.importorskip(package)
        for engine in importlib.import_module(f"layfigure_bench.{module}").engines():
            assert plots.style_of(engine.name)["marker"]

    def test_every_engine_swings_a_bent_pendulum_like_the_closed_form(self, module: str, package: str) -> None:
        # One link on a stiff, overdamped joint without gravity: its strain decays along its own axis.
        pytest.importorskip(package)
        body = Chain(1, stiffness=1.0, damping=1.0).bodies()[0]
        angle = 0.2
        bent = replace(body, quat0=exponential(np.array([0.0, 0.0, angle])))
        scene = Scene("link", (0.0, 0.0, 0.0), 0.5, (bent,))
        inertia = body.inertia[2] + body.mass * body.com[0] ** 2
        fast, slow = sorted(np.roots([inertia, body.D, body.K]))
        end = angle * (fast * np.exp(slow * 0.5) - slow * np.exp(fast * 0.5)) / (fast - slow)
        for engine in importlib.import_module(f"layfigure_bench.{module}").engines():
            told = engine.run(StoredScene(scene, Path("unused.json")), 5e-4, 10.0)
            assert told is not None
            assert told.com[0] == pytest.approx(0.05 * np.array([np.cos(end), np.sin(end), 0.0]), abs=2e-5)
            assert told.energy == pytest.approx(0.5 * body.K * end**2, rel=1e-2)
