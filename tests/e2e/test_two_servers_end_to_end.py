"""Two servers on one bus: each command of the client, and the Python API, work with the one that is chosen."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from e2e_support import RunClient, StartClient
from server_support.process import ServerProcess, StartServer

import layfigure
from layfigure.bus import Bus, Event, EventLogWriter
from layfigure.connection import Connection
from layfigure.protocol import CHARACTER_CHANNEL, COMMAND_CHANNEL, MESH_CHANNEL, POSE_CHANNEL, REPLY_CHANNEL
from layfigure.usd.checks import check

LOCKSTEP = ("--clock", "lockstep")
NOBODY = 1  # an id that no server will draw
SESSION = """
[[hand]]
pointer = 0
do = [{ grab = "hand.L" }, { move = [0.0, -0.03, 0.05], over = 0.5 }, { release = true }, { wait = 0.2 }]

[[expect]]
at = 0.5
moved = "hand.L"
since = 0.0
at_least = 0.01
"""
SESSION_POSES = 43  # 0.7 s at 60 Hz, both ends


class Pair:
    """Two servers in lockstep on the broker of the first, by their ids."""

    def __init__(self, start_server: StartServer) -> None:
        first = start_server(*LOCKSTEP)
        self.url = first.url
        with Bus(self.url) as bus:
            one = Connection(bus).wait_for_status().server_id
        second = start_server(*LOCKSTEP, "--lcm-url", self.url)
        self.servers: dict[int, ServerProcess] = {one: first, self._other_than(one): second}
        self.one, self.other = self.servers

    def _other_than(self, known: int) -> int:
        found: list[int] = []
        with Bus(self.url) as bus:
            bus.subscribe("LAYFIGURE_STATUS", lambda data: found.append(int.from_bytes(data[20:28], "big")))
            assert bus.wait_until(lambda: any(server_id != known for server_id in found), 30.0)
            bus.wait_until(lambda: False, 0.3)  # in which the two hear each other
        return next(server_id for server_id in found if server_id != known)

    def options(self, server_id: int | None = None) -> tuple[object, ...]:
        chosen = () if server_id is None else ("--server", server_id)
        return ("--lcm-url", self.url, *chosen)


@pytest.fixture
def pair(start_server: StartServer) -> Pair:
    return Pair(start_server)


def refusal(client: RunClient, *arguments: object) -> str:
    result = client(*arguments)
    assert (result.returncode, result.stdout) == (1, "")
    assert len(result.stderr.splitlines()) == 1, result.stderr
    return str(result.stderr)


def steps_of(pair: Pair, server_id: int) -> int:
    with layfigure.connect(pair.url, server=server_id) as doll:
        return doll.status().steps


@pytest.mark.parametrize("arguments", [("status",), ("step",), ("undo",), ("record", "take.usda")])
def test_command_that_chooses_none_is_refused_and_names_both_and_the_choice(
    pair: Pair, client: RunClient, arguments: tuple[str, ...]
) -> None:
    line = refusal(client, *arguments, *pair.options())
    for words in (str(pair.one), str(pair.other), "choose one with --server ID"):
        assert words in line
    assert [steps_of(pair, server_id) for server_id in pair.servers] == [0, 0]


def test_commands_reach_the_chosen_server_alone(pair: Pair, client: RunClient) -> None:
    assert client("step", 5, *pair.options(pair.one)).stdout == "step: done at 0.005 s, steps 5\n"
    assert client("step", 7, *pair.options(pair.other)).stdout == "step: done at 0.007 s, steps 7\n"
    assert f"server_id: {pair.one}\n" in client("status", *pair.options(pair.one)).stdout
    assert [steps_of(pair, server_id) for server_id in pair.servers] == [5, 7]
    assert client("shutdown", *pair.options(pair.other)).returncode == 0
    assert pair.servers[pair.other].wait()[0] == 0
    assert steps_of(pair, pair.one) == 5


def test_server_that_is_not_there_is_named(pair: Pair, client: RunClient) -> None:
    line = refusal(client, "step", *pair.options(NOBODY))
    assert f"no server of the id {NOBODY} answered 'step'" in line
    assert [steps_of(pair, server_id) for server_id in pair.servers] == [0, 0]


@contextlib.contextmanager
def in_the_background(work: Callable[[threading.Event], None]) -> Iterator[None]:
    """Does it on a thread of its own, until the event that it is given, which is the end of the `with` block."""
    ended = threading.Event()
    failures: list[Exception] = []

    def run() -> None:
        try:
            work(ended)
        except Exception as failure:  # told where the block ends
            failures.append(failure)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
    assert failures == []


def keep_moving(pair: Pair, server_id: int, ended: threading.Event) -> None:
    """Somebody else's work on the other server."""
    with layfigure.connect(pair.url, server=server_id) as doll:
        doll.command("grab", pointer=0, bone="head")
        while not ended.is_set():
            doll.step(10, {0: [0.3, 0.3, 0.3]})


