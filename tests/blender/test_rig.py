"""Joints to bones and back, with bones of any axes in armatures of any place, scale and handedness."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from layfigure_blender.rig import UNSEEN_TURN, UNSEEN_WAY, Bone, BoneMap, MisfitError, fitted, looks_alike, matrices

import layfigure
from layfigure import rotation, skeleton
from layfigure.protocol import Character, Joint

ROUNDING = 1e-12  # [m], [rad]: double precision through a few products
PARENTS = (-1, 0, 1, 2, 0, 4, 1)
NAMES = ("hips", "spine", "chest", "hand", "thigh", "foot", "helper")
NO_BODY = 6
SCALES = (0.01, 1.0, 100.0)


def random_rotations(dice: np.random.Generator, count: int) -> np.ndarray:
    return rotation.normalized(dice.normal(size=(count, 4)))


def make_character(dice: np.random.Generator) -> Character:
    count = len(PARENTS)
    rests, offsets = random_rotations(dice, count), dice.normal(size=(count, 3))
    worlds, places = skeleton.compose(generations_of(PARENTS), offsets[None], rests[None])
    joints = tuple(
        Joint(NAMES[j], PARENTS[j], offsets[j], rests[j], places[0, j], worlds[0, j], j != NO_BODY, 1.0, 1.0, 1.0)
        for j in range(count)
    )
    return Character(0, 1, "made", "made.glb", "", 7, 1000.0, 60.0, "realtime", 0, joints)


def generations_of(parents: tuple[int, ...]) -> list[tuple[np.ndarray, np.ndarray]]:
    depths = [0] * len(parents)
    for j, parent in enumerate(parents):
        depths[j] = depths[parent] + 1 if parent >= 0 else 0
    return [
        (np.flatnonzero(np.array(depths) == d), np.array(parents)[np.flatnonzero(np.array(depths) == d)])
        for d in range(1, max(depths) + 1)
    ]


def make_pose(character: Character, rotations: np.ndarray, root: np.ndarray | None = None) -> layfigure.Pose:
    count = len(rotations)
    at = character.joints[0].rest_translation if root is None else root
    return layfigure.Pose(0, 1, 7, 0, 0, at, rotations, rotations, np.zeros((count, 3)), np.zeros(count, np.bool_))


def rest_rotations(character: Character) -> np.ndarray:
    return np.array([joint.rest_rotation for joint in character.joints])


def random_pose(character: Character, dice: np.random.Generator) -> layfigure.Pose:
    """As a doll has it: what is no body rides rigidly."""
    turned = random_rotations(dice, len(character.joints))
    turned[NO_BODY] = character.joints[NO_BODY].rest_rotation
    return make_pose(character, turned, dice.normal(size=3))


def similarity(dice: np.random.Generator, scale: float, *, mirrored: bool = False) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3] = (
        scale * rotation.to_matrix(random_rotations(dice, 1))[0] @ np.diag([-1.0 if mirrored else 1.0, 1, 1])
    )
    result[:3, 3] = scale * dice.normal(size=3)
    return result


def joint_matrices(character: Character, pose: layfigure.Pose) -> np.ndarray:
    return matrices(*layfigure.world_poses(character, pose))


def make_bones(character: Character, to_world: np.ndarray, dice: np.random.Generator) -> list[Bone]:
    """At the joints, with axes of their own: any rotation, in particular any roll."""
    rest = joint_matrices(character, make_pose(character, rest_rotations(character)))
    own = matrices(random_rotations(dice, len(rest)), np.zeros((len(rest), 3)))
    bones = []
    for joint, world, turn in zip(character.joints, rest, own, strict=True):
        at = np.eye(4)
        at[:3, 3] = (np.linalg.inv(to_world) @ world)[:3, 3]
        bones.append(Bone(joint.name, joint.parent, at @ turn))
    return bones


@pytest.fixture
def dice() -> np.random.Generator:
    return np.random.default_rng(5)


@pytest.fixture
def character(dice: np.random.Generator) -> Character:
    return make_character(dice)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("scale", SCALES)
def test_bones_move_as_their_joints_do(
    character: Character, dice: np.random.Generator, scale: float, mirrored: bool
) -> None:
    to_world = similarity(dice, scale, mirrored=mirrored)
    bones = make_bones(character, to_world, dice)
    bone_map = BoneMap(character, bones, to_world)
    rest, pose = make_pose(character, rest_rotations(character)), random_pose(character, dice)
    in_rest = bone_map.pose_matrices(rest)
    assert np.allclose(in_rest, [bone.rest for bone in bones], rtol=0.0, atol=ROUNDING / min(scale, 1.0))
    moved = bone_map.pose_matrices(pose)
    motions = joint_matrices(character, pose) @ np.linalg.inv(joint_matrices(character, rest))
    expected = motions @ to_world @ np.array([bone.rest for bone in bones])
    assert np.allclose(to_world @ moved, expected, rtol=0.0, atol=ROUNDING * max(scale, 1.0))
    assert np.allclose(moved[:, :3, :3] @ moved[:, :3, :3].transpose(0, 2, 1), np.eye(3), atol=ROUNDING)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("scale", SCALES)
def test_rotations_are_those_that_the_pose_came_from(
    character: Character, dice: np.random.Generator, scale: float, mirrored: bool
) -> None:
    to_world = similarity(dice, scale, mirrored=mirrored)
    bone_map = BoneMap(character, make_bones(character, to_world, dice), to_world)
    pose = random_pose(character, dice)
    joints, rotations = bone_map.rotations(bone_map.pose_matrices(pose))
    assert joints.tolist() == [1, 2, 3, 4, 5]  # not the root, not what is no body
    assert rotation.angle_between(rotations, pose.rotations[joints]).max() < ROUNDING


def test_root_that_is_moved_takes_the_doll_along(character: Character, dice: np.random.Generator) -> None:
    to_world = similarity(dice, 2.0)
    bone_map = BoneMap(character, make_bones(character, to_world, dice), to_world)
    pose = random_pose(character, dice)
    moved_by = matrices(random_rotations(dice, 1), dice.normal(size=(1, 3)))[0]
    wanted = moved_by @ bone_map.pose_matrices(pose)
    bone_map.place_root(wanted)
    _, rotations = bone_map.rotations(wanted)
    assert rotation.angle_between(rotations, pose.rotations[[1, 2, 3, 4, 5]]).max() < ROUNDING
    sagged = make_pose(character, pose.rotations, np.add(pose.root_translation, [0.0, 0.0, -0.01]))
    bone_map.place_root(wanted, sagged)
    assert np.allclose(bone_map.pose_matrices(sagged), wanted, atol=10 * ROUNDING)


def test_bones_without_a_joint_keep_their_place_on_their_parent(
    character: Character, dice: np.random.Generator
) -> None:
    bones = make_bones(character, np.eye(4), dice)
    extra = Bone("only in blender", 3, bones[3].rest @ similarity(dice, 1.0))
    above = Bone("control", -1, similarity(dice, 1.0))
    moved = BoneMap(character, [*bones, extra, above], np.eye(4)).pose_matrices(random_pose(character, dice))
    local = np.linalg.inv(bones[3].rest) @ extra.rest
    assert np.allclose(np.linalg.inv(moved[3]) @ moved[-2], local, atol=ROUNDING)
    assert np.allclose(moved[-1], above.rest)


def test_what_holds_a_driven_bone_is_driven_or_between_driven_ones(character: Character) -> None:
    chain = ("control", "hips", "rider", "spine", "helper", "leaf")  # the doll has bodies of hips and spine alone
    bones = [Bone(name, index - 1, np.eye(4)) for index, name in enumerate(chain)]
    bone_map = BoneMap(character, bones, np.eye(4))
    assert bone_map.driven_names == ("hips", "spine")
    assert bone_map.holding_names == ("hips", "rider", "spine")
    assert {bones[b].name for b in bone_map.moved} == set(chain) - {"control"}


def test_joints_and_bones_know_each_other_by_name(character: Character, dice: np.random.Generator) -> None:
    bones = make_bones(character, np.eye(4), dice)
    renamed = [bone._replace(name="Fuß") if bone.name == "foot" else bone for bone in bones]
    bone_map = BoneMap(character, renamed, np.eye(4))
    assert bone_map.joint_of_bone("chest") == 2
    assert bone_map.bone_of_joint(2) == "chest"
    assert bone_map.joint_of_bone("Fuß") is None
    assert bone_map.bone_of_joint(5) is None
    assert bone_map.driven_names == ("hips", "spine", "chest", "hand", "thigh")


def test_scale_that_differs_between_axes_is_refused(character: Character, dice: np.random.Generator) -> None:
    bones = make_bones(character, np.eye(4), dice)
    for axes, words in (((1.0, 1.0, 1.01), "scaled unevenly"), ((0.0, 0.0, 0.0), "scale is 0")):
        with pytest.raises(MisfitError, match=words):
            BoneMap(character, bones, np.diag([*axes, 1.0]))
    sheared = np.eye(4)
    sheared[0, 1] = 0.1
    with pytest.raises(MisfitError, match="scaled unevenly"):
        BoneMap(character, bones, sheared)


def test_armature_of_another_character_is_refused(character: Character) -> None:
    with pytest.raises(MisfitError, match="no bone of the armature is a joint of the doll 'made'"):
        BoneMap(character, [Bone("Bone", -1, np.eye(4))], np.eye(4))
    with pytest.raises(MisfitError, match="no bone of the armature is a joint of the doll 'made'"):
        fitted(character, [Bone("Bone", -1, np.eye(4))], np.eye(4))


@pytest.mark.parametrize("scale", SCALES)
def test_fitted_finds_where_another_program_has_put_the_character(
    character: Character, dice: np.random.Generator, scale: float
) -> None:
    to_world = similarity(dice, scale)
    bones = make_bones(character, to_world, dice)
    assert fitted(character, bones, to_world) is to_world
    found = fitted(character, bones, np.eye(4))
    assert np.allclose(found, to_world, rtol=1e-9, atol=1e-9 * scale)


def test_fitted_armature_of_other_proportions_is_refused(character: Character, dice: np.random.Generator) -> None:
    bones = make_bones(character, np.eye(4), dice)
    longer = bones[3].rest.copy()
    longer[:3, 3] += 0.5
    with pytest.raises(MisfitError, match="the armature is not that of the doll 'made': bones are up to"):
        fitted(character, [*bones[:3], bones[3]._replace(rest=longer), *bones[4:]], np.eye(4))


def test_poses_look_alike_up_to_what_nobody_sees(character: Character, dice: np.random.Generator) -> None:
    pose = random_pose(character, dice)
    for share, alike in ((0.5, True), (2.0, False)):
        turn = rotation.from_vector(share * UNSEEN_TURN * np.array([0.0, 0.0, 1.0]))
        turned = rotation.multiply(pose.rotations, turn)
        assert looks_alike(pose, dataclasses.replace(pose, rotations=turned)) is alike
        away = pose.root_translation + np.array([0.0, share * UNSEEN_WAY, 0.0])
        assert looks_alike(pose, dataclasses.replace(pose, root_translation=away)) is alike
