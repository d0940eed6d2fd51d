"""Forward kinematics of a character. Leading axis F: frames."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from layfigure import rotation
from layfigure.protocol import Character, Floats

Indices = NDArray[np.intp]


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
    return compose(generations(character), local_translations(character, root_translations), rotations)


def generations(character: Character) -> list[tuple[Indices, Indices]]:
    """The joints that have parents, and those: first the roots' children, then theirs, and so on."""
    depths = [0] * len(character.joints)
    for j, parent in enumerate(parents(character)):
        depths[j] = depths[parent] + 1 if parent >= 0 else 0
    ordered = [np.flatnonzero(np.array(depths) == depth) for depth in range(1, max(depths) + 1)]
    return [(joints, np.array(parents(character))[joints]) for joints in ordered]


def compose(
    generations: list[tuple[Indices, Indices]], translations: Floats, rotations: Floats
) -> tuple[Floats, Floats]:
    """World rotations and positions of local translations (F, J, 3) and rotations (F, J, 4).

    In memory the frames of a component are side by side, in and out: what is reckoned for all of them goes through the
    memory in its order, which takes half the time.
    """
    world_rotations, positions = _by_component(rotations), _by_component(translations)
    for joints, above in generations:
        carriers = _of_joints(world_rotations, above)
        carried = rotation.rotate(carriers, _of_joints(positions, joints))
        world_rotations.T[:, joints] = rotation.multiply(carriers, _of_joints(world_rotations, joints)).T
        positions.T[:, joints] = (_of_joints(positions, above) + carried).T
    return world_rotations, positions


def _by_component(values: Floats) -> Floats:
    """A copy of (F, J, C) whose frames are side by side in memory."""
    return np.array(values.T, order="C").T


def _of_joints(values: Floats, joints: Indices) -> Floats:
    """values[:, joints], in the same order in memory."""
    return values.T[:, joints].T
