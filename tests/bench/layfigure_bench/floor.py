"""Scenes with a floor beside the other engines.

Engines mean different things by contact: MuJoCo's gives way, DART's, Bullet's and ours are rigid but undo an overlap at
their own paces. So no run can be the truth for all of them: an engine's error is its distance from its own run with the
shortest step, and beside it stands how well it keeps the floor: the largest penetration, the motion left at the end,
and the sum of the contact forces over what they have to carry.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from layfigure_bench.engine import Engine, Run, StoredScene
from layfigure_bench.floor_scenes import carried
from layfigure_bench.ladder import climb, rms
from layfigure_bench.scenes import Array, Scene, save

# The step of an engine's own limit is this much shorter than the shortest that is judged by it.
REFINED = 2.0


@dataclass(frozen=True)
class FloorPoint:
    """A run, judged by its own engine's limit."""

    engine: str
    family: str
    h: float
    steps: int
    cpu_s: float
    error: float  # rms distance of the coms at the end from the engine's own limit [m]; infinite if the run blew up
    penetration: float  # [m]
    kinetic: float  # [J]
    support: float  # of the contacts, relative to what they have to carry


@dataclass(frozen=True)
class FloorResult:
    name: str
    bodies: int
    duration: float
    points: tuple[FloorPoint, ...]
    limits: dict[str, float]  # by engine: how far its limit is from that of the first one [m]


def measure_floor(scene: Scene, engines: Sequence[Engine], lengths: Sequence[float], limit_s: float) -> FloorResult:
    points: list[FloorPoint] = []
    limits: dict[str, Array] = {}
    with tempfile.TemporaryDirectory() as folder:
        stored = StoredScene(scene, Path(folder) / "scene.json")
        save(scene, stored.path)
        for engine in engines:
            runs = climb(engine, stored, lengths, limit_s)
            limit = own_limit(engine, stored, runs, limit_s)
            if limit is not None:
                limits[engine.name] = limit.com
            points += [floor_point(engine, run, limit, scene) for run in runs]
    first = next(iter(limits.values()), None)
    distances = {} if first is None else {name: rms(com - first) for name, com in limits.items()}
    return FloorResult(scene.name, len(scene.bodies), scene.duration, tuple(points), distances)


def own_limit(engine: Engine, stored: StoredScene, runs: Sequence[Run], limit_s: float) -> Run | None:
    """None if not even its shortest steps survive."""
    if not runs:
        return None
    finest = engine.run(stored, runs[-1].h / REFINED, 2.0 * REFINED * limit_s)
    return finest if finest is not None and finest.finite else None


def floor_point(engine: Engine, run: Run, limit: Run | None, scene: Scene) -> FloorPoint:
    if run.touch is None:
        raise ValueError(f"{engine.name}: told nothing of the floor of {scene.name}")
    error = rms(run.com - limit.com) if run.finite and limit is not None else math.inf
    touch = run.touch
    support = touch.support / carried(scene)
    return FloorPoint(
        engine.name, engine.family, run.h, run.steps, run.cpu_s, error, touch.penetration, touch.kinetic, support
    )


def at_rate(result: FloorResult, rate_hz: float) -> list[FloorPoint]:
    """The engines' runs at so many steps a second."""
    return [p for p in result.points if math.isclose(p.h * rate_hz, 1.0, rel_tol=0.05)]
