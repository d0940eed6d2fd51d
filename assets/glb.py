"""Writes one skinned character as a binary glTF 2.0 file (.glb).

Positions are metres in glTF's axes: right-handed, Y up, the character looking along +Z. The same character gives the
same bytes each time.
"""

from __future__ import annotations

import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pygltflib  # type: ignore[import-untyped]

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

INFLUENCES = 4  # per vertex: one JOINTS_0 / WEIGHTS_0 pair of glTF


@dataclass(frozen=True)
class Bone:
    """A bone and its frame, which is both its bind and its rest pose."""

    name: str
    parent: int  # index of an earlier bone, -1 for a root
    frame: Array  # (4, 4), bone -> world, rotation and translation only


@dataclass(frozen=True)
class Mesh:
    """A skinned triangle mesh in its bind pose."""

    name: str
    color: tuple[float, float, float]  # linear RGB in 0..1
    points: Array  # (n, 3)
    triangles: Indices  # (m, 3), counter-clockwise seen from outside
    weights: Array  # (n, bones), each row with a positive sum


def rigid(rotation: Array, translation: Array) -> Array:
    """The 4x4 frame of a rotation matrix and a translation."""
    frame = np.eye(4)
    frame[:3, :3] = rotation
    frame[:3, 3] = translation
    return frame


def write_glb(path: Path, name: str, bones: list[Bone], meshes: list[Mesh]) -> None:
    """Writes the character to `path`, whole or not at all.

    Raises ValueError if a vertex has no weight, OSError if the file cannot be written.
    """
    builder = _Builder()
    gltf = builder.gltf
    bone_nodes = [builder.add_bone(bones, index) for index in range(len(bones))]
    skin = builder.add_skin(name, bones, bone_nodes)
    roots = [node for index, node in enumerate(bone_nodes) if bones[index].parent < 0]
    mesh_nodes = [builder.add_mesh(mesh, skin) for mesh in meshes]
    gltf.scenes = [pygltflib.Scene(name=name, nodes=roots + mesh_nodes)]
    gltf.scene = 0
    builder.finish()
    _write_whole(path, b"".join(gltf.save_to_bytes()))


def four_heaviest(weights: Array) -> tuple[Indices, Array]:
    """The four heaviest bones of each vertex, heaviest first, and their weights, normalised."""
    order = np.argsort(-weights, axis=1, kind="stable")[:, :INFLUENCES]
    kept = np.take_along_axis(weights, order, axis=1)
    padding = ((0, 0), (0, INFLUENCES - kept.shape[1]))
    order, kept = np.pad(order, padding), np.pad(kept, padding)
    total = kept.sum(axis=1, keepdims=True)
    if not np.all(total > 0.0):
        raise ValueError(f"vertex {int(np.argmin(total))} has no weight")
    return np.where(kept > 0.0, order, 0), kept / total


