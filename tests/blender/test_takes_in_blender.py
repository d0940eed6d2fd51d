"""Takes as Blender imports them: bones and skin stand where the server's poses have them, in all frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from blender_support.bpy_process import BpyPython
from server_support.process import ServerProcess

import layfigure
from layfigure import skeleton
from layfigure.skinning import Skin
from layfigure.usd.names import joint_paths, unique_names

FRAMES = 1000
BLOCK = 100  # frames
POSE_HZ = 50.0  # every 20 steps: a pose falls on each frame, so that frames are poses and nothing is between them
HEAD_TOLERANCE = 1e-5  # [m] what animators need; single precision in Blender's chains of bones takes 1e-6
SKIN_TOLERANCE = 1e-4  # [m] likewise; Blender keeps and blends weights in single precision

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Scene:
    """A character, and the bones by which a hand leads its arm round and round while another bends its trunk."""

    hand: str
    chest: str
    reach: float  # [m], past the yield of its arm
    bend: float  # [m]


SCENES = {
    "doll": Scene("hand.L", "chest", 0.08, 0.02),
    "human": Scene("mixamorig:LeftHand", "mixamorig:Spine2", 0.15, 0.03),
}


@pytest.fixture(scope="session", params=SCENES)
def take(
    request: pytest.FixtureRequest, bpy_python: BpyPython, binary: Path, tmp_path_factory: pytest.TempPathFactory
) -> layfigure.Take:
    """The project's own doll, and MakeHuman's body on Mixamo's rig."""
    scene = SCENES[request.param]
    if request.param == "doll":
        character = request.getfixturevalue("character")
    else:
        character = request.getfixturevalue("make_human_rig")("mixamo")
    command = [binary, character, "--clock", "lockstep", "--broker", "0", "--pose-hz", POSE_HZ]
    with ServerProcess(list(map(str, command))) as server, layfigure.connect(server.url) as doll:
        places = layfigure.world_poses(doll.character, doll.pose())[1]
        hand, chest = places[doll.joint(scene.hand)], places[doll.joint(scene.chest)]
        for pointer, bone, place in ((0, scene.hand, hand), (1, scene.chest, chest)):
            doll.move_pointer(pointer, place)
            doll.command("grab", pointer=pointer, bone=bone, point=[0.0, 0.0, 0.0])
        with doll.record(tmp_path_factory.mktemp("take") / "take.lcmlog") as recording:
            for frame in range(1, FRAMES):
                turn = 2.0 * np.pi * frame / 200.0
                reach = scene.reach * np.array([0.2 * np.sin(turn), np.cos(turn) - 1.0, np.sin(2.0 * turn)])
                bend = scene.bend * np.array([0.0, np.sin(0.5 * turn), 0.0])
                doll.next_pose({0: hand + reach, 1: chest + bend})
    assert len(recording.take.times_us) == FRAMES
    return recording.take


@dataclass(frozen=True)
class Posed:
    """The server's poses, in blocks of frames: all vertices of a human in 1000 frames are many."""

    skin: Skin
    rotations: np.ndarray
    positions: np.ndarray  # (F, J, 3)

    def farthest(self, vertices: np.ndarray) -> float:
        """The largest distance of vertices (F, V, 3) of all meshes from where the poses have them."""
        found = 0.0
        for start in range(0, len(self.positions), BLOCK):
            block = slice(start, start + BLOCK)
            motions = self.skin.motions(self.rotations[block], self.positions[block])
            found = max(found, farthest(vertices[block], self.skin.skin(motions)))
        return found


@pytest.fixture(scope="session")
def posed(take: layfigure.Take) -> Posed:
    return Posed(
        Skin(take.character, take.meshes),
        *skeleton.world_poses(take.character, take.root_translations, take.rotations),
    )


def imported(bpy_python: BpyPython, usd: Path, folder: Path) -> Mapping[str, np.ndarray]:
    out = folder / "imported.npz"
    bpy_python.run("import_take.py", usd, out)
    with np.load(out) as arrays:
        return dict(arrays)


def farthest(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b, axis=-1).max())


@pytest.mark.parametrize("meters_per_unit", [1.0, 0.01])
@pytest.mark.parametrize("up_axis", ["Z", "Y"])
def test_blender_poses_bones_and_skin_as_the_server_does(
    up_axis: Literal["Y", "Z"],
    meters_per_unit: float,
    bpy_python: BpyPython,
    take: layfigure.Take,
    posed: Posed,
    tmp_path: Path,
) -> None:
    out = tmp_path / "take.usda"
    usd = layfigure.write_usd(take, out, fps=POSE_HZ, up_axis=up_axis, meters_per_unit=meters_per_unit)
    blender = imported(bpy_python, usd, tmp_path)

    joints = take.character.joints
    names = [path.rpartition("/")[2] for path in joint_paths([j.name for j in joints], [j.parent for j in joints])]
    order = [blender["bones"].tolist().index(name) for name in names]
    heads = blender["heads"][:, order]
    mesh_names = list(unique_names((mesh.name for mesh in take.meshes), "mesh"))
    of_meshes = [blender[f"vertices_{blender['meshes'].tolist().index(name)}"] for name in mesh_names]

    assert heads.shape == posed.positions.shape
    assert farthest(posed.positions, posed.positions[:1]) > 0.1  # it moves
    head_error = farthest(heads, posed.positions)
    skin_error = posed.farthest(np.concatenate(of_meshes, axis=1))
    errors = f"heads {head_error:.2e} m, skin {skin_error:.2e} m"
    print(f"{take.character.name}, {up_axis} up, {meters_per_unit:g} m: {errors} over {len(heads)} frames")
    assert head_error < HEAD_TOLERANCE
    assert skin_error < SKIN_TOLERANCE
