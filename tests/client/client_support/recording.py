"""`layfigure record` as a process, with a scripted server."""

from __future__ import annotations

import resource
import signal
import subprocess
import time
from pathlib import Path

from client_support.broker import Broker
from client_support.cli import cli_command, cli_environment
from client_support.scripted_server import ScriptedServer
from layfigure.bus import Bus, read_events
from layfigure.protocol import POSE_CHANNEL

WAIT_S = 30.0


def wait_for_poses(log: Path, count: int) -> None:
    deadline = time.monotonic() + WAIT_S
    while sum(event.channel == POSE_CHANNEL for event in read_events(log)) < count:
        assert time.monotonic() < deadline, "the poses did not arrive"
        time.sleep(0.02)


class Recording:
    """`layfigure record` as a process, with a scripted server on the same broker."""

    def __init__(
        self,
        folder: Path,
        broker: Broker,
        *options: str,
        out: str = "take.usda",
        largest_file: int = resource.RLIM_INFINITY,
    ) -> None:
        self.server = ScriptedServer(Bus(broker.url))
        self._serving = self.server.serve()
        self._publisher = ScriptedServer(Bus(broker.url))  # a thread may use only its own bus
        self._publisher.bus._handlers.clear()
        self.process = subprocess.Popen(
            cli_command("record", out, "--lcm-url", broker.url, *options),
            cwd=folder,
            env=cli_environment(),
            stdin=subprocess.PIPE,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file)),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.first_line = self._first_line()

    def _first_line(self) -> str:
        assert self.process.stderr is not None
        return self.process.stderr.readline()

    def publish(self, poses: int, log: Path) -> None:
        """Returns when the recorder's log holds all of them."""
        self._publisher.publish_poses(poses)
        wait_for_poses(log, self._publisher.poses)

    def finish(self, number: int | None = signal.SIGINT) -> tuple[int, str, str]:
        if number is not None:
            self.process.send_signal(number)
        output, errors = self.process.communicate(timeout=WAIT_S)
        return self.process.returncode, output, errors

    def throw_switch(self) -> str:
        """A line on the recorder's standard input; returns what it answers on stderr."""
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return self._first_line()

    def leave(self) -> None:
        self._publisher.publish_status("leaving")

    def end(self) -> None:
        self.server.stop()
        self._serving.join(WAIT_S)
        if self.process.poll() is None:
            self.process.kill()
        self.process.communicate()
