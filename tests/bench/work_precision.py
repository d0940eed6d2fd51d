"""Work-precision beside other engines: CPU time against error on the same scenes, scenes with a floor, costs.

Writes results.json, results.csv, floor.json, floor.csv, cost.json, figures.json, z_width.json, table.md,
work_precision.png, floor.png, cost.png and z_width.png; on demand the README's section too. Peers whose Python package
is absent are left out, with a line that says so.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path

from layfigure_bench import cost, plots, readme, report, subjects
from layfigure_bench.comparison import point_of
from layfigure_bench.engine import Engine, StoredScene
from layfigure_bench.floor import FloorResult, measure_floor
from layfigure_bench.floor_scenes import floor_scenes
from layfigure_bench.jointed_doll import make_jointed_doll
from layfigure_bench.ladder import climb, make_reference, step_lengths
from layfigure_bench.programs import ORDERS, OWN, bullet_dantzig_engine, bullet_engine, own_engine
from layfigure_bench.scenes import Scene, load, made_scenes, save

STORED_SCENES = Path(__file__).resolve().parent.parent / "data" / "scenes"
DOLL = "doll-52"
# The map of stable walls, which layfigure-bench writes itself.
Z_WIDTH = "z_width.json"
# From the folder of the build.
SERVER = "server/app/layfigure-server"
# Over an impact every order is base steps: one above the first shows what it costs.
FLOOR_ORDERS = ORDERS[:2]
# Module of the peer, and the package that it needs.
PYTHON_PEERS = {"mujoco_peer": "mujoco", "dart_peer": "dartpy"}


@dataclass(frozen=True)
class Effort:
    """How much a run of the benchmark takes on."""

    lengths: list[float]  # of steps [s]
    limit_s: float  # CPU time of one run of a scene
    reference_h: float  # the longest step tried for the reference
    reference_limit_s: float
    floor_lengths: list[float]
    floor_limit_s: float
    # What layfigure-bench tells by itself, with its arguments.
    subjects: dict[str, tuple[str, ...]] = field(default_factory=dict)


FULL = Effort(
    step_lengths(17, 2.0),
    limit_s=1.2,
    reference_h=5e-4,
    reference_limit_s=8.0,
    floor_lengths=[1.0 / 60.0 / 2.0**k for k in range(6)],
    floor_limit_s=5.0,
    subjects={"cost": (), "contact": (), "skip": (), "haptics": (), "stress": (), "latency": ()},
)
QUICK = Effort(
    step_lengths(7, 4.0),
    limit_s=0.2,
    reference_h=1e-3,
    reference_limit_s=0.6,
    floor_lengths=[1.0 / 60.0, 1.0 / 240.0, 1.0 / 960.0],
    floor_limit_s=0.2,
    subjects={
        "cost": (),
        "contact": ("--rows", "24"),
        "skip": (),
        "haptics": ("--quick",),
        "stress": ("--scenes", "200"),
        "latency": ("--quick",),
    },
)


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


def measure_scenes(
    scenes: Sequence[Scene], peers: Sequence[Engine], programs: Path, effort: Effort
) -> list[report.SceneResult]:
    results = []
    for scene in scenes:
        print(f"work_precision: {scene.name}", flush=True)
        results.append(measure_scene(scene, peers, programs, effort))
    return results


def measure_floors(doll: Scene, peers: Sequence[Engine], programs: Path, effort: Effort) -> list[FloorResult]:
    own = [own_engine(programs, order) for order in FLOOR_ORDERS]
    engines = [*own, *peers, bullet_dantzig_engine(programs)]
    results = []
    for scene in floor_scenes(doll):
        print(f"work_precision: {scene.name}", flush=True)
        results.append(measure_floor(scene, engines, effort.floor_lengths, effort.floor_limit_s))
    return results


def measure(programs: Path, effort: Effort, out: Path) -> tuple[report.Results, dict[str, str]]:
    local, versions = python_peers()
    peers = [bullet_engine(programs), *local]
    stored = {scene.name: scene for scene in map(load, sorted(STORED_SCENES.glob("*.json")))}
    doll = stored.pop(DOLL)
    chains = sorted([*stored.values(), *made_scenes()], key=lambda scene: (scene.flows, len(scene.bodies)))
    scenes = measure_scenes([doll, *chains], peers, programs, effort)
    floors = measure_floors(doll, peers, programs, effort)
    print("work_precision: cost of a step", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        costs = cost.measure_costs([doll, *cost.chains()], programs, Path(folder))
    print(f"work_precision: {', '.join(effort.subjects)}", flush=True)
    out.mkdir(parents=True, exist_ok=True)
    haptics = (*effort.subjects["haptics"], "--z-width", str(out / Z_WIDTH))
    with tempfile.TemporaryDirectory() as folder:
        doll_60 = Path(folder) / "jointed.glb"
        make_jointed_doll(doll_60)
        served = ("--server", str(programs.parents[1] / SERVER), "--character", str(doll_60))
        latency = (*effort.subjects["latency"], *served)
        figures = subjects.run_subjects(programs, {**effort.subjects, "haptics": haptics, "latency": latency})
    return report.Results(scenes, floors, costs, figures), versions


def write(results: report.Results, versions: dict[str, str], out: Path) -> None:
    out.mkdir(parents=True, exist_ok=True)
    report.write_results(results.scenes, versions, out)
    report.write_floor(results.floors, out)
    costs = {"points": [asdict(c) for c in results.costs], "slopes": cost.slopes(results.costs)}
    report.write_json(costs, out / "cost.json")
    figures = {subject: [asdict(f) for f in found] for subject, found in results.figures.items()}
    report.write_json(figures, out / "figures.json")
    report.write_tables(results, out)
    plots.draw_work_precision(results.scenes, out / "work_precision.png")
    plots.draw_floor(results.floors, out / "floor.png")
    solutions = subjects.solutions(results.figures.get("contact", []))
    plots.draw_cost(results.costs, solutions, out / "cost.png")
    plots.draw_z_width(subjects.load_walls(out / Z_WIDTH), out / "z_width.png")


def main() -> int:
    parser = argparse.ArgumentParser(description=f"CPU time against error, {OWN} beside other engines.")
    parser.add_argument("programs", type=Path, help="folder of layfigure-bench and bullet_peer")
    parser.add_argument("out", type=Path, help="folder for the results, made if need be")
    parser.add_argument("--readme", type=Path, help="README whose section on speed and accuracy is written anew")
    parser.add_argument("--pictures", type=Path, help="folder of that section's pictures")
    parser.add_argument("--quick", action="store_true", help="fewer and longer steps: some minutes")
    arguments = parser.parse_args()
    missing = [name for name in ("layfigure-bench", "bullet_peer") if not (arguments.programs / name).exists()]
    if missing:
        parser.error(f"{arguments.programs}: no {missing[0]} in it: build it, or name the folder that has it")
    if (arguments.readme is None) != (arguments.pictures is None):
        parser.error("--readme and --pictures go together")
    try:
        results, versions = measure(arguments.programs, QUICK if arguments.quick else FULL, arguments.out)
        write(results, versions, arguments.out)
        if arguments.readme is not None:
            readme.refresh(arguments.readme, arguments.pictures, results, arguments.out)
    except (OSError, RuntimeError, ValueError) as error:
        print(f"work_precision: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
