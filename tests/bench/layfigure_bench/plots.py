"""The diagrams: error against CPU time, a panel for each scene; the scenes with a floor; costs against sizes; walls.

Made to be read at the width of a README.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from layfigure_bench.comparison import Point
from layfigure_bench.cost import CostPoint
from layfigure_bench.floor import FloorPoint, FloorResult
from layfigure_bench.programs import ORDERS, OWN
from layfigure_bench.report import SceneResult
from layfigure_bench.subjects import Solution, Wall

COLUMNS = 4
WIDTH_IN = 12.0
DPI = 120
LIGHTEST, DARKEST = 0.4, 1.0  # of the blues
# Okabe and Ito's colours, which the colour-blind tell apart, and a marker for each engine; ours are one blue that
# darkens with the order.
PEER_STYLES = {
    "MuJoCo Euler": {"color": "#e69f00", "marker": "^"},
    "MuJoCo implicitfast": {"color": "#e69f00", "marker": "v"},
    "MuJoCo RK4": {"color": "#d55e00", "marker": "*"},
    "MuJoCo discrete": {"color": "#d55e00", "marker": "P"},
    "DART": {"color": "#009e73", "marker": "D"},
    "Bullet btMultiBody": {"color": "#cc79a7", "marker": "s"},
    "Bullet btMLCPSolver": {"color": "#882255", "marker": "p"},
    "Pinocchio ABA": {"color": "#000000", "marker": "X"},
}
# By kind of problem and solver: label, colour, marker.
SOLVER_STYLES = {
    ("friction", "cold"): ("Layfigure, friction, cold", "#08306b", "o"),
    ("friction", "warm"): ("Layfigure, friction, warm", "#56a0d3", "o"),
    ("frictionless", "Layfigure"): ("Layfigure, frictionless, cold", "#2070b4", "v"),
    ("frictionless", "Bullet Dantzig"): ("Bullet Dantzig, frictionless", "#cc79a7", "s"),
    ("frictionless", "Bullet Lemke"): ("Bullet Lemke, frictionless", "#009e73", "D"),
    ("frictionless", "Bullet Gauss-Seidel, 10 sweeps"): ("Bullet Gauss-Seidel (10), frictionless", "#e69f00", "^"),
}
LARGEST_ERROR = 10.0
# Stable stiffness of the ideal wall with steps of 16.7 um by the rate [N/m], and each rate's colour.
IDEAL_WALLS = {1000.0: 2700.0, 4000.0: 5900.0, 10_000.0: 9400.0}
RATE_COLORS = {1000.0: "#e69f00", 4000.0: "#009e73", 10_000.0: "#0072b2"}
AnyPoint = TypeVar("AnyPoint", Point, FloorPoint)
UNKNOWN = "below the reference's own change"


def style_of(engine: str) -> dict[str, Any]:
    if engine in PEER_STYLES:
        size = 7.5 if PEER_STYLES[engine]["marker"] == "*" else 4.0
        return {**PEER_STYLES[engine], "linestyle": "--", "linewidth": 0.9, "markersize": size}
    order = ORDERS.index(int(engine.removeprefix(f"{OWN} order ")))
    shade = LIGHTEST + (DARKEST - LIGHTEST) * order / (len(ORDERS) - 1)
    color = mpl.colormaps["Blues"](shade)
    return {"color": color, "marker": "o", "linestyle": "-", "linewidth": 1.6, "markersize": 4.0}


def draw_work_precision(results: Sequence[SceneResult], path: Path) -> None:
    mpl.use("Agg")
    rows = math.ceil((len(results) + 1) / COLUMNS)  # one place at least is the legend's
    figure = Figure(figsize=(WIDTH_IN, 2.6 * rows), layout="constrained")
    panels = list(figure.subplots(rows, COLUMNS, squeeze=False, sharex=True, sharey=True).ravel())
    for axes, result in zip(panels, results, strict=False):
        draw_panel(axes, result)
    for i, axes in enumerate(panels):
        axes.label_outer()
        if i + COLUMNS >= len(results):
            axes.tick_params(labelbottom=True)
        if i >= len(results):
            axes.set_axis_off()
    figure.supxlabel("CPU time of the scene [ms]")
    figure.supylabel("rms position error at its end [m]")
    add_legend(figure, panels, loc="lower right", ncols=1 if len(results) % COLUMNS == COLUMNS - 1 else 2)
    figure.savefig(path, dpi=DPI)


def add_legend(figure: Figure, panels: Iterable[Axes], **place: Any) -> None:
    """One legend for all panels."""
    handles: dict[str, Artist] = {}
    for axes in panels:
        lines, labels = axes.get_legend_handles_labels()
        handles.update(zip(labels, lines, strict=True))
    figure.legend(handles.values(), handles.keys(), frameon=False, fontsize=9, **place)


def draw_panel(axes: Axes, result: SceneResult) -> None:
    for engine in dict.fromkeys(p.engine for p in result.points):
        line = plotted([p for p in result.points if p.engine == engine])
        if line:
            axes.loglog([p.cpu_s * 1e3 for p in line], [p.error for p in line], label=engine, **style_of(engine))
    axes.axhspan(1e-16, max(result.reference_change, 1e-15), color="#dddddd", zorder=0, label=UNKNOWN)
    axes.set_title(f"{result.name} ({result.duration:g} s)", fontsize=10)
    axes.set_ylim(1e-12, LARGEST_ERROR)
    axes.yaxis.set_major_locator(LogLocator(numticks=7))
    axes.yaxis.set_minor_formatter(NullFormatter())
    add_grid(axes)


def add_grid(axes: Axes) -> None:
    axes.grid(visible=True, which="major", color="#e5e5e5", linewidth=0.7)


def plotted(points: Sequence[AnyPoint]) -> list[AnyPoint]:
    """Those that a logarithmic axis can show and that are no worse than having blown up."""
    return [p for p in points if 0.0 < p.error <= LARGEST_ERROR]


def draw_floor(results: Sequence[FloorResult], path: Path) -> None:
    """Above, each engine's error by its own limit; below, how deep the limbs get into the floor."""
    mpl.use("Agg")
    figure = Figure(figsize=(WIDTH_IN, 6.6), layout="constrained")
    panels = figure.subplots(2, len(results), squeeze=False, sharex=True, sharey="row")
    for column, result in zip(panels.T, results, strict=True):
        column[0].set_title(f"{result.name} ({result.bodies} bodies, {result.duration:g} s)", fontsize=10)
        for engine in dict.fromkeys(p.engine for p in result.points):
            line = plotted([p for p in result.points if p.engine == engine])
            times = [p.cpu_s * 1e3 for p in line]
            column[0].loglog(times, [p.error for p in line], label=engine, **style_of(engine))
            column[1].loglog(times, [p.penetration * 1e3 for p in line], **style_of(engine))
        column[1].set_xlabel("CPU time of the scene [ms]")
        for axes in column:
            add_grid(axes)
    panels[0, 0].set_ylabel("rms distance from the\nengine's own limit [m]")
    panels[1, 0].set_ylabel("largest penetration [mm]")
    add_legend(figure, panels.ravel(), loc="outside lower center", ncols=5)
    figure.savefig(path, dpi=DPI)


