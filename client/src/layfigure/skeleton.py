"""Forward kinematics of a character, and linear blend skinning of its meshes. Leading axis F: frames."""

from __future__ import annotations

import numpy as np

from layfigure import rotation
from layfigure.protocol import Character, Floats, Mesh


def parents(character: Character) -> list[int]:
    return [joint.parent for joint in character.joints]


def first_root(character: Character) -> int:
    """The joint whose translation is the pose's root translation."""
    return parents(character).index(-1)


def local_translations(character: Character, root_translations: Floats) -> Floats:
    """(F, J, 3): the bones' fixed ones, and for the first root where it is in each frame (F, 3)."""
    fixed = np.array([joint.rest_translation for joint in character.joints])
    translations = np.repeat(fixed[None], len(root_translations), axis=0)
    translations[:, first_root(character)] = root_translations
    return translations


def world_poses(character: Character, root_translations: Floats, rotations: Floats) -> tuple[Floats, Floats]:
    """From local rotations (F, J, 4) to world rotations (F, J, 4) and positions (F, J, 3)."""
    translations = local_translations(character, root_translations)
    world_rotations = np.empty_like(rotations)
    positions = np.empty_like(translations)
    for j, parent in enumerate(parents(character)):
        if parent < 0:
            world_rotations[:, j], positions[:, j] = rotations[:, j], translations[:, j]
        else:
            world_rotations[:, j] = rotation.multiply(world_rotations[:, parent], rotations[:, j])
            carried = rotation.rotate(world_rotations[:, parent], translations[:, j])
            positions[:, j] = positions[:, parent] + carried
    return world_rotations, positions


def skin(character: Character, mesh: Mesh, world_rotations: Floats, positions: Floats) -> Floats:
    """Linear blend skinning of one frame: (J, 4) and (J, 3) in, vertices (V, 3) in the world out.

    v = sum_k w_k X_WJ(k) X_WJ_bind(k)^-1 v_bind
    """
    bind_rotations = np.array([joint.bind_rotation for joint in character.joints])
    bind_positions = np.array([joint.bind_translation for joint in character.joints])
    motions = rotation.multiply(world_rotations, rotation.conjugate(bind_rotations))
    matrices = rotation.to_matrix(motions)
    offsets = positions - rotation.rotate(motions, bind_positions)
    points = mesh.points.astype(np.float64)
    skinned = np.zeros_like(points)
    for k in range(mesh.joint_indices.shape[1]):
        joints, weights = mesh.joint_indices[:, k], mesh.joint_weights[:, k, None]
        skinned += weights * (np.einsum("vij,vj->vi", matrices[joints], points) + offsets[joints])
    return skinned
