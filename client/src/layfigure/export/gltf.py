"""Writes glTF 2.0 through pygltflib: joints as nodes, skins, and one animation with a key in every frame."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from layfigure import rotation
from layfigure.errors import LayfigureError
from layfigure.export.clip import Clip, SkeletonClip
from layfigure.export.whole_file import write_whole
from layfigure.protocol import Floats
from layfigure.usd.character_layer import vertex_normals
from layfigure.usd.looks import Look, Texture
from layfigure.usd.pictures import MIME_TYPES, as_png_or_jpeg
from layfigure.usd.reader import BoundMesh

_REPEAT, _CLAMP, _MIRROR = 10497, 33071, 33648  # OpenGL's numbers
_WRAPS = {"repeat": _REPEAT, "clamp": _CLAMP, "mirror": _MIRROR}
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
        self._materials: dict[tuple[object, ...], int] = {}
        self._textures: dict[tuple[bytes, tuple[str, str]], int | None] = {}

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
        split = split_vertices(mesh)
        attributes = lib.Attributes(
            POSITION=self._add(mesh.points[split.sources], lib.FLOAT, lib.VEC3, with_bounds=True, **vertices),
            NORMAL=self._add(split.normals, lib.FLOAT, lib.VEC3, **vertices),
        )
        if split.uvs is not None:
            attributes.TEXCOORD_0 = self._add(split.uvs, lib.FLOAT, lib.VEC2, **vertices)
        joints, weights = (values[split.sources] for values in strongest_first(mesh))
        for group in range(joints.shape[1] // _GROUP):
            part = slice(group * _GROUP, (group + 1) * _GROUP)
            joint_accessor = self._add(joints[:, part], lib.UNSIGNED_SHORT, lib.VEC4, **vertices)
            setattr(attributes, f"JOINTS_{group}", joint_accessor)
            setattr(attributes, f"WEIGHTS_{group}", self._add(weights[:, part], lib.FLOAT, lib.VEC4, **vertices))
        primitives: list[Any] = []
        for where, surface in self._surfaces(mesh):
            indices = split.triangles[where].reshape(-1)
            accessor = self._add(indices, lib.UNSIGNED_INT, lib.SCALAR, target=lib.ELEMENT_ARRAY_BUFFER)
            name = surface.look.name if surface.look is not None and surface.look.name else mesh.name
            material = self._add_material(name, surface)
            primitives.append(lib.Primitive(attributes=attributes, indices=accessor, material=material))
        gltf.meshes.append(lib.Mesh(name=mesh.name, primitives=primitives))
        gltf.nodes.append(lib.Node(name=mesh.name, mesh=len(gltf.meshes) - 1, skin=skin))
        self._roots.append(len(gltf.nodes) - 1)

    def _surfaces(self, mesh: BoundMesh) -> Iterator[tuple[Any, _Surface]]:
        """Which triangles look how. Those without a texture go by their colours."""
        looks = mesh.looks
        if looks is None:
            yield from _by_color(mesh, np.arange(len(mesh.triangles)), None)
            return
        for number, look in enumerate(looks.looks):
            where = np.flatnonzero(looks.of_triangles == number)
            texture = self._add_texture(look.texture) if look.texture is not None and len(where) else None
            if texture is None or look.texture is None:
                yield from _by_color(mesh, where, look)
            else:
                yield where, _Surface(look.texture.factor, look, texture)

    def _add_material(self, name: str, surface: _Surface) -> int:
        """One that several meshes have is there once."""
        lib, gltf, look = self.lib, self._gltf, surface.look
        factor = np.clip(surface.factor, 0.0, 1.0).tolist()
        blends = factor[3] < 1.0 or (surface.texture is not None and look is not None and look.texture_alpha)
        cutoff = look.alpha_cutoff if look is not None else 0.0
        key = (name, tuple(factor), surface.texture, blends, cutoff)
        if key in self._materials:
            return self._materials[key]
        pbr = lib.PbrMetallicRoughness(baseColorFactor=factor, metallicFactor=0.0, roughnessFactor=_ROUGHNESS)
        if surface.texture is not None:
            pbr.baseColorTexture = lib.TextureInfo(index=surface.texture)
        material = lib.Material(name=name, pbrMetallicRoughness=pbr, doubleSided=True)
        if blends:
            material.alphaMode = lib.MASK if cutoff > 0.0 else lib.BLEND
            material.alphaCutoff = cutoff if cutoff > 0.0 else None
        gltf.materials.append(material)
        self._materials[key] = len(gltf.materials) - 1
        return self._materials[key]

    def _add_texture(self, texture: Texture) -> int | None:
        """Pictures that several materials have are there once. None: glTF cannot hold it."""
        key = (texture.data, texture.wrap)
        if key not in self._textures:
            self._textures[key] = self._add_picture(texture)
        return self._textures[key]

    def _add_picture(self, texture: Texture) -> int | None:
        lib, gltf = self.lib, self._gltf
        picture = as_png_or_jpeg(texture.data)
        if picture is None:
            return None
        kind, data = picture
        view = self._add_bytes(data)
        gltf.images.append(lib.Image(name=texture.name, mimeType=MIME_TYPES[kind], bufferView=view))
        wrap_s, wrap_t = (_WRAPS[wrap] for wrap in texture.wrap)
        gltf.samplers.append(lib.Sampler(wrapS=wrap_s, wrapT=wrap_t))
        gltf.textures.append(lib.Texture(sampler=len(gltf.samplers) - 1, source=len(gltf.images) - 1))
        return len(gltf.textures) - 1

    def _add(self, values: Any, component: int, kind: str, with_bounds: bool = False, target: int | None = None) -> int:
        """An accessor with a view of its own."""
        lib, gltf = self.lib, self._gltf
        types = {lib.FLOAT: np.float32, lib.UNSIGNED_SHORT: np.uint16, lib.UNSIGNED_INT: np.uint32}
        array = np.ascontiguousarray(values, types[component])
        view = self._add_bytes(array.tobytes(), target)
        accessor = lib.Accessor(bufferView=view, componentType=component, count=len(array), type=kind)
        if with_bounds:
            accessor.min = np.atleast_1d(array.min(axis=0)).tolist()
            accessor.max = np.atleast_1d(array.max(axis=0)).tolist()
        gltf.accessors.append(accessor)
        return len(gltf.accessors) - 1

    def _add_bytes(self, data: bytes, target: int | None = None) -> int:
        """A view of the buffer."""
        lib, gltf = self.lib, self._gltf
        self._data.extend(b"\0" * (-len(self._data) % _ALIGNMENT))
        gltf.bufferViews.append(
            lib.BufferView(buffer=0, byteOffset=len(self._data), byteLength=len(data), target=target)
        )
        self._data.extend(data)
        return len(gltf.bufferViews) - 1


@dataclass(frozen=True, eq=False)
class _Surface:
    factor: Floats  # (4) linear RGB and alpha, times the texture's
    look: Look | None
    texture: int | None


@dataclass(frozen=True, eq=False)
class Split:
    """A mesh whose vertices have one normal and one texture coordinate each; N vertices."""

    sources: Any  # (N) the mesh's own vertices that they are
    normals: Floats  # (N, 3)
    uvs: Floats | None  # (N, 2) v downwards, as glTF has it
    triangles: Any  # (T, 3)


def split_vertices(mesh: BoundMesh) -> Split:
    """As many vertices as needed, in the order of the mesh's. If any is split, those of no triangle are left out."""
    looks = mesh.looks
    textured = looks is not None and any(look.texture is not None for look in looks.looks)
    normals = vertex_normals(mesh.points, mesh.triangles)
    if (mesh.normals is None and not textured) or not len(mesh.triangles):
        return Split(np.arange(len(mesh.points)), normals, None, mesh.triangles)
    of_corners = mesh.normals if mesh.normals is not None else normals[mesh.triangles]
    shading = [of_corners, *([looks.uvs] if looks is not None and textured else [])]
    rounded = np.concatenate(shading, axis=2).astype(np.float32)  # as it is written
    corners = np.concatenate([mesh.triangles[:, :, None], rounded], axis=2, dtype=np.float64)
    rows, numbers = np.unique(corners.reshape(-1, corners.shape[2]), axis=0, return_inverse=True)
    uvs = np.stack([rows[:, 4], 1.0 - rows[:, 5]], axis=1) if textured else None
    return Split(rows[:, 0].astype(np.int64), rows[:, 1:4], uvs, numbers.reshape(-1, 3))


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


def _by_color(mesh: BoundMesh, where: Any, look: Look | None) -> Iterator[tuple[Any, _Surface]]:
    """Of the triangles `where`: those of each colour."""
    opacity = look.opacity if look is not None else 1.0
    colors, numbers = np.unique(mesh.colors[where], axis=0, return_inverse=True)
    if len(colors) > _MAX_MATERIALS:
        yield where, _Surface(np.append(mesh.colors[where].mean(axis=0), opacity), look, None)
        return
    for number, color in enumerate(colors):
        yield where[numbers.reshape(-1) == number], _Surface(np.append(color, opacity), look, None)


def _quaternions(matrices: Floats) -> Floats:
    """x y z w, of (F, J, 3, 3), neighbours in one hemisphere."""
    return rotation.in_one_hemisphere(rotation.from_matrix(matrices))[..., [1, 2, 3, 0]]
