"""A long take of a large doll, recorded live: no pose is lost, and memory does not grow with it.

LAYFIGURE_LONG_TAKE_POSES=10000 makes it as long as takes get; the figures of time are printed and not judged, for they
are the machine's as well (pytest -s).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from e2e_support import NO_DEFAULT_BUS, REPOSITORY, TIMEOUT_S
from pxr import Usd
from server_support.process import ServerProcess

import layfigure
from layfigure.take_collector import read_take

sys.path.append(str(REPOSITORY / "tests/bench"))
from layfigure_bench.jointed_doll import JOINTS, make_jointed_doll

POSES = int(os.environ.get("LAYFIGURE_LONG_TAKE_POSES", "2400"))
POSE_HZ = 240
FPS = 240
SWING_S = 2.0
SETTLED_POSES = 480  # until libraries are loaded and buffers have their sizes
BYTES_PER_POSE = 2048  # that stay in memory while it grows, of the 7000 of a pose with 60 joints
MOVING_PART = 0.9  # a doll at rest has no new poses, and it is where the hand turns, or is late

pytestmark = pytest.mark.slow


def test_long_take_loses_no_pose_and_its_memory_is_bounded(binary: Path, tmp_path: Path) -> None:
    character, figures = tmp_path / "jointed.glb", tmp_path / "figures.json"
    make_jointed_doll(character)
    server_command = [binary, character, "--clock", "realtime", "--pose-hz", POSE_HZ, "--broker", "0"]
    with ServerProcess(list(map(str, server_command))) as server, layfigure.connect(server.url) as doll:
        bone = doll.character.joints[-1].name
        place = layfigure.world_poses(doll.character, doll.pose())[1][-1]
        doll.move_pointer(0, place)
        doll.command("grab", pointer=0, bone=bone, point=[0.0, 0.0, 0.0])
        duration = (POSES - 1) / POSE_HZ
        arguments = ["take.usda", "--fps", FPS, "--duration", duration, "--lcm-url", server.url]
        with subprocess.Popen(
            [sys.executable, REPOSITORY / "tests/e2e/measured_record.py", figures, *map(str, arguments)],
            cwd=tmp_path,
            env={**os.environ, **NO_DEFAULT_BUS},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as recorder:
            for pose in doll.poses():
                turn = 2.0 * np.pi * pose.time_us * 1e-6 / SWING_S
                doll.move_pointer(0, place + 0.08 * np.array([np.sin(turn), 0.0, np.sin(2.0 * turn)]))
                if recorder.poll() is not None:
                    break
            output, errors = recorder.communicate(timeout=TIMEOUT_S)
        late = doll.status().late_steps
    assert recorder.returncode == 0, errors
    assert "lost" not in errors

    take = read_take(tmp_path / "take.lcmlog", duration)
    assert len(take.character.joints) == JOINTS + 1
    assert take.lost_poses == 0
    assert len(take.times_us) > MOVING_PART * POSES
    # Poses are of the physics' whole milliseconds, so that a take ends within a frame of its duration.
    assert Usd.Stage.Open(str(tmp_path / "take.usda")).GetEndTimeCode() == pytest.approx(POSES - 1, abs=1.0)

    measured = json.loads(figures.read_text())
    poses, memory = np.array(measured["poses"]), np.array(measured["memory_kb"])
    first = int(np.searchsorted(poses, SETTLED_POSES))
    grown = 1024 * (memory[-1] - memory[first]) / (poses[-1] - poses[first])
    print(f"\n{output.strip()}\n{told(measured)}\nmemory grows by {grown:.0f} bytes a pose; late steps: {late}")
    assert grown < BYTES_PER_POSE


def told(measured: dict[str, Any]) -> str:
    wall, cpu = measured["export"]
    turns = "\n".join(f"{len(measured[what])} {what}: {told_costs(measured[what])}" for what in ("appends", "saves"))
    return f"{turns}\nexport {wall:.2f} s, CPU {cpu:.2f} s; {measured['peak_kb'] >> 10} MiB at most"


def told_costs(costs: list[tuple[float, float]]) -> str:
    return ", ".join(
        f"{kind} median {np.median(ms):.2f}, 99 % {np.percentile(ms, 99):.2f}, largest {ms.max():.2f} ms"
        for kind, ms in zip(("wall-clock", "CPU"), 1e3 * np.array(costs).T, strict=True)
    )
