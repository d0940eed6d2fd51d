"""What is exported of a USD file: its skeletons at every frame, and the skins that they move, in metres, Y up."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from layfigure.errors import LayfigureError
from layfigure.protocol import Floats
from layfigure.usd.reader import BoundMesh, SkinnedStage
from layfigure.usd.skeleton_reader import PosedSkeleton, local_matrices

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class SkeletonClip:
    """F frames of J joints, parents before children."""

    path: str  # of its prim
    names: list[str]
    parents: list[int]  # -1 for a root
    bind: Floats  # (J, 4, 4) joint -> world
    rest: Floats  # (J, 4, 4) joint -> world
    local: Floats  # (F, J, 4, 4) joint -> parent; a root's: joint -> world


@dataclass(frozen=True, eq=False)
class Clip:
    name: str
    fps: float
    skeletons: tuple[SkeletonClip, ...]
    meshes: tuple[BoundMesh, ...]

    @property
    def frames(self) -> int:
        return len(self.skeletons[0].local)


def read_clip(path: Path) -> Clip:
    """Raises LayfigureError if the file holds no skeleton, or joints that are scaled."""
    stage = SkinnedStage(path, needs_skin=False, up_axis="Y")
    skeletons = stage.skeletons()
    if not skeletons:
        raise LayfigureError(f"'{path}' holds no skeleton")
    meshes = tuple(stage.bound())
    for mesh in meshes:
        if mesh.has_blend_shapes:
            _logger.warning("the blend shapes of mesh '%s' are left out", mesh.name)
    frames = np.arange(stage.first_frame, stage.last_frame + 1e-6)
    if not len(frames):
        raise LayfigureError(f"'{path}' has no frames: its endTimeCode is before its startTimeCode")
    clips = tuple(_clip_of(skeleton, frames) for skeleton in skeletons)
    return Clip(path.stem, stage.fps, clips, meshes)


def _clip_of(skeleton: PosedSkeleton, frames: Floats) -> SkeletonClip:
    if scaled := skeleton.scaled_joint(frames):
        raise LayfigureError(f"joint '{scaled[0]}' is scaled in frame {scaled[1]:g}: only rigid joints can be exported")
    return SkeletonClip(
        path=str(skeleton.prim.GetPath()),
        names=skeleton.original_names(),
        parents=skeleton.parents,
        bind=skeleton.bind(frames[0]),
        rest=skeleton.rest(frames[0]),
        local=local_matrices(skeleton.world(frames), skeleton.parents),
    )
