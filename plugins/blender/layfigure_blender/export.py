# SPDX-License-Identifier: GPL-3.0-or-later
"""An armature and its meshes, in the rest pose, as a GLB for the server.

Blender's own exporter writes a scene of copies, which is made for it and removed: nothing of the user's is changed,
whatever mode, selection, frame and pose it is in, and modifiers, constraints and animation need not be undone.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import bpy
import numpy as np
from mathutils import Matrix

from .control_rigs import why_it_falls_apart
from .rig import Floats, check_similarity

# The server takes sizes in this range as they are meant; others come out of scenes in other units, and it would change
# them itself. They are brought to about a metre by a power of ten, which the mapping takes back.
LEAST_SIZE, MOST_SIZE = 0.1, 10.0  # [m], of the longest side

# They make a skin smoother, at many times the vertices: nothing that the doll's bodies would differ by.
_SMOOTHING_MODIFIERS = frozenset({"SUBSURF", "MULTIRES"})


_Data = TypeVar("_Data", bound=bpy.types.ID)


class ExportError(RuntimeError):
    """What cannot become a doll; the message is one line for the user."""


@dataclass(frozen=True)
class Exported:
    path: Path
    to_world: Floats  # (4, 4): from the armature's space to the server's world


@dataclass(frozen=True)
class _Skin:
    """A mesh to be exported: of an object, by its weights or, rigidly, with one bone."""

    source: bpy.types.Object
    bone: str | None


def export_character(context: bpy.types.Context, armature: bpy.types.Object, path: Path) -> Exported:
    """Writes `path`. Raises ExportError, or MisfitError for a scale that no doll can have."""
    world = np.array(armature.matrix_world)
    check_similarity(world)
    skins = _skins_of(context, armature)
    torn = why_it_falls_apart(armature, _deforming_names(skins, armature))
    if torn is not None:
        raise ExportError(torn)
    with _temporary_data() as made:
        scene = made.scene()
        meshes = [(skin, mesh) for skin in skins if (mesh := _rest_mesh(skin.source, scene, made)) is not None]
        shrink = _shrinking([(_rest_world(skin.source), mesh) for skin, mesh in meshes])
        body = _copy_armature(
            armature, Matrix(world) if shrink == 1.0 else Matrix.Scale(shrink, 4) @ Matrix(world), made
        )
        scene.collection.objects.link(body)
        for skin, mesh in meshes:
            scene.collection.objects.link(_bound(skin, mesh, body, shrink, made))
        if not any(_is_weighted(child, body) for child in scene.collection.objects if child.type == "MESH"):
            raise ExportError(
                f"the meshes of '{armature.name}' have no weights of its bones: bind them, Object > Parent > Armature "
                "Deform > With Automatic Weights"
            )
        _write(context, scene, path)
    return Exported(path, np.diag([shrink, shrink, shrink, 1.0]) @ world)


def bound_meshes(context: bpy.types.Context, armature: bpy.types.Object) -> list[bpy.types.Object]:
    """The objects that the doll's skin is made of: those bound to the armature that can be seen."""
    return [skin.source for skin in _skins_of(context, armature)]


def _skins_of(context: bpy.types.Context, armature: bpy.types.Object) -> list[_Skin]:
    """Raises ExportError if there are none."""
    found = [skin for child in context.view_layer.objects if (skin := _skin_of(child, armature)) is not None]
    visible = [skin for skin in found if skin.source.visible_get()]
    if visible:
        return visible
    if found:
        raise ExportError(f"all meshes of '{armature.name}' are hidden: show those that the doll is to be made of")
    raise ExportError(
        f"no mesh is bound to '{armature.name}': select mesh and armature, then Object > Parent > Armature Deform > "
        "With Automatic Weights"
    )


def _skin_of(candidate: bpy.types.Object, armature: bpy.types.Object) -> _Skin | None:
    if candidate.type != "MESH":
        return None
    deformed = any(m.type == "ARMATURE" and m.object == armature for m in candidate.modifiers)
    if deformed or (candidate.parent == armature and candidate.parent_type == "ARMATURE"):
        return _Skin(candidate, None)
    carried = candidate
    while carried is not None:
        if carried.parent == armature and carried.parent_type == "BONE":
            return _Skin(candidate, carried.parent_bone) if carried.parent_bone in armature.data.bones else None
        carried = carried.parent
    return None


