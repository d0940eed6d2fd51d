"""Synthetic poses to USD, opened again by USD's own code."""

import math
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from client_support import synthetic
from client_support.takes import make_take
from pxr import Usd, UsdGeom, UsdShade, UsdSkel

from layfigure.errors import LayfigureError, UsageError
from layfigure.resample import resample
from layfigure.take import Take
from layfigure.take_form import TakeForm
from layfigure.usd.checks import check
from layfigure.usd.names import joint_paths, legal_name, unique_names
from layfigure.usd.reader import SkinnedStage
from layfigure.usd.writer import check_output, write_take

ROOT = "/Synthetic_arm"
FPS = 24.0
FELT = TakeForm(custom_data=True)
FLOAT_TOLERANCE = 2e-7  # a few roundings of values near 1 to float
CHAIN_TOLERANCE = 3e-6  # [m] such roundings along a chain of joints, over a metre
POSE_FRAMES = (0, 12, 24)  # those at exactly the time of a pose: nothing is interpolated


@pytest.fixture(scope="module")
def folder(take: Take, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("usd")
    assert len(write_take(take, folder / "take.usda", FPS, FELT).frames) == 25
    return folder


@pytest.fixture(scope="module")
def stage(folder: Path) -> Usd.Stage:
    return Usd.Stage.Open(str(folder / "take.usda"))


@pytest.fixture(scope="module")
def animation(stage: Usd.Stage) -> UsdSkel.Animation:
    return UsdSkel.Animation(stage.GetPrimAtPath(f"{ROOT}/Animation"))


@pytest.fixture(scope="module")
def skeleton(stage: Usd.Stage) -> UsdSkel.Skeleton:
    return UsdSkel.Skeleton(stage.GetPrimAtPath(f"{ROOT}/Skeleton"))


def quaternions(value: object) -> np.ndarray:
    return np.array([[q.GetReal(), *q.GetImaginary()] for q in value], np.float64)


def test_write_take_layered_makes_three_files_and_nothing_else(folder: Path) -> None:
    assert sorted(path.name for path in folder.iterdir()) == ["take.anim.usdc", "take.character.usdc", "take.usda"]
    root = (folder / "take.usda").read_text()
    assert "references = @./take.character.usdc@" in root
    assert "@./take.anim.usdc@" in root
    assert str(folder) not in root


def test_write_take_stage_has_all_metadata(stage: Usd.Stage) -> None:
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (24.0, 24.0)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, 24.0)
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetDefaultPrim().GetPath() == ROOT
    assert stage.GetDefaultPrim().IsA(UsdSkel.Root)
    assert Usd.ModelAPI(stage.GetDefaultPrim()).GetKind() == "component"


def test_write_take_every_validator_and_own_check_pass(folder: Path) -> None:
    report = check(folder / "take.usda")
    assert [str(finding) for finding in report.findings] == []
    assert (report.validators, report.skeletons, report.frames) == (30, 1, 25)


def test_write_take_animation_has_all_three_channels_in_their_types(animation: UsdSkel.Animation) -> None:
    types = [
        str(attribute.GetTypeName())
        for attribute in (animation.GetRotationsAttr(), animation.GetTranslationsAttr(), animation.GetScalesAttr())
    ]
    assert types == ["quatf[]", "float3[]", "half3[]"]
    assert animation.GetRotationsAttr().GetTimeSamples() == [float(frame) for frame in range(25)]
    assert animation.GetTranslationsAttr().GetTimeSamples() == [float(frame) for frame in range(25)]
    assert animation.GetScalesAttr().GetNumTimeSamples() == 0
    np.testing.assert_array_equal(np.array(animation.GetScalesAttr().Get()), np.ones((4, 3)))


def test_write_take_rotations_follow_the_motion_as_unit_quaternions(animation: UsdSkel.Animation) -> None:
    for frame in range(25):
        written = quaternions(animation.GetRotationsAttr().Get(frame))
        np.testing.assert_allclose(np.linalg.norm(written, axis=1), 1.0, atol=FLOAT_TOLERANCE)
        expected = synthetic.pose_rotations(frame / FPS)
        np.testing.assert_allclose(np.abs(np.sum(written * expected, axis=1)), 1.0, atol=FLOAT_TOLERANCE)


def test_write_take_bones_keep_their_lengths(animation: UsdSkel.Animation) -> None:
    expected = np.array(synthetic.OFFSETS, np.float32)[1:]
    for frame in range(25):
        np.testing.assert_array_equal(np.array(animation.GetTranslationsAttr().Get(frame))[1:], expected)


def test_write_take_neighbouring_rotations_are_in_one_hemisphere(animation: UsdSkel.Animation) -> None:
    samples = np.array([quaternions(animation.GetRotationsAttr().Get(frame)) for frame in range(25)])
    assert np.sum(samples[1:] * samples[:-1], axis=-1).min() > 0.9


