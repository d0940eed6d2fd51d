"""How far the skin between two keys is from where it was recorded.

Keys are taken as USD and others store them, in single precision. Translations go in straight lines between them, local
rotations as the Interpolation says: by slerp, as USD does it, or as another program plays them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from layfigure import rotation, skeleton
from layfigure.protocol import Character, Floats
from layfigure.resample import Frames
from layfigure.skinning import Indices, Skin, largest

_BATCH = 2048  # frames whose motions are in memory at once: about 25 MB for 60 joints
_ROUNDING_M = 1e-6  # of single precision along a chain of joints, some metres from the origin


class Interpolation(Protocol):
    """How joints turn between two keys."""

    def between(self, first: Floats, last: Floats, part: Floats) -> Floats:
        """(E, J, 4) of local rotations (E, J, 4) of two keys, so far from the first one to the other (E, 1), 0 to 1."""

    def turn(self, first: Floats, last: Floats) -> Floats:
        """(E, J) no joint turns farther on its way from one key to the other [rad]; a way over another key in between
        is never shorter."""


class Slerp:
    """As USD plays keys."""

    def between(self, first: Floats, last: Floats, part: Floats) -> Floats:
        return rotation.slerp(first, last, part)

    def turn(self, first: Floats, last: Floats) -> Floats:
        return rotation.angle_between(first, last)


class SkinDistance:
    """Of the skin between keys from the recorded one, for frames of one take."""

    def __init__(
        self,
        character: Character,
        skin: Skin,
        rotations: Floats,
        translations: Floats,
        movers: Sequence[int],
        interpolation: Interpolation,
    ) -> None:
        """Of the joints' local rotations (F, J, 4) and translations (F, J, 3). `movers` are the M joints whose
        translations are keyed; those of all others are given, whatever the keys."""
        self.interpolation = interpolation
        self._character = character
        self._skin = skin
        self._generations = skeleton.generations(character)
        self._recorded = skin.motions(*skeleton.compose(self._generations, translations, rotations))
        self._rotations = _rounded(rotation.normalized(rotations))
        self._translations = _rounded(translations)
        self._movers = np.array(movers, np.intp)

    @staticmethod
    def of_frames(character: Character, skin: Skin, frames: Frames) -> SkinDistance:
        """Of keys that USD plays."""
        translations = skeleton.local_translations(character, frames.root_translations)
        return SkinDistance(character, skin, frames.rotations, translations, [skeleton.first_root(character)], Slerp())

    def __len__(self) -> int:
        return len(self._rotations)

    def exceeds(
        self, first: Indices, last: Indices, between: Indices, tolerance_m: float | Floats
    ) -> NDArray[np.bool_]:
        """(E): whether with keys at the frames `first` and `last` any vertex is too far off at the frames `between`.
        `tolerance_m`: one for all, or (E)."""
        limit = np.broadcast_to(tolerance_m - _ROUNDING_M, len(between))
        parts = [slice(start, start + _BATCH) for start in range(0, len(between), _BATCH)]
        found = [self._exceeds(first[part], last[part], between[part], limit[part]) for part in parts]
        return np.concatenate([np.zeros(0, np.bool_), *found])

    def _exceeds(self, first: Indices, last: Indices, between: Indices, limit: Floats) -> NDArray[np.bool_]:
        part = (between - first) / (last - first)
        moved = self._translations[:, self._movers]
        turns, places = (self._rotations[first], self._rotations[last]), (moved[first], moved[last])
        return self._between(turns, places, part, between, limit, limit) > limit

    def of_keys(self, rotations: Floats, translations: Floats, interval: Indices, part: Floats) -> Floats:
        """(F) how far the farthest vertex is off in each frame with keys of these values (N, J, 4), (N, 3 M): each
        frame is so far, 0 to 1, from key `interval` to the next."""
        rotations = _rounded(rotation.normalized(rotations))
        moved = _rounded(translations.reshape(len(translations), -1, 3))
        found = []
        for start in range(0, len(self), _BATCH):
            frames = np.arange(start, min(start + _BATCH, len(self)))
            first = interval[frames]
            turns, places = (rotations[first], rotations[first + 1]), (moved[first], moved[first + 1])
            found.append(self._between(turns, places, part[frames], frames, 0.0, np.inf))
        return np.concatenate(found)

    def of_poses(self, rotations: Floats, translations: Floats) -> Floats:
        """(F) how far the farthest vertex is off in each frame with local rotations (F, J, 4) and translations
        (F, 3 M), wherever they are from."""
        moved = translations.reshape(len(translations), -1, 3)
        parts = [np.arange(start, min(start + _BATCH, len(self))) for start in range(0, len(self), _BATCH)]
        return np.concatenate([self._farthest(rotations[part], moved[part], part, 0.0, np.inf) for part in parts])

    def within(self, errors: Floats, tolerance_m: float) -> NDArray[np.bool_]:
        """Whether errors of of_keys() hold the tolerance, with roundings."""
        return np.asarray(errors <= tolerance_m - _ROUNDING_M)

    def _between(
        self,
        turns: tuple[Floats, Floats],
        places: tuple[Floats, Floats],
        part: Floats,
        between: Indices,
        floor: float | Floats,
        ceiling: float | Floats,
    ) -> Floats:
        rotations = self.interpolation.between(*turns, part[:, None])
        moved = places[0] + part[:, None, None] * (places[1] - places[0])
        return self._farthest(rotations, moved, between, floor, ceiling)

    def _farthest(
        self, rotations: Floats, moved: Floats, between: Indices, floor: float | Floats, ceiling: float | Floats
    ) -> Floats:
        translations = self._translations[between].copy()
        translations[:, self._movers] = moved
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
        steps = self.interpolation.turn(self._rotations[:-1], self._rotations[1:]) * self._reaches()
        for joints, above in self._generations:
            steps[:, joints] += steps[:, above]
        carried = np.linalg.norm(np.diff(self._translations[:, self._movers], axis=0), axis=2).sum(axis=1)
        return np.concatenate([[0.0], np.cumsum(carried + steps.max(axis=1))])

    def _reaches(self) -> Floats:
        """(J) the greatest distance from a joint to a vertex on it or on what it carries, in any pose."""
        reaches = np.zeros(len(self._character.joints))
        np.maximum.at(reaches, self._skin.bounds.joints, self._skin.bounds.reaches)
        bones = np.linalg.norm(self._translations, axis=2).max(axis=0)
        for joint, parent in reversed(list(enumerate(skeleton.parents(self._character)))):
            if parent >= 0:
                reaches[parent] = max(reaches[parent], reaches[joint] + bones[joint])
        return reaches


def _rounded(values: Floats) -> Floats:
    """As single precision keeps them."""
    return values.astype(np.float32).astype(np.float64)
