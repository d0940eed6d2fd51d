"""Each kind of damage to a good file is found."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from client_support import usd_files
from client_support.cli import Cli
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from layfigure.errors import LayfigureError
from layfigure.take import Take
from layfigure.usd.checks import check
from layfigure.usd.findings import Finding
from layfigure.usd.writer import write_take

ROOT = "/Synthetic_arm"


@pytest.fixture(scope="module")
def flat(take: Take, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A good take as one layer, in text."""
    folder = tmp_path_factory.mktemp("checks")
    write_take(take, folder / "take.usda", 24.0)
    return str(Usd.Stage.Open(str(folder / "take.usda")).Flatten().ExportToString())


@pytest.fixture
def stage(flat: str, tmp_path: Path) -> Usd.Stage:
    (tmp_path / "damaged.usda").write_text(flat)
    return Usd.Stage.Open(str(tmp_path / "damaged.usda"))


def animation(stage: Usd.Stage) -> Any:
    return UsdSkel.Animation(stage.GetPrimAtPath(f"{ROOT}/Animation"))


def skeleton(stage: Usd.Stage) -> Any:
    return UsdSkel.Skeleton(stage.GetPrimAtPath(f"{ROOT}/Skeleton"))


def mesh(stage: Usd.Stage) -> Any:
    return UsdGeom.Mesh(stage.GetPrimAtPath(f"{ROOT}/Geometry/arm_mesh"))


def binding(stage: Usd.Stage) -> Any:
    return UsdSkel.BindingAPI(mesh(stage).GetPrim())


def long_quaternion(stage: Usd.Stage) -> None:
    attribute = animation(stage).GetRotationsAttr()
    value = attribute.Get(7)
    value[1] = Gf.Quatf(1.1, 0, 0, 0)
    attribute.Set(value, 7)


def stretched_bone(stage: Usd.Stage) -> None:
    attribute = animation(stage).GetTranslationsAttr()
    value = attribute.Get(7)
    value[2] = value[2] * 1.001
    attribute.Set(value, 7)


def infinite_translation(stage: Usd.Stage) -> None:
    attribute = animation(stage).GetTranslationsAttr()
    value = attribute.Get(7)
    value[0] = Gf.Vec3f(float("inf"), 0, 0)
    attribute.Set(value, 7)


def short_rotations(stage: Usd.Stage) -> None:
    attribute = animation(stage).GetRotationsAttr()
    attribute.Set(attribute.Get(3)[:2], 3)


def float_scales(stage: Usd.Stage) -> None:
    animation(stage).GetPrim().RemoveProperty("scales")
    prim = stage.GetRootLayer().GetPrimAtPath(f"{ROOT}/Animation")
    Sdf.AttributeSpec(prim, "scales", Sdf.ValueTypeNames.Float3Array).default = Vt.Vec3fArray([Gf.Vec3f(1)] * 4)


def weights_of_half(stage: Usd.Stage) -> None:
    primvar = binding(stage).GetJointWeightsPrimvar()
    primvar.Set(Vt.FloatArray.FromNumpy(0.5 * np.array(primvar.Get())))


def joint_index_out_of_range(stage: Usd.Stage) -> None:
    primvar = binding(stage).GetJointIndicesPrimvar()
    indices = np.array(primvar.Get())
    indices[5] = 4
    primvar.Set(Vt.IntArray.FromNumpy(indices))


def short_weights(stage: Usd.Stage) -> None:
    primvar = binding(stage).GetJointWeightsPrimvar()
    primvar.Set(primvar.Get()[:-1])


def joints_in_wrong_order(stage: Usd.Stage) -> None:
    joints = list(skeleton(stage).GetJointsAttr().Get())
    skeleton(stage).GetJointsAttr().Set(joints[::-1])


def missing_parent(stage: Usd.Stage) -> None:
    joints = list(skeleton(stage).GetJointsAttr().Get())
    skeleton(stage).GetJointsAttr().Set([*joints[:3], "nobody/thumb_L"])


def twice_the_same_joint(stage: Usd.Stage) -> None:
    joints = list(skeleton(stage).GetJointsAttr().Get())
    skeleton(stage).GetJointsAttr().Set([*joints[:3], joints[2]])


def vertex_index_out_of_range(stage: Usd.Stage) -> None:
    attribute = mesh(stage).GetFaceVertexIndicesAttr()
    indices = np.array(attribute.Get())
    indices[0] = 10_000
    attribute.Set(Vt.IntArray.FromNumpy(indices))


