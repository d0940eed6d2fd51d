"""Reads glTF with pygltflib and poses its skins by the format's description alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pygltflib

from client_support import synthetic
from layfigure.protocol import Floats

_TYPES = {pygltflib.FLOAT: np.float32, pygltflib.UNSIGNED_SHORT: np.uint16, pygltflib.UNSIGNED_INT: np.uint32}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class GltfFile:
    def __init__(self, path: Path) -> None:
        self.gltf: Any = pygltflib.GLTF2().load(str(path))
        self.gltf.convert_buffers(pygltflib.BufferFormat.BINARYBLOB)

    def values(self, accessor_index: int) -> Floats:
        accessor = self.gltf.accessors[accessor_index]
        view = self.gltf.bufferViews[accessor.bufferView]
        width = _WIDTHS[accessor.type]
        start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
        kind = np.dtype(_TYPES[accessor.componentType])
        assert start % kind.itemsize == 0
        raw = np.frombuffer(self.gltf.binary_blob(), kind, accessor.count * width, start)
        if accessor.min:
            np.testing.assert_allclose(raw.reshape(-1, width).min(axis=0), accessor.min)
            np.testing.assert_allclose(raw.reshape(-1, width).max(axis=0), accessor.max)
        return raw.reshape(accessor.count, width).astype(np.float64)

    def picture(self, index: int) -> bytes:
        """The file of a picture in the buffer."""
        view = self.gltf.bufferViews[self.gltf.images[index].bufferView]
        return bytes(self.gltf.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength])

    def times(self) -> Floats:
        return self.values(self.gltf.animations[0].samplers[0].input)[:, 0]

    def node_worlds(self, frame: int) -> list[Floats]:
        """(4, 4) of each node, at a key of the animation."""
        nodes = self.gltf.nodes
        parts = [
            [np.array(node.rotation or [0, 0, 0, 1.0]), np.array(node.translation or [0, 0, 0.0])] for node in nodes
        ]
        for channel in self.gltf.animations[0].channels:
            value = self.values(self.gltf.animations[0].samplers[channel.sampler].output)[frame]
            parts[channel.target.node][0 if channel.target.path == "rotation" else 1] = value
        worlds: dict[int, Floats] = {}

        def place(index: int, parent: Floats) -> None:
            x, y, z, w = parts[index][0]
            worlds[index] = parent @ synthetic.matrix(np.array([w, x, y, z]), parts[index][1])
            for child in nodes[index].children or []:
                place(child, worlds[index])

        for root in self.gltf.scenes[0].nodes:
            place(root, np.eye(4))
        return [worlds[index] for index in range(len(nodes))]

    def skinned(self, frame: int) -> dict[str, Floats]:
        """Vertices of each skinned mesh node in the world, Y up."""
        worlds = self.node_worlds(frame)
        posed = {}
        for node in self.gltf.nodes:
            if node.skin is not None:
                posed[node.name] = self._skin(node, worlds)
        return posed

    def _skin(self, node: Any, worlds: list[Floats]) -> Floats:
        skin = self.gltf.skins[node.skin]
        inverse_binds = self.values(skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
        motions = np.array([worlds[joint] @ bind for joint, bind in zip(skin.joints, inverse_binds, strict=True)])
        attributes = self.gltf.meshes[node.mesh].primitives[0].attributes
        points = self.values(attributes.POSITION)
        ones = np.column_stack([points, np.ones(len(points))])
        blended, total, group = np.zeros((len(points), 3)), np.zeros(len(points)), 0
        while (joints := getattr(attributes, f"JOINTS_{group}", None)) is not None:
            indices = self.values(joints).astype(int)
            weights = self.values(getattr(attributes, f"WEIGHTS_{group}"))
            blended += np.einsum("vk,vkij,vj->vi", weights, motions[indices], ones)[:, :3]
            total += weights.sum(axis=1)
            group += 1
        np.testing.assert_allclose(total, 1.0, atol=1e-6)
        return blended