def _deforming_names(skins: list[_Skin], armature: bpy.types.Object) -> set[str]:
    """Of the bones that may move the skins."""
    groups = {group.name for skin in skins if skin.bone is None for group in skin.source.vertex_groups}
    deforming = {bone.name for bone in armature.data.bones if bone.use_deform and bone.name in groups}
    return deforming | {skin.bone for skin in skins if skin.bone is not None}


def _rest_world(item: bpy.types.Object) -> Matrix:
    """Object -> world, as it is with bones in their rest pose."""
    parent = item.parent
    if parent is None or (parent.type == "ARMATURE" and item.parent_type != "BONE"):
        return item.matrix_world.copy()
    if item.parent_type == "BONE":
        bone = parent.data.bones.get(item.parent_bone)
        if bone is None:
            return item.matrix_world.copy()
        above = parent.matrix_world
        if not bone.use_relative_parent:  # it hangs at the bone's tail
            above = above @ bone.matrix_local @ Matrix.Translation((0.0, bone.length, 0.0))
        return above @ item.matrix_parent_inverse @ item.matrix_basis
    if item.parent_type == "OBJECT":
        return _rest_world(parent) @ item.matrix_parent_inverse @ item.matrix_basis
    return item.matrix_world.copy()


def _rest_mesh(source: bpy.types.Object, scene: bpy.types.Scene, made: _Made) -> bpy.types.Mesh | None:
    """The mesh as its modifiers make it, but for the armature's and those that only smooth; None if it has no faces."""
    if source.mode == "EDIT":
        source.update_from_editmode()
    copy = made.keep(source.copy())
    copy.data = made.keep(source.data.copy())
    copy.animation_data_clear()
    copy.constraints.clear()
    copy.parent = None
    copy.matrix_world = _rest_world(source)
    _settle_shape_keys(copy.data)
    for modifier in list(copy.modifiers):
        if modifier.type == "ARMATURE" or modifier.type in _SMOOTHING_MODIFIERS:
            copy.modifiers.remove(modifier)
    scene.collection.objects.link(copy)
    scene.view_layers[0].update()
    depsgraph = scene.view_layers[0].depsgraph
    mesh = made.keep(
        bpy.data.meshes.new_from_object(
            copy.evaluated_get(depsgraph), preserve_all_data_layers=True, depsgraph=depsgraph
        )
    )
    scene.collection.objects.unlink(copy)
    return mesh if len(mesh.polygons) else None


def _settle_shape_keys(mesh: bpy.types.Mesh) -> None:
    """Keys that something drives, as correctives are by bones, are left out; others stay as they are now."""
    keys = mesh.shape_keys
    if keys is None or keys.animation_data is None:
        return
    driven = [curve.data_path.rpartition(".")[0] for curve in keys.animation_data.drivers]
    keys.animation_data_clear()
    for path in driven:
        with contextlib.suppress(ValueError):
            key = keys.path_resolve(path)
            if isinstance(key, bpy.types.ShapeKey):
                key.value = 0.0


