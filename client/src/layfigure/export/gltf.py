"""Writes glTF 2.0 through pygltflib: joints as nodes, skins, and one animation with a key in every frame."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from layfigure import rotation
from layfigure.errors import LayfigureError
from layfigure.export.clip import Clip, SkeletonClip
from layfigure.export.whole_file import write_whole
from layfigure.protocol import Floats
from layfigure.usd.character_layer import vertex_normals
from layfigure.usd.reader import BoundMesh

_GROUP = 4  # influences per vertex attribute: JOINTS_0, JOINTS_1, ...
_MAX_MATERIALS = 64  # of one mesh: more colours than that are a texture's, and their mean is taken
_STILL = 1e-7  # [m] a translation that changes by less is that of the node
_ROUGHNESS = 0.6
_ALIGNMENT = 4  # of an accessor in the buffer [bytes]


def write_gltf(clip: Clip, out: Path) -> None:
    """A .glb, or a .gltf with its buffer inside. Raises LayfigureError if it cannot be written."""
    builder = _Builder(clip)
    gltf = builder.build()
    if out.suffix == ".glb":
        write_whole(out, b"".join(gltf.save_to_bytes()))
        return
    gltf.convert_buffers(builder.lib.BufferFormat.DATAURI)
    write_whole(out, json.dumps(json.loads(gltf.to_json()), indent=1).encode())


class _Builder:
    def __init__(self, clip: Clip) -> None:
        try:
            import pygltflib
        except ImportError as error:
            raise LayfigureError("glTF cannot be written without pygltflib: pip install 'layfigure[export]'") from error
        self.lib: Any = pygltflib
        self._clip = clip
        self._gltf = pygltflib.GLTF2(asset=pygltflib.Asset(version="2.0", generator="layfigure"))
        self._data = bytearray()
        self._roots: list[int] = []

    def build(self) -> Any:
        lib, gltf = self.lib, self._gltf
        gltf.animations.append(lib.Animation(name=self._clip.name))
        times = self._add(np.arange(self._clip.frames) / self._clip.fps, lib.FLOAT, lib.SCALAR, with_bounds=True)
        skins = {skeleton.path: self._add_skeleton(skeleton, times) for skeleton in self._clip.skeletons}
        for mesh in self._clip.meshes:
            self._add_mesh(mesh, skins[mesh.skeleton])
        gltf.scenes.append(lib.Scene(nodes=self._roots))
        gltf.scene = 0
        gltf.buffers.append(lib.Buffer(byteLength=len(self._data)))
        gltf.set_binary_blob(bytes(self._data))
        return gltf

    def _add_skeleton(self, skeleton: SkeletonClip, times: int) -> int:
        """Returns the skin."""
        lib, gltf = self.lib, self._gltf
        first = len(gltf.nodes)
        quaternions = _quaternions(skeleton.local[..., :3, :3])
        translations = skeleton.local[..., :3, 3]
        for joint, name in enumerate(skeleton.names):
            children = [first + child for child, parent in enumerate(skeleton.parents) if parent == joint]
            gltf.nodes.append(
                lib.Node(
                    name=name,
                    children=children,
                    translation=translations[0, joint].tolist(),
                    rotation=quaternions[0, joint].tolist(),
                )
            )
            self._animate(first + joint, "rotation", times, quaternions[:, joint], lib.VEC4)
            if np.ptp(translations[:, joint], axis=0).max() > _STILL:
                self._animate(first + joint, "translation", times, translations[:, joint], lib.VEC3)
        self._roots += [first + joint for joint, parent in enumerate(skeleton.parents) if parent < 0]
        inverse_binds = np.linalg.inv(skeleton.bind).swapaxes(1, 2)  # glTF's matrices are stored by columns
        inverse_binds[:, :3, 3], inverse_binds[:, 3, 3] = 0.0, 1.0
        matrices = self._add(inverse_binds.reshape(-1, 16), lib.FLOAT, lib.MAT4)
        joints = list(range(first, first + len(skeleton.names)))
        gltf.skins.append(lib.Skin(joints=joints, inverseBindMatrices=matrices, skeleton=joints[0]))
        return len(gltf.skins) - 1

    def _animate(self, node: int, path: str, times: int, values: Floats, kind: str) -> None:
        lib, animation = self.lib, self._gltf.animations[0]
        sampler = lib.AnimationSampler(input=times, output=self._add(values, lib.FLOAT, kind), interpolation="LINEAR")
        animation.samplers.append(sampler)
        target = lib.AnimationChannelTarget(node=node, path=path)
        animation.channels.append(lib.AnimationChannel(sampler=len(animation.samplers) - 1, target=target))

    def _add_mesh(self, mesh: BoundMesh, skin: int) -> None:
        lib, gltf = self.lib, self._gltf
        vertices = {"target": lib.ARRAY_BUFFER}
        attributes = lib.Attributes(
            POSITION=self._add(mesh.points, lib.FLOAT, lib.VEC3, with_bounds=True, **vertices),
            NORMAL=self._add(vertex_normals(mesh.points, mesh.triangles), lib.FLOAT, lib.VEC3, **vertices),
        )
        joints, weights = strongest_first(mesh)
        for group in range(joints.shape[1] // _GROUP):
            part = slice(group * _GROUP, (group + 1) * _GROUP)
            joint_accessor = self._add(joints[:, part], lib.UNSIGNED_SHORT, lib.VEC4, **vertices)
            setattr(attributes, f"JOINTS_{group}", joint_accessor)
            setattr(attributes, f"WEIGHTS_{group}", self._add(weights[:, part], lib.FLOAT, lib.VEC4, **vertices))
        primitives: list[Any] = []
        for color, triangles in _by_color(mesh):
            indices = self._add(triangles.reshape(-1), lib.UNSIGNED_INT, lib.SCALAR, target=lib.ELEMENT_ARRAY_BUFFER)
            material = self._add_material(f"{mesh.name}_{len(primitives)}", color)
            primitives.append(lib.Primitive(attributes=attributes, indices=indices, material=material))
        gltf.meshes.append(lib.Mesh(name=mesh.name, primitives=primitives))
        gltf.nodes.append(lib.Node(name=mesh.name, mesh=len(gltf.meshes) - 1, skin=skin))
        self._roots.append(len(gltf.nodes) - 1)

    def _add_material(self, name: str, color: Floats) -> int:
        lib, gltf = self.lib, self._gltf
        surface = lib.PbrMetallicRoughness(
            baseColorFactor=[*color.tolist(), 1.0], metallicFactor=0.0, roughnessFactor=_ROUGHNESS
        )
        gltf.materials.append(lib.Material(name=name, pbrMetallicRoughness=surface, doubleSided=True))
        return len(gltf.materials) - 1

    def _add(self, values: Any, component: int, kind: str, with_bounds: bool = False, target: int | None = None) -> int:
        """An accessor with a view of its own."""
        lib, gltf = self.lib, self._gltf
        types = {lib.FLOAT: np.float32, lib.UNSIGNED_SHORT: np.uint16, lib.UNSIGNED_INT: np.uint32}
        array = np.ascontiguousarray(values, types[component])
        self._data.extend(b"\0" * (-len(self._data) % _ALIGNMENT))
        view = lib.BufferView(buffer=0, byteOffset=len(self._data), byteLength=array.nbytes, target=target)
        self._data.extend(array.tobytes())
        gltf.bufferViews.append(view)
        accessor = lib.Accessor(
            bufferView=len(gltf.bufferViews) - 1, componentType=component, count=len(array), type=kind
        )
        if with_bounds:
            accessor.min = np.atleast_1d(array.min(axis=0)).tolist()
            accessor.max = np.atleast_1d(array.max(axis=0)).tolist()
        gltf.accessors.append(accessor)
        return len(gltf.accessors) - 1


def strongest_first(mesh: BoundMesh) -> tuple[Any, Floats]:
    """Joints and weights (V, 4 n), normalised, as many as are used; unused ones are joint 0 with weight 0, and no joint
    comes twice."""
    count = len(mesh.points)
    dense = np.zeros((count, int(mesh.joint_indices.max(initial=0)) + 1))
    rows = np.repeat(np.arange(count), mesh.joint_indices.shape[1])
    np.add.at(dense, (rows, mesh.joint_indices.reshape(-1)), mesh.joint_weights.reshape(-1))
    used = max(int((dense > 0.0).sum(axis=1).max(initial=1)), 1)
    width = min(used, dense.shape[1])
    joints = np.argsort(-dense, axis=1, kind="stable")[:, :width]
    weights = np.take_along_axis(dense, joints, axis=1)
    joints = np.where(weights > 0.0, joints, 0)
    padding = ((0, 0), (0, -width % _GROUP))
    sums = weights.sum(axis=1, keepdims=True)
    return np.pad(joints, padding), np.pad(weights / np.where(sums > 0.0, sums, 1.0), padding)


def _by_color(mesh: BoundMesh) -> Iterable[tuple[Floats, Any]]:
    colors, inverse = np.unique(mesh.colors, axis=0, return_inverse=True)
    if len(colors) > _MAX_MATERIALS:
        return [(mesh.colors.mean(axis=0), mesh.triangles)]
    return [(color, mesh.triangles[inverse.reshape(-1) == number]) for number, color in enumerate(colors)]


def _quaternions(matrices: Floats) -> Floats:
    """x y z w, of (F, J, 3, 3), neighbours in one hemisphere."""
    return rotation.in_one_hemisphere(rotation.from_matrix(matrices))[..., [1, 2, 3, 0]]
