# SPDX-License-Identifier: GPL-3.0-or-later
"""Between the server's joints and an armature's bones. No bpy.

Spaces: W the server's world, in metres, Z up; A the armature's own space, in which its bones are given. X_WA, a
similarity (rotation, place, one scale, perhaps a mirror), takes A to W. A joint J and the bone B of its name have axes
of their own, but move rigidly together: with D_J = X_WJ(t) X_WJ(rest)^-1, the joint's motion from the rest pose,

    M_AB(t) = X_WA^-1 D_J X_WA M_AB(rest)

whatever the bone's roll and axes are.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from layfigure import Character, Pose, rotation, skeleton

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

# Between poses that look alike: the turn [rad], so far below what is seen that the turns of all bones of a chain are,
# too; and the root's way [m].
UNSEEN_TURN = 4e-6
UNSEEN_WAY = 2e-6
FIT_TOLERANCE = 1e-3  # of the size of the whole: importers of other programs round places
UNIFORM_TOLERANCE = 1e-4  # relative, between the scales of axes: far above single precision, far below what is seen


class MisfitError(ValueError):
    """An armature that cannot be moved by the doll; the message is one line for the user."""


class Bone(NamedTuple):
    name: str
    parent: int  # index of an earlier bone, -1: none
    rest: Floats  # (4, 4), bone -> armature


def moved_by(bones: Sequence[Bone], driven: Iterable[int]) -> frozenset[int]:
    """The driven bones and those that they carry. All others stand where the armature alone puts them."""
    found = set(driven)
    for index, bone in enumerate(bones):
        if bone.parent in found:
            found.add(index)
    return frozenset(found)


class BoneMap:
    """Which bones the joints of `character` move, and how.

    Bone and joint belong together by their names. The doll moves, `driven`, the bones whose joints are bodies: others
    ride on their parents, in the doll as in Blender.

    `placement` (4, 4), of the doll as a whole in A, comes before M_AB(t) above; identity unless place_root() is called.
    Nothing else of it changes.
    """

    def __init__(self, character: Character, bones: Sequence[Bone], object_to_world: Floats) -> None:
        """`object_to_world`: X_WA, (4, 4). Raises MisfitError for one that is no similarity, or if no bone fits."""
        check_similarity(object_to_world)
        self.character = character
        self.bones = tuple(bones)
        self.to_world = np.array(object_to_world, np.float64)
        self.placement = np.eye(4)
        self._to_armature = np.linalg.inv(self.to_world)
        self._rests = np.array([bone.rest for bone in bones], np.float64).reshape(-1, 4, 4)
        joints = {joint.name: index for index, joint in enumerate(character.joints)}
        self._joints = tuple(joints.get(bone.name) for bone in bones)
        self._bone_names = {j: bone.name for j, bone in zip(self._joints, bones, strict=True) if j is not None}
        self._is_body = np.array([joint.is_body for joint in character.joints])
        self.driven: Ints = np.array(
            [b for b, joint in enumerate(self._joints) if joint is not None and self._is_body[joint]], np.intp
        )
        if not len(self.driven):
            raise MisfitError(
                f"no bone of the armature is a joint of the doll '{character.name}': connect to a server that has "
                "this character"
            )
        self.moved = moved_by(bones, self.driven.tolist())
        self._driven_joints = np.array([self._joints[b] for b in self.driven], np.intp)
        self._generations = skeleton.generations(character)
        rest = np.array([joint.rest_rotation for joint in character.joints])
        self._root_joint = skeleton.first_root(character)
        self._offsets = np.array([joint.rest_translation for joint in character.joints])
        root = self._offsets[self._root_joint]
        rotations, positions = self._world_poses(root, rest)
        self._rest_rotations = rotations
        # X_JB: where a bone is on its joint, for ever
        of_joints = np.linalg.inv(matrices(rotations, positions)[self._driven_joints])
        self._on_joints = of_joints @ self.to_world @ self._rests[self.driven]

    @property
    def root(self) -> int:
        """The index of the bone that carries all others that are driven, or of the first of several."""
        return int(self.driven[0])

    def place_root(self, pose_matrices: Floats, pose: Pose | None = None) -> None:
        """Lets the doll stand where the root bone is in `pose_matrices` (B, 4, 4): sets `placement`.

        A doll's root is pinned: so it is the doll as a whole that is where the armature has it. `pose`: where the pin
        holds the root, the rest pose if left out.
        """
        self.placement = np.eye(4)
        stands = self._rests[self.root] if pose is None else self._driven_matrices(pose)[0]
        motion = np.asarray(pose_matrices, np.float64)[self.root] @ np.linalg.inv(stands)
        motion[:3, :3] = nearest_rotations(motion[None, :3, :3])[0]
        self.placement = motion

    @property
    def driven_names(self) -> tuple[str, ...]:
        return tuple(self.bones[b].name for b in self.driven)

    @property
    def holding_names(self) -> tuple[str, ...]:
        """Of the driven bones and of those between them: what else moves these moves driven ones."""
        holding = set(self.driven.tolist())
        for b in self.driven.tolist():
            above = self.bones[b].parent
            while above in self.moved:
                holding.add(above)
                above = self.bones[above].parent
        return tuple(self.bones[b].name for b in sorted(holding))

    def bone_of_joint(self, joint: int) -> str | None:
        """None for a joint that no bone has the name of."""
        return self._bone_names.get(joint)

    def joint_of_bone(self, name: str) -> int | None:
        """None for a bone that is no joint."""
        return next((j for j, known in self._bone_names.items() if known == name), None)

    def pose_matrices(self, pose: Pose) -> Floats:
        """(B, 4, 4), bone -> armature. Bones that are not driven keep their rest place on their parents."""
        result = np.empty((len(self.bones), 4, 4))
        result[self.driven] = self._driven_matrices(pose)
        is_driven = np.zeros(len(self.bones), np.bool_)
        is_driven[self.driven] = True
        for b, bone in enumerate(self.bones):
            if is_driven[b]:
                continue
            above = bone.parent
            result[b] = bone.rest if above < 0 else result[above] @ np.linalg.inv(self._rests[above]) @ bone.rest
        return result

    def rotations(self, pose_matrices: Floats) -> tuple[Ints, Floats]:
        """What load_pose needs for bones to stand as in `pose_matrices` (B, 4, 4): joints, rotations (n, 4).

        Rotations are joint -> parent, w x y z. A body's parent that is no body is where the server will have it.
        """
        worlds = self._rest_rotations.copy()
        of_bones = dict(zip(self._driven_joints.tolist(), self._world_rotations(pose_matrices), strict=True))
        local = np.array([joint.rest_rotation for joint in self.character.joints])
        for j, joint in enumerate(self.character.joints):
            above = worlds[joint.parent] if joint.parent >= 0 else np.array([1.0, 0.0, 0.0, 0.0])
            worlds[j] = of_bones[j] if j in of_bones else rotation.multiply(above, local[j])
            local[j] = rotation.multiply(rotation.conjugate(above), worlds[j])
        joints = np.array([j for j in self._driven_joints.tolist() if self.character.joints[j].parent >= 0], np.intp)
        return joints, rotation.normalized(local[joints])

    def _driven_matrices(self, pose: Pose) -> Floats:
        rotations, positions = self._world_poses(pose.root_translation, pose.rotations)
        now = matrices(rotations[self._driven_joints], positions[self._driven_joints])
        return self.placement @ self._to_armature @ now @ self._on_joints

    def _world_poses(self, root: Floats, rotations: Floats) -> tuple[Floats, Floats]:
        """Rotations (J, 4), joint -> world, and places (J, 3) [m]."""
        offsets = self._offsets.copy()
        offsets[self._root_joint] = root
        worlds, places = skeleton.compose(self._generations, offsets[None], rotations[None])
        return worlds[0], places[0]

    def _world_rotations(self, pose_matrices: Floats) -> Floats:
        """(n, 4) of the driven joints, joint -> world."""
        of_bones = np.asarray(pose_matrices, np.float64)[self.driven]
        in_armature = np.linalg.inv(self.placement) @ of_bones @ np.linalg.inv(self._rests[self.driven])
        motions = self.to_world @ in_armature @ self._to_armature
        turns = rotation.from_matrix(nearest_rotations(motions[:, :3, :3]))
        return rotation.multiply(turns, self._rest_rotations[self._driven_joints])


def looks_alike(a: Pose, b: Pose) -> bool:
    """Whether nobody could tell two poses of one doll from each other. A quaternion differs by half of a small turn."""
    turns = a.rotations - b.rotations
    way = a.root_translation - b.root_translation
    return bool(np.abs(turns).max() <= 0.5 * UNSEEN_TURN and np.abs(way).max() <= UNSEEN_WAY)


def matrices(rotations: Floats, positions: Floats) -> Floats:
    """(n, 4, 4) of unit quaternions (n, 4) and places (n, 3)."""
    result = np.zeros((len(rotations), 4, 4))
    result[:, :3, :3] = rotation.to_matrix(rotations)
    result[:, :3, 3] = positions
    result[:, 3, 3] = 1.0
    return result


def nearest_rotations(linear: Floats) -> Floats:
    """(n, 3, 3): the rotations nearest to (n, 3, 3), without their scale and shear (by singular values)."""
    u, _, vt = np.linalg.svd(linear)
    u[:, :, 2] *= np.linalg.det(u @ vt)[:, None]
    return np.asarray(u @ vt, np.float64)


def check_similarity(transform: Floats) -> float:
    """The scale, > 0, of a similarity (4, 4). Raises MisfitError."""
    linear = np.asarray(transform, np.float64)[:3, :3]
    squares = linear.T @ linear
    scale = float(np.sqrt(np.trace(squares) / 3.0))
    if not (np.isfinite(scale) and scale > 0.0):
        raise MisfitError("the armature's scale is 0: set it to another value")
    if np.abs(squares / scale**2 - np.eye(3)).max() > UNIFORM_TOLERANCE:
        raise MisfitError(
            "the armature is scaled unevenly, so that its bones would be sheared: apply its scale (Ctrl A), or make "
            "the scale of the three axes the same"
        )
    return scale


def fitted(character: Character, bones: Sequence[Bone], guess: Floats) -> Floats:
    """X_WA of an armature whose joints stand in the server's world as another program has put them there.

    `guess` where that fits, else the similarity, without a mirror, that brings the bones' heads onto the joints of
    their names (Umeyama 1991, least squares). Raises MisfitError if none does.
    """
    joints = {joint.name: joint.bind_translation for joint in character.joints if joint.is_body}
    pairs = [(bone.rest[:3, 3], joints[bone.name]) for bone in bones if bone.name in joints]
    if not pairs:
        raise MisfitError(
            f"no bone of the armature is a joint of the doll '{character.name}': connect to a server that has this "
            "character"
        )
    heads, places = (np.array(points) for points in zip(*pairs, strict=True))
    size = max(float(np.ptp(places, axis=0).max()), 1e-3)
    if _misfit(guess, heads, places) <= FIT_TOLERANCE * size or len(pairs) < 3:
        return guess
    result = _similarity(heads, places)
    worst = _misfit(result, heads, places)
    if worst > FIT_TOLERANCE * size:
        raise MisfitError(
            f"the armature is not that of the doll '{character.name}': bones are up to {100.0 * worst:.1f} cm away "
            "from its joints; start a server of its own"
        )
    return result


def _misfit(transform: Floats, heads: Floats, places: Floats) -> float:
    return float(np.linalg.norm(heads @ transform[:3, :3].T + transform[:3, 3] - places, axis=1).max())


def _similarity(heads: Floats, places: Floats) -> Floats:
    a, b = heads - heads.mean(axis=0), places - places.mean(axis=0)
    u, values, vt = np.linalg.svd(b.T @ a)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    scale = float((values * signs).sum() / (a**2).sum())
    result = np.eye(4)
    result[:3, :3] = scale * u @ np.diag(signs) @ vt
    result[:3, 3] = places.mean(axis=0) - result[:3, :3] @ heads.mean(axis=0)
    return result
