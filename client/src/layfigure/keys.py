"""Which frames of a take become keys."""

from __future__ import annotations

import numpy as np

from layfigure.errors import LayfigureError
from layfigure.key_error import SkinDistance
from layfigure.key_fitting import Keys, fitted_keys, keys_at
from layfigure.key_reduction import Progress, silent
from layfigure.resample import Frames
from layfigure.skinning import Indices, Skin
from layfigure.take import Take
from layfigure.take_form import TakeForm


def choose_keys(take: Take, skin: Skin, frames: Frames, form: TakeForm, tell: Progress = silent) -> Keys:
    """The keys' frames, rising, at least one. Raises LayfigureError if marked ones are wanted and none was marked."""
    if form.keys == "marked":
        return keys_at(frames, _marked_keys(take, frames))
    if form.keys == "reduced":
        if skin.vertex_count == 0:
            raise LayfigureError(f"'{take.character.name}' has no mesh to measure a tolerance on: choose other --keys")
        return fitted_keys(SkinDistance.of_frames(take.character, skin, frames), frames, form.tolerance_m, tell)
    return keys_at(frames, np.arange(len(frames)))


def _marked_keys(take: Take, frames: Frames) -> Indices:
    """The frames nearest to the marks."""
    if len(take.marks_us) == 0:
        raise LayfigureError("no key was marked: run 'layfigure key' while recording, or choose other --keys")
    nearest = np.rint(take.marks_us * 1e-6 * frames.fps).astype(np.intp)
    return np.unique(np.minimum(nearest, len(frames) - 1))
