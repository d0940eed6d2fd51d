"""A person with more bones than any body needs: a face, twist bones, IK, hair, a tail, and names as artists leave them.

T-pose, 1.7 m, looking along +Z, Y up.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from glb import Array, Bone, Mesh, rigid, write_glb

from .creature import tube

HAIR = "hair"  # that of all strands' bones
TAIL = "尾"
APRON = "Schürze"
FACE = ("brow", "eyelid", "cheek", "lip", "nose", "tongue", "teeth", "eye")
RINGS_PER_BONE = 8


class Rig:
    """Bones and meshes in the making."""

    def __init__(self) -> None:
        self.bones: list[Bone] = []
        self.skins: list[tuple[str, Array, Array, list[tuple[int, Array]]]] = []

    def add_bone(self, name: str, parent: int, place: Array) -> int:
        self.bones.append(Bone(name, parent, rigid(np.eye(3), place)))
        return len(self.bones) - 1

    def add_limb(self, names: list[str], parent: int, start: Array, end: Array, radius: float) -> list[int]:
        """A tube along bones that share it evenly; a bone called after a Twist hangs on the last other one."""
        indices: list[int] = []
        limb = parent
        for k, name in enumerate(names):
            index = self.add_bone(name, limb, start + (end - start) * (k / len(names)))
            indices.append(index)
            limb = limb if "Twist" in name else index
        points, triangles, along = tube(start, end, (radius, 0.9 * radius), RINGS_PER_BONE * len(names))
        place = np.clip(along * len(names), 0.0, len(names) - 1e-9)
        of_point = np.asarray(indices)[place.astype(int)]
        weights = [(index, (of_point == index).astype(float)) for index in indices]
        self.skins.append((names[0], points, triangles.astype(float), weights))
        return indices

    def take_points(self, skin: int, bone: int, count: int) -> None:
        """Gives the bone the points of a skin that are nearest to it, all their weight."""
        _, points, _, weights = self.skins[skin]
        near = np.argsort(np.linalg.norm(points - self.bones[bone].frame[:3, 3], axis=1), kind="stable")[:count]
        for _, values in weights:
            values[near] = 0.0
        own = np.zeros(len(points))
        own[near] = 1.0
        weights.append((bone, own))

    def meshes(self) -> list[Mesh]:
        result = []
        for name, points, triangles, weights in self.skins:
            matrix = np.zeros((len(points), len(self.bones)))
            for bone, values in weights:
                matrix[:, bone] = values
            result.append(Mesh(name, (0.6, 0.5, 0.4), points, triangles.astype(int), matrix))
        return result


def at(x: float, y: float, z: float) -> Array:
    return np.array([x, y, z])


def add_arm(rig: Rig, side: str, x: float, chest: int) -> None:
    shoulder = rig.add_limb([f"{side}Shoulder"], chest, at(0.03 * x, 1.38, 0), at(0.17 * x, 1.38, 0), 0.05)[-1]
    arm = [f"{side}Arm", f"{side}ArmTwist1", f"{side}ArmTwist2"]
    upper = rig.add_limb(arm, shoulder, at(0.17 * x, 1.38, 0), at(0.42 * x, 1.38, 0), 0.045)[0]
    arm = [f"{side}ForeArm", f"{side}ForeArmTwist1", f"{side}ForeArmTwist2"]
    lower = rig.add_limb(arm, upper, at(0.42 * x, 1.38, 0), at(0.66 * x, 1.38, 0), 0.035)[0]
    hand = rig.add_limb([f"{side}Hand"], lower, at(0.66 * x, 1.38, 0), at(0.76 * x, 1.38, 0), 0.035)[0]
    for k, finger in enumerate(["Thumb", "Index", "Middle", "Ring", "Pinky"]):
        z = 0.03 - 0.015 * k
        names = [f"{side}Hand{finger}{segment}" for segment in range(1, 5)]
        rig.add_limb(names, hand, at(0.75 * x, 1.38, z), at(0.85 * x, 1.38, 1.2 * z), 0.006)
    rig.add_bone(f"IK_Hand.{side[0]}", 0, at(0.66 * x, 1.38, 0))
    rig.add_bone(f"IK_Elbow_Pole.{side[0]}", 0, at(0.42 * x, 1.38, -0.4))


def add_leg(rig: Rig, side: str, x: float, hips: int) -> None:
    names = [f"{side}UpLeg", f"{side}UpLegTwist1", f"{side}UpLegTwist2"]
    thigh = rig.add_limb(names, hips, at(0.1 * x, 0.92, 0), at(0.1 * x, 0.5, 0), 0.07)[0]
    names = [f"{side}Leg", f"{side}LegTwist1"]
    shin = rig.add_limb(names, thigh, at(0.1 * x, 0.5, 0), at(0.1 * x, 0.09, 0), 0.05)[0]
    foot = rig.add_limb([f"{side}Foot"], shin, at(0.1 * x, 0.06, -0.04), at(0.1 * x, 0.04, 0.12), 0.04)[0]
    ball = rig.add_limb([f"{side}ToeBase"], foot, at(0.1 * x, 0.035, 0.12), at(0.1 * x, 0.03, 0.16), 0.033)[0]
    for k in range(5):
        place = (0.1 + 0.012 * (k - 2)) * x
        names = [f"{side}Toe{k}_1", f"{side}Toe{k}_2"]
        rig.add_limb(names, ball, at(place, 0.02, 0.16), at(place, 0.02, 0.2), 0.006)
    rig.add_bone(f"IK_Foot.{side[0]}", 0, at(0.1 * x, 0.06, -0.04))
    rig.add_bone(f"IK_Knee_Pole.{side[0]}", 0, at(0.1 * x, 0.5, 0.5))


def add_face(rig: Rig, head: int, skin: int) -> None:
    rig.add_bone("Jaw", head, at(0, 1.5, 0.06))
    rig.take_points(skin, len(rig.bones) - 1, 24)
    for row, part in enumerate(FACE):
        for k in range(6):
            angle = 0.25 * (k - 2.5)
            place = at(0.09 * np.sin(angle), 1.54 + 0.015 * row, 0.09 * np.cos(angle))
            rig.take_points(skin, rig.add_bone(f"{part}.{'L' if k > 2 else 'R'}.{k % 3:03d}", head, place), 3)


def make_crowded(path: Path) -> int:
    """Writes the person; returns the number of its bones."""
    rig = Rig()
    spine = ["Hips", "Spine", "Spine1", "Spine2"]
    hips, *_, chest = rig.add_limb(spine, -1, at(0, 0.92, 0), at(0, 1.42, 0), 0.12)
    neck = rig.add_limb(["Neck"], chest, at(0, 1.42, 0), at(0, 1.5, 0), 0.05)[0]
    head = rig.add_limb(["Head"], neck, at(0, 1.5, 0), at(0, 1.7, 0), 0.09)[0]
    add_face(rig, head, len(rig.skins) - 1)
    for side, x in (("Left", 1.0), ("Right", -1.0)):
        add_arm(rig, side, x, chest)
        add_leg(rig, side, x, hips)
    rig.add_limb([f"{TAIL}{k}" for k in range(24)], hips, at(0, 0.95, -0.12), at(0, 0.6, -0.7), 0.02)
    for k in range(12):
        angle = np.pi * (0.5 + k / 11.0)
        out = at(np.cos(angle), 0.0, np.sin(angle))
        rig.add_limb([HAIR] * 6, head, 0.09 * out + at(0, 1.65, 0), 0.16 * out + at(0, 1.35, 0), 0.008)
    for k in range(8):
        angle = 2.0 * np.pi * k / 8.0
        out = at(np.cos(angle), 0.0, np.sin(angle))
        names = [f"{APRON}.{k}.{segment}" for segment in range(3)]
        rig.add_limb(names, hips, 0.13 * out + at(0, 0.9, 0), 0.2 * out + at(0, 0.6, 0), 0.015)
    for k in range(30):
        rig.add_bone(f"CTRL_{k}", 0, at(0.1 * (k - 15), 1.9, 0))
    write_glb(path, "crowded", rig.bones, rig.meshes())
    return len(rig.bones)
