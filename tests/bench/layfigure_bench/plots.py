"""The diagrams: error against CPU time, a panel for each scene, and the cost of a step against the bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from layfigure_bench.comparison import Point
from layfigure_bench.cost import CostPoint
from layfigure_bench.report import SceneResult

COLUMNS = 3
# Okabe and Ito's colours, which the colour-blind tell apart; ours are one blue that darkens with the order. Peers have
# markers of their own too.
STYLES = {
    "Layfigure order 1": {"color": "#9ecae1", "marker": "o"},
    "Layfigure order 2": {"color": "#6baed6", "marker": "o"},
    "Layfigure order 3": {"color": "#4292c6", "marker": "o"},
    "Layfigure order 4": {"color": "#2171b5", "marker": "o"},
    "Layfigure order 5": {"color": "#08519c", "marker": "o"},
    "Layfigure order 6": {"color": "#08306b", "marker": "o"},
    "MuJoCo Euler": {"color": "#e69f00", "marker": "^"},
    "MuJoCo implicitfast": {"color": "#e69f00", "marker": "v"},
    "MuJoCo RK4": {"color": "#d55e00", "marker": "*"},
    "MuJoCo discrete": {"color": "#e69f00", "marker": "P"},
    "DART": {"color": "#009e73", "marker": "D"},
    "Bullet btMultiBody": {"color": "#cc79a7", "marker": "s"},
    "Pinocchio ABA": {"color": "#000000", "marker": "X"},
}
LARGEST_ERROR = 10.0
UNKNOWN = "below the reference's own change"


def style_of(engine: str) -> dict[str, Any]:
    own = engine.startswith("Layfigure")
    size = 9.0 if STYLES[engine]["marker"] == "*" else 5.0
    return {**STYLES[engine], "linestyle": "-" if own else "--", "linewidth": 1.8 if own else 1.0, "markersize": size}


def draw_work_precision(results: Sequence[SceneResult], path: Path) -> None:
    mpl.use("Agg")
    rows = math.ceil(len(results) / COLUMNS)
    spare = rows * COLUMNS > len(results)
    figure = Figure(figsize=(4.6 * COLUMNS, 3.8 * rows + (0.0 if spare else 0.9)), layout="constrained")
    panels = list(figure.subplots(rows, COLUMNS, squeeze=False).ravel())
    for axes, result in zip(panels, results, strict=False):
        draw_panel(axes, result)
    for axes in panels[len(results) :]:
        axes.set_axis_off()
    add_legend(figure, panels, in_corner=spare)
    figure.savefig(path, dpi=120)


def add_legend(figure: Figure, panels: Sequence[Axes], *, in_corner: bool) -> None:
    """One legend for all panels: where the last ones are missing, or else below."""
    handles: dict[str, Artist] = {}
    for axes in panels:
        lines, labels = axes.get_legend_handles_labels()
        handles.update(zip(labels, lines, strict=True))
    names = [name for name in [*STYLES, UNKNOWN] if name in handles]
    place: dict[str, Any] = (
        {"loc": "lower right", "ncols": 2} if in_corner else {"loc": "outside lower center", "ncols": 5}
    )
    figure.legend([handles[n] for n in names], names, frameon=False, fontsize=12, **place)


def draw_panel(axes: Axes, result: SceneResult) -> None:
    for engine in dict.fromkeys(p.engine for p in result.points):
        line = plotted([p for p in result.points if p.engine == engine])
        if line:
            axes.loglog([p.cpu_s * 1e3 for p in line], [p.error for p in line], label=engine, **style_of(engine))
    axes.axhspan(1e-16, max(result.reference_change, 1e-15), color="#dddddd", zorder=0, label=UNKNOWN)
    axes.set_title(f"{result.name} ({result.bodies} bodies, {result.duration:g} s)", fontsize=11)
    axes.set_xlabel("CPU time [ms]")
    axes.set_ylabel("rms position error [m]")
    axes.set_ylim(1e-12, LARGEST_ERROR)
    axes.yaxis.set_major_locator(LogLocator(numticks=7))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(visible=True, which="major", color="#e5e5e5", linewidth=0.7)


def plotted(points: Sequence[Point]) -> list[Point]:
    """Those that a logarithmic axis can show and that are no worse than having blown up."""
    return [p for p in points if 0.0 < p.error <= LARGEST_ERROR]


def draw_cost(costs: Sequence[CostPoint], path: Path) -> None:
    mpl.use("Agg")
    figure = Figure(figsize=(6.4, 4.8), layout="constrained")
    axes = figure.subplots()
    chains = [c for c in costs if c.scene.startswith("chain-")]
    for engine in dict.fromkeys(c.engine for c in chains):
        line = [c for c in chains if c.engine == engine]
        axes.loglog([c.bodies for c in line], [c.us_per_step for c in line], label=engine, **style_of(engine))
    axes.set_xlabel("bodies of the chain")
    axes.set_ylabel("CPU time of a step [us]")
    axes.grid(visible=True, which="major", color="#e5e5e5", linewidth=0.7)
    axes.legend(frameon=False)
    figure.savefig(path, dpi=120)
