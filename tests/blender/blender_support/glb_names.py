"""Gives the bones of a .glb other names, and nothing else."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from pathlib import Path

_HEADER = 12  # bytes: magic, version, length
_CHUNK = 8  # bytes: length, type


def rename_nodes(source: Path, names: Mapping[str, str], out: Path) -> None:
    data = source.read_bytes()
    length = struct.unpack_from("<I", data, _HEADER)[0]
    start = _HEADER + _CHUNK
    description = json.loads(data[start : start + length])
    for node in description["nodes"]:
        node["name"] = names.get(node.get("name", ""), node.get("name", ""))
    text = json.dumps(description).encode()
    text += b" " * (-len(text) % 4)
    rest = data[start + length :]
    size = start + len(text) + len(rest)
    out.write_bytes(struct.pack("<4sII", b"glTF", 2, size) + struct.pack("<I4s", len(text), b"JSON") + text + rest)
