"""Skinned USD files as other tools write them: their units, axes and layouts are not those of a take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from layfigure.protocol import Floats

JOINTS = ["root", "root/upper", "root/upper/lower"]
BONE_M = 0.5
HALF_WIDTH_M = 0.1
FRAMES = 13
LAST_ANGLE_DEG = 60.0  # of `upper`, about the axis that points at the viewer


def column(rings: int = 9) -> tuple[Floats, list[int], list[int], Floats, Floats]:
    """A square column along Y, a metre and a half high, in quads: points, counts, indices, joints and weights."""
    corners = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]]) * HALF_WIDTH_M
    heights = np.linspace(0.0, 3.0 * BONE_M, rings)
    points = np.array([[x, height, z] for height in heights for x, z in corners])
    faces = [
        [4 * r + a, 4 * r + b, 4 * r + 4 + b, 4 * r + 4 + a]
        for r in range(rings - 1)
        for a, b in zip(range(4), (1, 2, 3, 0), strict=True)
    ]
    faces += [[3, 2, 1, 0], [4 * rings - 4 + corner for corner in range(4)]]
    along = points[:, 1] / BONE_M
    bones = np.clip(np.floor(along), 0, 2)
    blend = np.clip(along - bones - 0.5, 0.0, 0.5)
    joints = np.stack([bones, np.minimum(bones + 1, 2)], axis=1)
    weights = np.stack([1.0 - blend, blend], axis=1)
    return points, [len(face) for face in faces], [i for face in faces for i in face], joints, weights


def write_figure(
    path: Path,
    up_axis: str = "Y",
    meters_per_unit: float = 0.01,
    skeletons: int = 1,
    animated: bool = True,
    blend_shape: bool = False,
) -> Path:
    """Columns of three joints side by side, of which `upper` bends sideways; in units of `meters_per_unit`."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, up_axis)
    UsdGeom.SetStageMetersPerUnit(stage, meters_per_unit)
    stage.SetTimeCodesPerSecond(30.0)
    stage.SetFramesPerSecond(30.0)
    stage.SetStartTimeCode(1.0)
    stage.SetEndTimeCode(float(FRAMES))
    world = UsdGeom.Xform.Define(stage, "/World")
    Usd.ModelAPI(world.GetPrim()).SetKind("assembly")
    stage.SetDefaultPrim(world.GetPrim())
    if up_axis == "Z":
        world.AddRotateXOp().Set(90.0)
    for number in range(skeletons):
        _define_figure(stage, f"/World/figure{number}", number, 1.0 / meters_per_unit, animated, blend_shape)
    stage.GetRootLayer().Save()
    return path


def _define_figure(stage: Usd.Stage, path: str, number: int, units: float, animated: bool, blend_shape: bool) -> None:
    """`units` per metre."""
    root = UsdSkel.Root.Define(stage, path)
    root.AddTranslateOp().Set(Gf.Vec3d(0.6 * number * units, 0.0, 0.0))
    skeleton = UsdSkel.Skeleton.Define(stage, f"{path}/rig/skeleton")
    skeleton.CreateJointsAttr(JOINTS)
    binds, rests = [], []
    for level in range(3):
        binds.append(Gf.Matrix4d().SetTranslate(Gf.Vec3d(0.0, level * BONE_M * units, 0.0)))
        rests.append(Gf.Matrix4d().SetTranslate(Gf.Vec3d(0.0, (level > 0) * BONE_M * units, 0.0)))
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray(binds))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray(rests))
    UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    mesh = _define_column(stage, f"{path}/skin", units, skeleton)
    if blend_shape:
        shape = UsdSkel.BlendShape.Define(stage, f"{path}/skin/wide")
        shape.CreateOffsetsAttr([Gf.Vec3f(0.2 * units, 0, 0)] * 4)
        shape.CreatePointIndicesAttr([0, 1, 4, 5])
        binding = UsdSkel.BindingAPI(mesh.GetPrim())
        binding.CreateBlendShapesAttr(["wide"])
        binding.CreateBlendShapeTargetsRel().SetTargets([shape.GetPath()])
    if animated:
        animation = _define_animation(stage, f"{path}/rig/motion", units, blend_shape)
        UsdSkel.BindingAPI(skeleton.GetPrim()).CreateAnimationSourceRel().SetTargets([animation.GetPath()])


def _define_column(stage: Usd.Stage, path: str, units: float, skeleton: UsdSkel.Skeleton) -> UsdGeom.Mesh:
    points, counts, indices, joints, weights = column()
    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy((points * units).astype(np.float32)))
    mesh.CreateFaceVertexCountsAttr(counts)
    mesh.CreateFaceVertexIndicesAttr(indices)
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreateExtentAttr(UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
    binding = UsdSkel.BindingAPI.Apply(mesh.GetPrim())
    binding.CreateJointIndicesPrimvar(False, 2).Set(joints.astype(int).ravel().tolist())
    binding.CreateJointWeightsPrimvar(False, 2).Set(weights.ravel().tolist())
    binding.CreateGeomBindTransformAttr(Gf.Matrix4d(1.0))
    binding.CreateSkeletonRel().SetTargets([skeleton.GetPath()])
    return mesh


def _define_animation(stage: Usd.Stage, path: str, units: float, blend_shape: bool) -> UsdSkel.Animation:
    animation = UsdSkel.Animation.Define(stage, path)
    order = [JOINTS[2], JOINTS[0], JOINTS[1]]  # not the skeleton's
    animation.CreateJointsAttr(order)
    animation.CreateScalesAttr([Gf.Vec3h(1, 1, 1)] * 3)
    lengths = {JOINTS[0]: 0.0, JOINTS[1]: BONE_M * units, JOINTS[2]: BONE_M * units}
    animation.CreateTranslationsAttr([Gf.Vec3f(0, lengths[joint], 0) for joint in order])
    rotations = animation.CreateRotationsAttr()
    for frame in range(1, FRAMES + 1):
        turned = Gf.Rotation(Gf.Vec3d(0, 0, 1), LAST_ANGLE_DEG * (frame - 1) / (FRAMES - 1)).GetQuat()
        rotations.Set([Gf.Quatf(turned) if joint == JOINTS[1] else Gf.Quatf(1) for joint in order], frame)
    if blend_shape:
        animation.CreateBlendShapesAttr(["wide"])
        weights = animation.CreateBlendShapeWeightsAttr()
        weights.Set([0.0], 1)
        weights.Set([1.0], FRAMES)
    return animation


def write_prop(path: Path) -> Path:
    """A file without a skeleton."""
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, "Y")
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetDefaultPrim(UsdGeom.Cube.Define(stage, "/Cube").GetPrim())
    stage.GetRootLayer().Save()
    return path


def edit(path: Path) -> Usd.Stage:
    return Usd.Stage.Open(Sdf.Layer.FindOrOpen(str(path)))