def test_write_take_skeleton_keeps_names_parents_and_transforms(skeleton: UsdSkel.Skeleton) -> None:
    assert list(skeleton.GetJointsAttr().Get()) == [
        "mixamorig_Hips",
        "mixamorig_Hips/mixamorig_LeftArm",
        "mixamorig_Hips/mixamorig_LeftArm/mixamorig_LeftHand",
        "mixamorig_Hips/mixamorig_LeftArm/thumb_L",
    ]
    assert list(skeleton.GetPrim().GetCustomDataByKey("layfigure:jointNames")) == synthetic.NAMES
    binds = np.array(skeleton.GetBindTransformsAttr().Get())
    rests = np.array(skeleton.GetRestTransformsAttr().Get())
    rotations = synthetic.rest_rotations()
    for j, world in enumerate(synthetic.world_matrices(rotations)):
        np.testing.assert_allclose(binds[j].T, world, atol=1e-12)
        local = synthetic.matrix(rotations[j], np.array(synthetic.OFFSETS[j]))
        np.testing.assert_allclose(rests[j].T, local, atol=1e-12)


def test_write_take_joint_parameters_are_kept(skeleton: UsdSkel.Skeleton) -> None:
    prim = skeleton.GetPrim()
    assert list(prim.GetCustomDataByKey("layfigure:yieldTorque")) == synthetic.YIELD_TORQUES
    assert list(prim.GetCustomDataByKey("layfigure:isBody")) == [True, True, True, False]
    assert list(prim.GetCustomDataByKey("layfigure:mass")) == [3.0, 1.5, 0.5, 0.0]


def test_write_take_torques_and_yield_events_are_kept(animation: UsdSkel.Animation) -> None:
    prim = animation.GetPrim()
    torques = np.array(prim.GetAttribute("layfigure:torques").Get(12))
    np.testing.assert_allclose(torques[1], [0.1, 5.0 * math.sin(0.5), 0.0], atol=1e-3)
    rests = quaternions(prim.GetAttribute("layfigure:restRotations").Get(12))
    np.testing.assert_allclose(np.abs(np.sum(rests * synthetic.rest_rotations(), axis=1)), 1.0, atol=FLOAT_TOLERANCE)
    assert list(prim.GetCustomDataByKey("layfigure:yieldJoints")) == [1]
    assert list(prim.GetCustomDataByKey("layfigure:yieldStarts")) == pytest.approx([24 * 0.167])
    assert list(prim.GetCustomDataByKey("layfigure:yieldEnds")) == pytest.approx([24 * 0.317])


def test_write_take_posed_joints_match_forward_kinematics(stage: Usd.Stage, skeleton: UsdSkel.Skeleton) -> None:
    query = UsdSkel.Cache()
    query.Populate(UsdSkel.Root(stage.GetDefaultPrim()), Usd.PrimDefaultPredicate)
    for frame in POSE_FRAMES:
        transforms = query.GetSkelQuery(skeleton).ComputeJointSkelTransforms(frame)
        time_s = frame / FPS
        worlds = synthetic.world_matrices(synthetic.pose_rotations(time_s), synthetic.root_translation(time_s))
        np.testing.assert_allclose(np.array([np.array(t).T for t in transforms]), worlds, atol=CHAIN_TOLERANCE)


def test_write_take_skin_by_usd_matches_blending_of_the_poses(folder: Path) -> None:
    """Vertices that UsdSkel skins, against linear blend skinning written out here from the messages."""
    stage = SkinnedStage(folder / "take.usda")
    mesh = synthetic.meshes_message().meshes[0]
    binds = [np.linalg.inv(bind) for bind in synthetic.world_matrices(synthetic.rest_rotations())]
    for frame in POSE_FRAMES:
        time_s = frame / FPS
        worlds = synthetic.world_matrices(synthetic.pose_rotations(time_s), synthetic.root_translation(time_s))
        skinned = stage.posed(frame)[0].points
        assert len(skinned) == mesh.vertex_count
        for vertex in range(0, mesh.vertex_count, 5):
            bound = np.append(mesh.points[vertex], 1.0)
            expected = sum(
                weight * (worlds[joint] @ binds[joint] @ bound)
                for joint, weight in zip(mesh.joint_indices[vertex], mesh.joint_weights[vertex], strict=True)
            )
            np.testing.assert_allclose(skinned[vertex], expected[:3], atol=CHAIN_TOLERANCE)


def test_write_take_extent_is_the_box_of_the_skinned_mesh(folder: Path, stage: Usd.Stage) -> None:
    posed = SkinnedStage(folder / "take.usda")
    for frame in (0, 13, 24):
        extent = np.array(UsdGeom.Boundable(stage.GetDefaultPrim()).GetExtentAttr().Get(frame))
        points = posed.posed(frame)[0].points
        np.testing.assert_allclose(extent, [points.min(axis=0), points.max(axis=0)], atol=CHAIN_TOLERANCE)


