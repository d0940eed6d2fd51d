"""A rig of 300 bones becomes a doll of the limbs that matter; what became of every other bone is told."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from character_support.crowded import APRON, FACE, HAIR, TAIL, make_crowded

SECONDS = 10.0
PHYSICS_HZ = 500.0
LARGEST_SAG = 1.05 * 0.04  # [rad]; the default settings let a limb sag by 0.04 that is stretched out level
LARGEST_SPEED = 1e-2  # [rad/s] of a joint in the end
LARGEST_LENGTH_ERROR = 1e-13  # of the character's size: rounding

Numbers = dict[str, Any]


@pytest.fixture(scope="module")
def crowded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("crowded") / "crowded.glb"
    assert make_crowded(path) >= 300
    return path


@pytest.fixture(scope="module")
def doll(binary: Path, crowded: Path) -> Numbers:
    done = subprocess.run([binary, "--inspect", crowded, "--json"], capture_output=True, check=True, text=True)
    result: Numbers = json.loads(done.stdout)
    return result


def bodies(doll: Numbers) -> set[str]:
    return {body["name"] for body in doll["bodies"]}


def test_every_bone_is_a_body_or_rides_for_a_reason(doll: Numbers) -> None:
    merged = {entry["bone"]: entry for entry in doll["merged"]}
    assert len(merged) + len(doll["bodies"]) == doll["bones"]
    assert not merged.keys() & bodies(doll)
    assert all(entry["reason"] and entry["body"] in bodies(doll) for entry in merged.values())


def test_limbs_fingers_tail_hair_and_clothes_are_bodies(doll: Numbers) -> None:
    limbs = {"Hips", "Spine", "Spine1", "Spine2", "Neck", "Head", "Jaw"}
    for side in ("Left", "Right"):
        limbs |= {f"{side}{part}" for part in ("Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase")}
        limbs |= {f"{side}Hand{finger}{k}" for finger in ("Thumb", "Index", "Pinky") for k in (1, 2, 3)}
    assert limbs <= bodies(doll)
    assert {f"{TAIL}{k}" for k in range(24)} <= bodies(doll)
    assert {f"{APRON}.{k}.{segment}" for k in range(8) for segment in range(3)} <= bodies(doll)


def test_twist_bones_faces_and_controls_ride(doll: Numbers) -> None:
    merged = {entry["bone"]: entry for entry in doll["merged"]}
    for side in ("Left", "Right"):
        for limb in ("Arm", "ForeArm", "UpLeg"):
            for k in (1, 2):
                helper = merged[f"{side}{limb}Twist{k}"]
                assert (helper["body"], helper["reason"]) == (f"{side}{limb}", "twist helper")
        for helper_name in ("IK_Hand", "IK_Elbow_Pole", "IK_Foot", "IK_Knee_Pole"):
            assert merged[f"{helper_name}.{side[0]}"]["reason"] in ("control without skin", "no skin")
    for part in FACE:
        face = [entry for bone, entry in merged.items() if bone.startswith(f"{part}.")]
        assert len(face) == 6
        assert {entry["body"] for entry in face} <= {"Head", "Jaw"}
        assert {entry["reason"] for entry in face} <= {"part of the face", "no skin"}  # three points may hold none


def test_bones_of_one_name_are_told_apart(doll: Numbers) -> None:
    names = [body["name"] for body in doll["bodies"]] + [entry["bone"] for entry in doll["merged"]]
    assert len(set(names)) == doll["bones"]
    strands = [name for name in names if name.split("_")[0] == HAIR]
    assert len(strands) == 72
    assert len([w for w in doll["warnings"] if w.startswith("bone ") and f"name '{HAIR}' is used twice" in w]) == 71


def test_both_sides_are_alike(doll: Numbers) -> None:
    by_name = {body["name"]: body for body in doll["bodies"]}
    for name, body in by_name.items():
        if name.startswith("Left"):
            other = by_name[name.replace("Left", "Right")]
            assert other["mass"] == pytest.approx(body["mass"], rel=1e-4), name
            assert other["yield_torque"] == pytest.approx(body["yield_torque"], rel=1e-3), name


def test_crowded_rig_stands(doll_stand: Path, crowded: Path) -> None:
    command = [doll_stand, crowded, str(SECONDS), str(PHYSICS_HZ)]
    stood: Numbers = json.loads(subprocess.run(command, capture_output=True, check=True, text=True).stdout)
    print(
        f"\n{stood['bones']} bones, {stood['bodies']} bodies, {stood['cpu_seconds']:.1f} s of CPU, sag {stood['sag']}"
    )
    assert stood["finite"], stood["failure"]
    assert stood["joint_speed"] < LARGEST_SPEED
    assert stood["sag"] < LARGEST_SAG, stood["sagging"]
    assert stood["bone_length_error"] < LARGEST_LENGTH_ERROR * 2.0
