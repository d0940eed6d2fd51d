"""Session logs: written by --log, read by LCM's own tools, played again bit for bit by --replay."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import lcm
import pytest
from server_support.client import Client, Connect
from server_support.process import StartServer, run_server

HAND = "hand.L"


def work(client: Client, step: bool) -> None:
    """Every kind of command, with gestures of two hands, so long that the doll flows and comes to rest."""

    def go_on(count: int) -> None:
        if step:
            client.accepted("step", count=count)
        else:
            time.sleep(count / 1000)

    client.accepted("get_character")
    client.accepted("set", bone="*", **{"stiffness.factor": 0.8, "yield_torque.factor": 0.5})
    held = client.accepted("grab", bone=HAND)["position"]
    for k in range(1, 31):
        client.point((held[0], held[1], held[2] + 0.01 * k))
        go_on(10)
    client.accepted("snapshot", name="up")
    client.accepted("release")
    go_on(300)
    (released,) = client.accepted("history")["place"]
    client.accepted("mirror", side="left")
    client.accepted("lock", bone=HAND)
    go_on(100)
    client.accepted("undo")
    client.accepted("undo")
    client.accepted("redo")
    go_on(100)
    client.accepted("history", action="go", place=0)
    go_on(50)
    client.accepted("history", action="go", place=released)
    go_on(50)
    assert not client.command("grab", bone="nobody").accepted
    client.accepted("snapshot", name="up", action="restore")
    client.accepted("set", gravity=(0.0, 1.0, -9.0))
    go_on(200)
    client.accepted("reset", all=1)
    go_on(700)
    client.accepted("key")
    client.accepted("grab", bone=HAND, mode="6dof")
    go_on(50)
    client.accepted("shutdown")


def log_of(start_server: StartServer, connect: Connect, path: Path, *options: object, step: bool) -> Path:
    server = start_server("--log", path, *options)
    prefix = "P_" if "--channel-prefix" in options else ""
    work(connect(server, prefix), step)
    code, error = server.wait()
    assert code == 0
    assert "the log" not in error
    return path


@pytest.fixture
def lockstep_log(start_server: StartServer, connect: Connect, tmp_path: Path) -> Path:
    return log_of(start_server, connect, tmp_path / "work.lcmlog", "--clock", "lockstep", step=True)


def events(path: Path) -> Iterator[lcm.Event]:
    log = lcm.EventLog(str(path), "r")
    while (event := log.read_next_event()) is not None:
        yield event


def poses_of(text: str) -> int:
    found = re.fullmatch(r"replayed \d+ steps: all (\d+) poses are the same, bit for bit\n", text)
    assert found, text
    return int(found[1])


def test_lockstep_session_replays_bit_for_bit(binary: Path, lockstep_log: Path) -> None:
    result = run_server(binary, "--replay", lockstep_log)
    assert (result.returncode, result.stderr) == (0, "")
    published = sum(event.channel == "LAYFIGURE_POSE" for event in events(lockstep_log))
    assert published - 2 <= poses_of(result.stdout) <= published  # but for the one that get_character repeats
    assert published > 80


@pytest.mark.parametrize("options", [(), ("--physics-hz", "500", "--pose-hz", "33", "--channel-prefix", "P_")])
def test_realtime_session_replays_bit_for_bit(
    binary: Path, start_server: StartServer, connect: Connect, tmp_path: Path, options: tuple[str, ...]
) -> None:
    log = log_of(start_server, connect, tmp_path / "work.lcmlog", *options, step=False)
    result = run_server(binary, "--replay", log)
    assert (result.returncode, result.stderr) == (0, "")
    assert poses_of(result.stdout) > 20


DEVICES = ("--device", "spidar-g6", "--device", "spidar-g6")


def work_with_devices(client: Client, step: bool) -> None:
    """Two simulated hands take the arm one after the other, bend it, touch it, and are put back."""

    def go_on(count: int) -> None:
        if step:
            client.accepted("step", count=count)
        else:
            time.sleep(count / 1000)

    go_on(50)
    for pointer, bone in enumerate((HAND, "forearm.L")):
        held = client.accepted("grab", bone=bone, pointer=pointer)["position"]
        client.point(held, pointer)
        go_on(30)
        client.point((held[0], held[1], held[2] + 0.04), pointer)
        go_on(120)
    client.accepted("snapshot", name="bent")
    client.accepted("release", pointer=0)
    go_on(50)
    client.accepted("undo")
    go_on(50)
    client.accepted("set", gravity=(0.0, 1.0, -9.0))
    client.point((held[0], held[1], held[2] + 0.4), 1)
    client.accepted("touch", pointer=1)
    client.point((held[0], held[1], held[2] - 0.1), 1)
    go_on(200)
    client.accepted("snapshot", name="bent", action="restore")
    go_on(50)
    client.accepted("key")
    client.accepted("shutdown")


@pytest.mark.parametrize("clock", ["lockstep", "realtime"])
@pytest.mark.parametrize("rates", [(), ("--physics-hz", 250, "--haptic-hz", 1000)])
def test_session_with_devices_replays_bit_for_bit_without_them(
    binary: Path,
    start_server: StartServer,
    connect: Connect,
    messages: ModuleType,
    tmp_path: Path,
    clock: str,
    rates: tuple[object, ...],
) -> None:
    path = tmp_path / "devices.lcmlog"
    server = start_server("--log", path, "--clock", clock, *DEVICES, *rates)
    work_with_devices(connect(server), step=clock == "lockstep")
    assert server.wait()[0] == 0
    result = run_server(binary, "--replay", path)
    assert (result.returncode, result.stderr) == (0, "")
    assert poses_of(result.stdout) > 20
    read = list(events(path))
    steps = [messages.log_devices_t.decode(event.data).step for event in read if event.channel.endswith("LOG_DEVICES")]
    assert steps == list(range(len(steps)))  # one for each
    assert any(
        messages.pose_t.decode(event.data).yielded.count(True) for event in read if event.channel.endswith("_POSE")
    )


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_log_with_devices_that_was_cut_off_replays_as_far_as_it_goes(
    binary: Path, start_server: StartServer, connect: Connect, tmp_path: Path, share: float
) -> None:
    path = tmp_path / "devices.lcmlog"
    server = start_server("--log", path, "--clock", "lockstep", *DEVICES)
    work_with_devices(connect(server), step=True)
    assert server.wait()[0] == 0
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    result = run_server(binary, "--replay", path)
    assert (result.returncode, result.stderr) == (0, "")
    assert poses_of(result.stdout) > 5


def test_log_without_what_devices_brought_into_one_step_differs_there(
    binary: Path, start_server: StartServer, connect: Connect, messages: ModuleType, tmp_path: Path
) -> None:
    path, changed = tmp_path / "devices.lcmlog", tmp_path / "changed.lcmlog"
    server = start_server("--log", path, "--clock", "lockstep", *DEVICES)
    work_with_devices(connect(server), step=True)
    assert server.wait()[0] == 0
    out = lcm.EventLog(str(changed), "w", overwrite=True)
    for event in events(path):
        brought = event.channel.endswith("LOG_DEVICES") and messages.log_devices_t.decode(event.data)
        if not (brought and brought.step == 40):
            out.write_event(event.timestamp, event.channel, event.data)
    out.close()
    result = run_server(binary, "--replay", changed)
    assert result.returncode == 1
    assert "step 41: the log has what devices brought into step 42" in result.stderr
    assert result.stderr.count("\n") == 1


def test_log_holds_what_was_taken_in_and_published(lockstep_log: Path, messages: ModuleType) -> None:
    read = list(events(lockstep_log))
    assert read[0].channel == "LAYFIGURE_LOG_START"
    start = messages.log_start_t.decode(read[0].data)
    assert (start.clock, start.physics_hz, start.protocol_version) == ("lockstep", 1000.0, 1)
    assert start.character.endswith("doll.glb")
    channels = {event.channel.removeprefix("LAYFIGURE_") for event in read}
    assert channels == {
        *("LOG_START", "LOG_STEP", "LOG_SNAPSHOT", "COMMAND", "POINTER"),
        *("CHARACTER", "POSE", "FORCE", "REPLY", "STATUS"),
    }
    steps = [messages.log_step_t.decode(event.data).step for event in read if event.channel.endswith("LOG_STEP")]
    assert steps == sorted(steps)


def test_replay_that_differs_tells_the_first_difference(
    binary: Path, lockstep_log: Path, messages: ModuleType, tmp_path: Path
) -> None:
    changed = tmp_path / "changed.lcmlog"
    out = lcm.EventLog(str(changed), "w", overwrite=True)
    poses = 0
    for event in events(lockstep_log):
        data = event.data
        if event.channel == "LAYFIGURE_POSE":
            poses += 1
            if poses == 40:
                pose = messages.pose_t.decode(data)
                rotations = [list(rotation) for rotation in pose.rotations]
                rotations[1][1] += 1e-9
                pose.rotations = rotations
                data = pose.encode()
        out.write_event(event.timestamp, event.channel, data)
    out.close()
    result = run_server(binary, "--replay", changed)
    assert result.returncode == 1
    assert re.search(r"differs from the log after \d+ poses: pose \d+, step \d+: '", result.stderr), result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9])
def test_log_that_was_cut_off_replays_as_far_as_it_goes(
    binary: Path, lockstep_log: Path, tmp_path: Path, share: float
) -> None:
    data = lockstep_log.read_bytes()
    cut = tmp_path / "cut.lcmlog"
    cut.write_bytes(data[: int(share * len(data))])
    result = run_server(binary, "--replay", cut)
    assert (result.returncode, result.stderr) == (0, "")
    assert poses_of(result.stdout) > 0


def test_log_of_a_killed_server_replays(
    binary: Path, start_server: StartServer, connect: Connect, tmp_path: Path
) -> None:
    path = tmp_path / "killed.lcmlog"
    server = start_server("--log", path)
    client = connect(server)
    client.accepted("grab", bone=HAND)
    time.sleep(1.5)
    server.process.kill()
    server.wait()
    result = run_server(binary, "--replay", path)
    assert (result.returncode, result.stderr) == (0, "")
    assert poses_of(result.stdout) > 10


def test_other_character_is_refused_in_one_line(
    binary: Path, character: Path, lockstep_log: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other.glb"
    other.write_bytes(character.read_bytes().replace(b"hand.L", b"claw.L"))
    result = run_server(binary, "--replay", lockstep_log, other)
    assert result.returncode == 1
    assert "is of another character" in result.stderr
    assert result.stderr.count("\n") == 1


def test_log_of_another_version_is_refused(
    binary: Path, lockstep_log: Path, messages: ModuleType, tmp_path: Path
) -> None:
    changed = tmp_path / "old.lcmlog"
    out = lcm.EventLog(str(changed), "w", overwrite=True)
    event = next(events(lockstep_log))
    start = messages.log_start_t.decode(event.data)
    start.program = "layfigure-server 0.0.1"
    out.write_event(event.timestamp, event.channel, start.encode())
    out.close()
    result = run_server(binary, "--replay", changed)
    assert result.returncode == 1
    assert "is of layfigure-server 0.0.1" in result.stderr


@pytest.mark.parametrize("content", [b"", b"no log", bytes(range(256)) * 40])
def test_file_that_is_no_log_is_refused(binary: Path, tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "no.lcmlog"
    path.write_bytes(content)
    result = run_server(binary, "--replay", path)
    assert result.returncode == 1
    assert "is no log of a server's session" in result.stderr


def test_log_that_cannot_be_written_is_told_at_start(binary: Path, character: Path, tmp_path: Path) -> None:
    result = run_server(binary, character, "--broker", "0", "--log", tmp_path / "no_folder" / "a.lcmlog")
    assert result.returncode == 1
    assert "cannot write the log" in result.stderr


def test_two_servers_with_one_log_the_second_is_refused(
    start_server: StartServer, binary: Path, character: Path, tmp_path: Path
) -> None:
    path = tmp_path / "a.lcmlog"
    start_server("--log", path)
    result = run_server(binary, character, "--broker", "0", "--log", path)
    assert result.returncode == 1
    assert "is being written by another process" in result.stderr


def test_full_disk_ends_the_log_and_not_the_server(
    binary: Path, character: Path, start_server: StartServer, connect: Connect, tmp_path: Path
) -> None:
    full = tmp_path / "full.lcmlog"
    full.symlink_to("/dev/full")
    server = start_server("--log", full)
    client = connect(server)
    time.sleep(0.6)
    client.accepted("key")
    client.accepted("shutdown")
    code, error = server.wait()
    assert code == 0
    assert "ends here: No space left on device" in error
