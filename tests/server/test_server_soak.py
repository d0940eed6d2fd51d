"""A server in use for long, also under tools that see what tests do not: memory errors and leaks, and races of threads.

LAYFIGURE_SOAK_SECONDS says how long each (20; an hour before a release). LAYFIGURE_TSAN_SERVER names a server of the
CMake preset tsan, if it is not at build/tsan.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from server_support.client import Client, Connect
from server_support.process import ServerProcess

REPOSITORY = Path(__file__).resolve().parents[2]
TSAN_SERVER = Path(os.environ.get("LAYFIGURE_TSAN_SERVER", REPOSITORY / "build/tsan/server/app/layfigure-server"))
TSAN_SUPPRESSIONS = Path(__file__).with_name("tsan.supp")
VALGRIND_SUPPRESSIONS = Path(__file__).with_name("valgrind.supp")
SECONDS = float(os.environ.get("LAYFIGURE_SOAK_SECONDS", "20"))
PATIENCE_S = 300.0  # for an answer of an instrumented server, whose hardest steps take seconds, or its leave
FOUND = 66  # exit code of a server in which something was found
# So slow a server steps less often; what it does in a step is the same.
OPTIONS = ("--broker", "0", "--physics-hz", "100", "--pose-hz", "50")
MAX_GROWTH_MB = 24.0  # of the resident memory after the first fifth: what can be undone, and the heap's spread
# Two hands that are served between steps, at rates that let their forces through, and a device whose process comes and
# goes.
DEVICE_OPTIONS = ("--broker", "0", "--physics-hz", "250", "--haptic-hz", "1000", "--pose-hz", "50")
DEVICES = ("--device", "spidar-g6", "--device", "spidar-g6", "--device", "lcm")
LCM_DEVICE = REPOSITORY / "assets/lcm_device.py"
DEVICE_LIFE_S = 5.0
BONES = ("hand.L", "hand.R", "foot.L", "head", "chest")


def use(client: Client, connect: Connect, server: ServerProcess, seconds: float, seed: int = 1) -> int:
    """All that clients do, at random, for so long; returns the number of commands."""
    choose = random.Random(seed)
    commands = 0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        pointer = choose.randrange(3)
        what = choose.randrange(12)
        if what == 0:
            client.command("grab", bone=choose.choice(BONES), pointer=pointer)
        elif what == 1:
            client.command("touch", pointer=pointer)
        elif what == 2:
            client.command("release", pointer=pointer)
        elif what == 3:
            client.command("pin", bone=choose.choice(BONES))
        elif what == 4:
            client.command("unpin")
        elif what == 5:
            client.command("set", softness=choose.uniform(0.1, 2.0))
        elif what == 6:
            client.command("get_mesh")
        elif what == 7:
            client.command(choose.choice(("reset", "key", "no such", "get_character")))
        elif what == 8:
            client.publish("COMMAND", choose.randbytes(choose.randrange(300)))
        elif what == 9:
            visitor = connect(server)  # comes and goes
            visitor.timeout_s = PATIENCE_S
            visitor.command("key")
            visitor.close()
        for _ in range(10):
            client.point([choose.uniform(-0.3, 0.3) for _ in range(3)], pointer)
        client.poll()
        commands += 1
        for messages in client.received.values():
            messages.clear()
    return commands


def use_while_a_device_is_killed(client: Client, connect: Connect, server: ServerProcess, seconds: float) -> int:
    """The same, while a device's process is started, killed and started again."""
    commands = 0
    lives = max(1, round(seconds / DEVICE_LIFE_S))
    for life in range(lives):
        device = subprocess.Popen([sys.executable, LCM_DEVICE, "--lcm-url", server.url], stdout=subprocess.DEVNULL)
        try:
            commands += use(client, connect, server, seconds / lives, seed=life)
            devices = client.wait_for("status_t").devices
            print("; ".join(f"{d.name}: {d.state}, {d.share:.0%} of its force let through" for d in devices))
        finally:
            device.kill()
            device.wait()
    return commands


Use = Callable[[Client, Connect, ServerProcess, float], int]


def soak(command: list[str], environment: dict[str, str], connect: Connect, use_it: Use = use) -> str:
    """Runs the server in use; returns what it wrote, after it has left by itself."""
    with ServerProcess(command, environment) as server:
        client = connect(server)
        client.timeout_s = PATIENCE_S
        assert use_it(client, connect, server, SECONDS) > 0
        client.command("shutdown")
        _, log = server.process.communicate(timeout=PATIENCE_S)
        assert server.process.returncode == 0, log
        return str(log)


def resident_mb(server: ServerProcess) -> float:
    pages = Path(f"/proc/{server.process.pid}/statm").read_text().split()[1]
    return int(pages) * os.sysconf("SC_PAGE_SIZE") / 2**20


@pytest.mark.slow
def test_soak_at_full_rate_keeps_the_memory(binary: Path, character: Path, connect: Connect) -> None:
    with ServerProcess([str(binary), str(character), "--broker", "0"]) as server:
        client = connect(server)
        client.timeout_s = PATIENCE_S
        commands = use(client, connect, server, SECONDS / 5)
        settled_mb = resident_mb(server)
        first = client.wait_for("status_t")
        commands += use(client, connect, server, SECONDS * 4 / 5, seed=2)
        grown_mb = resident_mb(server) - settled_mb
        last = client.wait_for("status_t")
        print(
            f"{commands} commands, {last.steps} steps of which {last.late_steps} late, {last.dropped_time:.3f} s "
            f"dropped, {last.poses} poses; memory {settled_mb:.1f} MB {grown_mb:+.2f} MB"
        )
        assert last.clients <= 2  # this one, and perhaps a visitor that has just left
        assert grown_mb < MAX_GROWTH_MB
        assert last.steps > first.steps
        assert last.poses > first.poses
        client.command("shutdown")
        assert server.wait()[0] == 0


@pytest.mark.slow
def test_soak_under_valgrind_finds_no_memory_error_and_no_leak(binary: Path, character: Path, connect: Connect) -> None:
    valgrind = shutil.which("valgrind")
    if valgrind is None:
        pytest.skip("needs valgrind")
    check = [valgrind, f"--error-exitcode={FOUND}", "--leak-check=full", "--errors-for-leak-kinds=definite"]
    check.append(f"--suppressions={VALGRIND_SUPPRESSIONS}")
    log = soak([*check, str(binary), str(character), *OPTIONS], {}, connect)
    assert "ERROR SUMMARY: 0 errors" in log


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "use_it"),
    [(OPTIONS, use), ((*DEVICE_OPTIONS, *DEVICES), use_while_a_device_is_killed)],
    ids=["clients", "devices"],
)
def test_soak_under_thread_sanitizer_finds_no_race(
    character: Path, connect: Connect, arguments: tuple[str, ...], use_it: Use
) -> None:
    if not TSAN_SERVER.is_file():
        pytest.skip("needs a server of the preset tsan: cmake --preset tsan, then build layfigure-server")
    options = f"exitcode={FOUND} suppressions={TSAN_SUPPRESSIONS}"
    log = soak([str(TSAN_SERVER), str(character), *arguments], {"TSAN_OPTIONS": options}, connect, use_it)
    assert "WARNING: ThreadSanitizer" not in log