def test_write_take_mesh_has_normals_colour_and_material(stage: Usd.Stage) -> None:
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{ROOT}/Geometry/arm_mesh"))
    normals = np.array(mesh.GetNormalsAttr().Get())
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)
    points = np.array(mesh.GetPointsAttr().Get()).reshape(synthetic.RINGS, synthetic.SIDES, 3)
    outward = (points - points.mean(axis=1, keepdims=True)).reshape(-1, 3)
    assert np.sum(normals * outward, axis=1).min() > 0.0
    np.testing.assert_allclose(np.array(mesh.GetDisplayColorAttr().Get()), [[0.8, 0.5, 0.3]], atol=1e-7)
    material, _ = UsdShade.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial()
    shader = material.ComputeSurfaceSource()[0]
    assert shader.GetIdAttr().Get() == "UsdPreviewSurface"
    np.testing.assert_allclose(shader.GetInput("diffuseColor").Get(), [0.8, 0.5, 0.3], atol=1e-7)


@pytest.mark.parametrize("name", ["take.usd", "take.usda", "take.usdc", "take.usdz"])
def test_write_take_every_format_passes_the_checks(take: Take, tmp_path: Path, name: str) -> None:
    write_take(take, tmp_path / name, FPS)
    assert [str(finding) for finding in check(tmp_path / name).findings] == []


def test_write_take_usdz_is_one_file_with_all_layers(take: Take, tmp_path: Path) -> None:
    write_take(take, tmp_path / "take.usdz", FPS)
    assert [path.name for path in tmp_path.iterdir()] == ["take.usdz"]
    names = zipfile.ZipFile(tmp_path / "take.usdz").namelist()
    assert names[0] == "take.usdc"
    assert sorted(names) == ["take.anim.usdc", "take.character.usdc", "take.usdc"]


WRITE_IN_NEW_PROCESS = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from client_support.takes import make_take
from layfigure.usd.writer import write_take
write_take(make_take(), Path(sys.argv[2]), 24.0)
"""


@pytest.mark.parametrize("name", ["take.usda", "take.usdc", "take.usdz"])
def test_write_take_in_other_process_and_folder_gives_equal_bytes(tmp_path: Path, name: str) -> None:
    for folder in ("first", "a second one"):
        (tmp_path / folder).mkdir()
        arguments = [
            sys.executable,
            "-c",
            WRITE_IN_NEW_PROCESS,
            str(Path(__file__).parent),
            str(tmp_path / folder / name),
        ]
        subprocess.run(arguments, check=True, timeout=60)
    first, second = tmp_path / "first", tmp_path / "a second one"
    names = sorted(path.name for path in first.iterdir())
    assert names == sorted(path.name for path in second.iterdir())
    for each in names:
        assert (first / each).read_bytes() == (second / each).read_bytes(), each


def test_write_take_replaces_an_earlier_take(take: Take, tmp_path: Path) -> None:
    write_take(make_take(poses=10), tmp_path / "take.usda", FPS)
    write_take(take, tmp_path / "take.usda", FPS)
    assert Usd.Stage.Open(str(tmp_path / "take.usda")).GetEndTimeCode() == 24.0
    assert len(list(tmp_path.iterdir())) == 3


def test_write_take_single_pose_is_valid(tmp_path: Path) -> None:
    assert len(write_take(make_take(poses=1), tmp_path / "take.usda", FPS).frames) == 1
    assert check(tmp_path / "take.usda").findings == ()


def test_write_take_that_fails_leaves_the_earlier_take_alone(
    take: Take, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_take(take, tmp_path / "take.usda", FPS)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("layfigure.usd.writer.write_animation_layer", fail)
    with pytest.raises(LayfigureError, match=r"take\.usda': No space left on device"):
        write_take(make_take(poses=5), tmp_path / "take.usda", FPS)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("name", ["take", "take.fbx", "take.USDA", "missing/take.usda"])
def test_check_output_impossible_name_is_a_usage_error(tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match=re.escape(str(tmp_path / name))):
        check_output(tmp_path / name)


def test_check_output_folder_is_a_usage_error(tmp_path: Path) -> None:
    (tmp_path / "take.usda").mkdir()
    with pytest.raises(UsageError, match="is a folder"):
        check_output(tmp_path / "take.usda")


@pytest.mark.parametrize(
    ("name", "legal"),
    [
        ("Hand", "Hand"),
        ("mixamorig:Hand", "mixamorig_Hand"),
        ("hand.L", "hand_L"),
        ("3rd", "_3rd"),
        ("Handgelenk ä", "Handgelenk__"),
        ("手", "joint"),
        ("", "joint"),
        ("a/b", "a_b"),
    ],
)
def test_legal_name_any_text_becomes_an_identifier(name: str, legal: str) -> None:
    assert legal_name(name, "joint") == legal


def test_unique_names_repeated_ones_are_numbered() -> None:
    assert unique_names(["a", "a", "a_1", "a:", "a."], "x") == ["a", "a_1", "a_1_1", "a_", "a__1"]


def test_joint_paths_several_roots_start_anew() -> None:
    assert joint_paths(["a", "b", "c"], [-1, 0, -1]) == ["a", "a/b", "c"]


def test_resample_frames_never_reach_past_the_last_pose(take: Take) -> None:
    for fps in (1.0, 23.976, 24.0, 25.0, 29.97, 59.94, 60.0, 120.0):
        frames = resample(take, fps)
        assert (len(frames) - 1) / fps <= take.duration_s + 1e-6 < len(frames) / fps + 1e-6
