"""Engines that are programs of this project's build: Layfigure's own steps, and Bullet."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from layfigure_bench.engine import ENOUGH_S, REPEATS, Run, StoredScene, Touch

OWN = "Layfigure"
# The convergence orders of its steps.
ORDERS = (1, 2, 3, 4, 5, 6)
# Beside the CPU time asked for: starting, reading the scene, and the share of the machine that others take.
GRACE_S = 20.0


@dataclass(frozen=True)
class ProgramEngine:
    """A program that takes --scene and --h and prints a JSON list of runs."""

    name: str
    family: str
    command: tuple[str, ...]

    def run(self, stored: StoredScene, h: float, limit_s: float) -> Run | None:
        command = [*self.command, "--scene", str(stored.path), "--h", repr(h)]
        timeout_s = GRACE_S + 2.0 * (limit_s + REPEATS * ENOUGH_S)
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s, check=False)
        except subprocess.TimeoutExpired:
            return None
        if done.returncode != 0:
            raise RuntimeError(done.stderr.strip() or f"{command[0]}: exit code {done.returncode}")
        return run_of(json.loads(done.stdout)[0])


def run_of(item: dict[str, Any]) -> Run:
    """A run from a program's JSON, in which numbers that are not finite are null."""
    com = np.array(item["com"], dtype=float)
    rest = np.array(item["rest"], dtype=float) if "rest" in item else None
    energy = _number(item["energy"])
    finite = bool(item["finite"]) and bool(np.isfinite(com).all())
    touch = None
    if "touch" in item:
        touch = Touch(*(_number(item["touch"][key]) for key in ("penetration", "kinetic", "support")))
    return Run(float(item["h"]), int(item["steps"]), float(item["cpu_s"]), com, energy, finite, rest, touch)


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def own_engine(programs: Path, order: int) -> ProgramEngine:
    command = (str(programs / "layfigure-bench"), "work-precision", "--json", "--order", str(order))
    return ProgramEngine(f"{OWN} order {order}", OWN, command)


def bullet_engine(programs: Path) -> ProgramEngine:
    return ProgramEngine("Bullet btMultiBody", "Bullet", (str(programs / "bullet_peer"),))


def bullet_dantzig_engine(programs: Path) -> ProgramEngine:
    """Bullet whose contacts are solved by btMLCPSolver's Dantzig instead of its sequential impulses."""
    return ProgramEngine("Bullet btMLCPSolver", "Bullet", (str(programs / "bullet_peer"), "--dantzig"))
