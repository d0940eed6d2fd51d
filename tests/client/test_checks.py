"""Each kind of damage to a good file is found."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from layfigure.errors import LayfigureError
from layfigure.take import Take
from layfigure.usd.checks import check
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
