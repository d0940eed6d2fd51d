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
    """World rotations and positions of local translations (F, J, 3) and rotations (F, J, 4)."""
    world_rotations, positions = rotations.copy(), translations.copy()
    for joints, above in generations:
        carriers = world_rotations[:, above]
        world_rotations[:, joints] = rotation.multiply(carriers, rotations[:, joints])
        positions[:, joints] = positions[:, above] + rotation.rotate(carriers, translations[:, joints])
    return world_rotations, positions
