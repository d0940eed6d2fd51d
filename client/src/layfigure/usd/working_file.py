"""The take so far as one USD file that grows while it is recorded, so that it can be opened after a crash."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Tf, Usd

from layfigure import skeleton
from layfigure.protocol import Character, Mesh
from layfigure.resample import Between, frame_times_us
from layfigure.take import TakeBuilder
from layfigure.usd import values
from layfigure.usd.animation_layer import add_samples, define_animation
from layfigure.usd.character_layer import set_stage_units, write_character
from layfigure.usd.failures import reason
from layfigure.usd.textures import named_textures

SAVE_EVERY_US = 250_000  # of simulation time
APPEND_EVERY_US = 50_000  # likewise; each takes about as long as a save, and what is done for a batch is done seldom
_LONGEST_TAIL = 0.005  # of the take that is not saved yet: see WorkingFile

_logger = logging.getLogger(__name__)


class WorkingFile:
    """Every frame of every joint, whatever is made of the take in the end. A crate file is saved by appending to it, so
    a save costs what has come since the last one, and 24 bytes for each frame that there is: a table of where they are
    is written anew. Were saves as close in a long take as in a short one, these tables would fill the disk, with the
    square of its length; they are a share of the take apart, so that they take 24 / 0.005 = 4800 bytes for each frame,
    no more than its pose in the event log of a doll of 60 joints.

    A file that cannot be written is given up, with a warning: the event log holds all that it would."""

    def __init__(self, path: Path, character: Character, meshes: tuple[Mesh, ...], fps: float) -> None:
        self.path = path
        self._character = character
        self._fps = fps
        self._frames = 0
        self._poses = 0  # of those that came, the last one that is in a frame, or just before it
        self._saved_us = 0
        self._appended_us = 0
        self._stage: Any = None
        path.unlink(missing_ok=True)
        try:
            self._stage = Usd.Stage.CreateNew(str(path))
            set_stage_units(self._stage)
            self._stage.SetTimeCodesPerSecond(fps)
            self._stage.SetFramesPerSecond(fps)
            self._stage.SetStartTimeCode(0.0)
            write_character(self._stage, character, meshes, named_textures(character, meshes, path))
            self._animation = define_animation(self._stage, character)
            self._rest()
            self._save()
        except Tf.ErrorException as error:
            self._give_up(error)

    def update(self, builder: TakeBuilder) -> None:
        """Takes the poses that have come, or saves what was taken, now and then. Never both at once: messages wait."""
        if self._stage is None or builder.pose_count == 0:
            return
        now_us = round(builder.duration_s * 1e6)
        try:
            if self._appended_us >= self._saved_us + max(SAVE_EVERY_US, _LONGEST_TAIL * now_us):
                self._saved_us = self._appended_us
                self._save()
            elif now_us >= self._appended_us + APPEND_EVERY_US:
                self._appended_us = now_us
                self._append(builder)
        except Tf.ErrorException as error:
            self._give_up(error)

    def remove(self) -> None:
        """When all is in better hands."""
        self._stage = None
        self.path.unlink(missing_ok=True)

    def _rest(self) -> None:
        """What is seen as long as no frame has come."""
        joints = self._character.joints
        rotations = values.quatf_array(np.array([joint.rest_rotation for joint in joints]))
        self._animation.GetRotationsAttr().Set(rotations)
        self._animation.GetTranslationsAttr().Set(values.vec3f_array([joint.rest_translation for joint in joints]))

    def _append(self, builder: TakeBuilder) -> None:
        motion = builder.motion_since(self._poses)
        wanted_us = frame_times_us(motion.times_us, self._fps, self._frames)
        if len(wanted_us) == 0:
            return
        between = Between(motion.times_us, wanted_us)
        translations = skeleton.local_translations(self._character, between.linear(motion.root_translations))
        rotations = between.spherical(motion.rotations)
        codes = range(self._frames, self._frames + len(wanted_us))
        add_samples(self._animation.GetRotationsAttr(), codes, values.quatf_arrays(rotations))
        add_samples(self._animation.GetTranslationsAttr(), codes, values.vec3f_arrays(translations))
        self._frames += len(wanted_us)
        self._poses += int(np.searchsorted(motion.times_us, wanted_us[-1], side="right")) - 1

    def _save(self) -> None:
        self._stage.SetEndTimeCode(max(self._frames - 1.0, 0.0))
        self._stage.GetRootLayer().Save()

    def _give_up(self, error: Tf.ErrorException) -> None:
        _logger.warning("cannot write '%s', the take is in its event log alone: %s", self.path, reason(error))
        self.remove()
