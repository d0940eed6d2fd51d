"""Event logs of the synthetic character, as a recorder writes them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from client_support import synthetic
from layfigure.bus import Event, EventLogWriter
from layfigure.protocol import CHARACTER_CHANNEL, FORCE_CHANNEL, MESH_CHANNEL, POSE_CHANNEL, STATUS_CHANNEL


def write_log_of_servers(path: Path, server_ids: Sequence[int], poses: int) -> None:
    """As of a logger that hears a bus with several servers: they speak in turn."""
    log = EventLogWriter(path)
    for server_id in server_ids:
        log.write(Event(1, CHARACTER_CHANNEL, synthetic.character_message(server_id).encode()))
        for chunk in synthetic.chunk_messages(server_id=server_id):
            log.write(Event(2, MESH_CHANNEL, chunk.encode()))
    for sequence in range(poses):
        for server_id in server_ids:
            log.write(Event(3 + sequence, POSE_CHANNEL, synthetic.pose_message(sequence, server_id).encode()))
            log.write(Event(3 + sequence, FORCE_CHANNEL, synthetic.force_message(sequence, server_id).encode()))
    log.close()


def write_log(path: Path, poses: int) -> None:
    log = EventLogWriter(path)
    log.write(Event(1, CHARACTER_CHANNEL, synthetic.character_message().encode()))
    for chunk in synthetic.chunk_messages():
        log.write(Event(2, MESH_CHANNEL, chunk.encode()))
    log.write(Event(3, STATUS_CHANNEL, synthetic.status_message().encode()))
    for sequence in range(poses):
        log.write(Event(4 + sequence, POSE_CHANNEL, synthetic.pose_message(sequence).encode()))
        log.write(Event(4 + sequence, FORCE_CHANNEL, synthetic.force_message(sequence).encode()))
    log.close()
