"""The figures that layfigure-bench tells by itself: cost, contact problems, what is skipped, the random scenes."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

# What a solution leaves above this is none: the laws are violated by a part in a thousand of the largest speed.
LARGEST_RESIDUAL = 1e-3


@dataclass(frozen=True)
class Figure:
    name: str
    value: float
    unit: str
    target: float | None  # the largest value allowed
    holds: bool


def run_subjects(programs: Path, subjects: Mapping[str, Sequence[str]]) -> dict[str, list[Figure]]:
    """Runs each subject with its arguments. Raises RuntimeError if one fails."""
    return {name: run_subject(programs, name, arguments) for name, arguments in subjects.items()}


def run_subject(programs: Path, name: str, arguments: Sequence[str]) -> list[Figure]:
    command = [str(programs / "layfigure-bench"), name, *arguments, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip() or f"layfigure-bench {name}: exit code {done.returncode}")
    return [figure_of(item) for item in json.loads(done.stdout)]


def figure_of(item: Mapping[str, object]) -> Figure:
    target = item["target"]
    return Figure(
        name=str(item["name"]),
        value=_number(item["value"]),
        unit=str(item["unit"]),
        target=None if target is None else _number(target),
        holds=bool(item["holds"]),
    )


def _number(value: object) -> float:
    return float(value) if isinstance(value, (int, float)) else float("nan")


@dataclass(frozen=True)
class Wall:
    """The stiffest wall of a damping that the whole haptic chain renders stably."""

    rate_hz: float
    hand: bool  # pressed by a hand, or by an elastic band
    damping: float
    stiffness: float


def load_walls(path: Path) -> list[Wall]:
    return [Wall(**item) for item in json.loads(path.read_text(encoding="utf-8"))]


@dataclass(frozen=True)
class Solution:
    """How a solver did on one contact problem."""

    solver: str
    kind: str  # "friction" or "frictionless"
    rows: int
    us: float
    residual: float

    @property
    def solved(self) -> bool:
        return self.residual <= LARGEST_RESIDUAL


def solutions(figures: Iterable[Figure]) -> list[Solution]:
    """The contact problems' times and residuals, smallest problems first."""
    times: dict[str, float] = {}
    found = []
    for figure in figures:
        name, _, quantity = figure.name.partition(": ")
        problem = re.fullmatch(r".*, (friction|frictionless), (\d+) rows?, (.*)", name)
        if problem is None:
            continue
        if not quantity:
            times[name] = figure.value
        elif quantity.startswith("residual"):
            kind, rows, solver = problem.groups()
            found.append(Solution(solver, kind, int(rows), times[name], figure.value))
    return sorted(found, key=lambda s: s.rows)
