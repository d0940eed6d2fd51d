"""What the driver asks of an engine, and how a run of one is timed.

CPU time is that of the stepping thread, of the stepping alone: building the scene and reading its end are not counted.
Runs shorter than half a second are repeated up to five times, and their median counts.
"""

from __future__ import annotations

import contextlib
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from layfigure_bench.floor_scenes import penetration
from layfigure_bench.scenes import Array, Scene

REPEATS = 5
ENOUGH_S = 0.5
# A run looks at the clock this many times, to give up when it takes too long.
CHUNKS = 64


@dataclass(frozen=True)
class StoredScene:
    """A scene and the file that the programs read it from."""

    scene: Scene
    path: Path


@dataclass(frozen=True)
class Touch:
    """How an engine kept the limbs on the floor."""

    penetration: float  # largest depth below the floor among the poses that were looked at [m]
    kinetic: float  # energy at the end [J]
    support: float  # vertical sum of the contact forces of the last step, as the engine tells them [N]


@dataclass(frozen=True)
class Run:
    """One run of a scene to its end."""

    h: float
    steps: int
    cpu_s: float
    com: Array  # (bodies, 3), world [m]
    energy: float
    finite: bool
    rest: Array | None = None  # (bodies, 4): rest rotations w x y z, of engines whose joints flow
    touch: Touch | None = None  # of scenes that have a floor


class Engine(Protocol):
    @property
    def name(self) -> str: ...

    @property
    def family(self) -> str: ...

    def run(self, stored: StoredScene, h: float, limit_s: float) -> Run | None:
        """Steps the scene to its end with steps of about h. None where that would take more CPU than the limit."""


class Simulation(Protocol):
    """A scene in an engine that lives in this process."""

    def restart(self) -> None:
        """Puts the scene back to its start."""

    def advance(self, steps: int) -> None: ...

    def com(self) -> Array: ...

    def energy(self) -> float: ...

    def frames(self) -> tuple[Array, Array]:
        """The bodies' origins (bodies, 3) and rotations (bodies, 3, 3) in the world."""

    def kinetic(self) -> float: ...

    def support(self) -> float:
        """Vertical sum of the contact forces of the last step [N]."""

    def call_cost_s(self) -> float:
        """What Python costs a step, which is not the engine's to pay."""


@dataclass(frozen=True)
class LocalEngine:
    """An engine with a Python interface."""

    name: str
    family: str
    build: Callable[[Scene, float], Simulation]
    most_bodies: int = 500  # larger scenes take it minutes to build alone

    def run(self, stored: StoredScene, h: float, limit_s: float) -> Run | None:
        scene = stored.scene
        if len(scene.bodies) > self.most_bodies:
            return None
        steps = max(1, round(scene.duration / h))
        times: list[float] = []
        deepest = 0.0
        with silence():
            simulation = self.build(scene, scene.duration / steps)
            while len(times) < REPEATS and sum(times) < ENOUGH_S:
                simulation.restart()
                timing = timed(simulation, scene, steps, limit_s)
                if timing is None:
                    return None
                times.append(timing.cpu_s)
                deepest = timing.penetration
                if not finite(simulation):
                    break
            touch = None
            if scene.floor is not None:
                touch = Touch(deepest, simulation.kinetic(), simulation.support())
            com, energy = simulation.com(), simulation.energy()
        cpu_s = statistics.median(times)
        return Run(scene.duration / steps, steps, cpu_s, com, energy, bool(np.isfinite(com).all()), touch=touch)


def finite(simulation: Simulation) -> bool:
    return bool(np.isfinite(simulation.com()).all())


@dataclass(frozen=True)
class Timing:
    cpu_s: float
    penetration: float


def timed(simulation: Simulation, scene: Scene, steps: int, limit_s: float) -> Timing | None:
    """CPU time of the steps, None as soon as it is clear that they take longer than the limit.

    A simulation that blew up is not stepped further. Between the chunks the limbs are looked at, which is not timed.
    """
    call_cost_s = simulation.call_cost_s()
    spent = 0.0
    done = 0
    deepest = 0.0
    while done < steps and finite(simulation):
        chunk = min(steps - done, max(1, steps // CHUNKS))
        start = time.thread_time()
        simulation.advance(chunk)
        spent += time.thread_time() - start
        done += chunk
        if spent > limit_s:
            return None
        if scene.floor is not None:
            deepest = max(deepest, penetration(scene, *simulation.frames()))
    return Timing(max(spent - call_cost_s * done, 0.0), deepest)


@contextlib.contextmanager
def silence() -> Iterator[None]:
    """Keeps what libraries say about a simulation that blows up from the terminal: the result tells it."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(1), os.dup(2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        yield
    finally:
        for number, copy in zip((1, 2), kept, strict=True):
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)
