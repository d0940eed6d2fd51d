"""Multicast over networks that lose, delay and reorder, inside a network namespace with a loopback device alone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from e2e_support import REPOSITORY
from test_multicast_end_to_end import SCRIPT, SETUP

from layfigure.take_collector import read_take
from layfigure.usd.checks import check

TIMEOUT_S = 300.0
POSES = 301  # of the session, and one before it
NETEM = "tc qdisc add dev lo root netem delay 2ms 1ms loss 3% reorder 25% 50%"
# The server on one group, its clients on another, and a bad network between them.
RELAY_SCRIPT = """
import contextlib, signal, subprocess, sys
from pathlib import Path
sys.path[:0] = sys.argv[1:3]
from e2e_support import ClientProcess
from lossy_relay import Faults, LossyRelay
from server_support.process import ServerProcess
folder, session, server = Path(sys.argv[3]), sys.argv[4], sys.argv[5:]
here, there = ("239.255.76.67", 7667), ("239.255.76.68", 7668)
url = lambda group: f"udpm://{group[0]}:{group[1]}?ttl=0"
with LossyRelay(here, there, Faults()) as relay:
    with ServerProcess([*server, "--clock", "lockstep", "--lcm-url", url(here)]) as server:
        with ClientProcess(folder, ["record", "take.usda", "--lcm-url", url(there)]) as recorder:
            print(recorder.error_line(), end="")
            for command in (["play", session], ["shutdown"]):
                with ClientProcess(folder, [*command, "--lcm-url", url(there)]) as client:
                    print(*client.finish())
            # The word that the server leaves may be among what was lost: then the recorder waits for it.
            with contextlib.suppress(subprocess.TimeoutExpired):
                recorder.process.wait(10)
            print(*recorder.finish(None if recorder.process.poll() is not None else signal.SIGINT))
assert relay.lost > 0
"""


def check_take(network: tuple[str, ...], folder: Path, setup: str, script: str, inputs: list[Path]) -> None:
    """Runs the script in a network of its own; every command gets through, and the take tells what it lacks."""
    paths = [Path(__file__).parent, REPOSITORY / "tests/server", folder, *inputs]
    done = subprocess.run(
        [*network, "sh", "-c", setup, "sh", sys.executable, "-c", script, *map(str, paths)],
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stdout, done.stdout
    assert (folder / "take.lcmlog").is_file(), done.stdout
    take = read_take(folder / "take.lcmlog")
    assert take.lost_poses > 0, "the network was no worse than others"
    assert 0.8 * POSES <= len(take.times_us) <= POSES - take.lost_poses, done.stdout
    assert (take.times_us[1:] > take.times_us[:-1]).all()
    assert take.pointers[0].attached.any()
    assert not take.pointers[0].attached[-1]
    assert check(folder / "take.usda").findings == ()


def test_record_and_play_through_a_relay_that_loses_and_reorders(
    binary: Path, character: Path, session: Path, tmp_path: Path, own_network: tuple[str, ...]
) -> None:
    check_take(own_network, tmp_path, SETUP, RELAY_SCRIPT, [session, binary, character])


def test_record_and_play_through_netem(
    binary: Path, character: Path, session: Path, tmp_path: Path, own_network: tuple[str, ...]
) -> None:
    allowed = subprocess.run(
        [*own_network, "sh", "-c", f"ip link set lo up && {NETEM}"], capture_output=True, text=True, check=False
    )
    if allowed.returncode != 0:
        pytest.skip(f"this machine does not allow netem in a network namespace: {allowed.stderr.strip()}")
    check_take(own_network, tmp_path, SETUP.replace("exec", f"{NETEM} && exec"), SCRIPT, [session, binary, character])
