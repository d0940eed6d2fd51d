"""kill -9 of the server, the recorder and the player, at random moments.

LAYFIGURE_KILLS says how many (20); LAYFIGURE_KILLS_SEED makes it other ones.
"""

from __future__ import annotations

import contextlib
import os
import random
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
from e2e_support import ClientProcess, StartClient
from pxr import Usd
from server_support.process import ServerProcess, StartServer, keepable_port

from layfigure.bus import read_events
from layfigure.errors import LayfigureError
from layfigure.take_collector import read_take
from layfigure.take_usd import write_usd
from layfigure.usd.checks import check

KILLS = int(os.environ.get("LAYFIGURE_KILLS", "20"))
SEED = int(os.environ.get("LAYFIGURE_KILLS_SEED", "1"))
LONGEST_S = 1.0  # from the recorder's start to the kill
PATIENCE_S = 60.0
SESSION = (
    '[[hand]]\npointer = 0\ndo = [{ grab = "hand.L" }, { move = [0.0, 0.0, 0.05], over = 0.5 }, { wait = 30 }, '
    "{ release = true }]\n"
)


def poses_of(log: Path) -> list[int]:
    """Sequences of the poses in a log that is being written, or was: what its recorder had acknowledged."""
    with contextlib.suppress(LayfigureError):
        return [
            int.from_bytes(event.data[36:44], "big") for event in read_events(log) if event.channel.endswith("_POSE")
        ]
    return []


def check_whole(log: Path, out: Path, acknowledged: int) -> None:
    """The take holds what was acknowledged, comes out of its log as USD, as `layfigure export` does it, and opens."""
    assert len(poses_of(log)) >= acknowledged
    take = read_take(log)
    assert len(take.times_us) >= acknowledged
    write_usd(take, out)
    assert Usd.Stage.Open(str(out)).GetDefaultPrim()
    assert check(out).findings == ()


def check_replay(binary: Path, log: Path) -> None:
    """What a killed server has logged plays again, bit for bit."""
    done = subprocess.run([binary, "--replay", log], capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    found = re.fullmatch(r"replayed \d+ steps: all (\d+) poses are the same, bit for bit\n", done.stdout)
    assert found, done.stdout
    assert int(found[1]) > 0
    log.unlink()


def wait_for_more(log: Path, count: int) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while len(poses_of(log)) <= count:
        assert time.monotonic() < deadline, "no more poses came"
        time.sleep(0.05)


def finish(recorder: ClientProcess, folder: Path, acknowledged: int) -> None:
    """A recorder that lives on ends its take when it is asked to."""
    code, _, errors = recorder.finish(signal.SIGINT)
    assert code == 0, errors
    assert check(folder / "take.usda").findings == ()
    check_whole(folder / "take.lcmlog", folder / "again.usda", acknowledged)


@pytest.mark.slow
def test_kills_at_random_moments_lose_nothing_that_was_acknowledged(
    binary: Path, start_server: StartServer, start_client: StartClient, tmp_path: Path
) -> None:
    random_moments = random.Random(SEED)
    (tmp_path / "hold.toml").write_text(SESSION)
    log = tmp_path / "take.recording.lcmlog"
    port = keepable_port()
    session = tmp_path / "session.lcmlog"  # the server's own
    server: ServerProcess = start_server("--broker", port, "--log", session)
    for number in range(KILLS):
        victim = random_moments.choice(("server", "recorder", "player"))
        moment_s = random_moments.uniform(0.0, LONGEST_S)
        print(f"kill {number}: {victim} after {moment_s:.3f} s", flush=True)
        recorder = start_client("record", "take.usda", "--lcm-url", server.url)
        assert recorder.error_line().startswith(("recording 'doll'", "layfigure: an earlier recording"))
        player = start_client("play", "hold.toml", "--lcm-url", server.url)
        wait_for_more(log, 0)
        time.sleep(moment_s)
        acknowledged = len(set(poses_of(log)))  # the newest pose comes again where somebody asks for the character
        if victim == "recorder":
            recorder.finish(signal.SIGKILL)
            check_whole(log, tmp_path / f"cut-off-{number}.usda", acknowledged)
            log.unlink()
        elif victim == "player":
            player.finish(signal.SIGKILL)
            wait_for_more(log, acknowledged)  # the server and the recorder go on
            finish(recorder, tmp_path, acknowledged)
        else:
            server.process.kill()
            server.process.wait()  # until then it may hold its port
            check_replay(binary, session)
            server = start_server("--broker", port, "--log", session)
            wait_for_more(log, acknowledged)  # the recorder has found the new one
            finish(recorder, tmp_path, acknowledged)
        player.finish(signal.SIGKILL)