DAMAGES: list[tuple[Callable[[Usd.Stage], Any], str]] = [
    (long_quaternion, "rotations at frame 7: holds a quaternion of length 1 +0.1"),
    (stretched_bone, "changes its length"),
    (infinite_translation, "translations at frame 7: holds a value that is not finite"),
    (short_rotations, "rotations at frame 3: has 2 values, expected 4"),
    (float_scales, "is of type float3[], expected half3[]"),
    (lambda stage: animation(stage).GetPrim().RemoveProperty("scales"), "scales: is not set"),
    (lambda stage: animation(stage).GetPrim().RemoveProperty("translations"), "translations: is not set"),
    (lambda stage: skeleton(stage).GetPrim().RemoveProperty("restTransforms"), "restTransforms: is not set"),
    (lambda stage: skeleton(stage).GetPrim().RemoveProperty("bindTransforms"), "bindTransforms: is not set"),
    (
        lambda stage: skeleton(stage).GetBindTransformsAttr().Set(Vt.Matrix4dArray([Gf.Matrix4d(1.0)] * 3)),
        "has 3 transforms, expected 4",
    ),
    (
        lambda stage: skeleton(stage).GetBindTransformsAttr().Set(Vt.Matrix4dArray([Gf.Matrix4d(0.0)] * 4)),
        "cannot be inverted",
    ),
    (lambda stage: skeleton(stage).GetJointsAttr().Set([]), "has no joints"),
    (lambda stage: skeleton(stage).GetPrim().RemoveProperty("skel:animationSource"), "has no animation source"),
    (joints_in_wrong_order, "comes after it"),
    (missing_parent, "the parent of joint 'nobody/thumb_L' is missing"),
    (twice_the_same_joint, "is listed twice"),
    (lambda stage: animation(stage).GetJointsAttr().Set(["a", "a/b", "a/b/c", "a/b/d"]), "animates joint 'a'"),
    (weights_of_half, "do not sum to 1"),
    (joint_index_out_of_range, "joint index out of range, expected 0 to 3"),
    (short_weights, "208 joint indices and 207 weights, expected 208"),
    (vertex_index_out_of_range, "vertex index out of range"),
    (lambda stage: mesh(stage).GetFaceVertexIndicesAttr().Set(Vt.IntArray()), "has no faces"),
    (lambda stage: mesh(stage).GetExtentAttr().Set(Vt.Vec3fArray(2)), "extent is not the box"),
    (lambda stage: mesh(stage).GetPrim().RemoveAPI(UsdSkel.BindingAPI), "SkelBindingAPI"),
    (lambda stage: stage.RemovePrim(f"{ROOT}/Skeleton"), "holds no skeleton"),
    (lambda stage: stage.SetFramesPerSecond(30.0), "differ"),
    (lambda stage: stage.SetEndTimeCode(-1.0), "endTimeCode is before startTimeCode"),
    (lambda stage: stage.ClearDefaultPrim(), "defaultPrim"),
    (lambda stage: stage.ClearMetadata("upAxis"), "upAxis is not set"),
    (lambda stage: stage.ClearMetadata("metersPerUnit"), "metersPerUnit is not set"),
    (lambda stage: stage.ClearMetadata("timeCodesPerSecond"), "timeCodesPerSecond is not set"),
    (lambda stage: Usd.ModelAPI(stage.GetDefaultPrim()).SetKind(""), "has no kind"),
]


def test_check_flattened_good_take_has_no_findings(stage: Usd.Stage, tmp_path: Path) -> None:
    assert check(tmp_path / "damaged.usda").findings == ()


@pytest.mark.parametrize(("damage", "words"), DAMAGES)
def test_check_damaged_take_is_found(
    stage: Usd.Stage, tmp_path: Path, damage: Callable[[Usd.Stage], Any], words: str
) -> None:
    damage(stage)
    stage.GetRootLayer().Save()
    findings = [str(finding) for finding in check(tmp_path / "damaged.usda").findings]
    assert any(words in finding for finding in findings), findings
    assert not any("\n" in finding for finding in findings)


