"""layfigure-bench latency as its users call it: what it counts, not how fast this machine is."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from layfigure_bench.jointed_doll import JOINTS, make_jointed_doll

REPOSITORY = Path(__file__).resolve().parents[2]
BENCH = REPOSITORY / "build/release/tests/bench/layfigure-bench"


@pytest.fixture(scope="module")
def jointed_doll(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("jointed") / "jointed.glb"
    make_jointed_doll(path)
    return path


def test_jointed_doll_has_its_joints(binary: Path, jointed_doll: Path) -> None:
    done = subprocess.run([binary, "--inspect", jointed_doll, "--json"], capture_output=True, text=True, check=True)
    assert len(json.loads(done.stdout)["bodies"]) == JOINTS + 1


def test_quick_run_loses_no_pose_and_sees_every_effect(binary: Path, jointed_doll: Path) -> None:
    command = [BENCH, "latency", "--quick", "--json", "--server", binary, "--character", jointed_doll]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    figures = {figure["name"]: figure for figure in json.loads(done.stdout)}
    for bus in ("broker", "multicast") if "no multicast" not in done.stderr else ("broker",):
        for quantile in ("p50", "p99", "max"):
            assert figures[f"pointer to pose, {bus}, {quantile}"]["value"] > 0.0
    assert figures["pointer to pose, broker, without an effect"]["value"] == 0
    assert figures["10 subscribers, one stopped, one slow: share missing at the others"]["value"] == 0.0
    assert figures["10 subscribers, one stopped, one slow: poses a second"]["value"] > 0.0


def test_server_that_does_not_start_is_told_in_one_line(jointed_doll: Path) -> None:
    command = [BENCH, "latency", "--quick", "--server", "/bin/true", "--character", jointed_doll]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (1, "layfigure-bench: /bin/true: did not start\n")
