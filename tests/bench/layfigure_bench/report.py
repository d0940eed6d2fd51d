"""The results as JSON, CSV and Markdown."""

from __future__ import annotations

import csv
import json
import math
import platform
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from layfigure_bench.comparison import JUDGED, Comparison, Point, agreement, compare, front
from layfigure_bench.cost import CostPoint, slopes
from layfigure_bench.floor import FloorPoint, FloorResult, at_rate
from layfigure_bench.programs import ORDERS
from layfigure_bench.subjects import Figure


@dataclass(frozen=True)
class SceneResult:
    name: str
    bodies: int
    duration: float
    reference_h: float
    reference_change: float
    points: tuple[Point, ...]

    def comparisons(self) -> list[Comparison]:
        return compare(self.points, self.reference_change)


# Of the many runs on a floor, those in the table: a frame, a quarter of one, and about a millisecond.
SHOWN_RATES_HZ = (60.0, 240.0, 960.0)


@dataclass(frozen=True)
class Results:
    """All that a run of the benchmark found."""

    scenes: Sequence[SceneResult]
    floors: Sequence[FloorResult]
    costs: Sequence[CostPoint]
    figures: dict[str, list[Figure]]


def processor() -> str:
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    models = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor()


def json_safe(value: Any) -> Any:
    """Infinities and NaN become null, which JSON has."""
    if isinstance(value, dict):
        return {key: json_safe(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [json_safe(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_json(value: Any, path: Path) -> None:
    path.write_text(json.dumps(json_safe(value), indent=1) + "\n", encoding="utf-8")


def write_results(results: Sequence[SceneResult], versions: dict[str, str], folder: Path) -> None:
    scenes = [{**asdict(result), "ratios": [_ratio_of(c) for c in result.comparisons()]} for result in results]
    write_json({"processor": processor(), "peers": versions, "scenes": scenes}, folder / "results.json")
    with (folder / "results.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["scene", "engine", "h_s", "steps", "cpu_s", "error_m", "rest_error_rad", "energy_J"])
        for result in results:
            for p in result.points:
                writer.writerow([result.name, p.engine, p.h, p.steps, p.cpu_s, p.error, p.rest_error, p.energy])


def _ratio_of(comparison: Comparison) -> dict[str, Any]:
    return {**asdict(comparison), "ratio": comparison.ratio}


def write_floor(results: Sequence[FloorResult], folder: Path) -> None:
    write_json([asdict(result) for result in results], folder / "floor.json")
    with (folder / "floor.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        quantities = ["own_error_m", "penetration_m", "kinetic_J", "support_over_carried"]
        writer.writerow(["scene", "engine", "h_s", "steps", "cpu_s", *quantities])
        for result in results:
            for p in result.points:
                numbers = (p.h, p.steps, p.cpu_s, p.error, p.penetration, p.kinetic, p.support)
                writer.writerow([result.name, p.engine, *numbers])


def write_tables(all_results: Results, folder: Path) -> None:
    parts = ["# CPU time against error\n", f"{processor()}, one thread, medians. Only runs that were made count.\n"]
    parts += [scene_section(result) for result in all_results.scenes]
    parts += [floor_section(result) for result in all_results.floors]
    parts.append(cost_section(all_results.costs))
    parts += [figures_section(subject, figures) for subject, figures in all_results.figures.items()]
    (folder / "table.md").write_text("\n".join(parts), encoding="utf-8")


def floor_section(result: FloorResult) -> str:
    lines = [
        f"## {result.name}: {result.bodies} bodies on a floor, {result.duration:g} s\n",
        "Engines differ in what contact is, so each error is the distance from the engine's own limit, a run with "
        "steps half as long as the shortest here. Penetration: the largest of the run. Forces: their vertical sum in "
        "the last step over weight and loads.\n",
        "| engine | h [s] | CPU [ms] | us/step | own error [m] | penetration [mm] | kinetic energy left [J] | forces |",
        "|---|---|---|---|---|---|---|---|",
    ]
    lines += [floor_row(p) for rate in SHOWN_RATES_HZ for p in at_rate(result, rate)]
    lines += ["", "| engine | distance of its limit from the first one's [m] |", "|---|---|"]
    lines += [f"| {engine} | {distance:.1e} |" for engine, distance in result.limits.items()]
    return "\n".join([*lines, ""])


def floor_row(p: FloorPoint) -> str:
    start = f"| {p.engine} | {p.h:.3g} | {p.cpu_s * 1e3:.3g} | {p.cpu_s / p.steps * 1e6:.3g} |"
    if not math.isfinite(p.kinetic):
        return f"{start} blew up | | | |"
    error = f"{p.error:.1e}" if math.isfinite(p.error) else "no limit"
    return f"{start} {error} | {p.penetration * 1e3:.3g} | {p.kinetic:.1e} | {p.support:.4f} |"


def figures_section(subject: str, figures: Sequence[Figure]) -> str:
    lines = [f"## {subject}\n", "| | value | unit | at most | holds |", "|---|---|---|---|---|"]
    for f in figures:
        target, holds = ("", "") if f.target is None else (f"{f.target:g}", "yes" if f.holds else "no")
        lines.append(f"| {f.name} | {f.value:.4g} | {f.unit} | {target} | {holds} |")
    return "\n".join([*lines, ""])


def scene_section(result: SceneResult) -> str:
    lines = [
        f"## {result.name}: {result.bodies} bodies, {result.duration:g} s\n",
        f"Reference: order {ORDERS[-1]}, h = {result.reference_h:.3g} s; halving the step last changed it by "
        f"{result.reference_change:.1e} m. Errors below {JUDGED:g} times that are not judged.\n",
        "| error [m] | Layfigure [ms] | by | best peer [ms] | by | ratio |",
        "|---|---|---|---|---|---|",
    ]
    lines += [comparison_row(c) for c in result.comparisons()]
    wins = [p for p in front(result.points) if not p.own and p.error >= JUDGED * result.reference_change]
    named = ", ".join(f"{p.engine} (h = {p.h:.3g} s)" for p in wins)
    lines += ["", f"Points of the front that a peer holds: {named or 'none'}.\n"]
    lines += ["| engine | nearest to the reference [m] | at h [s] | observed order |", "|---|---|---|---|"]
    for a in agreement(result.points):
        order = "" if a.order is None else f"{a.order:.2f}"
        lines.append(f"| {a.engine} | {a.least_error:.1e} | {a.h:.3g} | {order} |")
    lines.append("")
    lines += residual_rows(result.points)
    return "\n".join(lines)


def comparison_row(c: Comparison) -> str:
    ratio = "" if c.ratio is None else f"{c.ratio:.3g}"
    return f"| {c.error:.0e} | {_work(c.own)} | {_work(c.peer)} | {ratio} |"


def _work(point: Point | None) -> str:
    return "not reached | " if point is None else f"{point.cpu_s * 1e3:.3g} | {point.engine}, h = {point.h:.3g} s"


def residual_rows(points: Sequence[Point]) -> list[str]:
    """The error of the pose that the flow left, where there was any."""
    flowed = [p for p in points if p.rest_error]
    if not flowed:
        return []
    lines = ["| engine | h [s] | CPU [ms] | residual pose error [rad] |", "|---|---|---|---|"]
    lines += [f"| {p.engine} | {p.h:.3g} | {p.cpu_s * 1e3:.3g} | {p.rest_error:.1e} |" for p in flowed]
    return [*lines, ""]


def cost_section(costs: Sequence[CostPoint]) -> str:
    lines = ["## CPU time of a step\n", "| scene | bodies | engine | us/step | us/step/body |", "|---|---|---|---|---|"]
    lines += [
        f"| {c.scene} | {c.bodies} | {c.engine} | {c.us_per_step:.3g} | {c.us_per_step / c.bodies:.3g} |" for c in costs
    ]
    lines += ["", "Growth with the length of a chain, us/step = a n^p:", ""]
    lines += [f"- {engine}: p = {slope:.3f}" for engine, slope in slopes(costs).items()]
    return "\n".join([*lines, ""])
