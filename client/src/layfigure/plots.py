"""Plots of a take: what the hands pulled with, and what the joints bore of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")

import matplotlib.pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from layfigure.errors import LayfigureError
from layfigure.loads import HandLoads, JointLoads, Loads, choose_joints, short_name
from layfigure.protocol import Floats

MAX_JOINTS = 6  # that are chosen by their load
MAX_CHOSEN_JOINTS = 40  # by their names
# Okabe and Ito's colours, which colour-blind readers tell apart
_BLUE, _ORANGE, _GREEN, _VERMILION = "#0072B2", "#E69F00", "#009E73", "#D55E00"
_POINTER_COLORS = (_BLUE, _ORANGE, _GREEN, _VERMILION)
_GREY = "#555555"
_STYLE: dict[Any, Any] = {
    "font.size": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "legend.frameon": False,
}


def write_force_plot(loads: Loads, out: Path, patterns: list[str] | None = None) -> list[str]:
    """A PNG: above the hands' forces, below the joints that match a pattern, or without patterns those that came
    closest to their yield torque or went past it. Returns the joints' names."""
    joints = choose_joints(loads, patterns, MAX_CHOSEN_JOINTS) if patterns else choose_joints(loads, [], MAX_JOINTS)
    rows = (len(joints) + 1) // 2
    with plt.rc_context(_STYLE):
        figure = plt.figure(figsize=(11.0, 3.4 + 2.3 * rows), layout="constrained")
        grid = figure.add_gridspec(rows + 1, 2, height_ratios=[1.25] + [1.0] * rows)
        force_axes = figure.add_subplot(grid[0, :])
        _plot_forces(force_axes, loads)
        for index, joint in enumerate(joints):
            axes = figure.add_subplot(grid[1 + index // 2, index % 2], sharex=force_axes)
            _plot_joint(axes, loads.times_s, joint)
            if index >= len(joints) - 2:
                axes.set_xlabel("time [s]")
        figure.legend(handles=_legend_handles(), loc="outside lower center", ncols=3)
        _save(figure, out)
    return [joint.name for joint in joints]


def _legend_handles() -> list[Any]:
    return [
        Line2D([], [], color=_BLUE, linewidth=1.6, label="torque of the joint"),
        Line2D([], [], color=_VERMILION, linestyle="--", linewidth=1.4, label="yield torque about the weakest axis"),
        Patch(color=_ORANGE, alpha=0.25, linewidth=0.0, label="the joint flows"),
    ]


def _plot_forces(axes: Any, loads: Loads) -> None:
    axes.set_title(f"{loads.title}: force of each hand on the doll", loc="left", fontsize=12, fontweight="bold")
    axes.set_ylabel("force [N]")
    axes.set_xlim(0.0, max(float(loads.times_s[-1]), 1e-3))
    for hand, color in zip(loads.hands, _POINTER_COLORS * len(loads.hands), strict=False):
        _plot_hand(axes, hand, color)
    largest = max((float(hand.forces.max(initial=0.0)) for hand in loads.hands), default=0.0)
    axes.set_ylim(0.0, 1.25 * max(largest, 1e-6))
    if not loads.hands:
        axes.text(0.5, 0.5, "no hands were recorded", transform=axes.transAxes, ha="center", color=_GREY)
        axes.set_xlabel("time [s]")


def _plot_hand(axes: Any, hand: HandLoads, color: str) -> None:
    sizes = np.where(hand.holds, hand.forces, np.nan)
    axes.plot(hand.times_s, sizes, color=color, linewidth=1.8)
    axes.fill_between(hand.times_s, 0.0, np.nan_to_num(sizes), where=hand.holds, color=color, alpha=0.12, linewidth=0.0)
    for start, end in _runs(hand.holds):
        peak = start + int(np.nanargmax(sizes[start:end]))
        name = short_name(hand.joint_names[start])
        label = f"hand {hand.pointer} holds {name}, up to {sizes[peak]:.3g} N"
        axes.annotate(
            label,
            ((hand.times_s[start] + hand.times_s[end - 1]) / 2, np.nanmax(sizes[start:end])),
            xytext=(0, 6),
            textcoords="offset points",
            ha="center",
            color=color,
            path_effects=[withStroke(linewidth=3.0, foreground="white")],
        )


def _plot_joint(axes: Any, times_s: Floats, joint: JointLoads) -> None:
    axes.fill_between(
        times_s,
        0.0,
        1.0,
        where=joint.flows,
        transform=axes.get_xaxis_transform(),
        color=_ORANGE,
        alpha=0.25,
        linewidth=0.0,
    )
    axes.plot(times_s, joint.torques, color=_BLUE, linewidth=1.6)
    largest = float(joint.torques.max(initial=0.0))
    if np.isfinite(joint.yield_torque):
        axes.axhline(joint.yield_torque, color=_VERMILION, linestyle="--", linewidth=1.4)
        largest = max(largest, joint.yield_torque)
    axes.set_ylim(0.0, 1.3 * max(largest, 1e-6))
    axes.set_title(short_name(joint.name), loc="left", fontsize=11, fontweight="bold")
    axes.set_title(_outcome(joint), loc="right", fontsize=10, color=_GREY)
    axes.set_ylabel("torque [N m]")


def _outcome(joint: JointLoads) -> str:
    if not np.isfinite(joint.yield_torque):
        return "elastic"
    if not joint.flows.any():
        return "held"
    return "flowed" if joint.rest_moved_deg is None else f"flowed, rest moved {joint.rest_moved_deg:+.1f}°"


def _runs(flags: Any) -> list[tuple[int, int]]:
    """The ranges [start, end) where the flags hold."""
    changes = np.diff(np.asarray(flags, np.int8), prepend=0, append=0)
    return list(zip(np.flatnonzero(changes == 1).tolist(), np.flatnonzero(changes == -1).tolist(), strict=True))


def _save(figure: Any, out: Path) -> None:
    partial = out.with_name(f".{out.name}.partial")
    try:
        figure.savefig(partial, format="png", dpi=130)
        partial.replace(out)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise LayfigureError(f"cannot write '{out}': {error.strerror}") from error
    finally:
        plt.close(figure)
