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

from layfigure.analysis import JointSummary, summarize, torque_sizes
from layfigure.errors import LayfigureError
from layfigure.take import PointerTrack, Take

MAX_JOINTS = 6
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


def write_force_plot(take: Take, out: Path) -> None:
    """A PNG: above the pointers' forces, below the joints that came closest to their yield torque or went past it."""
    joints = [summary for summary in summarize(take) if np.isfinite(summary.yield_torque)][:MAX_JOINTS]
    rows = (len(joints) + 1) // 2
    with plt.rc_context(_STYLE):
        figure = plt.figure(figsize=(11.0, 3.4 + 2.3 * rows), layout="constrained")
        grid = figure.add_gridspec(rows + 1, 2, height_ratios=[1.25] + [1.0] * rows)
        force_axes = figure.add_subplot(grid[0, :])
        _plot_forces(force_axes, take)
        for index, summary in enumerate(joints):
            axes = figure.add_subplot(grid[1 + index // 2, index % 2], sharex=force_axes)
            _plot_joint(axes, take, summary)
            if index >= len(joints) - 2:
                axes.set_xlabel("time [s]")
        figure.legend(handles=_legend_handles(), loc="outside lower center", ncols=3)
        _save(figure, out)


def _legend_handles() -> list[Any]:
    return [
        Line2D([], [], color=_BLUE, linewidth=1.6, label="torque of the joint"),
        Line2D([], [], color=_VERMILION, linestyle="--", linewidth=1.4, label="yield torque"),
        Patch(color=_ORANGE, alpha=0.25, linewidth=0.0, label="the joint flows"),
    ]


def _plot_forces(axes: Any, take: Take) -> None:
    axes.set_title(f"{take.character.name}: force of each hand on the doll", loc="left", fontsize=12, fontweight="bold")
    axes.set_ylabel("force [N]")
    axes.set_xlim(0.0, max(take.duration_s, 1e-3))
    for track, color in zip(take.pointers, _POINTER_COLORS * len(take.pointers), strict=False):
        _plot_track(axes, take, track, color)
    largest = max((float(np.linalg.norm(track.forces, axis=1).max()) for track in take.pointers), default=0.0)
    axes.set_ylim(0.0, 1.25 * max(largest, 1e-6))
    if not take.pointers:
        axes.set_xlabel("time [s]")


def _plot_track(axes: Any, take: Take, track: PointerTrack, color: str) -> None:
    times = track.times_us * 1e-6
    sizes = np.where(track.attached, np.linalg.norm(track.forces, axis=1), np.nan)
    axes.plot(times, sizes, color=color, linewidth=1.8)
    axes.fill_between(times, 0.0, np.nan_to_num(sizes), where=track.attached, color=color, alpha=0.12, linewidth=0.0)
    for start, end in _runs(track.attached):
        name = _short(take.character.joints[int(track.joints[start])].name)
        peak = start + int(np.nanargmax(sizes[start:end]))
        label = f"hand {track.pointer} holds {name}, up to {sizes[peak]:.3g} N"
        axes.annotate(
            label,
            ((times[start] + times[end - 1]) / 2, np.nanmax(sizes[start:end])),
            xytext=(0, 6),
            textcoords="offset points",
            ha="center",
            color=color,
        )


def _plot_joint(axes: Any, take: Take, summary: JointSummary) -> None:
    times = take.times_us * 1e-6
    sizes = torque_sizes(take)[:, summary.joint]
    yielded = take.yielded[:, summary.joint]
    axes.fill_between(
        times, 0.0, 1.0, where=yielded, transform=axes.get_xaxis_transform(), color=_ORANGE, alpha=0.25, linewidth=0.0
    )
    axes.axhline(summary.yield_torque, color=_VERMILION, linestyle="--", linewidth=1.4)
    axes.plot(times, sizes, color=_BLUE, linewidth=1.6)
    axes.set_ylim(0.0, 1.3 * max(summary.yield_torque, summary.largest_torque, 1e-6))
    outcome = (
        f"flowed, rest moved {summary.rest_after_deg - summary.rest_before_deg:+.1f}°" if summary.yielded else "held"
    )
    axes.set_title(_short(summary.name), loc="left", fontsize=11, fontweight="bold")
    axes.set_title(outcome, loc="right", fontsize=10, color=_GREY)
    axes.set_ylabel("torque [N m]")


def _runs(flags: Any) -> list[tuple[int, int]]:
    """The ranges [start, end) where the flags hold."""
    changes = np.diff(np.asarray(flags, np.int8), prepend=0, append=0)
    return list(zip(np.flatnonzero(changes == 1).tolist(), np.flatnonzero(changes == -1).tolist(), strict=True))


def _short(name: str) -> str:
    """Without the rig's prefix."""
    return name.rpartition(":")[2]


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