def log_bus(pair: Pair, path: Path, ended: threading.Event) -> None:
    """All that is said, by whomever, as lcm-logger has it."""
    log = EventLogWriter(path)
    with Bus(pair.url) as bus:
        for channel in (CHARACTER_CHANNEL, MESH_CHANNEL, POSE_CHANNEL, COMMAND_CHANNEL, REPLY_CHANNEL):
            bus.subscribe(channel, lambda data, channel=channel: log.write(Event(0, channel, data)))
        bus.wait_until(ended.is_set, 60.0)
    log.close()


def record_play(start_client: StartClient, client: RunClient, name: str, *options: object) -> None:
    recorder = start_client("record", f"{name}.usda", *options)
    assert recorder.error_line().startswith("recording 'doll'")
    played = client("play", "session.toml", "--expect", *options)
    assert (played.returncode, played.stderr) == (0, "")
    assert client("shutdown", *options).returncode == 0
    assert recorder.finish()[0] == 0


def test_record_play_and_export_of_the_chosen_server_are_as_if_it_were_alone(
    pair: Pair, start_server: StartServer, start_client: StartClient, client: RunClient, tmp_path: Path
) -> None:
    (tmp_path / "session.toml").write_text(SESSION)
    record_play(start_client, client, "alone", "--lcm-url", start_server(*LOCKSTEP).url)
    bus_log = tmp_path / "bus.lcmlog"
    with (
        in_the_background(lambda ended: log_bus(pair, bus_log, ended)),
        in_the_background(lambda ended: keep_moving(pair, pair.one, ended)),
    ):
        record_play(start_client, client, "beside", *pair.options(pair.other))
    assert steps_of(pair, pair.one) > 0
    alone = layfigure.read_take(tmp_path / "alone.lcmlog")
    assert len(alone.times_us) == SESSION_POSES
    for beside in (
        layfigure.read_take(tmp_path / "beside.lcmlog"),
        layfigure.read_take(bus_log, server=pair.other),
    ):
        assert beside.character.server_id == pair.other
        assert (beside.lost_poses, beside.restarts) == (0, 0)
        np.testing.assert_array_equal(beside.times_us, alone.times_us)
        np.testing.assert_array_equal(beside.rotations, alone.rotations)
    assert check(tmp_path / "beside.usda").findings == ()
    exported = client("export", bus_log, "again.usda", "--server", pair.other)
    assert (exported.returncode, exported.stderr) == (0, "")
    assert f"{SESSION_POSES} poses" in exported.stdout
    assert "choose one with --server ID" in refusal(client, "export", bus_log, "both.usda")


def test_python_chooses_a_server_for_all_that_a_doll_does(pair: Pair, tmp_path: Path) -> None:
    with (
        layfigure.connect(pair.url, server=pair.one) as one,
        layfigure.connect(pair.url, server=pair.other) as other,
        one.record(tmp_path / "one.lcmlog") as recording,
    ):
        for _ in range(5):
            assert one.next_pose().server_id == pair.one
            other.step(3)
            assert other.pose().server_id == pair.other
        one.wait(0.3)
        assert one.status().steps == one.pose().step
        assert {one.command("key").server_id, other.command("key").server_id} == set(pair.servers)
    assert len(recording.take.times_us) == 6
    assert recording.take.restarts == 0
    with pytest.raises(layfigure.LayfigureError, match="two servers speak on this bus"):
        layfigure.connect(pair.url)
    with pytest.raises(layfigure.NoReplyError, match=f"no server of the id {NOBODY} "):
        layfigure.connect(pair.url, server=NOBODY, timeout_s=0.3)
    for bad in (0, -1, 1 << 63):
        with pytest.raises(layfigure.UsageError, match=f"server is {bad}: expected a server's id"):
            layfigure.connect(pair.url, server=bad)
