"""Channel prefixes on both sides: two servers on one bus that never hear of each other."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from e2e_support import LCM_DEVICE, RunClient, StartClient
from server_support.process import StartServer, run_server

import layfigure

LOCKSTEP = ("--clock", "lockstep")
LONGEST = "p" * 40
SESSION = '[[hand]]\npointer = 0\ndo = [{ grab = "hand.L" }, { move = [0, 0, 0.03], over = 0.2 }, { release = true }]\n'


class Pair:
    """Two servers on one broker, with the prefixes a_ and b_."""

    def __init__(self, start_server: StartServer, *options: object) -> None:
        self.a = start_server("--channel-prefix", "a_", *options)
        self.b = start_server("--channel-prefix", "b_", "--lcm-url", self.a.url, *options)
        self.url = self.a.url

    def options(self, prefix: str) -> tuple[object, ...]:
        return ("--lcm-url", self.url, "--channel-prefix", prefix)


def steps_of(url: str, prefix: str) -> int:
    with layfigure.connect(url, prefix=prefix) as doll:
        return doll.status().steps


def test_commands_sessions_and_python_reach_the_server_of_their_prefix_alone(
    start_server: StartServer, client: RunClient, tmp_path: Path
) -> None:
    pair = Pair(start_server, *LOCKSTEP)
    assert client("step", 3, *pair.options("a_")).stdout == "step: done at 0.003 s, steps 3\n"
    assert client("step", 5, *pair.options("b_")).stdout == "step: done at 0.005 s, steps 5\n"
    assert "steps: 3\n" in client("status", *pair.options("a_")).stdout
    (tmp_path / "session.toml").write_text(SESSION)
    played = client("play", "session.toml", *pair.options("b_"))
    assert (played.returncode, played.stderr) == (0, "")
    assert steps_of(pair.url, "b_") > 100
    with (
        layfigure.connect(pair.url, prefix="a_") as a,
        layfigure.connect(pair.url, prefix="b_") as b,
        a.record(tmp_path / "a.lcmlog") as recording,
    ):
        b.move_pointer(0, [0.0, 0.0, 0.5])
        b.step(100)
        assert a.next_pose().server_id != b.pose().server_id
        assert a.status().steps < 100
    assert recording.take.restarts == 0
    assert client("shutdown", *pair.options("b_")).returncode == 0
    assert pair.b.wait()[0] == 0
    assert steps_of(pair.url, "a_") < 100


def test_client_of_another_prefix_finds_no_server(start_server: StartServer, client: RunClient) -> None:
    server = start_server("--channel-prefix", "a_", *LOCKSTEP)
    for prefix in ("", "a", "A_", "a_a_"):
        result = client("status", "--lcm-url", server.url, "--channel-prefix", prefix)
        assert (result.returncode, result.stdout) == (1, "")
        assert result.stderr == (
            f"layfigure: no server is heard on '{server.url}' within 5 s: is layfigure-server running there?\n"
        )


def test_longest_prefix_works_and_one_longer_is_refused_on_both_sides(
    start_server: StartServer, start_client: StartClient, client: RunClient, binary: Path, character: Path
) -> None:
    server = start_server("--channel-prefix", LONGEST, *LOCKSTEP)
    options = ("--lcm-url", server.url, "--channel-prefix", LONGEST)
    recorder = start_client("record", "take.usda", *options)
    assert recorder.error_line().startswith("recording 'doll'")
    assert client("step", 100, *options).returncode == 0
    assert client("shutdown", *options).returncode == 0
    assert recorder.finish()[0] == 0
    for bad in (LONGEST + "p", "a b", "a.b", "é"):
        refused = run_server(binary, character, "--channel-prefix", bad)
        assert (refused.returncode, refused.stdout) == (2, "")
        assert len(refused.stderr.splitlines()) == 1
        asked = client("status", "--channel-prefix", bad)
        assert (asked.returncode, asked.stdout) == (2, "")
        assert len(asked.stderr.splitlines()) == 1


def test_device_moves_the_pointer_of_the_server_of_its_prefix(start_server: StartServer) -> None:
    pair = Pair(start_server, "--device", "lcm")
    device = subprocess.Popen(
        [sys.executable, LCM_DEVICE, "--lcm-url", pair.url, "--channel-prefix", "b_"], stdout=subprocess.PIPE, text=True
    )
    try:
        with layfigure.connect(pair.url, prefix="a_") as a, layfigure.connect(pair.url, prefix="b_") as b:
            states = set()
            for _ in range(100):
                states.add((a.status().devices[0].state, b.status().devices[0].state))
                if any(second == "ok" for _, second in states):
                    break
            assert {first for first, _ in states} == {"no pose yet"}
            assert any(second == "ok" for _, second in states)
    finally:
        device.kill()
        device.communicate()