@pytest.mark.parametrize("content", [b"", b"#usda 1.0\n(", b"not usd", b"PXR-USDC" + b"\x00" * 100])
@pytest.mark.parametrize("name", ["bad.usda", "bad.usdc", "bad.usd", "bad.usdz"])
def test_check_broken_file_is_refused_in_one_line(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(LayfigureError, match=rf"^cannot read '.*{name}' as USD: .*$"):
        check(tmp_path / name)


def test_check_missing_layer_is_found(take: Take, tmp_path: Path) -> None:
    write_take(take, tmp_path / "take.usda", 24.0)
    (tmp_path / "take.character.usdc").unlink()
    assert check(tmp_path / "take.usda").findings != ()


def damage_foreign(path: Path, damage: Callable[[Usd.Stage], Any]) -> list[Finding]:
    stage = usd_files.edit(usd_files.write_figure(path, blend_shape=True))
    damage(stage)
    stage.GetRootLayer().Save()
    return list(check(path).findings)


FIGURE = "/World/figure0"


def motion(stage: Usd.Stage) -> Any:
    return UsdSkel.Animation(stage.GetPrimAtPath(f"{FIGURE}/rig/motion"))


def skin(stage: Usd.Stage) -> Any:
    return UsdGeom.Mesh(stage.GetPrimAtPath(f"{FIGURE}/skin"))


def skin_binding(stage: Usd.Stage) -> Any:
    return UsdSkel.BindingAPI(skin(stage).GetPrim())


def shape(stage: Usd.Stage) -> Any:
    return UsdSkel.BlendShape(stage.GetPrimAtPath(f"{FIGURE}/skin/wide"))


def negative_weight(stage: Usd.Stage) -> None:
    primvar = skin_binding(stage).GetJointWeightsPrimvar()
    weights = np.array(primvar.Get()).reshape(-1, 2)
    weights[3] = [1.5, -0.5]
    primvar.Set(Vt.FloatArray.FromNumpy(weights.ravel()))


def long_quaternions(stage: Usd.Stage) -> None:
    for frame in (3, 4, 5):
        motion(stage).GetRotationsAttr().Set([Gf.Quatf(2, 0, 0, 0)] * 3, frame)


def growing_bone(stage: Usd.Stage) -> None:
    attribute = motion(stage).GetTranslationsAttr()
    for frame, length in ((1, 50.0), (13, 60.0)):
        attribute.Set([Gf.Vec3f(0, length, 0), Gf.Vec3f(0, 0, 0), Gf.Vec3f(0, 50, 0)], frame)


FOREIGN_ERRORS: list[tuple[Callable[[Usd.Stage], Any], str]] = [
    (long_quaternions, "rotations at frame 3: holds a quaternion of length 1 +1, and 2 more frames are bad"),
    (negative_weight, "has a negative weight at vertex 3"),
    (lambda s: skin_binding(s).GetJointIndicesPrimvar().Set([9] * 72), "joint index out of range, expected 0 to 2"),
    (lambda s: skin_binding(s).GetJointWeightsPrimvar().Set([0.4] * 72), "do not sum to 1: 0.8 at vertex 0, and of 35"),
    (lambda s: skin_binding(s).GetJointWeightsPrimvar().Set([float("nan")] * 72), "do not sum to 1: nan"),
    (lambda s: skin(s).GetPrim().RemoveProperty("points"), "has no faces"),
    (lambda s: skin_binding(s).GetSkeletonRel().ClearTargets(True), "is bound to no skeleton"),
    (lambda s: skin_binding(s).CreateJointsAttr(["root", "nobody"]), "is bound to joint 'nobody'"),
    (lambda s: skin(s).GetFaceVertexCountsAttr().Set([4] * 33), "its faces take 132 vertex indices"),
    (lambda s: skin(s).GetPointsAttr().Set([Gf.Vec3f(float("nan"))] * 36), "has a point that is not finite"),
    (lambda s: skin_binding(s).GetBlendShapesAttr().Set(["wide", "tall"]), "names 2 blend shapes, and has 1 targets"),
    (lambda s: s.RemovePrim(f"{FIGURE}/skin/wide"), "is missing"),
    (lambda s: shape(s).GetOffsetsAttr().Set([Gf.Vec3f(1)] * 5), "has 5 offsets, expected 4"),
    (lambda s: shape(s).GetPointIndicesAttr().Set([0, 1, 2, 36]), "has a point index out of range, expected 0 to 35"),
    (lambda s: motion(s).GetBlendShapeWeightsAttr().Set([0.0, 1.0], 1), "has 2 values, expected 1"),
    (lambda s: (s.SetStartTimeCode(100), s.SetEndTimeCode(200)), "outside of the stage's 100 to 200"),
    (
        lambda s: (
            UsdSkel.BindingAPI(s.GetPrimAtPath(f"{FIGURE}/rig/skeleton"))
            .GetAnimationSourceRel()
            .SetTargets([f"{FIGURE}/skin"])
        ),
        "is no SkelAnimation",
    ),
]

FOREIGN_WARNINGS: list[tuple[Callable[[Usd.Stage], Any], str]] = [
    (growing_bone, "bone 'root/upper/lower' changes its length by 0.17 of it"),
    (lambda s: s.SetEndTimeCode(5), "its frames 1 to 13 go beyond the stage's 1 to 5"),
    (lambda s: Usd.ModelAPI(s.GetDefaultPrim()).SetKind(""), "has no kind"),
    (lambda s: s.SetFramesPerSecond(24.0), "differ"),
    (lambda s: s.GetPrimAtPath(f"{FIGURE}/rig/skeleton").RemoveProperty("restTransforms"), "is not set"),
    (lambda s: skin(s).GetPrim().RemoveProperty("extent"), "its extent is not the box"),
    (lambda s: motion(s).GetPrim().GetAttribute("joints").Set(["root", "root/a", "root/b"]), "animates joint 'root/a'"),
]


@pytest.mark.parametrize(("damage", "words"), FOREIGN_ERRORS)
def test_check_damaged_file_of_another_tool_has_an_error(
    tmp_path: Path, damage: Callable[[Usd.Stage], Any], words: str
) -> None:
    findings = damage_foreign(tmp_path / "figure.usda", damage)
    assert any(words in str(finding) for finding in findings if finding.is_error), [*map(str, findings)]


@pytest.mark.parametrize(("damage", "words"), FOREIGN_WARNINGS)
def test_check_what_usd_allows_is_a_warning(tmp_path: Path, damage: Callable[[Usd.Stage], Any], words: str) -> None:
    findings = damage_foreign(tmp_path / "figure.usda", damage)
    assert any(words in str(finding) for finding in findings), [*map(str, findings)]
    assert not any(finding.is_error for finding in findings), [*map(str, findings)]


def test_check_what_usd_allows_is_an_error_in_a_take(stage: Usd.Stage, tmp_path: Path) -> None:
    stretched_bone(stage)
    stage.GetRootLayer().Save()
    assert [finding.is_error for finding in check(tmp_path / "damaged.usda").findings] == [True]


@pytest.mark.parametrize("up_axis", ["Y", "Z"])
@pytest.mark.parametrize("meters_per_unit", [0.01, 1.0])
@pytest.mark.parametrize("skeletons", [1, 3])
@pytest.mark.parametrize("blend_shape", [False, True])
def test_check_good_files_of_other_layouts_have_no_findings(
    tmp_path: Path, up_axis: str, meters_per_unit: float, skeletons: int, blend_shape: bool
) -> None:
    path = usd_files.write_figure(tmp_path / "f.usdc", up_axis, meters_per_unit, skeletons, blend_shape=blend_shape)
    report = check(path)
    assert [*map(str, report.findings)] == []
    assert (report.skeletons, report.frames) == (skeletons, usd_files.FRAMES)


def test_check_character_without_animation_has_a_warning_alone(tmp_path: Path) -> None:
    report = check(usd_files.write_figure(tmp_path / "figure.usda", animated=False))
    assert [*map(str, report.findings)] == [f"warning: {FIGURE}/rig/skeleton: has no animation source"]


def test_check_file_without_skeleton_has_an_error(tmp_path: Path) -> None:
    report = check(usd_files.write_prop(tmp_path / "prop.usda"))
    assert [str(finding) for finding in report.findings if finding.is_error] == [
        f"error: {tmp_path / 'prop.usda'}: holds no skeleton"
    ]


def test_check_instanced_characters_are_checked(tmp_path: Path) -> None:
    usd_files.write_figure(tmp_path / "figure.usda")
    stage = Usd.Stage.CreateNew(str(tmp_path / "crowd.usda"))
    for name in ("/Crowd/a", "/Crowd/b"):
        prim = stage.DefinePrim(name, "Xform")
        prim.GetReferences().AddReference("./figure.usda")
        prim.SetInstanceable(True)
    stage.GetRootLayer().Save()
    assert check(tmp_path / "crowd.usda").skeletons == 2


def test_cli_check_missing_layer_is_one_clear_line(take: Take, tmp_path: Path, cli: Cli) -> None:
    write_take(take, tmp_path / "take.usda", 24.0)
    (tmp_path / "take.anim.usdc").unlink()
    result = cli("check", "take.usda")
    assert result.returncode == 1
    assert "take.anim.usdc', which is missing or cannot be read" in result.stdout
    assert sum("take.anim.usdc" in line for line in result.stdout.splitlines()) == 1
    assert len(result.stderr.splitlines()) == 1  # nothing of USD's own warnings


def test_cli_check_warnings_alone_exit_with_0(tmp_path: Path, cli: Cli) -> None:
    usd_files.write_figure(tmp_path / "figure.usda", animated=False)
    result = cli("check", "figure.usda")
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.splitlines()[0].startswith("warning: ")
    assert result.stdout.endswith("1 skeleton, 13 frames, 1 warning)\n")
