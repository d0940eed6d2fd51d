"""Which step lengths an engine is run with on a scene, and the reference that all are compared with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from layfigure_bench.engine import Engine, Run, StoredScene
from layfigure_bench.scenes import Array

# A few long steps of a high order are the cheapest where errors of centimetres are allowed.
LONGEST_STEP = 1.0
# A reference whose change on halving its step is below this needs no further halving: errors down to 1e-10 are judged.
ENOUGH = 1e-11


@dataclass(frozen=True)
class Reference:
    run: Run
    change: float  # of the coms when its step was last halved (rms) [m]: it is not known better than this


def step_lengths(count: int, factor: float) -> list[float]:
    """From the longest step downward."""
    return [LONGEST_STEP / factor**k for k in range(count)]


def climb(engine: Engine, stored: StoredScene, steps: Sequence[float], limit_s: float) -> list[Run]:
    """Runs with ever shorter steps within the scene, until the next one would take longer than the limit."""
    runs: list[Run] = []
    for h in steps:
        if h > stored.scene.duration:
            continue
        if runs and runs[-1].cpu_s * runs[-1].h / h > limit_s:
            break
        done = engine.run(stored, h, limit_s)
        if done is None:
            break
        runs.append(done)
    return runs


def make_reference(engine: Engine, stored: StoredScene, longest: float, limit_s: float) -> Reference:
    """Halves the step until that changes nothing, or rounding makes the change grow, or the time is up."""
    last = _finite_run(engine, stored, longest, limit_s)
    best: Reference | None = None
    while best is None or (best.change > ENOUGH and 2.0 * last.cpu_s < limit_s):
        finer = _finite_run(engine, stored, last.h / 2.0, limit_s)
        change = rms(last.com - finer.com)
        if best is not None and change >= best.change:
            return best
        best = Reference(finer, change)
        last = finer
    return best


def _finite_run(engine: Engine, stored: StoredScene, h: float, limit_s: float) -> Run:
    run = engine.run(stored, h, limit_s)
    if run is None or not run.finite:
        raise RuntimeError(f"{stored.scene.name}: no reference: {engine.name} failed with steps of {h:g} s")
    return run


def rms(distances: Array) -> float:
    """Root mean square length of the rows [m]."""
    return float(np.sqrt(np.mean(np.sum(distances**2, axis=1))))


def rms_angle(a: Array, b: Array) -> float:
    """Root mean square angle between the rotations of two lists [rad]: q and -q are the same."""
    # By the chord, not the dot product, whose arc cosine loses half the digits of a small angle.
    chord = np.minimum(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
    angle = 4.0 * np.arcsin(np.clip(0.5 * chord, 0.0, 1.0))
    return float(np.sqrt(np.mean(angle**2)))
