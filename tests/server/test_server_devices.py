"""Haptic devices of a server, simulated with their hands, and what goes wrong with devices."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from server_support.client import Client, Connect
from server_support.process import StartServer, run_server

HAND = "hand.L"
DEVICE = ("--device", "spidar-g6")
STEPS = 500


def pull_up(client: Client, steps: int = STEPS) -> Any:
    """The hand of device 0 takes the doll's and goes up; what it feels then."""
    client.accepted("step", count=100)
    held = client.accepted("grab", bone=HAND)["position"]
    # At the grab the pointer stands where it was; from there the way counts.
    sequence = client.point((held[0], held[1], held[2]))
    client.accepted("step", count=100, pointer_sequence=(0, sequence))
    sequence = client.point((held[0], held[1], held[2] + 0.03))
    steps_done = client.accepted("step", count=steps, pointer_sequence=(0, sequence))["steps"][0]
    time_us = round(steps_done * 1000)
    return client.wait_for("force_t", lambda force: force.pointer == 0 and force.time_us > time_us - 20_000)


def test_simulated_hand_pulls_the_doll_and_feels_it(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep", *DEVICE))
    force = pull_up(client)
    assert force.attached
    assert force.force[2] > 0.0
    assert force.hand_force[2] < 0.0
    status = client.wait_for("status_t", lambda status: status.steps >= STEPS)
    (device,) = status.devices
    assert (device.pointer, device.state, device.faults, device.share) == (0, "ok", 0, 1.0)
    assert "SPIDAR-G6X3" in device.name


def bend_with_two_hands(client: Client, physics_hz: int) -> list[Any]:
    """Two hands hold an arm and pull it up; what each feels in the end."""
    bones = ("hand.L", "forearm.L")
    client.accepted("step", count=physics_hz // 5)
    for pointer, bone in enumerate(bones):
        held = client.accepted("grab", bone=bone, pointer=pointer)["position"]
        client.point(held, pointer)
        sequence = client.point((held[0], held[1], held[2] + 0.02), pointer)
    steps = client.accepted("step", count=physics_hz, pointer_sequence=(1, sequence))["steps"][0]
    late = (steps / physics_hz - 0.1) * 1e6
    return [
        client.wait_for("force_t", lambda force, k=pointer: force.pointer == k and force.time_us > late)
        for pointer in range(len(bones))
    ]


@pytest.mark.parametrize(("physics_hz", "haptic_hz"), [(1000, 4000), (50, 2000)])
def test_hands_are_served_faster_than_the_doll_is_stepped(
    start_server: StartServer, connect: Connect, physics_hz: int, haptic_hz: int
) -> None:
    rates = ("--physics-hz", physics_hz, "--pose-hz", 50, "--haptic-hz", haptic_hz)
    whole = bend_with_two_hands(connect(start_server("--clock", "lockstep", *DEVICE, *DEVICE)), 1000)
    client = connect(start_server("--clock", "lockstep", *DEVICE, *DEVICE, *rates))
    for force, expected in zip(bend_with_two_hands(client, physics_hz), whole, strict=True):
        assert force.attached
        size = math.hypot(*expected.hand_force)
        assert size > 0.1
        # The friction of the simulated pulleys leaves each hand somewhere within a tenth.
        assert math.dist(force.hand_force, expected.hand_force) < 0.1 * size
    steps = client.received["reply_t"][-1].results[0].values[0]
    status = client.wait_for("status_t", lambda status: status.steps >= steps)
    for device in status.devices:
        assert (device.state, device.faults, device.late_ticks) == ("ok", 0, 0)
        assert device.share == 1.0
        assert device.haptic_hz == haptic_hz
        assert device.haptic_rate == pytest.approx(haptic_hz, rel=1e-6)
        assert 0.0 < device.tick_us_p50 <= device.tick_us_p99 <= device.tick_us_max


def test_multirate_servers_give_the_same_bits(start_server: StartServer, connect: Connect) -> None:
    poses = []
    for _ in range(2):
        client = connect(
            start_server("--clock", "lockstep", *DEVICE, *DEVICE, "--physics-hz", 100, "--haptic-hz", 1000)
        )
        bend_with_two_hands(client, 100)
        poses.append(client.received["pose_t"][-1].rotations)
    assert poses[0] == poses[1]


def test_stiffness_is_felt_the_same_at_any_physics_rate(start_server: StartServer, connect: Connect) -> None:
    felt = []
    for physics_hz in (50, 500, 2000):
        rates = ("--physics-hz", physics_hz, "--haptic-hz", 2000, "--pose-hz", 50)
        client = connect(start_server("--clock", "lockstep", *DEVICE, *rates))
        client.accepted("set", softness=100.0)  # nothing yields
        client.accepted("step", count=physics_hz)
        held = client.accepted("grab", bone=HAND)["position"]
        client.point(held)
        client.accepted("step", count=2 * physics_hz)
        sequence = client.point((held[0], held[1], held[2] + 0.01))
        steps = client.accepted("step", count=4 * physics_hz, pointer_sequence=(0, sequence))["steps"][0]
        late = (steps / physics_hz - 0.05) * 1e6
        force = client.wait_for("force_t", lambda force, late=late: force.time_us > late)
        felt.append(math.hypot(*force.force))
    assert felt[2] > 0.0
    for force in felt:
        assert force == pytest.approx(felt[2], rel=0.03)


def test_haptic_thread_runs_in_realtime_and_is_told(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server(*DEVICE, *DEVICE, "--physics-hz", 250, "--haptic-hz", 1000))
    client.wait_for("status_t", lambda status: all(device.share > 0.0 for device in status.devices))
    held = client.accepted("grab", bone=HAND)["position"]
    client.point(held)
    client.point((held[0], held[1], held[2] + 0.03))
    force = client.wait_for("force_t", lambda force: force.attached and math.hypot(*force.hand_force) > 0.01)
    assert force.pointer == 0
    client.accepted("release")
    client.wait_for("force_t", lambda later: later.time_us > force.time_us and not later.attached)
    client.accepted("reset")
    status = client.wait_for("status_t", lambda status: status.devices[0].haptic_rate > 0.0)
    for device in status.devices:
        assert device.haptic_hz == 1000.0
        assert 0.0 < device.tick_us_p50 <= device.tick_us_p99 <= device.tick_us_max
        assert device.realtime in (0, 1)
    assert math.isfinite(status.elastic_energy)


def test_fingertip_of_a_device_touches_on_slow_physics(start_server: StartServer, connect: Connect) -> None:
    rates = ("--physics-hz", 50, "--haptic-hz", 1000, "--pose-hz", 50)
    client = connect(start_server("--clock", "lockstep", *DEVICE, *rates))
    client.accepted("step", count=50)
    grabbed = client.accepted("grab", bone=HAND)["position"]
    client.accepted("release")
    above = (grabbed[0], grabbed[1], grabbed[2] + 0.1)
    sequence = client.point(above)
    client.accepted("step", count=10, pointer_sequence=(0, sequence))
    client.accepted("touch")
    sequence = client.point((above[0], above[1], above[2] - 0.15))
    client.accepted("step", count=100, pointer_sequence=(0, sequence))
    force = client.wait_for("force_t", lambda force: force.contact)
    assert force.tool == "touch"
    assert force.hand_force[2] > 0.0, "what is below pushes the hand up"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((*DEVICE, "--physics-hz", "300", "--haptic-hz", "1000"), ["--haptic-hz", "1000", "multiple", "300"]),
        ((*DEVICE, "--haptic-hz", "500"), ["--haptic-hz", "500", "multiple", "1000"]),
        ((*DEVICE, "--haptic-hz", "20000"), ["--haptic-hz", "20000", "10000"]),
        ((*DEVICE, "--haptic-hz", "nan"), ["--haptic-hz", "nan"]),
        (("--haptic-hz", "4000"), ["--haptic-hz", "--device"]),
        ((*(5 * DEVICE), "--haptic-hz", "4000"), ["--haptic-hz", "5 devices", "4"]),
        ((*DEVICE, "--passivity", "on"), ["--passivity", "on", "together"]),
    ],
)
def test_rate_that_cannot_be_had_is_refused(
    binary: Path, character: Path, options: tuple[str, ...], words: list[str]
) -> None:
    done = run_server(binary, character, "--broker", 0, *options)
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    for word in words:
        assert word in line


