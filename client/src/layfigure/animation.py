"""A take as it is to be written: frames at a fixed rate, of which some are keys."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from layfigure import skeleton
from layfigure.key_fitting import Keys
from layfigure.key_reduction import Progress, silent
from layfigure.keys import choose_keys
from layfigure.protocol import Floats
from layfigure.resample import Frames, at_rest, resample
from layfigure.skinning import Indices, Skin
from layfigure.take import Take
from layfigure.take_form import TakeForm, selected_joints

_BATCH = 1024  # frames whose boxes are found at once: of 60 joints, 6 MB of motions


@dataclass(frozen=True, eq=False)
class Animation:
    take: Take
    form: TakeForm
    frames: Frames
    keys: Indices  # (N) frames that are keys, rising, at least one
    values: Keys  # of the keys
    extents: (
        Floats  # (N, 2, 3) corners of a box that holds the skin from the key before to the one after; none: (0, ..)
    )


def animate(take: Take, fps: float, form: TakeForm, tell: Progress = silent) -> Animation:
    """Raises UsageError if no joint is the wanted one, LayfigureError if there is no key.

    `tell` is told what takes long.
    """
    frames = at_rest(resample(take, fps), take.character, selected_joints(take.character, form.joints))
    skin = Skin(take.character, take.meshes)
    chosen = choose_keys(take, skin, frames, form, tell)
    keys = chosen.frames
    extents = _boxes_of_keys(_boxes(take, skin, frames), keys) if skin.vertex_count else np.zeros((0, 2, 3))
    return Animation(take, form, frames, keys, chosen, extents)


def _boxes(take: Take, skin: Skin, frames: Frames) -> Floats:
    parts = []
    for start in range(0, len(frames), _BATCH):
        part = slice(start, start + _BATCH)
        posed = skeleton.world_poses(take.character, frames.root_translations[part], frames.rotations[part])
        parts.append(skin.boxes(skin.motions(*posed)))
    return np.concatenate(parts)


def _boxes_of_keys(boxes: Floats, keys: Indices) -> Floats:
    """A mean of two neighbours' boxes then holds what is between them."""
    if len(keys) == len(boxes):
        return boxes
    starts = np.concatenate([[0], keys[:-1]])
    ends = np.concatenate([keys[1:], [len(boxes) - 1]]) + 1
    spans = [boxes[start:end] for start, end in zip(starts, ends, strict=True)]
    return np.array([[span[:, 0].min(axis=0), span[:, 1].max(axis=0)] for span in spans])
