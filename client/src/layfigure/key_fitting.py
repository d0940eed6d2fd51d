"""Values of reduced keys that leave the recorded poses, so that fewer keys are enough.

Between keys that are recorded poses the skin errs to one side. Keys are therefore chosen with a looser tolerance, and
moved until it errs to both: weighted least squares of the rotation vectors from between the keys to the recorded
rotations, and of the root's translations, with weights that grow where a vertex is far off. What is found is judged by
the skin in every frame. Where it does not hold the tolerance, keys are chosen anew, with one that is less loose there,
until it holds everywhere. That takes some five fits, each of at most ROUNDS steps, of 0.1 ms of CPU time a frame each
for 50 joints and 13 000 vertices: up to 15 ms for a frame in all.

How few keys there can be, whatever their values: an interval cannot hold the tolerance if, with some weights, the least
weighted mean square of what its vertices are off exceeds the tolerance's square, for the largest error is no less. Of
the demo's take at 24 fps, 205 frames, that leaves no fewer than 67 keys at frames for 0.5 mm, where 86 are found: in a
frame joints turn by 3 degrees, whose bends are above the tolerance. At 60 fps a smaller share of the frames are keys.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from layfigure import rotation
from layfigure.key_error import Interpolation, SkinDistance
from layfigure.key_reduction import KeySearch, Progress
from layfigure.protocol import Floats
from layfigure.resample import Frames
from layfigure.skinning import Indices

_LOOSER = (2.0, 1.7, 1.4, 1.2, 1.0)  # than the tolerance: a fit may halve what errs to one side; 1 needs no fit
ROUNDS = 12
_GENTLE_FITS = 4  # then recorded poses have to do where no fit is found
_GROWTH = 0.35  # exponent of a weight's growth with the error
_WEIGHTS = (0.1, 30.0)
_AIM = 0.8  # of the tolerance: the error at which a weight stays
_STIFFNESS = 1e-3  # that holds a key which no frame needs


@dataclass(frozen=True, eq=False)
class Keys:
    frames: Indices  # (N) rising
    rotations: Floats  # (N, J, 4)
    root_translations: Floats  # (N, 3), or of M joints that move beside their parents (N, 3 M)


def keys_at(frames: Frames, keys: Indices) -> Keys:
    """Recorded poses."""
    return Keys(keys, frames.rotations[keys], frames.root_translations[keys])


def fitted_keys(distance: SkinDistance, frames: Frames, tolerance_m: float, tell: Progress) -> Keys:
    """The first and the last key, and those about rests, are recorded poses; so are those between which no fit holds,
    which are all in the end."""
    search = KeySearch(distance, tolerance_m, tell)
    levels, last_level = np.zeros(len(frames), np.intp), len(_LOOSER) - 1
    fits = 0
    while True:
        chosen = search.keys(np.array(_LOOSER)[levels] * tolerance_m)
        if len(chosen) == 1:
            return keys_at(frames, chosen)
        fixed = _fixed(search, chosen, levels)
        keys, bad = _fit(distance, frames, keys_at(frames, chosen), fixed, tolerance_m, tell)
        if not len(bad):
            return keys
        fits += 1
        for first, last in zip(chosen[:-1][bad], chosen[1:][bad], strict=True):
            part = slice(first, last + 1)
            levels[part] = np.minimum(levels[part] + 1, last_level) if fits <= _GENTLE_FITS else last_level


def _fixed(search: KeySearch, keys: Indices, levels: Indices) -> Indices:
    """Both ends of rests, and of what holds with recorded poses alone."""
    rests = search.rest_ends[keys[:-1]] >= keys[1:]
    strict = np.minimum.reduceat(levels, keys[:-1]) == len(_LOOSER) - 1
    ends = np.flatnonzero(rests | strict)
    return np.unique([0, len(keys) - 1, *ends, *(ends + 1)])


def _fit(
    distance: SkinDistance,
    frames: Frames,
    keys: Keys,
    fixed: Indices,
    tolerance_m: float,
    tell: Progress,
) -> tuple[Keys, Indices]:
    """And the intervals between keys in which the tolerance is not held: of the fit with the fewest."""
    interval = np.clip(
        np.searchsorted(keys.frames, np.arange(len(frames)), side="right") - 1,
        0,
        len(keys.frames) - 2,
    )
    part = (np.arange(len(frames)) - keys.frames[interval]) / np.diff(keys.frames)[interval]
    weights = np.ones(len(frames))
    best, fewest = keys, np.arange(len(keys.frames))
    for number in range(ROUNDS + 1):
        errors = distance.of_keys(keys.rotations, keys.root_translations, interval, part)
        bad = np.unique(interval[~distance.within(errors, tolerance_m)])
        if len(bad) < len(fewest):
            best, fewest = keys, bad
        if not len(bad):
            break
        tell(f"keys: {len(keys.frames)} are moved, for the {number + 1}. time")
        if number > 0:  # the first step is that of equal weights
            weights = np.clip(weights * (errors / (_AIM * tolerance_m)) ** _GROWTH, *_WEIGHTS)
        keys = _moved(distance.interpolation, frames, keys, interval, part, weights, fixed)
    return best, fewest


def _moved(
    interpolation: Interpolation,
    frames: Frames,
    keys: Keys,
    interval: Indices,
    part: Floats,
    weights: Floats,
    fixed: Indices,
) -> Keys:
    """One step of Gauss and Newton; the normal equations of hat functions are tridiagonal."""
    ends = keys.rotations[interval], keys.rotations[interval + 1]
    turns = rotation.multiply(rotation.conjugate(interpolation.between(*ends, part[:, None])), frames.rotations)
    roots = keys.root_translations
    line = roots[interval] + part[:, None] * (roots[interval + 1] - roots[interval])
    missing = np.concatenate(
        [
            rotation.to_vector(turns).reshape(len(frames), -1),
            frames.root_translations - line,
        ],
        axis=1,
    )
    count = len(keys.frames)
    near, far, squares = 1.0 - part, part, weights**2
    diagonal, beside = np.full(count, _STIFFNESS), np.zeros(count - 1)
    np.add.at(diagonal, interval, squares * near**2)
    np.add.at(diagonal, interval + 1, squares * far**2)
    np.add.at(beside, interval, squares * near * far)
    right = np.zeros((count, missing.shape[1]))
    np.add.at(right, interval, (squares * near)[:, None] * missing)
    np.add.at(right, interval + 1, (squares * far)[:, None] * missing)
    right[fixed], diagonal[fixed] = 0.0, 1.0
    beside[fixed[fixed < count - 1]] = 0.0
    beside[fixed[fixed > 0] - 1] = 0.0
    step = _solved(diagonal, beside, right)
    of_joints, of_roots = np.split(step, [step.shape[1] - roots.shape[1]], axis=1)
    turned = rotation.multiply(keys.rotations, rotation.from_vector(of_joints.reshape(count, -1, 3)))
    return Keys(keys.frames, rotation.normalized(turned), roots + of_roots)


def _solved(diagonal: Floats, beside: Floats, right: Floats) -> Floats:
    """Of a symmetric tridiagonal system that is positive definite; right sides (N, M)."""
    diagonal, solution = diagonal.copy(), right.copy()
    for row in range(1, len(diagonal)):
        factor = beside[row - 1] / diagonal[row - 1]
        diagonal[row] -= factor * beside[row - 1]
        solution[row] -= factor * solution[row - 1]
    solution[-1] /= diagonal[-1]
    for row in range(len(diagonal) - 2, -1, -1):
        solution[row] = (solution[row] - beside[row] * solution[row + 1]) / diagonal[row]
    return solution
