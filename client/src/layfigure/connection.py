"""Commands and pointer poses to a server, and the character it answers with."""

from __future__ import annotations

import os
import secrets
import time
from collections.abc import Callable

import numpy as np

from layfigure import codec
from layfigure.bus import Bus, TimeLimit
from layfigure.errors import NoReplyError, RefusedError
from layfigure.mesh_assembly import MeshAssembly
from layfigure.protocol import (
    CHARACTER_CHANNEL,
    COMMAND_CHANNEL,
    MESH_CHANNEL,
    POINTER_CHANNEL,
    REPLY_CHANNEL,
    STATUS_CHANNEL,
    Argument,
    Character,
    Command,
    Floats,
    Mesh,
    Pointer,
    Reply,
    Status,
)
from layfigure.servers import CONFIRMED_AFTER_S, ServerWatch

RESEND_AFTER_S = 0.5
REPLY_TIMEOUT_S = 5.0
MESH_TIMEOUT_S = 20.0
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


class Connection:
    """One client of the server on `bus`, to which it addresses all that it sends once it has heard or chosen it.

    Its id is new for every connection, so that two clients are told apart.
    """

    def __init__(self, bus: Bus) -> None:
        self.bus = bus
        self.client_id = f"layfigure-{os.getpid()}-{secrets.token_hex(4)}"
        self._command_sequence = 0
        self._pointer_sequence = 0
        self._pending: PendingReply | None = None  # the newest
        self._character: Character | None = None
        self._assembly: MeshAssembly | None = None
        self.watch = ServerWatch(bus.server_id)
        self.status: Status | None = None  # the newest heartbeat
        bus.subscribe(REPLY_CHANNEL, self._on_reply)
        bus.subscribe(CHARACTER_CHANNEL, self._on_character)
        bus.subscribe(MESH_CHANNEL, self._on_mesh_chunk)
        bus.subscribe(STATUS_CHANNEL, self._on_status)

    def command(self, name: str, *arguments: Argument, timeout_s: float = REPLY_TIMEOUT_S) -> Reply:
        """Sends a command until it is answered: it carries its sequence number, so it is carried out once.

        Raises RefusedError with the server's reason, or NoReplyError after `timeout_s`, see TimeLimit.
        """
        reply = self.ask(name, *arguments, timeout_s=timeout_s)
        if not reply.accepted:
            raise RefusedError(reply.reason)
        return reply

    def ask(self, name: str, *arguments: Argument, timeout_s: float = REPLY_TIMEOUT_S) -> Reply:
        """As command(), but a refusal is a reply as well."""
        pending = self.begin(name, *arguments, timeout_s=timeout_s)
        while pending.reply is None:
            pending.send_if_due()
            self.bus.wait_until(lambda: pending.reply is not None or pending.due_in_s <= 0.0, pending.due_in_s)
        return pending.reply

    def begin(self, name: str, *arguments: Argument, timeout_s: float = REPLY_TIMEOUT_S) -> PendingReply:
        """A command that does not wait: the caller handles messages, and calls send_if_due(), until it has its reply.

        A connection has one command at a time: the next one may begin when this one is answered or given up.
        """
        self._command_sequence += 1
        self._pending = PendingReply(self, self._command_sequence, name, arguments, timeout_s)
        return self._pending

    def send_pointer(self, pointer: int, position: Floats, rotation: Floats = IDENTITY) -> int:
        """Says where a pointer is to be [m, world] and how it is turned; returns the message's sequence number."""
        self._pointer_sequence += 1
        message = Pointer(
            _wall_clock_us(),
            self.watch.current or 0,
            self.client_id,
            self._pointer_sequence,
            pointer,
            position,
            rotation,
        )
        self.bus.publish(POINTER_CHANNEL, codec.encode_pointer(message))
        return self._pointer_sequence

    def fetch_character(self, timeout_s: float = REPLY_TIMEOUT_S) -> Character:
        self._character = None
        self.command("get_character", timeout_s=timeout_s)
        if not self._wait_until(lambda: self._character is not None, TimeLimit(self.bus, timeout_s)):
            raise NoReplyError("the server accepted 'get_character' but sent no character it can be read from")
        assert self._character is not None
        return self._character

    def wait_for_pose(self, character: Character, has_come: Callable[[], bool], timeout_s: float) -> None:
        """The pose that answers `get_character`: where time stands still no other follows one that was lost."""
        limit = TimeLimit(self.bus, timeout_s)
        while not self.bus.wait_until(has_come, min(RESEND_AFTER_S, limit.remaining_s)):
            if limit.remaining_s == 0.0:
                raise NoReplyError(f"no pose of '{character.name}' arrived within {timeout_s:g} s")
            self.command("get_character", timeout_s=limit.remaining_s)

    def fetch_meshes(self, character: Character, timeout_s: float = MESH_TIMEOUT_S) -> tuple[Mesh, ...]:
        """The character's skinned meshes. Chunks that are lost on the way are asked for again."""
        self._assembly = assembly = MeshAssembly(character)
        limit = TimeLimit(self.bus, timeout_s)
        while limit.remaining_s > 0.0:
            missing = tuple(map(float, assembly.missing()))
            self.command("get_mesh", *([Argument("chunks", values=missing)] if missing else []))
            if self._wait_for_chunks(assembly, limit):
                return assembly.meshes()
        raise NoReplyError(f"the mesh of '{character.name}' did not arrive whole within {timeout_s:g} s")

    def _wait_for_chunks(self, assembly: MeshAssembly, limit: TimeLimit) -> bool:
        """True if it is complete, False if no chunk comes any more: what is on its way is not asked for again."""
        before = -1
        while before < assembly.chunk_count and limit.remaining_s > 0.0:
            before = assembly.chunk_count
            if self.bus.wait_until(lambda: assembly.complete, RESEND_AFTER_S):
                return True
        return False

    def newest_status(self) -> Status:
        """The newest heartbeat that was heard, else the next one."""
        return self.status if self.status is not None else self.wait_for_status()

    def wait_for_status(self, timeout_s: float = REPLY_TIMEOUT_S) -> Status:
        """The next heartbeat."""
        self.status = None
        if not self._wait_until(lambda: self.status is not None, TimeLimit(self.bus, timeout_s)):
            raise self.unheard("is heard", timeout_s)
        assert self.status is not None
        return self.status

    def _wait_until(self, condition: Callable[[], bool], limit: TimeLimit) -> bool:
        """Handles messages until `condition` holds; False if it does not within the limit."""
        while not self.bus.wait_until(condition, limit.remaining_s):
            if limit.remaining_s == 0.0:
                return False
        return True

    def listen_for_rivals(self) -> None:
        """Raises TwoServersError if a second server speaks on the bus, of which none was chosen."""
        if self.bus.server_id is None:
            self.bus.wait_until(lambda: False, CONFIRMED_AFTER_S)

    def unheard(self, what: str, timeout_s: float) -> NoReplyError:
        """The error of a server that has kept silent."""
        who, mend = "no server", "is layfigure-server running there?"
        if self.bus.server_id is not None:
            who = f"no server of the id {self.bus.server_id}"
            mend = "one that was started again has another id, which 'layfigure status' tells"
        if self.bus.problem:
            mend = f"what is said there cannot be read ({self.bus.problem}); use server and client of one version"
        return NoReplyError(f"{who} {what} on '{self.bus.url}' within {timeout_s:g} s: {mend}")

    def _on_reply(self, data: bytes) -> None:
        reply = codec.decode_reply(data)
        pending = self._pending
        if reply.client_id != self.client_id or pending is None or reply.sequence != pending.sequence:
            return
        self.watch.hear(reply.server_id)
        pending.reply = reply

    def _on_character(self, data: bytes) -> None:
        character = codec.decode_character(data)
        self.watch.hear(character.server_id)
        self._character = character

    def _on_status(self, data: bytes) -> None:
        status = codec.decode_status(data)
        self.watch.hear(status.server_id)
        self.status = status

    def _on_mesh_chunk(self, data: bytes) -> None:
        if self._assembly is not None:
            self._assembly.add(codec.decode_mesh_chunk(data))


