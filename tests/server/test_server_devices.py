"""Haptic devices of a server, simulated with their hands, and what goes wrong with devices."""

from __future__ import annotations

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
