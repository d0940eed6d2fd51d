"""Takes as Blender imports them: bones and skin stand where the server's poses have them, in all frames."""

from __future__ import annotations

from collections.abc import Mapping
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
POSE_HZ = 50.0  # every 20 steps: a pose falls on each frame, so that frames are poses and nothing is between them
HEAD_TOLERANCE = 1e-5  # [m] what animators need; single precision in Blender's chains of bones takes 1e-6
SKIN_TOLERANCE = 1e-4  # [m] likewise; Blender keeps and blends weights in single precision

pytestmark = pytest.mark.slow


@pytest.fixture(scope="session")
def take(
    bpy_python: BpyPython, binary: Path, character: Path, tmp_path_factory: pytest.TempPathFactory
) -> layfigure.Take:
    """A hand leads the doll's left hand round and round, past the yield of its arm, while another bends the trunk."""
    command = [binary, character, "--clock", "lockstep", "--broker", "0", "--pose-hz", POSE_HZ]
    with ServerProcess(list(map(str, command))) as server, layfigure.connect(server.url) as doll:
        places = layfigure.world_poses(doll.character, doll.pose())[1]
        hand, chest = places[doll.joint("hand.L")], places[doll.joint("chest")]
        for pointer, bone, place in ((0, "hand.L", hand), (1, "chest", chest)):
            doll.move_pointer(pointer, place)
            doll.command("grab", pointer=pointer, bone=bone, point=[0.0, 0.0, 0.0])
        with doll.record(tmp_path_factory.mktemp("take") / "take.lcmlog") as recording:
            for frame in range(1, FRAMES):
                turn = 2.0 * np.pi * frame / 200.0
                reach = 0.08 * np.array([0.2 * np.sin(turn), np.cos(turn) - 1.0, np.sin(2.0 * turn)])
                bend = 0.02 * np.array([0.0, np.sin(0.5 * turn), 0.0])
                doll.next_pose({0: hand + reach, 1: chest + bend})
    assert len(recording.take.times_us) == FRAMES
    return recording.take


@pytest.fixture(scope="session")
def skinned(take: layfigure.Take) -> tuple[np.ndarray, np.ndarray]:
    """Joints (F, J, 3) and vertices of all meshes (F, V, 3) of the server's poses."""
    skin = Skin(take.character, take.meshes)
    rotations, positions = skeleton.world_poses(take.character, take.root_translations, take.rotations)
    return positions, skin.skin(skin.motions(rotations, positions))


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
    skinned: tuple[np.ndarray, np.ndarray],
    tmp_path: Path,
) -> None:
    out = tmp_path / "take.usda"
    usd = layfigure.write_usd(take, out, fps=POSE_HZ, up_axis=up_axis, meters_per_unit=meters_per_unit)
    blender = imported(bpy_python, usd, tmp_path)
    positions, vertices = skinned

    joints = take.character.joints
    names = [path.rpartition("/")[2] for path in joint_paths([j.name for j in joints], [j.parent for j in joints])]
    order = [blender["bones"].tolist().index(name) for name in names]
    heads = blender["heads"][:, order]
    mesh_names = list(unique_names((mesh.name for mesh in take.meshes), "mesh"))
    of_meshes = [blender[f"vertices_{blender['meshes'].tolist().index(name)}"] for name in mesh_names]

    assert heads.shape == positions.shape
    assert farthest(positions, positions[:1]) > 0.1  # it moves
    head_error, skin_error = farthest(heads, positions), farthest(np.concatenate(of_meshes, axis=1), vertices)
    errors = f"heads {head_error:.2e} m, skin {skin_error:.2e} m"
    print(f"{up_axis} up, {meters_per_unit:g} m: {errors} over {len(heads)} frames")
    assert head_error < HEAD_TOLERANCE
    assert skin_error < SKIN_TOLERANCE
