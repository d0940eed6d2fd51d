"""A server of the synthetic character without physics: it answers commands and publishes what a test tells it to."""

from __future__ import annotations

import math
import threading

from client_support import synthetic
from layfigure import messages
from layfigure.bus import Bus
from layfigure.protocol import (
    CHARACTER_CHANNEL,
    COMMAND_CHANNEL,
    FORCE_CHANNEL,
    MESH_CHANNEL,
    POINTER_CHANNEL,
    POSE_CHANNEL,
    PROTOCOL_VERSION,
    REPLY_CHANNEL,
    STATUS_CHANNEL,
)


class ScriptedServer:
    """Lives on `bus`: one that is shared with the client (memq), or its own (a broker) with serve() on a thread."""

    def __init__(
        self,
        bus: Bus,
        clock: str = "realtime",
        server_id: int = synthetic.SERVER_ID,
        content_hash: int = synthetic.CONTENT_HASH,
    ) -> None:
        self.bus = bus
        self.clock = clock
        self.server_id = server_id
        self.content_hash = content_hash
        self.steps = 0
        self.poses = 0
        self.time_us = 0  # of replies
        self.commands: list = []  # every command_t that came, repeated ones too
        self.pointers: list = []  # every pointer_t that came
        self.refusals: dict[str, str] = {}  # by command: the reason
        self.devices: dict[int, str] = {}  # by their pointers: names of what moves these
        self.unanswered = 0  # so many commands are left without a reply
        self.lost_answers = 0  # so many commands `get_character` are answered without the pose
        self.lost_chunks: set[int] = set()  # sent only when asked for by number
        self._stop = threading.Event()
        bus.subscribe(COMMAND_CHANNEL, self._on_command)
        bus.subscribe(POINTER_CHANNEL, lambda data: self.pointers.append(messages.pointer_t.decode(data)))

    def command_names(self) -> list[str]:
        return [command.name for command in self.commands]

    def serve(self) -> threading.Thread:
        """Handles commands and sends heartbeats on a thread of its own until stop()."""
        thread = threading.Thread(target=self._serve, daemon=True)
        thread.start()
        return thread

    def stop(self) -> None:
        self._stop.set()

    def publish_pose(self, sequence: int) -> None:
        self.bus.publish(POSE_CHANNEL, synthetic.pose_message(sequence, self.server_id, self.content_hash).encode())
        self.bus.publish(FORCE_CHANNEL, synthetic.force_message(sequence, self.server_id).encode())

    def publish_poses(self, count: int) -> None:
        for _ in range(count):
            self.publish_pose(self.poses)
            self.poses += 1

    def publish_status(self, state: str = "running") -> None:
        message = synthetic.status_message(state, self.server_id, self.clock)
        message.devices = [synthetic.device_message(pointer, name) for pointer, name in self.devices.items()]
        message.device_count = len(message.devices)
        self.bus.publish(STATUS_CHANNEL, message.encode())

    def publish_character(self) -> None:
        message = synthetic.character_message(self.server_id, self.clock, self.content_hash)
        self.bus.publish(CHARACTER_CHANNEL, message.encode())

    def _serve(self) -> None:
        while not self._stop.is_set():
            self.publish_status()
            self.bus.poll(0.05)

    def _on_command(self, data: bytes) -> None:
        command = messages.command_t.decode(data)
        self.commands.append(command)
        if self.unanswered > 0:
            self.unanswered -= 1
            return
        reply = messages.reply_t()
        reply.protocol_version = PROTOCOL_VERSION
        reply.server_id = self.server_id
        reply.time_us = self.time_us
        reply.client_id, reply.sequence = command.client_id, command.sequence
        reply.reason = self.refusals.get(command.name, "")
        reply.accepted = not reply.reason
        if reply.accepted:
            reply.results = self._carry_out(command)
            reply.result_count = len(reply.results)
        self.bus.publish(REPLY_CHANNEL, reply.encode())

    def _carry_out(self, command) -> list:
        given = {argument.name: argument for argument in command.arguments}
        if command.name == "get_character":
            self.publish_character()
            self.publish_status()
            if self.lost_answers > 0:
                self.lost_answers -= 1
            elif self.poses > 0:
                self.publish_pose(self.poses - 1)
        elif command.name == "get_mesh":
            self._publish_mesh(given)
        elif command.name == "grab":
            return [_result("joint", [2.0]), _result("position", [1.0, 2.0, 3.0])]
        elif command.name == "pin":
            return [_result("pin", [7.0])]
        elif command.name == "key":
            return [_result("time_us", [0.0]), _result("pose", [float(self.poses - 1)])]
        elif command.name == "step":
            self._advance(int(given["count"].values[0]))
            return [_result("steps", [float(self.steps)])]
        return []

    def _publish_mesh(self, given: dict) -> None:
        wanted = set(map(int, given["chunks"].values)) if "chunks" in given else None
        for chunk in synthetic.chunk_messages(server_id=self.server_id, content_hash=self.content_hash):
            if chunk.index in wanted if wanted is not None else chunk.index not in self.lost_chunks:
                self.bus.publish(MESH_CHANNEL, chunk.encode())

    def _advance(self, count: int) -> None:
        self.steps += count
        while math.ceil(self.poses * synthetic.PHYSICS_HZ / synthetic.POSE_HZ) <= self.steps:
            self.publish_poses(1)


def _result(name: str, values: list[float]):
    result = messages.argument_t()
    result.name, result.values, result.value_count = name, values, len(values)
    return result
