"""A client of the server that uses LCM and the generated types, nothing else."""

from __future__ import annotations

import itertools
import socket
import time
from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

import lcm

TIMEOUT_S = 30.0
POLL_MS = 50
TYPES = {
    "CHARACTER": "character_t",
    "MESH": "mesh_chunk_t",
    "POSE": "pose_t",
    "FORCE": "force_t",
    "REPLY": "reply_t",
    "STATUS": "status_t",
}
_client_numbers = itertools.count(1)

Values = float | Sequence[float] | str


class Client:
    """Collects what the server publishes, by type, and sends commands and pointers."""

    def __init__(self, messages: ModuleType, url: str, prefix: str = "") -> None:
        self.id = f"test-{next(_client_numbers)}"
        self.version = 1
        self.server_id = 0  # that is meant; 0: the only one
        self.timeout_s = TIMEOUT_S  # of every wait
        self._messages = messages
        self._prefix = prefix
        self._sequence = 0
        self._pointer_sequence = 0
        self._connected = True
        self.received: dict[str, list[Any]] = {name: [] for name in TYPES.values()}
        self._lcm = lcm.LCM(url)
        if url.startswith("tcpq://"):
            _set_no_delay(self._lcm.fileno())
        subscription = self._lcm.subscribe(f"{prefix}LAYFIGURE_.*", self._receive)
        subscription.set_queue_capacity(100_000)

    def send(self, name: str, /, **arguments: Values) -> None:
        """The next command, without waiting for its reply."""
        self._sequence += 1
        self.send_numbered(self._sequence, name, **arguments)

    def send_numbered(self, number: int, name: str, /, **arguments: Values) -> None:
        command = self._messages.command_t()
        command.protocol_version = self.version
        command.server_id = self.server_id
        command.client_id = self.id
        command.sequence = number
        command.name = name
        command.arguments = [self._argument(key, value) for key, value in arguments.items()]
        command.argument_count = len(command.arguments)
        self.publish("COMMAND", command.encode())

    def command(self, name: str, /, **arguments: Values) -> Any:
        """A command's reply."""
        self.send(name, **arguments)
        return self.wait_for("reply_t", lambda reply: (reply.client_id, reply.sequence) == (self.id, self._sequence))

    def accepted(self, name: str, /, **arguments: Values) -> dict[str, tuple[float, ...]]:
        """The results of a command that must be accepted."""
        reply = self.command(name, **arguments)
        assert reply.accepted, reply.reason
        return {result.name: tuple(result.values) for result in reply.results}

    def point(self, position: Sequence[float], pointer: int = 0) -> int:
        """Sends a pointer; returns the message's sequence number."""
        self._pointer_sequence += 1
        message = self._messages.pointer_t()
        message.protocol_version = self.version
        message.server_id = self.server_id
        message.client_id = self.id
        message.sequence = self._pointer_sequence
        message.pointer = pointer
        message.position = list(position)
        message.rotation = [1.0, 0.0, 0.0, 0.0]
        self.publish("POINTER", message.encode())
        return self._pointer_sequence

    def publish(self, channel: str, data: bytes) -> None:
        self._lcm.publish(f"{self._prefix}LAYFIGURE_{channel}", data)

    def wait_for(self, type_name: str, condition: Callable[[Any], bool] = lambda _: True) -> Any:
        """The first message, of those received already or to come, for which `condition` holds."""
        deadline = time.monotonic() + self.timeout_s
        looked_at = 0
        while True:
            messages = self.received[type_name]
            for message in messages[looked_at:]:
                if condition(message):
                    return message
            looked_at = len(messages)
            assert time.monotonic() < deadline, f"no such {type_name} came"
            assert self.poll(), f"no such {type_name} came before the server left"

    def poll(self) -> bool:
        """Receives for a moment; False once the connection is lost."""
        try:
            if self._connected:
                self._lcm.handle_timeout(POLL_MS)
        except OSError:
            self._connected = False
        return self._connected

    def close(self) -> None:
        """Disconnects now, and not when it is collected; nothing else can be done with it afterwards."""
        self._connected = False
        del self._lcm

    def drain(self) -> None:
        """Receives until the connection is lost."""
        deadline = time.monotonic() + TIMEOUT_S
        while self.poll():
            assert time.monotonic() < deadline, "the server does not leave"

    def _argument(self, name: str, value: Values) -> Any:
        argument = self._messages.argument_t()
        argument.name = name
        if isinstance(value, str):
            argument.text = value
        else:
            argument.values = [float(v) for v in (value if isinstance(value, Sequence) else [value])]
            argument.value_count = len(argument.values)
        return argument

    def _receive(self, channel: str, data: bytes) -> None:
        type_name = TYPES.get(channel.removeprefix(f"{self._prefix}LAYFIGURE_"))
        if type_name is not None:
            self.received[type_name].append(getattr(self._messages, type_name).decode(data))


def _set_no_delay(file_descriptor: int) -> None:
    connection = socket.socket(fileno=file_descriptor)
    try:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    finally:
        connection.detach()


Connect = Callable[..., Client]  # (server or URL, prefix)
