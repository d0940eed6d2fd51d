"""The layer of what moves: the SkelAnimation, and what the doll felt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel, Vt

from layfigure import skeleton
from layfigure.resample import Frames
from layfigure.take import Take
from layfigure.usd import values
from layfigure.usd.character_layer import character_prim_path, set_stage_units, skeleton_path
from layfigure.usd.names import joint_paths


@dataclass(frozen=True)
class YieldEvent:
    """A joint flowed from the pose at `start` to the one at `end` [time codes]."""

    joint: int
    start: float
    end: float


def yield_events(take: Take, fps: float) -> list[YieldEvent]:
    """Ordered by joint, then by time. They are found on the poses, so that none falls between two frames."""
    codes = take.times_us * 1e-6 * fps
    events = []
    for joint in range(take.yielded.shape[1]):
        changes = np.diff(take.yielded[:, joint].astype(np.int8), prepend=0, append=0)
        for start, end in zip(np.flatnonzero(changes == 1), np.flatnonzero(changes == -1), strict=True):
            events.append(YieldEvent(joint, float(codes[start]), float(codes[end - 1])))
    return events


def set_stage_time(stage: Any, frames: Frames) -> None:
    stage.SetTimeCodesPerSecond(frames.fps)
    stage.SetFramesPerSecond(frames.fps)
    stage.SetStartTimeCode(0.0)
    stage.SetEndTimeCode(len(frames) - 1.0)


def write_animation_layer(path: str, take: Take, frames: Frames) -> None:
    stage = Usd.Stage.CreateNew(path)
    set_stage_units(stage)
    set_stage_time(stage, frames)
    root = stage.OverridePrim(character_prim_path(take.character))
    stage.SetDefaultPrim(root)
    animation = UsdSkel.Animation.Define(stage, f"{root.GetPath()}/Animation")
    bound = stage.OverridePrim(skeleton_path(take.character))
    relation = bound.CreateRelationship("skel:animationSource", custom=False)
    relation.SetTargets([animation.GetPath()])
    _write_motion(animation, take, frames)
    _write_felt(animation.GetPrim(), take, frames)
    _write_extent(root, take, frames)
    stage.GetRootLayer().GetPrimAtPath(root.GetPath()).specifier = Sdf.SpecifierOver  # the root layer defines it
    stage.GetRootLayer().Save()


def _write_motion(animation: Any, take: Take, frames: Frames) -> None:
    joints = take.character.joints
    animation.CreateJointsAttr(Vt.TokenArray(joint_paths([j.name for j in joints], [j.parent for j in joints])))
    rotations = animation.CreateRotationsAttr()
    for code, quaternions in enumerate(frames.rotations):
        rotations.Set(values.quatf_array(quaternions), code)
    translations = skeleton.local_translations(take.character, frames.root_translations)
    _set_samples(animation.CreateTranslationsAttr(), [values.vec3f_array(row) for row in translations])
    animation.CreateScalesAttr(values.vec3h_array(np.ones((len(joints), 3))))


def _write_felt(prim: Any, take: Take, frames: Frames) -> None:
    """Torques and rest rotations as sampled custom attributes; yield events as custom data."""
    torques = prim.CreateAttribute("layfigure:torques", Sdf.ValueTypeNames.Vector3fArray, custom=True)
    rests = prim.CreateAttribute("layfigure:restRotations", Sdf.ValueTypeNames.QuatfArray, custom=True)
    for code in range(len(frames)):
        torques.Set(values.vec3f_array(frames.torques[code]), code)
        rests.Set(values.quatf_array(frames.rest_rotations[code]), code)
    events = yield_events(take, frames.fps)
    prim.SetCustomDataByKey("layfigure:yieldJoints", values.int_array([event.joint for event in events]))
    prim.SetCustomDataByKey("layfigure:yieldStarts", values.double_array([event.start for event in events]))
    prim.SetCustomDataByKey("layfigure:yieldEnds", values.double_array([event.end for event in events]))


def _write_extent(root: Any, take: Take, frames: Frames) -> None:
    """The box of the skinned meshes in each frame, so that viewers frame and cull the moving character."""
    if not take.meshes:
        return
    rotations, positions = skeleton.world_poses(take.character, frames.root_translations, frames.rotations)
    extents = []
    for frame_rotations, frame_positions in zip(rotations, positions, strict=True):
        skinned = [skeleton.skin(take.character, mesh, frame_rotations, frame_positions) for mesh in take.meshes]
        extents.append(values.extent_of(np.concatenate(skinned)))
    _set_samples(UsdGeom.Boundable(root).CreateExtentAttr(), extents)


def _set_samples(attribute: Any, samples: list[Any]) -> None:
    """One sample per frame; a value that never changes is set once, as the default."""
    if all(sample == samples[0] for sample in samples):
        attribute.Set(samples[0])
        return
    for code, sample in enumerate(samples):
        attribute.Set(sample, code)
