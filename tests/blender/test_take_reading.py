"""What is read of a take for an armature, without Blender: at any rate, in any place, of the right character only."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdSkel, Vt

from layfigure import LayfigureError, rotation
from layfigure.usd import values

sys.path.append(str(Path(__file__).resolve().parents[2] / "plugins/blender"))
from layfigure_blender import take_reading
from layfigure_blender.rig import Bone, MisfitError

NAMES = ["hips", "upper arm.L", "lower.L"]
PATHS = ["hips", "hips/upper_arm_L", "hips/upper_arm_L/lower_L"]
FPS = 25.0
SPEED = 0.5  # [rad/s] of all joints about their z axes
ROUNDING = 1e-6  # of USD's single precision
HEADS = np.array([[0.1, -0.2, 1.0], [0.1, 0.1, 1.3], [0.2, 0.4, 1.35]])


def write_take(path: Path, frames: int = 26, *, keeps_names: bool = True) -> Path:
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(FPS)
    stage.SetStartTimeCode(0.0)
    stage.SetEndTimeCode(frames - 1.0)
    UsdSkel.Root.Define(stage, "/doll")
    skeleton = UsdSkel.Skeleton.Define(stage, "/doll/Skeleton")
    skeleton.CreateJointsAttr(Vt.TokenArray(PATHS))
    if keeps_names:
        skeleton.GetPrim().SetCustomDataByKey("layfigure:jointNames", Vt.StringArray(NAMES))
    still = np.array([1.0, 0.0, 0.0, 0.0])
    local = np.diff(HEADS, axis=0, prepend=np.zeros((1, 3)))
    skeleton.CreateBindTransformsAttr(Vt.Matrix4dArray([values.matrix4d(still, head) for head in HEADS]))
    skeleton.CreateRestTransformsAttr(Vt.Matrix4dArray([values.matrix4d(still, place) for place in local]))
    animation = UsdSkel.Animation.Define(stage, "/doll/Animation")
    animation.CreateJointsAttr(Vt.TokenArray(PATHS))
    animation.CreateTranslationsAttr(values.vec3f_arrays(local[None])[0])
    animation.CreateScalesAttr(values.vec3h_array(np.ones((3, 3))))
    turned = rotation.from_vector(SPEED * np.arange(frames)[:, None, None] / FPS * np.array([[0.0, 0.0, 1.0]] * 3))
    for frame, sample in enumerate(values.quatf_arrays(turned)):
        animation.CreateRotationsAttr().Set(sample, float(frame))
    binding = UsdSkel.BindingAPI.Apply(skeleton.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([animation.GetPath()])
    stage.GetRootLayer().Save()
    return path


def bones_at(to_armature: np.ndarray, names: list[str] | None = None, heads: np.ndarray = HEADS) -> list[Bone]:
    """With axes of their own, where the joints are, seen from an armature."""
    dice = np.random.default_rng(8)
    bones = [Bone("control", -1, np.eye(4))]
    for index, (name, head) in enumerate(zip(names or NAMES, heads, strict=True)):
        rest = np.eye(4)
        rest[:3, :3] = rotation.to_matrix(rotation.normalized(dice.normal(size=4)))
        rest[:3, 3] = (to_armature @ [*head, 1.0])[:3]
        bones.append(Bone(name, index, rest))
    return bones


def similarity(scale: float, seed: int, mirror: float = 1.0) -> np.ndarray:
    dice = np.random.default_rng(seed)
    result = np.eye(4)
    turn = rotation.to_matrix(rotation.normalized(dice.normal(size=4)))
    result[:3, :3] = scale * turn @ np.diag([mirror, 1.0, 1.0])
    result[:3, 3] = dice.normal(size=3)
    return result


@pytest.mark.parametrize(("fps", "count"), [(25.0, 26), (50.0, 51), (24.0, 25), (10.0, 11), (30000.0 / 1001.0, 30)])
def test_take_is_resampled_to_the_scene(tmp_path: Path, fps: float, count: int) -> None:
    take = take_reading.read_take(write_take(tmp_path / "take.usda"), fps)
    assert take.names == tuple(NAMES)
    assert len(take.poses) == count
    angles = np.arctan2(take.poses[:, 0, 1, 0], take.poses[:, 0, 0, 0])
    np.testing.assert_allclose(angles, SPEED * np.arange(count) / fps, atol=ROUNDING)


def test_names_of_other_tools_are_the_ends_of_paths(tmp_path: Path) -> None:
    take = take_reading.read_take(write_take(tmp_path / "take.usda", keeps_names=False), FPS)
    assert take.names == ("hips", "upper_arm_L", "lower_L")


@pytest.mark.parametrize("mirror", [1.0, -1.0])
@pytest.mark.parametrize("scale", [0.01, 1.0, 40.0])
def test_bones_move_as_joints_do_wherever_the_armature_stood_and_stands(
    tmp_path: Path, scale: float, mirror: float
) -> None:
    take = take_reading.read_take(write_take(tmp_path / "take.usda"), FPS)
    was_at = similarity(scale, 9, mirror)
    bones = bones_at(np.linalg.inv(was_at))
    expected = take.poses @ np.linalg.inv(take.rests)
    for stands_at in (was_at, similarity(3.0, 10, mirror)):
        keyed, poses = take_reading.bone_poses(take, bones, stands_at, "doll")
        assert [bones[b].name for b in keyed] == NAMES
        rests = np.array([bones[b].rest for b in keyed])
        in_world = was_at @ poses[:, keyed] @ np.linalg.inv(rests) @ np.linalg.inv(was_at)
        # three joints are in a plane, which leaves a mirror open: `stands_at` has the same
        np.testing.assert_allclose(in_world, expected, atol=1e-5)
        np.testing.assert_array_equal(poses[:, 0], np.tile(np.eye(4), (len(poses), 1, 1)))


def test_other_character_is_refused(tmp_path: Path) -> None:
    take = take_reading.read_take(write_take(tmp_path / "take.usda"), FPS)
    with pytest.raises(MisfitError, match=r"none of its joints, such as 'hips', is a bone of 'Bob'"):
        take_reading.bone_poses(take, bones_at(np.eye(4), ["a", "b", "c"]), np.eye(4), "Bob")
    longer = HEADS + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.5, 0.0, 0.0]])
    with pytest.raises(MisfitError, match=r"other proportions: its joint '.*' is .* m from"):
        take_reading.bone_poses(take, bones_at(np.eye(4), heads=longer), np.eye(4), "Bob")


def test_armature_that_is_scaled_unevenly_is_refused(tmp_path: Path) -> None:
    take = take_reading.read_take(write_take(tmp_path / "take.usda"), FPS)
    with pytest.raises(MisfitError, match="scaled unevenly"):
        take_reading.bone_poses(take, bones_at(np.eye(4)), np.diag([1.0, 2.0, 1.0, 1.0]), "Bob")


def test_file_without_frames_is_refused(tmp_path: Path) -> None:
    path = write_take(tmp_path / "take.usda")
    path.write_text(path.read_text().replace("startTimeCode = 0", "").replace("endTimeCode = 25", ""))
    with pytest.raises(LayfigureError, match="does not say which frames it has"):
        take_reading.read_take(path, FPS)


def test_absurd_length_is_refused(tmp_path: Path) -> None:
    path = write_take(tmp_path / "take.usda")
    path.write_text(path.read_text().replace("endTimeCode = 25", "endTimeCode = 1e15"))
    with pytest.raises(LayfigureError, match="expected at most"):
        take_reading.read_take(path, FPS)


@pytest.mark.parametrize("content", ["", "hello", '#usda 1.0\ndef Cube "Cube" {}\n'])
def test_file_that_is_no_take_is_refused_in_one_line(tmp_path: Path, content: str) -> None:
    path = tmp_path / "take.usda"
    path.write_text(content)
    with pytest.raises(LayfigureError) as caught:
        take_reading.read_take(path, FPS)
    assert "\n" not in str(caught.value)
    assert "take.usda" in str(caught.value)


@pytest.mark.parametrize("count", [1, 2, 3, 12])
def test_similarity_goes_from_points_to_points(count: int) -> None:
    """What single points, lines and planes leave open is as in the similarity beside it."""
    source = np.random.default_rng(11).normal(size=(count, 3))
    true = similarity(2.5, 12)
    target = source @ true[:3, :3].T + true[:3, 3]
    found = take_reading.similarity(source, target, true)
    np.testing.assert_allclose(found, true, atol=1e-9)
    other = take_reading.similarity(source, target, similarity(0.7, 13))
    np.testing.assert_allclose(source @ other[:3, :3].T + other[:3, 3], target, atol=1e-7)