def draw_cost(costs: Sequence[CostPoint], found: Sequence[Solution], path: Path) -> None:
    """Left, a step against the bodies of a chain; right, a contact problem against its rows."""
    mpl.use("Agg")
    figure = Figure(figsize=(WIDTH_IN, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw_steps(left, costs)
    draw_solutions(right, found)
    for axes in (left, right):
        add_grid(axes)
        if axes.lines:
            axes.legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=DPI)


def draw_steps(axes: Axes, costs: Sequence[CostPoint]) -> None:
    chains = [c for c in costs if c.scene.startswith("chain-")]
    for engine in dict.fromkeys(c.engine for c in chains):
        line = [c for c in chains if c.engine == engine]
        axes.loglog([c.bodies for c in line], [c.us_per_step for c in line], label=engine, **style_of(engine))
    axes.set_title("a step, or a forward dynamics", fontsize=10)
    axes.set_xlabel("bodies of the chain")
    axes.set_ylabel("CPU time [us]")


def draw_solutions(axes: Axes, found: Sequence[Solution]) -> None:
    """Where a solver gave up, or left what is no solution, its marker is hollow."""
    for (kind, solver), (label, color, marker) in SOLVER_STYLES.items():
        line = [s for s in found if (s.kind, s.solver) == (kind, solver)]
        if not line:
            continue
        dashes = "--" if solver.startswith("Bullet") else "-"
        axes.loglog([s.rows for s in line], [s.us for s in line], color=color, linestyle=dashes, linewidth=1.2)
        faces = [color if s.solved else "white" for s in line]
        axes.scatter(
            [s.rows for s in line], [s.us for s in line], c=faces, edgecolors=color, marker=marker, s=26, zorder=3
        )
        axes.plot([], [], color=color, linestyle=dashes, marker=marker, label=label)
    axes.set_title("a contact problem (hollow: not solved)", fontsize=10)
    axes.set_xlabel("rows")
    axes.set_ylabel("CPU time [us]")


def draw_z_width(walls: Sequence[Wall], path: Path) -> None:
    """Stable stiffness against damping, with a hand and without, beside the ideal wall."""
    mpl.use("Agg")
    figure = Figure(figsize=(WIDTH_IN, 4.2), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    for axes, hand in zip(panels, (True, False), strict=True):
        for rate, color in RATE_COLORS.items():
            line = [w for w in walls if (w.rate_hz, w.hand) == (rate, hand)]
            label = f"{rate / 1e3:g} kHz"
            axes.plot([w.damping for w in line], [w.stiffness / 1e3 for w in line], "o-", color=color, label=label)
            axes.axhline(IDEAL_WALLS[rate] / 1e3, color=color, linestyle=":", label=f"{label}, ideal wall")
        axes.set_title("pressed by a hand" if hand else "pressed by an elastic band, no hand", fontsize=10)
        axes.set_xlabel("damping of the wall [N s/m]")
        axes.set_yscale("log")
        add_grid(axes)
    panels[0].set_ylabel("largest stable stiffness [kN/m]")
    panels[0].legend(frameon=False, fontsize=9)
    figure.savefig(path, dpi=DPI)