def test_passivity_observer_tells_what_the_hand_put_in(start_server: StartServer, connect: Connect) -> None:
    rates = ("--physics-hz", 250, "--haptic-hz", 1000)
    client = connect(start_server("--clock", "lockstep", *DEVICE, *rates, "--passivity", "each"))
    client.accepted("step", count=1000)  # the arm sinks and rests
    held = client.accepted("grab", bone=HAND)["position"]
    client.point(held)
    client.accepted("step", count=250)
    sequence = client.point((held[0], held[1], held[2] + 0.03))
    steps = client.accepted("step", count=500, pointer_sequence=(0, sequence))["steps"][0]
    status = client.wait_for("status_t", lambda status: status.steps >= steps)
    assert status.devices[0].energy > 0.0


def test_two_servers_with_devices_give_the_same_bits(start_server: StartServer, connect: Connect) -> None:
    poses = []
    for _ in range(2):
        client = connect(start_server("--clock", "lockstep", *DEVICE, *DEVICE))
        pull_up(client)
        poses.append(client.received["pose_t"][-1].rotations)
    assert poses[0] == poses[1]


def test_device_in_realtime_is_read_and_may_push_after_a_while(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server(*DEVICE))
    status = client.wait_for("status_t", lambda status: status.devices[0].share > 0.0)
    assert status.devices[0].state == "ok"


def test_device_without_a_pose_is_told_in_the_status(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--device", "lcm"))
    status = client.wait_for("status_t", lambda status: status.steps > 0)
    assert status.devices[0].state == "no pose yet"
    assert status.devices[0].share == 0.0


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [("missing.so", None, ["missing.so"]), ("text.so", "no plugin\n", ["text.so"])],
)
def test_plugin_that_cannot_be_used_fails_naming_it(
    binary: Path, character: Path, tmp_path: Path, name: str, content: str | None, words: list[str]
) -> None:
    plugin = tmp_path / name
    if content is not None:
        plugin.write_text(content)
    done = run_server(binary, character, "--broker", 0, "--device", plugin)
    assert done.returncode == 1
    errors = [line for line in done.stderr.splitlines() if "remarks" not in line]
    assert len(errors) == 1, done.stderr
    for word in words:
        assert word in errors[0]


def test_config_that_is_no_geometry_fails_naming_it(binary: Path, character: Path, tmp_path: Path) -> None:
    config = tmp_path / "bad.toml"
    config.write_text('name = "bad"\n')
    done = run_server(binary, character, "--broker", 0, *DEVICE, "--device-config", config)
    assert done.returncode == 1
    assert str(config) in done.stderr
