"""What does not move: skeleton, skinned meshes, materials."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdShade, UsdSkel, Vt

from layfigure.protocol import Character, Floats, Floats32, Mesh
from layfigure.usd import values
from layfigure.usd.materials import TEXTURE_COORDINATES, define_materials
from layfigure.usd.names import joint_paths, legal_name, unique_names
from layfigure.usd.textures import Textures

METERS_PER_UNIT = 1.0
STAGE_UP_AXIS = UsdGeom.Tokens.z
_NO_MATERIAL = (0.8, 0.8, 0.8)  # display colour, linear RGB


def character_prim_path(character: Character) -> str:
    return "/" + legal_name(character.name, "Character")


def skeleton_path(character: Character) -> str:
    return character_prim_path(character) + "/Skeleton"


def set_stage_units(stage: Any) -> None:
    UsdGeom.SetStageUpAxis(stage, STAGE_UP_AXIS)
    UsdGeom.SetStageMetersPerUnit(stage, METERS_PER_UNIT)


def write_character_layer(path: str, character: Character, meshes: tuple[Mesh, ...], textures: Textures) -> None:
    stage = Usd.Stage.CreateNew(path)
    set_stage_units(stage)
    write_character(stage, character, meshes, textures)
    stage.GetRootLayer().Save()


def write_character(stage: Any, character: Character, meshes: tuple[Mesh, ...], textures: Textures) -> None:
    root_path = character_prim_path(character)
    root = UsdSkel.Root.Define(stage, root_path)
    stage.SetDefaultPrim(root.GetPrim())
    Usd.ModelAPI(root.GetPrim()).SetKind(Kind.Tokens.component)
    root.GetPrim().SetCustomDataByKey("layfigure:sourceFile", character.source_file)
    skeleton = _define_skeleton(stage, character)
    materials = define_materials(stage, f"{root_path}/Materials", meshes, textures)
    for mesh, name in zip(meshes, unique_names((mesh.name for mesh in meshes), "mesh"), strict=True):
        geometry = _define_mesh(stage, f"{root_path}/Geometry/{name}", mesh, skeleton)
        if mesh.material is not None:
            UsdShade.MaterialBindingAPI.Apply(geometry.GetPrim()).Bind(materials[mesh.material])
    groups = [*(["Geometry"] if meshes else []), *(["Materials"] if materials else [])]
    for group in groups:
        stage.GetPrimAtPath(f"{root_path}/{group}").SetTypeName("Scope")
        stage.GetPrimAtPath(f"{root_path}/{group}").SetSpecifier(Sdf.SpecifierDef)


def _define_skeleton(stage: Any, character: Character) -> Any:
    joints = character.joints
    skeleton = UsdSkel.Skeleton.Define(stage, skeleton_path(character))
    skeleton.CreateJointsAttr(Vt.TokenArray(joint_paths([j.name for j in joints], [j.parent for j in joints])))
    binds = [values.matrix4d(j.bind_rotation, j.bind_translation) for j in joints]
    rests = [values.matrix4d(j.rest_rotation, j.rest_translation) for j in joints]
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray(binds))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray(rests))
    skeleton.CreateExtentAttr(values.extent_of([j.bind_translation for j in joints]))
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    _keep_joint_parameters(skeleton.GetPrim(), character)
    return skeleton


def _keep_joint_parameters(prim: Any, character: Character) -> None:
    """What USD has no place for, one value per joint, in the order of `joints`."""
    joints = character.joints
    prim.SetCustomDataByKey("layfigure:jointNames", Vt.StringArray([joint.name for joint in joints]))
    prim.SetCustomDataByKey("layfigure:isBody", Vt.BoolArray([joint.is_body for joint in joints]))
    prim.SetCustomDataByKey("layfigure:mass", values.double_array([joint.mass for joint in joints]))
    prim.SetCustomDataByKey("layfigure:stiffness", values.double_array([joint.stiffness for joint in joints]))
    prim.SetCustomDataByKey("layfigure:yieldTorque", values.double_array([joint.yield_torque for joint in joints]))


def _define_mesh(stage: Any, path: str, mesh: Mesh, skeleton: Any) -> Any:
    geometry = UsdGeom.Mesh.Define(stage, path)
    geometry.CreatePointsAttr(values.vec3f_array(mesh.points))
    geometry.CreateFaceVertexCountsAttr(values.int_array(np.full(len(mesh.triangles), 3)))
    geometry.CreateFaceVertexIndicesAttr(values.int_array(mesh.triangles))
    _set_normals(geometry, mesh)
    _set_texture_coordinates(geometry, mesh)
    geometry.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    geometry.CreateExtentAttr(values.extent_of(mesh.points))
    color = mesh.material.base_color.tolist() if mesh.material is not None else _NO_MATERIAL
    geometry.CreateDisplayColorAttr(Vt.Vec3fArray([Gf.Vec3f(*color)]))
    binding = UsdSkel.BindingAPI.Apply(geometry.GetPrim())
    influences = mesh.joint_indices.shape[1]
    binding.CreateJointIndicesPrimvar(False, influences).Set(values.int_array(mesh.joint_indices))
    binding.CreateJointWeightsPrimvar(False, influences).Set(values.float_array(mesh.joint_weights))
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    return geometry


def _set_normals(geometry: Any, mesh: Mesh) -> None:
    """Those of the character's file, else smooth ones."""
    if mesh.normals is None:
        geometry.CreateNormalsAttr(values.vec3f_array(vertex_normals(mesh.points, mesh.triangles)))
        geometry.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    elif _is_of_vertices(mesh.normals, mesh):
        geometry.CreateNormalsAttr(values.vec3f_array(mesh.normals[: len(mesh.points)]))
        geometry.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    else:
        geometry.CreateNormalsAttr(values.vec3f_array(mesh.normals[mesh.wedges.reshape(-1)]))
        geometry.SetNormalsInterpolation(UsdGeom.Tokens.faceVarying)


def _set_texture_coordinates(geometry: Any, mesh: Mesh) -> None:
    if mesh.uvs is None:
        return
    of_vertices = _is_of_vertices(mesh.uvs, mesh)
    primvar = UsdGeom.PrimvarsAPI(geometry).CreatePrimvar(
        TEXTURE_COORDINATES,
        Sdf.ValueTypeNames.TexCoord2fArray,
        UsdGeom.Tokens.vertex if of_vertices else UsdGeom.Tokens.faceVarying,
    )
    primvar.Set(values.vec2f_array(mesh.uvs[: len(mesh.points)] if of_vertices else mesh.uvs))
    if not of_vertices:
        primvar.SetIndices(values.int_array(mesh.wedges))


def _is_of_vertices(of_wedges: Floats32, mesh: Mesh) -> bool:
    """Whether no triangle has another value at a vertex than the first wedge of that."""
    return bool((of_wedges[mesh.wedges] == of_wedges[mesh.triangles]).all())


def vertex_normals(points: Any, triangles: Any) -> Floats:
    """(V, 3), each the mean of its triangles' normals weighted by area; (0, 0, 1) where there is none."""
    corners = np.asarray(points, np.float64)[triangles]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros((len(points), 3))
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], face_normals)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(lengths > 0.0, normals / np.where(lengths > 0.0, lengths, 1.0), [0.0, 0.0, 1.0])