def vertex_normals(points: Array, triangles: Indices) -> Array:
    """Unit normals: the mean of the adjoining triangles', weighted by their areas."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    areas = np.cross(b - a, c - a)
    normals = np.zeros_like(points)
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], areas)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    up = np.array([0.0, 1.0, 0.0])
    return np.where(length > 0.0, normals / np.where(length > 0.0, length, 1.0), up)


def quaternion(rotation: Array) -> list[float]:
    """The unit quaternion x, y, z, w (glTF's order) of a rotation matrix, w >= 0."""
    # The eigenvector of the largest eigenvalue (Bar-Itzhack 2000): no case distinctions, exact to rounding.
    r = rotation
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
            [0.0, r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
            [0.0, 0.0, r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
            [0.0, 0.0, 0.0, r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    q = np.linalg.eigh(k, UPLO="U")[1][:, -1]
    return [float(value) for value in (q if q[3] >= 0.0 else -q)]


class _Builder:
    """Collects nodes and binary data of one glTF file."""

    def __init__(self) -> None:
        self.gltf = pygltflib.GLTF2()
        self._blob = bytearray()

    def add_bone(self, bones: list[Bone], index: int) -> int:
        bone = bones[index]
        parent = bones[bone.parent].frame if bone.parent >= 0 else np.eye(4)
        local = np.linalg.inv(parent) @ bone.frame
        children = [child for child, other in enumerate(bones) if other.parent == index]
        node = pygltflib.Node(
            name=bone.name,
            translation=[float(value) for value in local[:3, 3]],
            rotation=quaternion(local[:3, :3]),
            children=children,
        )
        self.gltf.nodes.append(node)  # bones come first, so that node indices are bone indices
        return index

    def add_skin(self, name: str, bones: list[Bone], nodes: list[int]) -> int:
        # glTF matrices are column-major.
        inverse_binds = np.array([np.linalg.inv(bone.frame).T for bone in bones], dtype="<f4")
        inverse_binds[:, :3, 3] = 0.0
        inverse_binds[:, 3, 3] = 1.0
        accessor = self._add_array(inverse_binds.reshape(-1, 16), pygltflib.MAT4)
        self.gltf.skins.append(pygltflib.Skin(name=name, joints=nodes, inverseBindMatrices=accessor))
        return len(self.gltf.skins) - 1

    def add_mesh(self, mesh: Mesh, skin: int) -> int:
        joints, weights = four_heaviest(mesh.weights)
        attributes = pygltflib.Attributes(
            POSITION=self._add_array(mesh.points.astype("<f4"), pygltflib.VEC3, bounds=True),
            NORMAL=self._add_array(vertex_normals(mesh.points, mesh.triangles).astype("<f4"), pygltflib.VEC3),
            JOINTS_0=self._add_array(joints.astype("<u2"), pygltflib.VEC4),
            WEIGHTS_0=self._add_array(weights.astype("<f4"), pygltflib.VEC4),
        )
        indices = self._add_array(mesh.triangles.astype("<u4").reshape(-1, 1), pygltflib.SCALAR, indices=True)
        primitive = pygltflib.Primitive(
            attributes=attributes, indices=indices, material=self._add_material(mesh), mode=pygltflib.TRIANGLES
        )
        self.gltf.meshes.append(pygltflib.Mesh(name=mesh.name, primitives=[primitive]))
        self.gltf.nodes.append(pygltflib.Node(name=mesh.name, mesh=len(self.gltf.meshes) - 1, skin=skin))
        return len(self.gltf.nodes) - 1

    def finish(self) -> None:
        self.gltf.buffers = [pygltflib.Buffer(byteLength=len(self._blob))]
        self.gltf.set_binary_blob(bytes(self._blob))

    def _add_material(self, mesh: Mesh) -> int:
        surface = pygltflib.PbrMetallicRoughness(
            baseColorFactor=[*mesh.color, 1.0], metallicFactor=0.0, roughnessFactor=0.7
        )
        self.gltf.materials.append(pygltflib.Material(name=mesh.name, pbrMetallicRoughness=surface, alphaCutoff=None))
        return len(self.gltf.materials) - 1

    def _add_array(
        self, values: npt.NDArray[np.generic], kind: str, *, bounds: bool = False, indices: bool = False
    ) -> int:
        self._blob.extend(b"\0" * (-len(self._blob) % 4))  # accessors are aligned to their component's size
        data = values.tobytes()
        target = pygltflib.ELEMENT_ARRAY_BUFFER if indices else pygltflib.ARRAY_BUFFER
        view = pygltflib.BufferView(
            buffer=0,
            byteOffset=len(self._blob),
            byteLength=len(data),
            target=None if kind == pygltflib.MAT4 else target,
        )
        self._blob.extend(data)
        self.gltf.bufferViews.append(view)
        accessor = pygltflib.Accessor(
            bufferView=len(self.gltf.bufferViews) - 1,
            componentType=_COMPONENT_TYPES[values.dtype.str],
            count=values.shape[0],
            type=kind,
            min=values.min(axis=0).tolist() if bounds else None,  # required for positions
            max=values.max(axis=0).tolist() if bounds else None,
        )
        self.gltf.accessors.append(accessor)
        return len(self.gltf.accessors) - 1


_COMPONENT_TYPES = {
    "<f4": pygltflib.FLOAT,
    "<u2": pygltflib.UNSIGNED_SHORT,
    "<u4": pygltflib.UNSIGNED_INT,
}


def _write_whole(path: Path, data: bytes) -> None:
    """Writes beside the file and renames, so that `path` never holds half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        temporary.chmod(0o644)
        temporary.replace(path)
    except BaseException:
        temporary.unlink()
        raise
