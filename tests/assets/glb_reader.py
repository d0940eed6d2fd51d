"""Reads back what glb.py wrote, independently of it: JSON and bytes only."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

_TYPES = {5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COMPONENTS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass(frozen=True)
class Glb:
    json: dict[str, Any]
    data: bytes

    def array(self, accessor: int) -> Any:
        entry = self.json["accessors"][accessor]
        view = self.json["bufferViews"][entry["bufferView"]]
        components = _COMPONENTS[entry["type"]]
        count = entry["count"] * components
        values = np.frombuffer(self.data, _TYPES[entry["componentType"]], count, view["byteOffset"])
        return values.reshape(-1, components)

    def world_of_nodes(self) -> list[Any]:
        world: list[Any] = [None] * len(self.json["nodes"])
        pending = [(root, np.eye(4)) for root in self.json["scenes"][0]["nodes"]]
        while pending:
            index, parent = pending.pop()
            node = self.json["nodes"][index]
            local = np.eye(4)
            local[:3, :3] = _matrix(*node.get("rotation", (0.0, 0.0, 0.0, 1.0)))
            local[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
            world[index] = parent @ local
            pending += [(child, world[index]) for child in node.get("children", [])]
        return world


def read_glb(path: Path) -> Glb:
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    json_length, json_kind = struct.unpack_from("<I4s", data, 12)
    assert json_kind == b"JSON"
    return Glb(json.loads(data[20 : 20 + json_length]), data[28 + json_length :])


def _matrix(x: float, y: float, z: float, w: float) -> Any:
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