def _shrinking(meshes: list[tuple[Matrix, bpy.types.Mesh]]) -> float:
    """The power of ten that brings the whole to a size that the server takes as it is; 1 for what has it."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for world, mesh in meshes:
        points = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", points)
        matrix = np.array(world)
        in_world = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        low, high = np.minimum(low, in_world.min(axis=0)), np.maximum(high, in_world.max(axis=0))
    size = float((high - low).max()) if meshes else 1.0
    if not np.isfinite(size) or size <= 0.0 or LEAST_SIZE <= size <= MOST_SIZE:
        return 1.0
    return float(10.0 ** -round(np.log10(size)))


def _copy_armature(armature: bpy.types.Object, world: Matrix, made: _Made) -> bpy.types.Object:
    data = made.keep(armature.data.copy())
    data.animation_data_clear()
    data.pose_position = "REST"
    copy = made.keep(bpy.data.objects.new(_name_of_no_bone("armature", data), data))
    copy.matrix_world = world
    return copy


def _bound(skin: _Skin, mesh: bpy.types.Mesh, body: bpy.types.Object, shrink: float, made: _Made) -> bpy.types.Object:
    """An object of the mesh that the armature moves as it moves the source."""
    mesh.materials.clear()
    result = made.keep(bpy.data.objects.new(_name_of_no_bone("skin", body.data), mesh))
    if skin.bone is not None:
        result.vertex_groups.clear()
        result.vertex_groups.new(name=skin.bone).add(range(len(mesh.vertices)), 1.0, "REPLACE")
    for group in list(result.vertex_groups):
        bone = body.data.bones.get(group.name)
        if skin.bone is None and bone is not None and not bone.use_deform:
            result.vertex_groups.remove(group)  # Blender does not let it deform
    world = Matrix.Scale(shrink, 4) @ _rest_world(skin.source)
    result.parent = body
    result.matrix_parent_inverse = body.matrix_world.inverted()
    result.matrix_basis = world
    result.modifiers.new("Armature", "ARMATURE").object = body
    return result


def _is_weighted(item: bpy.types.Object, armature: bpy.types.Object) -> bool:
    groups = {group.index for group in item.vertex_groups if group.name in armature.data.bones}
    return any(g.group in groups and g.weight > 0.0 for vertex in item.data.vertices for g in vertex.groups)


def _name_of_no_bone(wish: str, armature: bpy.types.Armature) -> str:
    """The exporter's nodes have the names of objects and of bones: by these the server tells bones apart."""
    name, number = wish, 0
    while name in armature.bones or name in bpy.data.objects:
        number += 1
        name = f"{wish} {number}"
    return name


def _write(context: bpy.types.Context, scene: bpy.types.Scene, path: Path) -> None:
    if "gltf" not in dir(bpy.ops.export_scene):
        raise ExportError(
            "Blender's glTF exporter is off: enable the add-on 'glTF 2.0 format' in Edit > Preferences > Add-ons"
        )
    wanted = {
        "export_format": "GLB",
        "use_active_scene": True,
        "use_visible": False,
        "use_renderable": False,
        "use_selection": False,
        "export_yup": True,
        "export_apply": False,
        "export_texcoords": False,
        "export_normals": False,
        "export_tangents": False,
        "export_materials": "NONE",
        "export_colors": False,
        "export_vertex_color": "NONE",
        "export_attributes": False,
        "export_cameras": False,
        "export_lights": False,
        "export_extras": False,
        "export_animations": False,
        "export_current_frame": True,
        "export_rest_position_armature": True,
        "export_def_bones": False,
        "export_skins": True,
        "export_morph": False,
        "export_draco_mesh_compression_enable": False,
        "will_save_settings": False,
    }
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    window = context.window
    before = window.scene
    try:
        window.scene = scene
        with _quiet_output():
            bpy.ops.export_scene.gltf(
                filepath=str(path), **{name: value for name, value in wanted.items() if name in known}
            )
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[-1]
        raise ExportError(f"Blender's glTF exporter failed: {reason}") from error
    finally:
        window.scene = before
    if not path.is_file():
        raise ExportError(f"Blender's glTF exporter did not write {path}")


@contextlib.contextmanager
def _quiet_output() -> Iterator[None]:
    """The exporter tells the console each of its steps."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield


class _Made:
    """Data-blocks that are removed in the end."""

    def __init__(self) -> None:
        self._items: list[bpy.types.ID] = []

    def keep(self, item: _Data) -> _Data:
        self._items.append(item)
        return item

    def scene(self) -> bpy.types.Scene:
        return self.keep(bpy.data.scenes.new("layfigure export"))

    def remove(self) -> None:
        keys = [mesh.shape_keys for mesh in self._items if isinstance(mesh, bpy.types.Mesh) and mesh.shape_keys]
        bpy.data.batch_remove([*self._items, *keys])
        self._items.clear()


@contextlib.contextmanager
def _temporary_data() -> Iterator[_Made]:
    made = _Made()
    try:
        yield made
    finally:
        made.remove()
