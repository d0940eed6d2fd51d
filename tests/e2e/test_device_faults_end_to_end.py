"""What becomes of a force when a device, its messages or the server fail while a hand holds the doll."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from e2e_support import LCM_DEVICE, TIMEOUT_S, load_lcm_device
from server_support.client import Client
from server_support.process import ServerProcess, StartServer

from layfigure import codec, messages
from layfigure.bus import Bus
from layfigure.errors import BusError
from layfigure.protocol import SPIDAR_COMMAND_CHANNEL, SPIDAR_STATE_CHANNEL, SpidarState

HOLDING = ("--device", "lcm", "--physics-hz", 250, "--haptic-hz", 1000)
FORCE_LIMIT_N = 3.0 * (1.0 + 1e-12)  # what a server expects of a device that it knows nothing of


@pytest.fixture(scope="session")
def lcm_device() -> ModuleType:
    return load_lcm_device()


class WatchedDevice:
    """The example device in a thread; keeps the longest time after a command at which it still pushed."""

    def __init__(self, module: ModuleType, url: str) -> None:
        self._bus = Bus(url)
        self._device = module.Device(self._bus, "0")
        self.largest = 0.0  # of its force, N
        self.commands = 0
        self.held_on_s = 0.0
        self.lost = False
        self._last_command_s = time.monotonic()
        self._bus.subscribe(SPIDAR_COMMAND_CHANNEL, self._notice)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    @property
    def force(self) -> float:
        return float(np.linalg.norm(self._device.force))

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()
        self._bus.close()

    def _notice(self, _: bytes) -> None:
        self.commands += 1
        self._last_command_s = time.monotonic()

    def _run(self) -> None:
        begin = time.monotonic()
        while not self._stop.is_set():
            before = time.monotonic()
            try:
                self._device.tick(1e-3, before - begin)
            except BusError:
                self._device.let_go()
                self.lost = True
                return
            # A tick that began later than this after the last command must not leave a force.
            if self.force > 0.0:
                self.held_on_s = max(self.held_on_s, before - self._last_command_s)
            self.largest = max(self.largest, self.force)
            time.sleep(1e-3)


def wait_until(condition: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.01)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_device_whose_server_is_killed_lets_go_and_the_next_server_starts_well(
    binary: Path, character: Path, lcm_device: ModuleType
) -> None:
    port = free_port()
    command = [str(binary), str(character), "--broker", str(port), *map(str, HOLDING)]
    with ServerProcess(command) as server:
        device = WatchedDevice(lcm_device, server.url)
        try:
            Client(messages, server.url).accepted("grab", bone="hand.L")
            wait_until(lambda: device.force > 0.01, "the device does not feel what it holds")
            server.process.kill()
            server.process.wait(TIMEOUT_S)
            wait_until(lambda: device.force == 0.0, "the device holds on")
            time.sleep(10 * lcm_device.WATCHDOG_S)
            assert device.force == 0.0
            print(f"server killed: no force {1e3 * device.held_on_s:.1f} ms after the last command, and one tick")
            assert device.held_on_s <= lcm_device.WATCHDOG_S
        finally:
            device.stop()
    with ServerProcess(command) as server:
        again = WatchedDevice(lcm_device, server.url)
        try:
            client = Client(messages, server.url)
            status = client.wait_for("status_t", lambda status: status.devices[0].state == "ok")
            assert status.state == "running"
            pose = client.wait_for("pose_t")
            assert np.isfinite(pose.rotations).all()
            np.testing.assert_allclose(np.linalg.norm(pose.rotations, axis=1), 1.0, atol=1e-6)
            assert not np.any(pose.yielded)
        finally:
            again.stop()


def test_device_process_that_is_killed_is_missed_and_another_takes_its_place(
    start_server: StartServer,
) -> None:
    server = start_server(*HOLDING)
    client = Client(messages, server.url)

    def start() -> subprocess.Popen[str]:
        process = subprocess.Popen(
            [sys.executable, LCM_DEVICE, "--lcm-url", server.url], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        assert "telling where" in process.stdout.readline()
        return process

    process = start()
    try:
        client.wait_for("status_t", lambda status: status.devices[0].share > 0.0)
        client.accepted("grab", bone="hand.L")
        client.wait_for("force_t", lambda force: np.linalg.norm(force.hand_force) > 0.01)
        process.kill()
        process.communicate()
        seen = len(client.received["status_t"])
        gone = client.wait_for("status_t", lambda status: status.devices[0].state == "silent")
        assert gone.devices[0].share == 0.0
        assert gone.state == "running"
        assert np.isfinite(client.received["pose_t"][-1].rotations).all()
        del client.received["status_t"][:seen]
        process = start()
        client.wait_for("status_t", lambda status: status.devices[0].state == "ok" and status.devices[0].share > 0.0)
        assert client.received["status_t"][-1].devices[0].faults >= 1
    finally:
        process.kill()
        process.communicate()


class Grip:
    """A device of the test's own: tells what it is told to, keeps the commands with the time at which they came."""

    def __init__(self, url: str) -> None:
        self.forces: list[tuple[float, float]] = []  # seconds, newtons
        self.position = np.zeros(3)
        self.silent = False
        self._bus = Bus(url)
        self._bus.subscribe(SPIDAR_COMMAND_CHANNEL, self._receive)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()
        self._bus.close()

    def _receive(self, data: bytes) -> None:
        command = codec.decode_spidar_command(data)
        self.forces.append((time.monotonic(), float(np.linalg.norm(command.force))))

    def _run(self) -> None:
        sequence = 0
        while not self._stop.is_set():
            sequence += 1
            if not self.silent:
                state = SpidarState(
                    time.time_ns() // 1000, "0", sequence, None, self.position, np.array([1.0, 0, 0, 0])
                )
                self._bus.publish(SPIDAR_STATE_CHANNEL, codec.encode_spidar_state(state))
            self._bus.poll(1e-3)


@pytest.mark.parametrize("fault", ["not finite", "lost messages", "jump"])
def test_fault_of_a_device_that_holds_takes_the_force_away_for_a_while(start_server: StartServer, fault: str) -> None:
    server = start_server(*HOLDING)
    client = Client(messages, server.url)
    grip = Grip(server.url)
    try:
        client.wait_for("status_t", lambda status: status.devices[0].state == "ok")
        client.accepted("grab", bone="hand.L")
        grip.position = np.array([0.0, 0.0, 0.01])
        wait_until(lambda: bool(grip.forces) and grip.forces[-1][1] > 0.01, "the device does not feel what it holds")
        good = grip.position
        before = len(grip.forces)
        begin_s = time.monotonic()
        if fault == "not finite":
            grip.position = np.array([np.nan, 0.0, 0.0])
        elif fault == "lost messages":
            grip.silent = True
        else:
            grip.position = np.array([0.5, 0.0, 0.0])
        wait_until(lambda: any(force == 0.0 for _, force in grip.forces[before:]), f"{fault}: the force stays")
        none_s = next(when for when, force in grip.forces[before:] if force == 0.0)
        print(f"{fault}: a command of no force came {1e3 * (none_s - begin_s):.1f} ms after it, by way of this process")
        if fault != "jump":
            time.sleep(0.05)
            assert grip.forces[-1][1] == 0.0, "as long as it lasts"
        grip.position = good
        grip.silent = False
        wait_until(lambda: grip.forces[-1][1] > 0.01, "the force does not come back")
        assert max(force for _, force in grip.forces) <= FORCE_LIMIT_N
        assert np.isfinite(client.received["pose_t"][-1].rotations).all()
    finally:
        grip.stop()
