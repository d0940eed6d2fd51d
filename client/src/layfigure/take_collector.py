"""From a server's messages to a take: the same for a bus that is listened to and for an event log that is read."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path

from layfigure import codec
from layfigure.bus import read_events
from layfigure.errors import LayfigureError, ProtocolError, SpillError, TwoServersError
from layfigure.mesh_assembly import MeshAssembly
from layfigure.protocol import (
    CHARACTER_CHANNEL,
    FORCE_CHANNEL,
    MESH_CHANNEL,
    POSE_CHANNEL,
    REPLY_CHANNEL,
    STATUS_CHANNEL,
    Character,
    Mesh,
)
from layfigure.servers import ServerWatch, concerns
from layfigure.take import Take, TakeBuilder


class TakeCollector:
    """The take begins when the first character that is heard and its meshes are whole; what comes earlier is not in it.

    feed() raises ProtocolError for a message that must be left out, TwoServersError when a second server speaks, and
    LayfigureError when the character changes: the take so far stays good.
    """

    def __init__(self, folder: Path | None = None) -> None:
        """`folder` is where the takes' poses are kept, else in that of temporary files."""
        self._folder = folder
        self.watch = ServerWatch()
        self.server_left = False
        self.character: Character | None = None
        self.meshes: tuple[Mesh, ...] = ()
        self.builder: TakeBuilder | None = None
        self._assembly: MeshAssembly | None = None
        self._readers: dict[str, Callable[[bytes], None]] = {
            CHARACTER_CHANNEL: self._feed_character,
            MESH_CHANNEL: self._feed_mesh_chunk,
            POSE_CHANNEL: self._feed_pose,
            FORCE_CHANNEL: self._feed_force,
            REPLY_CHANNEL: self._feed_reply,
            STATUS_CHANNEL: self._feed_status,
        }

    def feed(self, channel: str, data: bytes) -> None:
        """Takes the next message; those of other channels than these do not matter to a take."""
        if channel in self._readers:
            self._readers[channel](data)

    def begin_take(self) -> None:
        """Another take of the character that was heard begins; the one so far is let go."""
        assert self.character is not None
        self.builder = TakeBuilder(self.character, self.meshes, self._folder)

    def drop_rival(self) -> None:
        """After a TwoServersError: forgets what the second server has put in."""
        if self.builder is not None and self.builder.restarts > 0 and self.watch.current is not None:
            self.builder.drop_run(self.watch.current)

    def _feed_character(self, data: bytes) -> None:
        character = codec.decode_character(data)
        self.watch.hear(character.server_id)
        if self.character is None:
            self.character = character
            self._assembly = MeshAssembly(character)
        elif character.content_hash != self.character.content_hash:
            raise LayfigureError(
                f"the server changed the character to '{character.name}': the take of '{self.character.name}' ends "
                "here; start a new one"
            )

    def _feed_mesh_chunk(self, data: bytes) -> None:
        if self.character is None or self._assembly is None or self.builder is not None:
            return
        self._assembly.add(codec.decode_mesh_chunk(data))
        if self._assembly.complete:
            self.meshes = self._assembly.meshes()
            self.builder = TakeBuilder(self.character, self.meshes, self._folder)

    def _feed_pose(self, data: bytes) -> None:
        pose = codec.decode_pose(data)
        self.watch.hear(pose.server_id)
        if self.builder is not None:
            self.builder.add_pose(pose)

    def _feed_force(self, data: bytes) -> None:
        if self.builder is not None:
            self.builder.add_force(codec.decode_force(data))

    def _feed_reply(self, data: bytes) -> None:
        if self.builder is not None and (reply := codec.decode_reply(data)).marks_key:
            self.builder.add_mark(reply)

    def _feed_status(self, data: bytes) -> None:
        status = codec.decode_status(data)
        self.watch.hear(status.server_id)
        self.server_left = status.state == "leaving"
        if self.builder is not None:
            self.builder.add_status(status)


def read_take(
    path: str | os.PathLike[str],
    duration_s: float = math.inf,
    folder: Path | None = None,
    server: int | None = None,
) -> Take:
    """The take in an event log that a recorder wrote, also a cut-off one; up to the first pose at `duration_s`.

    `server` is the id of the one server whose take it is, where the log holds several, such as one of lcm-logger.

    Its poses are kept in a file in `folder`, else in that of temporary files, about as large as the log. Raises
    SpillError if there is no room for it, TwoServersError if the log holds several servers from its beginning.
    """
    collector = TakeCollector(folder)
    for event in read_events(Path(path)):
        if server is not None and not concerns(event.data, server):
            continue
        try:
            collector.feed(event.channel, event.data)
        except ProtocolError:
            continue
        except TwoServersError:
            collector.drop_rival()
            if collector.builder is None or collector.builder.pose_count == 0:
                raise
            break
        except SpillError:
            raise  # poses are left out for want of room: not the log's end
        except LayfigureError:
            break
    if collector.builder is None:
        whose = "" if server is None else f" of the server {server}"
        raise LayfigureError(f"'{path}' holds no whole character{whose}: is it a log of 'layfigure record'?")
    return collector.builder.build(duration_s)
