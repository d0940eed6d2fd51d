"""What does not move: skeleton, skinned meshes, materials."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdShade, UsdSkel, Vt

from layfigure.protocol import Character, Floats, Mesh
from layfigure.usd import values
from layfigure.usd.names import joint_paths, legal_name, unique_names

METERS_PER_UNIT = 1.0
STAGE_UP_AXIS = UsdGeom.Tokens.z
_ROUGHNESS = 0.6


def character_prim_path(character: Character) -> str:
    return "/" + legal_name(character.name, "Character")


def skeleton_path(character: Character) -> str:
    return character_prim_path(character) + "/Skeleton"


def set_stage_units(stage: Any) -> None:
    UsdGeom.SetStageUpAxis(stage, STAGE_UP_AXIS)
    UsdGeom.SetStageMetersPerUnit(stage, METERS_PER_UNIT)


def write_character_layer(path: str, character: Character, meshes: tuple[Mesh, ...]) -> None:
    stage = Usd.Stage.CreateNew(path)
    set_stage_units(stage)
    write_character(stage, character, meshes)
    stage.GetRootLayer().Save()


def write_character(stage: Any, character: Character, meshes: tuple[Mesh, ...]) -> None:
    root_path = character_prim_path(character)
    root = UsdSkel.Root.Define(stage, root_path)
    stage.SetDefaultPrim(root.GetPrim())
    Usd.ModelAPI(root.GetPrim()).SetKind(Kind.Tokens.component)
    root.GetPrim().SetCustomDataByKey("layfigure:sourceFile", character.source_file)
    skeleton = _define_skeleton(stage, character)
    for mesh, name in zip(meshes, unique_names((mesh.name for mesh in meshes), "mesh"), strict=True):
        material = _define_material(stage, f"{root_path}/Materials/{name}", mesh)
        _define_mesh(stage, f"{root_path}/Geometry/{name}", mesh, skeleton, material)
    for group in ("Geometry", "Materials") if meshes else ():
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


def _define_material(stage: Any, path: str, mesh: Mesh) -> Any:
    material = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*mesh.color.tolist()))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(_ROUGHNESS)
    surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    material.CreateSurfaceOutput().ConnectToSource(surface)
    return material


def _define_mesh(stage: Any, path: str, mesh: Mesh, skeleton: Any, material: Any) -> None:
    geometry = UsdGeom.Mesh.Define(stage, path)
    geometry.CreatePointsAttr(values.vec3f_array(mesh.points))
    geometry.CreateFaceVertexCountsAttr(values.int_array(np.full(len(mesh.triangles), 3)))
    geometry.CreateFaceVertexIndicesAttr(values.int_array(mesh.triangles))
    geometry.CreateNormalsAttr(values.vec3f_array(vertex_normals(mesh.points, mesh.triangles)))
    geometry.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    geometry.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    geometry.CreateExtentAttr(values.extent_of(mesh.points))
    geometry.CreateDisplayColorAttr(Vt.Vec3fArray([Gf.Vec3f(*mesh.color.tolist())]))
    binding = UsdSkel.BindingAPI.Apply(geometry.GetPrim())
    influences = mesh.joint_indices.shape[1]
    binding.CreateJointIndicesPrimvar(False, influences).Set(values.int_array(mesh.joint_indices))
    binding.CreateJointWeightsPrimvar(False, influences).Set(values.float_array(mesh.joint_weights))
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    UsdShade.MaterialBindingAPI.Apply(geometry.GetPrim()).Bind(material)


def vertex_normals(points: Any, triangles: Any) -> Floats:
    """(V, 3), each the mean of its triangles' normals weighted by area; (0, 0, 1) where there is none."""
    corners = np.asarray(points, np.float64)[triangles]
    face_normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros((len(points), 3))
    for corner in range(3):
        np.add.at(normals, triangles[:, corner], face_normals)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(lengths > 0.0, normals / np.where(lengths > 0.0, lengths, 1.0), [0.0, 0.0, 1.0])
