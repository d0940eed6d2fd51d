"""How far the skin between two keys is from where it was recorded.

Keys are taken as USD stores them, rotations as quatf and translations as float3, and interpolated as USD does it: slerp
of each joint's local rotation, straight lines of translations.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from layfigure import rotation, skeleton
from layfigure.protocol import Character, Floats
from layfigure.resample import Frames
from layfigure.skinning import Indices, Skin, largest

_BATCH = 2048  # frames whose motions are in memory at once: about 25 MB for 60 joints
_ROUNDING_M = 1e-6  # of USD's single precision along a chain of joints, some metres from the origin


class SkinDistance:
    """Of the skin between keys from the recorded one, for frames of one take."""

    def __init__(self, character: Character, skin: Skin, frames: Frames) -> None:
        self._character = character
        self._skin = skin
        self._generations = skeleton.generations(character)
        translations = skeleton.local_translations(character, frames.root_translations)
        self._recorded = skin.motions(*skeleton.compose(self._generations, translations, frames.rotations))
        self._rotations = _rounded(rotation.normalized(frames.rotations))
        self._translations = _rounded(translations)
        self._root = skeleton.first_root(character)

    def __len__(self) -> int:
        return len(self._rotations)

    def exceeds(self, first: Indices, last: Indices, between: Indices, tolerance_m: float) -> NDArray[np.bool_]:
        """(E): whether with keys at the frames `first` and `last` any vertex is too far off at the frames `between`."""
        limit = tolerance_m - _ROUNDING_M
        parts = [slice(start, start + _BATCH) for start in range(0, len(between), _BATCH)]
        found = [self._exceeds(first[part], last[part], between[part], limit) for part in parts]
        return np.concatenate([np.zeros(0, np.bool_), *found])

    def _exceeds(self, first: Indices, last: Indices, between: Indices, limit: float) -> NDArray[np.bool_]:
        part = (between - first) / (last - first)
        roots = self._translations[:, self._root]
        turns, places = (self._rotations[first], self._rotations[last]), (roots[first], roots[last])
        return self._between(turns, places, part, between, limit, limit) > limit

    def of_keys(self, rotations: Floats, root_translations: Floats, interval: Indices, part: Floats) -> Floats:
        """(F) how far the farthest vertex is off in each frame with keys of these values (N, J, 4), (N, 3): each frame
        is so far, 0 to 1, from key `interval` to the next."""
        rotations, roots = _rounded(rotation.normalized(rotations)), _rounded(root_translations)
        found = []
        for start in range(0, len(self), _BATCH):
            frames = np.arange(start, min(start + _BATCH, len(self)))
            first = interval[frames]
            turns, places = (rotations[first], rotations[first + 1]), (roots[first], roots[first + 1])
            found.append(self._between(turns, places, part[frames], frames, 0.0, np.inf))
        return np.concatenate(found)

    def within(self, errors: Floats, tolerance_m: float) -> NDArray[np.bool_]:
        """Whether errors of of_keys() hold the tolerance, with USD's roundings."""
        return np.asarray(errors <= tolerance_m - _ROUNDING_M)

    def _between(
        self,
        turns: tuple[Floats, Floats],
        roots: tuple[Floats, Floats],
        part: Floats,
        between: Indices,
        floor: float,
        ceiling: float,
    ) -> Floats:
        rotations = rotation.slerp(*turns, part[:, None])
        translations = self._translations[between].copy()
        translations[:, self._root] = roots[0] + part[:, None] * (roots[1] - roots[0])
        motions = self._skin.motions(*skeleton.compose(self._generations, translations, rotations))
        differences = motions - self._recorded[between]
        bounds = self._skin.of_blocks(self._pair_bounds(differences))

        def farthest(block: int, rows: Indices) -> Floats:
            offsets = self._skin.skin_block(self._skin.blocks[block], differences[rows])
            return np.asarray(np.sqrt(np.einsum("fiv,fiv->fv", offsets, offsets).max(axis=1)), np.float64)

        return largest(bounds, farthest, floor=floor, ceiling=ceiling)

    def _pair_bounds(self, differences: Floats) -> Floats:
        """(E, B): no vertex of a block that one of its joints alone would move is farther off.

        |D p + d| <= |D c + d| + |D| |p - c| in the sphere about c; a difference D of two rotations stretches every
        direction across their common axis by the same |D| = sqrt(tr(D^T D) / 2).
        """
        bounds = self._skin.bounds
        moved = differences[:, :, bounds.joints]
        centres = np.einsum("fibk,bk->fib", moved[..., :3], bounds.centres) + moved[..., 3]
        turns = differences[..., :3]
        stretch = np.sqrt(0.5 * np.einsum("fijk,fijk->fj", turns, turns))[:, bounds.joints]
        return np.asarray(np.sqrt(np.einsum("fib,fib->fb", centres, centres)) + stretch * bounds.radii, np.float64)

    def path_lengths(self) -> Floats:
        """(F), never falling: between two frames no vertex moves farther than their values differ, nor if keys at both
        replace all that is between them.

        A joint that turns by an angle moves what hangs on it by at most that angle times how far that reaches.
        """
        steps = rotation.angle_between(self._rotations[:-1], self._rotations[1:]) * self._reaches()
        for joints, above in self._generations:
            steps[:, joints] += steps[:, above]
        root = self._translations[:, self._root]
        carried = np.linalg.norm(np.diff(root, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(carried + steps.max(axis=1))])

    def _reaches(self) -> Floats:
        """(J) the greatest distance from a joint to a vertex on it or on what it carries, in any pose."""
        reaches = np.zeros(len(self._character.joints))
        np.maximum.at(reaches, self._skin.bounds.joints, self._skin.bounds.reaches)
        for joint, parent in reversed(list(enumerate(skeleton.parents(self._character)))):
            if parent >= 0:
                bone = np.linalg.norm(self._character.joints[joint].rest_translation)
                reaches[parent] = max(reaches[parent], reaches[joint] + bone)
        return reaches


def _rounded(values: Floats) -> Floats:
    """As single precision keeps them."""
    return values.astype(np.float32).astype(np.float64)
