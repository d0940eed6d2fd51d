"""A server on the wall clock, and how servers end."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest
from server_support.client import Client, Connect
from server_support.process import TIMEOUT_S, StartServer

HAND = "hand.L"
STOPPED_S = 1.0
FLOOD = 20_000


def test_time_passes_by_itself(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server())
    client.accepted("get_character")
    first = client.wait_for("pose_t")
    last = client.wait_for("pose_t", lambda pose: pose.time_us > first.time_us + 300_000)
    poses = [pose for pose in client.received["pose_t"] if first.sequence <= pose.sequence <= last.sequence]
    assert sorted({pose.sequence for pose in poses}) == list(range(first.sequence, last.sequence + 1))
    status = client.wait_for("status_t", lambda status: status.steps > 0)
    assert status.clock == "realtime"
    assert status.step_us_p50 > 0
    assert status.realtime_factor > 0


def test_character_comes_without_being_asked_for(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server())
    assert client.wait_for("character_t").clock == "realtime"


def test_step_is_refused_naming_the_clock(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server())
    reply = client.command("step")
    assert not reply.accepted
    assert "lockstep" in reply.reason


def test_pull_is_felt_at_the_pointer(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server())
    held = client.accepted("grab", bone=HAND)["position"]
    goal = held[2] + 0.05
    client.point((held[0], held[1], goal))
    force = client.wait_for("force_t", lambda force: abs(force.target[2] - goal) < 1e-9 and force.force[2] > 0.0)
    assert force.attached
    assert force.position[2] < goal
    client.accepted("release")
    client.wait_for("force_t", lambda force: force.sequence > 0 and not force.attached)


def test_slower_poses_and_physics_are_obeyed(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--physics-hz", 200, "--pose-hz", 30))
    character = client.wait_for("character_t")
    assert (character.physics_hz, character.pose_hz) == (200.0, 30.0)
    pose = client.wait_for("pose_t", lambda pose: pose.sequence >= 3)
    assert pose.step == -(-pose.sequence * 200 // 30)
    assert pose.time_us == pose.step * 5000


def test_resting_doll_costs_heartbeats_alone_and_wakes_at_a_pull(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server())
    client.accepted("get_character")
    # Poses come at 60 Hz, from step to step; of a doll at rest with the heartbeats.
    rest = client.wait_for("pose_t", lambda pose: pose.step > 0 and _gap_before(client, pose) >= 90)
    later = client.wait_for("pose_t", lambda pose: pose.step >= rest.step + 500)
    assert later.rotations == rest.rotations
    held = client.accepted("grab", bone=HAND)["position"]
    client.point((held[0], held[1], held[2] + 0.05))
    moved = client.wait_for("pose_t", lambda pose: pose.step > later.step and pose.rotations != rest.rotations)
    before = next(pose for pose in client.received["pose_t"] if pose.sequence == moved.sequence - 1)
    assert before.rotations == rest.rotations
    assert moved.step - before.step <= 20, "the pose from which the motion starts"


def test_second_without_the_machine_is_counted_and_not_caught_up(start_server: StartServer, connect: Connect) -> None:
    server = start_server("--device", "spidar-g6")  # with a device it never rests
    client = connect(server)
    before = client.wait_for("status_t", lambda status: status.steps > 100)
    os.kill(server.process.pid, signal.SIGSTOP)
    time.sleep(STOPPED_S)
    os.kill(server.process.pid, signal.SIGCONT)
    after = client.wait_for("status_t", lambda status: status.dropped_time >= before.dropped_time + 0.9 * STOPPED_S)
    assert after.late_steps > before.late_steps
    assert after.step_us_p50 <= after.step_us_p99 <= after.step_us_max
    # What was given up is not made up for: simulation time stays that much behind the wall clock's.
    later = client.wait_for("status_t", lambda status: status.steps >= after.steps + 500)
    start = time.monotonic()
    last = client.wait_for("status_t", lambda status: status.steps >= later.steps + 1000)
    assert last.state == "running"
    assert last.time_us - later.time_us <= 1e6 * (time.monotonic() - start) + 500_000
    server.process.terminate()
    _, log = server.wait()
    assert "fell behind the wall clock" in log


def test_status_tells_the_limits_and_who_is_there(start_server: StartServer, connect: Connect) -> None:
    server = start_server()
    client = connect(server)
    others = [connect(server) for _ in range(3)]
    status = client.wait_for("status_t", lambda status: status.clients == 4)
    assert (status.max_clients, status.max_message_bytes, status.max_message_rate) == (256, 16 << 20, 20_000.0)
    assert (status.bad_messages, status.dropped_messages, status.paused_clients) == (0, 0, 0)
    del others


def test_flood_of_commands_slows_its_sender_alone(start_server: StartServer, connect: Connect) -> None:
    server = start_server()
    client = connect(server)
    client.wait_for("status_t")
    flooding = connect(server)
    flood = threading.Thread(target=lambda: [flooding.send("key") for _ in range(FLOOD)])
    flood.start()
    while flood.is_alive():
        client.accepted("key")
    flood.join()
    last = flooding.wait_for("reply_t", lambda reply: (reply.client_id, reply.sequence) == (flooding.id, FLOOD))
    assert last.accepted
    status = client.wait_for("status_t", lambda status: status.steps > 0)
    assert (status.state, status.bad_messages) == ("running", 0)


def test_url_that_leaves_the_machine_is_warned_of(binary: Path, character: Path, own_network: tuple[str, ...]) -> None:
    """In a network of its own: nothing leaves the test."""
    setup = 'ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"'
    for ttl, warned in ((0, False), (1, True)):
        url = f"udpm://239.255.76.67:7667?ttl={ttl}"
        command = [*own_network, "sh", "-c", setup, "sh", binary, character, "--lcm-url", url, "--duration", "0.1"]
        done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=TIMEOUT_S)
        assert (f"has ttl={ttl}" in done.stderr) == warned


def _gap_before(client: Client, pose: Any) -> int:
    before = [p.step for p in client.received["pose_t"] if p.sequence == pose.sequence - 1]
    return int(pose.step - before[0]) if before else 0


@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_signal_ends_it_well(start_server: StartServer, connect: Connect, stop: signal.Signals) -> None:
    server = start_server()
    client = connect(server)
    client.wait_for("status_t")
    os.kill(server.process.pid, stop)
    code, error = server.wait()
    assert (code, error.count("Traceback")) == (0, 0)
    client.drain()
    assert client.received["status_t"][-1].state == "leaving"


def test_shutdown_is_answered_before_it_leaves(start_server: StartServer, connect: Connect) -> None:
    server = start_server("--clock", "lockstep")
    client = connect(server)
    assert client.command("shutdown").accepted
    code, _ = server.wait()
    assert code == 0
    client.drain()
    assert client.received["status_t"][-1].state == "leaving"


def test_stopped_client_does_not_delay_others(start_server: StartServer, connect: Connect) -> None:
    server = start_server("--clock", "lockstep")
    port = int(server.url.rsplit(":", 1)[1])
    with socket.create_connection(("127.0.0.1", port)) as stopped:
        stopped.sendall(bytes.fromhex("287617fb00000100") + b"\0\0\0\2\0\0\0\2.*")
        client = connect(server)
        for _ in range(40):
            client.accepted("step", count=10_000)
        assert client.received["pose_t"][-1].step >= 399_990


UDPM_SCRIPT = """
import importlib, sys
sys.path[:0] = [sys.argv[1], sys.argv[2]]
from server_support.client import Client
from server_support.process import ServerProcess
messages = importlib.import_module("generated.layfigure")
with ServerProcess(sys.argv[3:], {"LCM_DEFAULT_URL": ""}) as server:
    client = Client(messages, server.url)
    client.wait_for("status_t")
    print(client.accepted("step", count=100)["steps"], server.url)
