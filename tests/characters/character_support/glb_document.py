"""Binary glTF files from documents that a sound writer would not write."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

Json = dict[str, Any]


def write_glb(path: Path, document: Json, data: bytes = b"") -> Path:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if data:
        chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def triangle(nodes: list[Json], joints: list[int]) -> tuple[Json, bytes]:
    """One triangle at node 0, skinned to the first of `joints`, whose binds are the identity."""
    positions = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    weights = struct.pack("<12f", *[1, 0, 0, 0] * 3)
    binds = struct.pack("<16f", *[float(k % 5 == 0) for k in range(16)]) * len(joints)
    data = positions + weights + bytes(12) + binds
    views = [(0, 36), (36, 48), (84, 12), (96, len(binds))]
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "WEIGHTS_0": 1, "JOINTS_0": 2}}]}],
        "skins": [{"joints": joints, "inverseBindMatrices": 3}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": length} for at, length in views],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC4"},
            {"bufferView": 2, "componentType": 5121, "count": 3, "type": "VEC4"},
            {"bufferView": 3, "componentType": 5126, "count": len(joints), "type": "MAT4"},
        ],
    }, data
