"""CPU time of a step against the number of bodies."""

from __future__ import annotations

import functools
import statistics
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from layfigure_bench.engine import Engine, StoredScene
from layfigure_bench.programs import own_engine
from layfigure_bench.scenes import Chain, Scene, hanging, save

CHAIN_LENGTHS = (10, 30, 100, 300, 1000, 3000, 10_000)
# The base step, and the order that is held to a multiple of it.
COST_ORDERS = (1, 4)
STEP = 1e-3
# Bodies stepped in a run: some 20 ms of the base step, so that a run is neither noise nor long.
BODY_STEPS = 300_000
FEWEST_STEPS = 30
ROUNDS = 5
LIMIT_S = 60.0
# Pinocchio allocates third-order tensors over all joints, several gigabytes for 300 bodies.
MOST_PINOCCHIO_BODIES = 100


@dataclass(frozen=True)
class CostPoint:
    scene: str
    bodies: int
    engine: str
    us_per_step: float


def steps_for(bodies: int) -> int:
    return max(FEWEST_STEPS, BODY_STEPS // bodies)


def chains() -> list[Scene]:
    return [hanging(f"chain-{n}", Chain(n, bend=0.1)) for n in CHAIN_LENGTHS]


def measure_costs(scenes: Iterable[Scene], programs: Path, folder: Path) -> list[CostPoint]:
    """Our base step and order 4, with Pinocchio's forward dynamics where it is installed and fits.

    The median of several rounds in which all take turns: the processor's clock changes within seconds.
    """
    costs = []
    for scene in scenes:
        timers = own_timers(scene, programs, folder) | pinocchio_timer(scene)
        rounds = [[measure() for measure in timers.values()] for _ in range(ROUNDS)]
        medians = map(statistics.median, zip(*rounds, strict=True))
        costs += [CostPoint(scene.name, len(scene.bodies), name, us) for name, us in zip(timers, medians, strict=True)]
    return costs


def own_timers(scene: Scene, programs: Path, folder: Path) -> dict[str, Callable[[], float]]:
    """What measures a step of each order once [us]. They read the scene from the folder."""
    short = replace(scene, duration=steps_for(len(scene.bodies)) * STEP)
    stored = StoredScene(short, folder / f"{scene.name}.json")
    save(short, stored.path)
    engines = [own_engine(programs, order) for order in COST_ORDERS]
    return {engine.name: functools.partial(us_per_step, engine, stored) for engine in engines}


def us_per_step(engine: Engine, stored: StoredScene) -> float:
    run = engine.run(stored, STEP, LIMIT_S)
    if run is None:
        raise RuntimeError(f"{stored.scene.name}: {engine.name} took too long")
    return run.cpu_s / run.steps * 1e6


def pinocchio_timer(scene: Scene) -> dict[str, Callable[[], float]]:
    bodies = len(scene.bodies)
    if bodies > MOST_PINOCCHIO_BODIES:
        return {}
    try:
        from layfigure_bench import pinocchio_peer
    except ImportError:
        return {}
    return {pinocchio_peer.FAMILY: pinocchio_peer.Evaluations(scene, max(10, steps_for(bodies) // 4)).us_per_evaluation}


def slopes(costs: Sequence[CostPoint]) -> dict[str, float]:
    """Exponent of the growth of each engine's cost along the chains, by least squares of the logarithms."""
    found = {}
    for engine in dict.fromkeys(c.engine for c in costs):
        line = [c for c in costs if c.engine == engine and c.scene.startswith("chain-")]
        if len(line) >= 2:
            n, us = np.log([c.bodies for c in line]), np.log([c.us_per_step for c in line])
            found[engine] = float(np.polyfit(n, us, 1)[0])
    return found