class PendingReply:
    """A command on its way: sent until it is answered, to the server that is there, and carried out once.

    Made by Connection.begin(), for its thread.
    """

    def __init__(
        self, connection: Connection, sequence: int, name: str, arguments: tuple[Argument, ...], timeout_s: float
    ) -> None:
        self.sequence = sequence
        self.reply: Reply | None = None
        self._connection = connection
        self._name = name
        self._arguments = arguments
        self._time_us = _wall_clock_us()
        self._limit = TimeLimit(connection.bus, timeout_s)
        self._until_resend = TimeLimit(connection.bus, 0.0)
        self._sent_to: int | None = None  # 0: whichever server there is; None: not sent yet

    @property
    def due_in_s(self) -> float:
        """How long nothing but its answer has to be waited for; 0: call send_if_due()."""
        watch = self._connection.watch
        if self._sent_to is None or self._is_for_another(watch.current or 0):
            return min(watch.unconfirmed_s, self._limit.remaining_s)
        return min(self._until_resend.remaining_s, self._limit.remaining_s)

    def send_if_due(self) -> None:
        """Raises NoReplyError when the time is up, BusError if the connection is lost."""
        connection = self._connection
        if self.reply is not None or self.due_in_s > 0.0:
            return
        if self._limit.remaining_s == 0.0:
            raise connection.unheard(f"answered '{self._name}'", self._limit.seconds)
        server_id = connection.watch.current or 0
        command = Command(self._time_us, server_id, connection.client_id, self.sequence, self._name, self._arguments)
        connection.bus.publish(COMMAND_CHANNEL, codec.encode_command(command))
        self._sent_to = server_id
        self._until_resend = TimeLimit(connection.bus, RESEND_AFTER_S)

    def _is_for_another(self, server_id: int) -> bool:
        """The server that it was sent to has gone."""
        return self._sent_to not in (0, server_id)


def _wall_clock_us() -> int:
    return time.time_ns() // 1000