"""


def test_multicast_in_a_network_of_its_own(
    binary: Path, character: Path, messages: object, own_network: tuple[str, ...]
) -> None:
    """udpm, the default bus, inside a network namespace with nothing but a loopback device."""
    types_folder = Path(str(messages.__path__[0])).parents[1]  # type: ignore[attr-defined]
    python = [sys.executable, "-c", UDPM_SCRIPT, str(types_folder), str(Path(__file__).parent)]
    server = [str(binary), str(character), "--clock", "lockstep"]
    setup = 'ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"'
    done = subprocess.run(
        [*own_network, "sh", "-c", setup, "sh", *python, *server],
        capture_output=True,
        text=True,
        timeout=2 * TIMEOUT_S,
        check=False,
    )
    assert done.stdout == "(100.0,) udpm://239.255.76.67:7667?ttl=0\n", done.stderr


def test_server_whose_messages_nobody_reads_goes_on(binary: Path, character: Path, connect: Connect) -> None:
    """A program that has started it, and does not read its stderr, in the end has a full pipe there."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with contextlib.suppress(BlockingIOError):
        while os.write(writer, b"." * 4096):
            pass
    os.set_blocking(writer, True)
    command = [str(binary), str(character), "--broker", "0"]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=writer, text=True)
    try:
        assert server.stdout is not None
        client = connect(server.stdout.readline().removeprefix("listening on ").strip())
        client.publish("COMMAND", b"no message, which is logged")
        client.accepted("key")
        client.accepted("shutdown")
        assert server.wait(TIMEOUT_S) == 0
    finally:
        server.kill()
        server.wait()
        os.close(reader)
        os.close(writer)
