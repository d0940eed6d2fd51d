"""Event logs of the synthetic character, as a recorder writes them."""

from __future__ import annotations

from pathlib import Path

from client_support import synthetic
from layfigure.bus import Event, EventLogWriter
from layfigure.protocol import CHARACTER_CHANNEL, FORCE_CHANNEL, MESH_CHANNEL, POSE_CHANNEL, STATUS_CHANNEL


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
