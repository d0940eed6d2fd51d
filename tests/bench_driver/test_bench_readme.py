"""The figures that layfigure-bench tells by itself, and the README's section made of a run."""

from __future__ import annotations

from pathlib import Path

import pytest
from layfigure_bench import plots
from layfigure_bench.comparison import Point
from layfigure_bench.cost import CostPoint
from layfigure_bench.floor import FloorPoint, FloorResult
from layfigure_bench.programs import OWN
from layfigure_bench.readme import BEGIN, END, refresh, section
from layfigure_bench.report import Results, SceneResult, figures_section
from layfigure_bench.subjects import Figure, figure_of, solutions


def figure(name: str, value: float, target: float | None = None) -> Figure:
    return Figure(name, value, "us", target, holds=True)


CONTACT = [
    figure("ball, friction, 3 rows, cold", 2.0),
    figure("ball, friction, 3 rows, cold: iterations", 4.0),
    figure("ball, friction, 3 rows, cold: residual", 1e-12),
    figure("ball, frictionless, 1 row, Bullet Lemke", 5.0),
    figure("ball, frictionless, 1 row, Bullet Lemke: residual, having given up", 1.0),
    figure("ball, base step with 1 contact", 7.0),
]


def results() -> Results:
    def point(family: str, cpu_s: float, error: float) -> Point:
        return Point(f"{family} order 1", family, 0.01, 100, cpu_s, error, None, 1.0)

    points = (point(OWN, 1e-3, 1e-3), point(OWN, 1e-2, 1e-5), point("Peer", 2.5e-1, 1e-3))
    floor = FloorPoint("DART", "DART", 1.0 / 240.0, 240, 0.24, 1e-3, 2e-3, 1e-6, 1.0)
    costs = [CostPoint(f"chain-{n}", n, f"{OWN} order 1", 0.1 * n) for n in (10, 100)]
    costs += [CostPoint("doll-52", 52, f"{OWN} order {order}", us) for order, us in ((1, 4.0), (4, 18.0))]
    return Results(
        scenes=[
            SceneResult("swing", 3, 1.0, 1e-4, 1e-7, points),
            SceneResult("pull", 3, 1.0, 1e-4, 1e-7, points[:2]),
        ],
        floors=[FloorResult("dropped", 3, 1.0, (floor,), {})],
        costs=[*costs, CostPoint("doll-52", 52, "Pinocchio ABA", 12.0)],
        figures={"contact": CONTACT, "cost": [figure("doll-52 order 4, wall time: two threads / one", 0.75)]},
    )


def test_figure_of_null_is_not_a_number() -> None:
    told = figure_of({"name": "n", "value": None, "unit": "us", "target": 1.0, "holds": False})
    assert told.value != told.value
    assert told.target == 1.0
    assert not told.holds


def test_solutions_join_time_and_residual_of_each_solver() -> None:
    lemke, own = solutions(CONTACT)
    assert (lemke.solver, lemke.kind, lemke.rows, lemke.us, lemke.solved) == (
        "Bullet Lemke",
        "frictionless",
        1,
        5.0,
        False,
    )
    assert (own.solver, own.kind, own.rows, own.us, own.solved) == ("cold", "friction", 3, 2.0, True)


def test_figures_section_shows_targets_where_there_are_some() -> None:
    text = figures_section("cost", [figure("a", 1.5), Figure("b", 2.0, "", 1.0, holds=False)])
    assert "| a | 1.5 | us |  |  |" in text
    assert "| b | 2 |  | 1 | no |" in text


def test_cost_picture_has_steps_and_contact_problems(tmp_path: Path) -> None:
    plots.draw_cost(results().costs, solutions(CONTACT), tmp_path / "cost.png")
    plots.draw_cost(results().costs, [], tmp_path / "bare.png")
    assert (tmp_path / "cost.png").read_bytes() != (tmp_path / "bare.png").read_bytes()


def test_section_has_the_ratios_the_costs_and_the_floor() -> None:
    text = section(results())
    assert "| swing | 250 | 250 | alone | alone | - | - |" in text
    assert "| pull |" not in text, "nothing to compare with"
    assert "base step of doll-52 takes 4 us, one of order 4 18 us (4.5 base steps)" in text
    assert "n^1.00" in text
    assert "On two threads one of order 4 is done in 0.75 of its time on one." in text.replace("\n", " ")
    assert "12 us, 3 times" in text
    assert "| DART | 1000 | 2 | 1.0e-06 | 1.0000 |" in text


def test_refresh_replaces_what_is_between_the_comments_alone(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    for name in ("work_precision.png", "cost.png"):
        (tmp_path / name).write_bytes(b"png")
    refresh(readme, pictures, results(), tmp_path)
    once = readme.read_text()
    assert once.startswith(f"before\n{BEGIN}\n")
    assert once.endswith(f"{END}\nafter\n")
    assert "old" not in once
    assert (pictures / "cost.png").read_bytes() == b"png"
    refresh(readme, pictures, results(), tmp_path)
    assert readme.read_text() == once


def test_refresh_readme_without_the_comments_is_an_error(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("nothing")
    with pytest.raises(ValueError, match="README"):
        refresh(readme, tmp_path, results(), tmp_path)
    assert readme.read_text() == "nothing"


def test_the_readme_has_the_comments() -> None:
    text = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")
    assert 0 <= text.find(BEGIN) < text.find(END)
