"""Work-precision beside other engines: CPU time against error on the same scenes, and the cost of a step.

Writes results.json, results.csv, table.md, work_precision.png, cost.json and cost.png. Peers whose Python package is
absent are left out, with a line that says so.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from layfigure_bench import cost, plots, report
from layfigure_bench.comparison import point_of
from layfigure_bench.engine import Engine, StoredScene
from layfigure_bench.ladder import climb, make_reference, step_lengths
from layfigure_bench.programs import OWN, bullet_engine, own_engine
from layfigure_bench.scenes import Scene, load, made_scenes, save

STORED_SCENES = Path(__file__).resolve().parent.parent / "data" / "scenes"
ORDERS = (1, 2, 3, 4, 5, 6)
# Module of the peer, and the package that it needs.
PYTHON_PEERS = {"mujoco_peer": "mujoco", "dart_peer": "dartpy"}


@dataclass(frozen=True)
class Effort:
    """How much a run of the benchmark takes on."""

    lengths: list[float]  # of steps [s]
    limit_s: float  # CPU time of one run of a scene
    reference_h: float  # the longest step tried for the reference
    reference_limit_s: float


FULL = Effort(step_lengths(14, 2.0), limit_s=2.0, reference_h=5e-4, reference_limit_s=8.0)
QUICK = Effort(step_lengths(6, 4.0), limit_s=0.2, reference_h=1e-3, reference_limit_s=0.6)


def python_peers() -> tuple[list[Engine], dict[str, str]]:
    """The engines whose packages are installed, and the versions of those."""
    engines: list[Engine] = []
    versions = {}
    for module, package in {**PYTHON_PEERS, "pinocchio_peer": "pin"}.items():
        try:
            peer = importlib.import_module(f"layfigure_bench.{module}")
        except ImportError as error:
            print(f"work_precision: without {package}: {error}", file=sys.stderr)
            continue
        versions[package] = version(package)
        if module in PYTHON_PEERS:
            engines += peer.engines()
    return engines, versions


def measure_scene(scene: Scene, peers: Sequence[Engine], programs: Path, effort: Effort) -> report.SceneResult:
    own = [own_engine(programs, order) for order in ORDERS]
    engines: list[Engine] = [*own] if scene.flows else [*own, *peers]
    with tempfile.TemporaryDirectory() as folder:
        stored = StoredScene(scene, Path(folder) / "scene.json")
        save(scene, stored.path)
        reference = make_reference(own[-1], stored, effort.reference_h, effort.reference_limit_s)
        points = []
        for engine in engines:
            runs = climb(engine, stored, effort.lengths, effort.limit_s)
            points += [point_of(engine.name, engine.family, run, reference) for run in runs]
    return report.SceneResult(
        scene.name, len(scene.bodies), scene.duration, reference.run.h, reference.change, tuple(points)
    )


def run(programs: Path, out: Path, effort: Effort) -> None:
    out.mkdir(parents=True, exist_ok=True)
    local, versions = python_peers()
    peers = [bullet_engine(programs), *local]
    stored = [load(path) for path in sorted(STORED_SCENES.glob("*.json"))]
    results = []
    for scene in sorted(stored, key=lambda s: (s.name.startswith("chain"), len(s.bodies))) + made_scenes():
        print(f"work_precision: {scene.name}", flush=True)
        results.append(measure_scene(scene, peers, programs, effort))
        report.write_results(results, versions, out)
    print("work_precision: cost of a step", flush=True)
    dolls = [scene for scene in stored if not scene.name.startswith("chain")]
    with tempfile.TemporaryDirectory() as folder:
        costs = cost.measure_costs([*dolls, *cost.chains()], programs, Path(folder))
    report.write_json({"points": [asdict(c) for c in costs], "slopes": cost.slopes(costs)}, out / "cost.json")
    report.write_tables(results, costs, out)
    plots.draw_work_precision(results, out / "work_precision.png")
    plots.draw_cost(costs, out / "cost.png")


def main() -> int:
    parser = argparse.ArgumentParser(description=f"CPU time against error, {OWN} beside other engines.")
    parser.add_argument("programs", type=Path, help="folder of layfigure-bench and bullet_peer")
    parser.add_argument("out", type=Path, help="folder for the results, made if need be")
    parser.add_argument("--quick", action="store_true", help="fewer and longer steps: about a minute")
    arguments = parser.parse_args()
    missing = [name for name in ("layfigure-bench", "bullet_peer") if not (arguments.programs / name).exists()]
    if missing:
        parser.error(f"{arguments.programs}: no {missing[0]} in it: build it, or name the folder that has it")
    try:
        run(arguments.programs, arguments.out, QUICK if arguments.quick else FULL)
    except (OSError, RuntimeError, ValueError) as error:
        print(f"work_precision: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
