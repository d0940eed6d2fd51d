"""Values of reduced keys that leave the recorded poses, so that fewer keys are enough.

Between keys that are recorded poses the skin errs to one side. Keys are therefore chosen with a looser tolerance, and
moved until it errs to both: weighted least squares of the rotation vectors from between the keys to the recorded
rotations, and of the root's translations, with weights that grow where a vertex is far off. What is found is judged by
the skin in every frame, and not taken unless it holds the tolerance. A few seconds for some thousand frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from layfigure import rotation
from layfigure.key_error import Interpolation, SkinDistance
from layfigure.key_reduction import Progress, reduced_keys, rest_ends
from layfigure.protocol import Floats
from layfigure.resample import Frames
from layfigure.skinning import Indices

_LOOSER = (
    1.4,
    1.2,
)  # than the tolerance: an error that changes sides may grow by up to about the root of 2
_ROUNDS = 12
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
    """The first and the last key, and those about rests, are recorded poses; so are all if no fit holds."""
    for looser in _LOOSER:
        chosen = reduced_keys(distance, looser * tolerance_m, tell)
        fit = _fit(distance, frames, keys_at(frames, chosen), tolerance_m, tell) if len(chosen) > 1 else None
        if fit is not None:
            return fit
    return keys_at(frames, reduced_keys(distance, tolerance_m, tell))


def _fit(
    distance: SkinDistance,
    frames: Frames,
    keys: Keys,
    tolerance_m: float,
    tell: Progress,
) -> Keys | None:
    """None if the tolerance is not held in every frame."""
    interval = np.clip(
        np.searchsorted(keys.frames, np.arange(len(frames)), side="right") - 1,
        0,
        len(keys.frames) - 2,
    )
    part = (np.arange(len(frames)) - keys.frames[interval]) / np.diff(keys.frames)[interval]
    fixed = _fixed(distance, keys.frames, tolerance_m)
    weights = np.ones(len(frames))
    for number in range(_ROUNDS + 1):
        errors = distance.of_keys(keys.rotations, keys.root_translations, interval, part)
        if distance.within(errors, tolerance_m).all():
            return keys
        tell(f"keys: {len(keys.frames)} are moved, for the {number + 1}. time")
        if number > 0:  # the first step is that of equal weights
            weights = np.clip(weights * (errors / (_AIM * tolerance_m)) ** _GROWTH, *_WEIGHTS)
        keys = _moved(distance.interpolation, frames, keys, interval, part, weights, fixed)
    return None


def _fixed(distance: SkinDistance, keys: Indices, tolerance_m: float) -> Indices:
    resting = np.flatnonzero(rest_ends(distance, tolerance_m)[keys[:-1]] >= keys[1:])
    return np.unique([0, len(keys) - 1, *resting, *(resting + 1)])


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
