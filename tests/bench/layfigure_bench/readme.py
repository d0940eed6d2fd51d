"""The README's section on speed and accuracy, made of a run's results."""

from __future__ import annotations

import math
import shutil
import textwrap
from collections.abc import Sequence
from pathlib import Path

from layfigure_bench.comparison import DECADES, Comparison
from layfigure_bench.cost import COST_ORDERS, CostPoint, slopes
from layfigure_bench.engine import LocalEngine
from layfigure_bench.floor import FloorPoint, FloorResult, at_rate
from layfigure_bench.programs import OWN
from layfigure_bench.report import Results, SceneResult, processor
from layfigure_bench.subjects import Figure

BEGIN = "<!-- bench: what is between these comments is written by ./run bench -->"
END = "<!-- bench: end -->"
PICTURES = ("work_precision.png", "cost.png")
# Of the errors compared, those in the table [m]: 1e-2 to 1e-6, and 1e-8.
SHOWN = (*DECADES[1:6], DECADES[7])
RATE_HZ = 240.0
WIDTH = 120


def refresh(readme: Path, pictures: Path, results: Results, out: Path) -> None:
    """Writes the section into the README, and puts its pictures where it shows them.

    Raises ValueError if the README lacks the comments that the section goes between.
    """
    text = readme.read_text(encoding="utf-8")
    head, begin, rest = text.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"{readme}: no '{BEGIN}' and '{END}' in it")
    readme.write_text(f"{head}{BEGIN}\n\n{section(results)}\n{END}{tail}", encoding="utf-8")
    for name in PICTURES:
        shutil.copy(out / name, pictures / name)


def section(results: Results) -> str:
    parts = [
        f"On one thread of: {processor()}. Compared are Bullet's btMultiBody, MuJoCo, DART and Pinocchio, all in the "
        "same run on the same scenes, each with the step that suits it best.",
        "![Error against CPU time, a panel for each scene](assets/images/work_precision.png)",
        "Times more CPU that the best peer takes for the same rms position error [m]:",
        ratio_table([result for result in results.scenes if any(not p.own for p in result.points)]),
        "![A step against the bodies of a chain, and a contact problem against its rows](assets/images/cost.png)",
        cost_lines(results.costs, results.figures.get("cost", [])),
        "Contacts are not the same in all engines: MuJoCo's give way, the others' are rigid. So only what a step costs "
        f"and how well each keeps the floor can be compared, here at {RATE_HZ:g} steps a second. An engine that is "
        "missing needs too long for so many steps.",
        *[floor_table(result) for result in results.floors],
    ]
    return "\n\n".join(wrapped(part) for part in parts) + "\n"


def wrapped(text: str) -> str:
    """To the README's width, but for tables."""
    lines = text.splitlines()
    return "\n".join(line if line.startswith("|") else textwrap.fill(line, WIDTH) for line in lines)


def ratio_table(results: Sequence[SceneResult]) -> str:
    lines = [
        "| scene | " + " | ".join(f"{error:.0e}" for error in SHOWN) + " |",
        "|---" * (1 + len(SHOWN)) + "|",
    ]
    for result in results:
        found = {c.error: c for c in result.comparisons()}
        lines.append(f"| {result.name} | " + " | ".join(ratio_cell(found.get(error)) for error in SHOWN) + " |")
    note = (
        "alone: no peer got there with the steps and the time that it was given; those in Python are not given more "
        f"than {LocalEngine.most_bodies} bodies, which take them minutes to build. -: not judged, as the reference is "
        "not known that well, or not reached."
    )
    return "\n".join([*lines, "", note])


def ratio_cell(comparison: Comparison | None) -> str:
    if comparison is None or comparison.own is None:
        return "-"
    return "alone" if comparison.ratio is None else rounded(comparison.ratio)


def rounded(value: float) -> str:
    """Two digits, without an exponent where that is readable."""
    return f"{float(f'{value:.2g}'):g}"


def cost_lines(costs: Sequence[CostPoint], told: Sequence[Figure]) -> str:
    dolls = {c.engine: c.us_per_step for c in costs if not c.scene.startswith("chain-")}
    base, high = (dolls[f"{OWN} order {order}"] for order in COST_ORDERS)
    growth = slopes(costs)[f"{OWN} order 1"]
    lines = [
        f"A base step of doll-52 takes {base:.3g} us, one of order {COST_ORDERS[-1]} {high:.3g} us "
        f"({high / base:.2g} base steps); "
        f"from 10 to 10 000 bodies the cost grows like n^{growth:.2f}."
    ]
    shared = {f.name: f.value for f in told}.get(f"doll-52 order {COST_ORDERS[-1]}, wall time: two threads / one")
    if shared is not None:
        lines.append(f"On two threads one of order {COST_ORDERS[-1]} is done in {shared:.2g} of its time on one.")
    if "Pinocchio ABA" in dolls:
        aba = dolls["Pinocchio ABA"]
        lines.append(f"Pinocchio's forward dynamics (ABA) alone takes {aba:.3g} us, {aba / base:.2g} times as long.")
    return " ".join(lines)


def floor_table(result: FloorResult) -> str:
    lines = [
        f"{result.name}, {result.bodies} bodies on a floor:",
        "",
        "| engine | us/step | largest penetration [mm] | kinetic energy left [J] | contact forces / load |",
        "|---|---|---|---|---|",
    ]
    return "\n".join([*lines, *(floor_row(p) for p in at_rate(result, RATE_HZ))])


def floor_row(p: FloorPoint) -> str:
    cost = f"| {p.engine} | {rounded(p.cpu_s / p.steps * 1e6)} |"
    if math.isnan(p.kinetic):
        return f"{cost} blew up | | |"
    return f"{cost} {p.penetration * 1e3:.2g} | {p.kinetic:.1e} | {p.support:.4f} |"
