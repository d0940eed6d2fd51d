"""Stands for a haptic device: a worked example of a process that drives one over LCM.

    layfigure-server CHARACTER --broker 7700 --device lcm           # takes the device in
    python assets/lcm_device.py --lcm-url tcpq://127.0.0.1:7700     # is the device
    layfigure-device-check lcm --lcm-url tcpq://127.0.0.1:7700      # tries it instead

A driver of a real device takes the place of `Grip`: it measures a pose (or the lengths of a SPIDAR's strings), exerts
forces, and lets go by itself when no command comes for 10 ms. This one has a grip of its own: a mass on a spring and
damper to a hand that goes round in a circle.
"""

from __future__ import annotations

import argparse
import math
import time

import numpy as np

from layfigure import codec
from layfigure.bus import Bus, default_url
from layfigure.errors import BusError
from layfigure.protocol import SPIDAR_COMMAND_CHANNEL, SPIDAR_STATE_CHANNEL, Floats, SpidarCommand, SpidarState

RATE_HZ = 1000.0
MAX_FORCE_N = 3.0  # what a server expects of a device that it knows nothing of
WATCHDOG_S = 0.010  # without a command it lets go
MASS, STIFFNESS, DAMPING = 0.6, 135.0, 12.0  # of a hand that holds a grip: kg, N/m, N s/m
CIRCLE_M, CIRCLE_HZ = 0.02, 0.5
RETRY_S = 1.0


def _cut(force: Floats) -> Floats:
    """What the device can do of a force."""
    size = float(np.linalg.norm(force))
    return force if size <= MAX_FORCE_N else force * (MAX_FORCE_N / size)


class Grip:
    """Where the grip is, and what pushes it."""

    def __init__(self) -> None:
        self.position = np.zeros(3)
        self.velocity = np.zeros(3)

    def advance(self, dt: float, time_s: float, force: Floats) -> None:
        phase = 2.0 * math.pi * CIRCLE_HZ * time_s
        wanted = CIRCLE_M * np.array([math.sin(phase), 0.0, 1.0 - math.cos(phase)])
        pull = STIFFNESS * (wanted - self.position) - DAMPING * self.velocity
        self.velocity = self.velocity + dt / MASS * (pull + force)
        self.position = self.position + dt * self.velocity


class Device:
    def __init__(self, bus: Bus, device_id: str) -> None:
        self._bus = bus
        self._id = device_id
        self._grip = Grip()
        self._sequence = 0
        self._force = np.zeros(3)
        self._last_command_s = -math.inf
        bus.subscribe(SPIDAR_COMMAND_CHANNEL, self._receive)

    def _receive(self, data: bytes) -> None:
        command: SpidarCommand = codec.decode_spidar_command(data)
        if command.device_id != self._id:
            return
        self._force = _cut(command.force) if command.active else np.zeros(3)
        self._last_command_s = time.monotonic()

    @property
    def force(self) -> Floats:
        """What it exerts on the hand."""
        return self._force

    def let_go(self) -> None:
        self._force = np.zeros(3)

    def tick(self, dt: float, time_s: float) -> None:
        """Takes in what has come, lets time pass, tells where the grip is."""
        self._bus.poll(0.0)
        if time.monotonic() - self._last_command_s > WATCHDOG_S:
            self.let_go()
        self._grip.advance(dt, time_s, self._force)
        self._sequence += 1
        state = SpidarState(
            time_us=time.time_ns() // 1000,
            device_id=self._id,
            sequence=self._sequence,
            position=self._grip.position,
            rotation=np.array([1.0, 0.0, 0.0, 0.0]),
        )
        self._bus.publish(SPIDAR_STATE_CHANNEL, codec.encode_spidar_state(state))


def run(device: Device, bus: Bus, seconds: float) -> None:
    """At RATE_HZ, as well as the machine keeps it; connects again when the server has gone and come back."""
    begin = last = time.monotonic()
    due = begin
    while last - begin < seconds:
        try:
            now = time.monotonic()
            device.tick(min(now - last, 2.0 / RATE_HZ), now - begin)
            last = now
            due = max(due + 1.0 / RATE_HZ, now)
            time.sleep(max(0.0, due - time.monotonic()))
        except BusError:
            device.let_go()  # nobody is left who could tell it to
            time.sleep(RETRY_S)
            reconnect(bus)
            last = time.monotonic()


def reconnect(bus: Bus) -> None:
    try:
        bus.connect()
    except BusError as error:
        print(f"lcm_device: {error}; trying again", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description="A haptic device that is not there, over LCM.")
    parser.add_argument("--lcm-url", default=default_url())
    parser.add_argument("--channel-prefix", default="")
    parser.add_argument("--device-id", default="0", help="as the server's --device-config says; without one, 0, 1, ..")
    parser.add_argument("--seconds", type=float, default=math.inf)
    arguments = parser.parse_args()
    try:
        with Bus(arguments.lcm_url, arguments.channel_prefix) as bus:
            print(f"lcm_device: telling where device '{arguments.device_id}' is, Ctrl-C ends", flush=True)
            run(Device(bus, arguments.device_id), bus, arguments.seconds)
    except BusError as error:
        raise SystemExit(f"lcm_device: {error}") from error
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
