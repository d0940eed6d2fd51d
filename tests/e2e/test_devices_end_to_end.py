"""Haptic devices on the bus: the conformance test as a process on one side, a device's process on the other, and the
server's broker between them."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from e2e_support import LCM_DEVICE, REPOSITORY, TIMEOUT_S, load_lcm_device
from server_support.process import StartServer

from layfigure import codec
from layfigure.bus import Bus
from layfigure.protocol import SPIDAR_COMMAND_CHANNEL, SPIDAR_STATE_CHANNEL, SpidarCommand, SpidarState


@pytest.fixture(scope="session")
def check(binary: Path) -> Path:
    """layfigure-device-check, built beside the server."""
    path = binary.parents[1] / "device/layfigure-device-check"
    assert path.is_file(), f"no conformance test at {path}: build it"
    return path


@pytest.fixture
def broker(start_server: StartServer) -> str:
    """The URL of a server's broker."""
    return start_server().url


def run_check(check: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(check), *map(str, arguments)], capture_output=True, text=True, timeout=TIMEOUT_S, check=False
    )


class Peer:
    """A device's process in a thread: tells poses at about 1 kHz, keeps the commands."""

    def __init__(self, url: str, device_id: str) -> None:
        self.commands: list[SpidarCommand] = []
        self._id = device_id
        self._bus = Bus(url)
        self._bus.subscribe(
            SPIDAR_COMMAND_CHANNEL, lambda data: self.commands.append(codec.decode_spidar_command(data))
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def wait_for_silence(self, seconds: float = 0.5) -> None:
        """Until no command has come for so long: the driver has said its last word."""
        count = -1
        while len(self.commands) > count:
            count = len(self.commands)
            time.sleep(seconds)

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()
        self._bus.close()

    def _run(self) -> None:
        sequence = 0
        while not self._stop.is_set():
            sequence += 1
            state = SpidarState(time.time_ns() // 1000, self._id, sequence, None, np.zeros(3), np.array([1.0, 0, 0, 0]))
            self._bus.publish(SPIDAR_STATE_CHANNEL, codec.encode_spidar_state(state))
            self._bus.poll(1e-3)


def test_the_example_device_passes_the_conformance_test(broker: str, check: Path) -> None:
    device = subprocess.Popen([sys.executable, LCM_DEVICE, "--lcm-url", broker], stdout=subprocess.PIPE, text=True)
    try:
        assert device.stdout is not None
        assert "telling where device '0' is" in device.stdout.readline()
        result = run_check(check, "lcm", "--lcm-url", broker, "--seconds", "2")
        assert result.returncode == 0, result.stdout + result.stderr
        assert "ok      poses are finite" in result.stdout
        assert "FAILED" not in result.stdout
    finally:
        device.terminate()
        device.communicate()


def test_forces_reach_the_device_and_the_last_command_lets_go(broker: str, check: Path, tmp_path: Path) -> None:
    config = tmp_path / "left.toml"
    config.write_text('device_id = "left"\nmax_force = 2.0\nmax_torque = 0.05\n')
    peer = Peer(broker, "left")
    deadline = time.monotonic() + TIMEOUT_S
    try:
        while True:
            result = run_check(check, "lcm", "--lcm-url", broker, "--device-config", config, "--seconds", "1")
            assert "ok      it exerts the force asked for: 1 N" in result.stdout, result.stdout + result.stderr
            peer.wait_for_silence()
            forces = np.array([command.force for command in peer.commands])
            # It is asked for in one tick among many, and newest wins: a machine under load may pass over that tick.
            if (forces[:, 2] == 1.0).any() or time.monotonic() >= deadline:
                break
    finally:
        peer.stop()
    assert [command.device_id for command in peer.commands] == ["left"] * len(peer.commands)
    assert np.isfinite(forces).all()
    assert (forces[:, 2] == 1.0).any(), "half of the largest, on purpose"
    assert np.linalg.norm(forces, axis=1).max() <= 2.0 * (1.0 + 1e-12), "cut to what the device can do"
    assert any(command.state_sequence > 0 for command in peer.commands)
    # The last of each driver that was opened: it says so more than once.
    assert not peer.commands[-1].active
    assert not peer.commands[-1].force.any()


def test_no_device_there_fails_the_conformance_test(broker: str, check: Path) -> None:
    result = run_check(check, "lcm", "--lcm-url", broker, "--seconds", "0.2")
    assert result.returncode == 1
    assert "FAILED  a pose comes" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ((), 2, "DEVICE"),
        (("spidar-g6", "--seconds", "-1"), 2, "--seconds"),
        (("mouse",), 1, "--device mouse: expected none, spidar-g6"),
        (("/no/such.so",), 1, "there is no such plugin"),
        (("lcm", "--lcm-url", "tcpq://127.0.0.1:1"), 1, "cannot reach an LCM tcpq server"),
    ],
)
def test_wrong_use_is_one_line_and_an_exit_code(
    check: Path, arguments: tuple[str, ...], code: int, message: str
) -> None:
    result = run_check(check, *arguments)
    assert result.returncode == code
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


class SilentBus:
    """Takes what is published, hands over what it is told to."""

    def __init__(self) -> None:
        self.waiting: list[bytes] = []

    def subscribe(self, _channel: str, handler: object) -> None:
        self._handler = handler

    def poll(self, _timeout_s: float) -> None:
        while self.waiting:
            self._handler(self.waiting.pop())  # type: ignore[operator]

    def publish(self, _channel: str, data: bytes) -> None:
        self.last = data


def test_the_example_device_lets_go_when_commands_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    example = load_lcm_device()
    bus = SilentBus()
    device = example.Device(bus, "left")
    now = 100.0
    monkeypatch.setattr(example.time, "monotonic", lambda: now)
    from layfigure import messages

    command = messages.spidar_command_t.decode((REPOSITORY / "tests/data/golden/spidar_command_t.bin").read_bytes())
    command.force = [0.0, 0.0, 2.0]
    bus.waiting.append(command.encode())
    device.tick(1e-3, 0.0)
    assert device._force[2] == 2.0
    now += 0.009
    device.tick(1e-3, 0.0)
    assert device._force[2] == 2.0
    now += 0.002
    device.tick(1e-3, 0.0)
    assert not device._force.any()
    command.active = False
    bus.waiting.append(command.encode())
    device.tick(1e-3, 0.0)
    assert not device._force.any(), "a command that says let go"
    command.active, command.device_id = True, "right"
    bus.waiting.append(command.encode())
    device.tick(1e-3, 0.0)
    assert not device._force.any(), "a command for another device"


def test_the_example_without_a_bus_says_so_in_one_line() -> None:
    result = subprocess.run(
        [sys.executable, LCM_DEVICE, "--lcm-url", "tcpq://127.0.0.1:1"],
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
        env=dict(os.environ),
    )
    assert result.returncode == 1
    assert result.stderr.startswith("lcm_device: ")
    assert result.stderr.count("\n") == 1
