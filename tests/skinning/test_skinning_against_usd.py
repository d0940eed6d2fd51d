"""The server's skinning library against UsdSkel's, on the USD that the client writes of the same poses."""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdSkel
from server_support.process import ServerProcess
from smooth_doll import write_smooth_doll

from layfigure import rotation, skeleton
from layfigure.bus import Bus
from layfigure.connection import Connection
from layfigure.protocol import Character, Floats, Mesh
from layfigure.skinning import Skin
from layfigure.take import Take
from layfigure.usd.reader import SkinnedStage
from layfigure.usd.writer import write_take

FPS = 25.0
FRAME_US = 40_000  # whole, so that every pose is a frame and nothing is interpolated
POSES = 12
LARGEST_TURN = 1.2  # [rad] of a joint
SEED = 20_08
FLOAT_TOLERANCE = 1e-6  # [m] roundings to float along a chain of joints, over 0.3 m and 1 m from the origin
LEAST_DIFFERENCE = 1e-3  # [m] between the two ways to blend, somewhere

METHODS = {"linear": UsdSkel.Tokens.classicLinear, "dual_quaternion": UsdSkel.Tokens.dualQuaternion}


@dataclass(frozen=True)
class Doll:
    path: Path
    character: Character
    meshes: tuple[Mesh, ...]


@pytest.fixture(scope="module")
def doll(binary: Path, tmp_path_factory: pytest.TempPathFactory) -> Doll:
    """The doll with a skin that bends, as the server describes it to its clients."""
    path = tmp_path_factory.mktemp("doll") / "doll.glb"
    write_smooth_doll(path)
    with (
        ServerProcess([str(binary), str(path), "--clock", "lockstep", "--broker", "0"]) as server,
        Bus(server.url) as bus,
    ):
        connection = Connection(bus)
        character = connection.fetch_character()
        return Doll(path, character, connection.fetch_meshes(character))


def random_rotations(character: Character) -> Floats:
    """(P, J, 4): each joint turned about any axis from its rest rotation."""
    generator = np.random.default_rng(SEED)
    joints = len(character.joints)
    axes = generator.normal(size=(POSES, joints, 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    half = 0.5 * generator.uniform(-LARGEST_TURN, LARGEST_TURN, size=(POSES, joints, 1))
    turns = np.concatenate([np.cos(half), np.sin(half) * axes], axis=-1)
    rests = np.array([joint.rest_rotation for joint in character.joints])
    return rotation.normalized(rotation.multiply(np.broadcast_to(rests, turns.shape), turns))


@pytest.fixture(scope="module")
def take(doll: Doll) -> Take:
    rotations = random_rotations(doll.character)
    generator = np.random.default_rng(SEED + 1)
    rests = np.array([joint.rest_rotation for joint in doll.character.joints])
    return Take(
        character=doll.character,
        meshes=doll.meshes,
        times_us=np.arange(POSES, dtype=np.int64) * FRAME_US,
        root_translations=generator.uniform(-1.0, 1.0, size=(POSES, 3)),
        rotations=rotations,
        rest_rotations=np.repeat(rests[None], POSES, axis=0),
        torques=np.zeros((POSES, len(rests), 3)),
        yielded=np.zeros((POSES, len(rests)), np.bool_),
        pointers=(),
        lost_poses=0,
        restarts=0,
        last_status=None,
    )


def skinned_by_usd(take: Take, blend: str, folder: Path) -> list[list[Floats]]:
    """For each pose the vertices of each mesh."""
    path = folder / f"{blend}.usda"
    assert len(write_take(take, path, FPS).frames) == POSES
    stage = Usd.Stage.Open(str(path))
    meshes = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert len(meshes) == len(take.meshes)
    for prim in meshes:
        UsdSkel.BindingAPI(prim).CreateSkinningMethodAttr(METHODS[blend])
    stage.GetRootLayer().Save()
    skinned = SkinnedStage(path)
    return [[mesh.points for mesh in skinned.posed(frame)] for frame in range(POSES)]


def skinned_by_library(skin_dump: Path, doll: Doll, take: Take, blend: str) -> list[list[Floats]]:
    lines = [
        json.dumps({"blend": blend, "root_translation": translation.tolist(), "rotations": rotations.tolist()})
        for translation, rotations in zip(take.root_translations, take.rotations, strict=True)
    ]
    result = subprocess.run(
        [skin_dump, doll.path], input="\n".join(lines), capture_output=True, text=True, timeout=60, check=True
    )
    return [[np.array(mesh) for mesh in json.loads(line)] for line in result.stdout.splitlines()]


def largest_distance(first: list[list[Floats]], second: list[list[Floats]]) -> float:
    assert len(first) == len(second) == POSES
    return max(
        float(np.linalg.norm(a - b, axis=1).max())
        for meshes in zip(first, second, strict=True)
        for a, b in zip(*meshes, strict=True)
    )


def test_doll_is_blended_of_several_bones(doll: Doll) -> None:
    influences = np.concatenate([(mesh.joint_weights > 0.0).sum(axis=1) for mesh in doll.meshes])
    assert (influences > 1).mean() > 0.8
    assert (influences > 2).mean() > 0.3


@pytest.mark.parametrize("blend", list(METHODS))
def test_skinning_equals_that_of_usd(skin_dump: Path, doll: Doll, take: Take, tmp_path: Path, blend: str) -> None:
    by_usd = skinned_by_usd(take, blend, tmp_path)
    by_library = skinned_by_library(skin_dump, doll, take, blend)
    assert largest_distance(by_usd, by_library) < FLOAT_TOLERANCE


def test_methods_of_blending_differ(skin_dump: Path, doll: Doll, take: Take, tmp_path: Path) -> None:
    for skinned in (
        {blend: skinned_by_usd(take, blend, tmp_path) for blend in METHODS},
        {blend: skinned_by_library(skin_dump, doll, take, blend) for blend in METHODS},
    ):
        assert largest_distance(skinned["linear"], skinned["dual_quaternion"]) > LEAST_DIFFERENCE


def test_linear_skinning_equals_that_of_the_client(skin_dump: Path, doll: Doll, take: Take) -> None:
    rotations, positions = skeleton.world_poses(take.character, take.root_translations, take.rotations)
    skin = Skin(take.character, take.meshes)
    by_client = [
        np.split(skinned, np.cumsum([len(mesh.points) for mesh in take.meshes])[:-1])
        for skinned in skin.skin(skin.motions(rotations, positions))
    ]
    assert largest_distance(by_client, skinned_by_library(skin_dump, doll, take, "linear")) < FLOAT_TOLERANCE


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ('{"blend": "cubic", "root_translation": [0, 0, 0], "rotations": []}', "blend 'cubic'"),
        ('{"blend": "linear", "root_translation": [0, 0, 0], "rotations": [[1, 0, 0, 0]]}', "1 rotations, expected 17"),
    ],
)
def test_dump_refuses_a_bad_pose(skin_dump: Path, doll: Doll, line: str, reason: str) -> None:
    result = subprocess.run([skin_dump, doll.path], input=line, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 1
    assert reason in result.stderr
