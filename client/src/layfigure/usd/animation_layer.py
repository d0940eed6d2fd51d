"""What moves: the SkelAnimation, and what the doll felt."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel, Vt

from layfigure import skeleton
from layfigure.animation import Animation
from layfigure.protocol import Bools, Character
from layfigure.resample import Felt, Frames, felt, pulls
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


def write_animation_layer(path: str, animation: Animation) -> None:
    """A layer of its own over the character's."""
    stage = Usd.Stage.CreateNew(path)
    set_stage_units(stage)
    set_stage_time(stage, animation.frames)
    root = stage.OverridePrim(character_prim_path(animation.take.character))
    stage.SetDefaultPrim(root)
    write_animation(stage, animation)
    stage.GetRootLayer().GetPrimAtPath(root.GetPath()).specifier = Sdf.SpecifierOver  # the root layer defines it
    stage.GetRootLayer().Save()


def write_animation(stage: Any, animation: Animation) -> None:
    take, frames, keys = animation.take, animation.frames, animation.keys
    skel_animation = define_animation(stage, take.character)
    prim = skel_animation.GetPrim()
    rotations = values.quatf_arrays(animation.values.rotations)
    translations = skeleton.local_translations(take.character, animation.values.root_translations)
    set_samples(skel_animation.GetRotationsAttr(), keys, rotations)
    set_samples(skel_animation.GetTranslationsAttr(), keys, values.vec3f_arrays(translations))
    _write_yield_events(prim, take, frames.fps)
    if animation.form.custom_data:
        _write_felt(prim, felt(take, frames.fps))
        _write_pulls(prim, take, frames)
    if len(animation.extents):
        root = UsdGeom.Boundable(stage.GetPrimAtPath(character_prim_path(take.character)))
        set_samples(root.CreateExtentAttr(), keys, values.vec3f_arrays(animation.extents))


def define_animation(stage: Any, character: Character) -> Any:
    """A SkelAnimation that the character's skeleton is bound to. Only its rotations and translations are still open."""
    root = character_prim_path(character)
    animation = UsdSkel.Animation.Define(stage, f"{root}/Animation")
    relation = stage.OverridePrim(skeleton_path(character)).CreateRelationship("skel:animationSource", custom=False)
    relation.SetTargets([animation.GetPath()])
    joints = character.joints
    animation.CreateJointsAttr(Vt.TokenArray(joint_paths([j.name for j in joints], [j.parent for j in joints])))
    animation.CreateRotationsAttr()
    animation.CreateTranslationsAttr()
    animation.CreateScalesAttr(values.vec3h_array(np.ones((len(joints), 3))))
    return animation


def set_samples(attribute: Any, codes: Iterable[Any], samples: list[Any]) -> None:
    """One sample per time code; a value that never changes is set once, as the default."""
    if all(sample == samples[0] for sample in samples):
        attribute.Set(samples[0])
        return
    add_samples(attribute, codes, samples)


def add_samples(attribute: Any, codes: Iterable[Any], samples: list[Any]) -> None:
    """Of an attribute in its stage's root layer, of the attribute's very type: by the layer, as Attribute.Set() takes
    twice as long for one."""
    layer, path = attribute.GetStage().GetRootLayer(), attribute.GetPath()
    with Sdf.ChangeBlock():  # nobody listens to each of them
        for code, sample in zip(codes, samples, strict=True):
            layer.SetTimeSample(path, float(code), sample)


def _write_yield_events(prim: Any, take: Take, fps: float) -> None:
    events = yield_events(take, fps)
    prim.SetCustomDataByKey("layfigure:yieldJoints", values.int_array([event.joint for event in events]))
    prim.SetCustomDataByKey("layfigure:yieldStarts", values.double_array([event.start for event in events]))
    prim.SetCustomDataByKey("layfigure:yieldEnds", values.double_array([event.end for event in events]))


def _write_felt(prim: Any, felt: Felt) -> None:
    """Of the joints, in the order of `joints`."""
    types = Sdf.ValueTypeNames
    _write_custom(prim, "torques", types.Vector3fArray, values.vec3f_arrays(felt.torques))
    _write_custom(prim, "restRotations", types.QuatfArray, values.quatf_arrays(felt.rest_rotations))
    _write_custom(prim, "yielded", types.BoolArray, [_bool_array(row) for row in felt.yielded])


def _write_pulls(prim: Any, take: Take, frames: Frames) -> None:
    """Of the pointers, in the order of `layfigure:pointers`."""
    tracks = [track for track in take.pointers if len(track.times_us)]
    if not tracks:
        return
    pointers = prim.CreateAttribute("layfigure:pointers", Sdf.ValueTypeNames.IntArray, custom=True)
    pointers.Set(values.int_array([track.pointer for track in tracks]))
    of_pointers = [pulls(track, frames) for track in tracks]
    types = Sdf.ValueTypeNames
    joints = np.stack([pull.joints for pull in of_pointers], axis=1)
    positions = np.stack([pull.positions for pull in of_pointers], axis=1)
    forces = np.stack([pull.forces for pull in of_pointers], axis=1)
    _write_custom(prim, "heldJoints", types.IntArray, [values.int_array(row) for row in joints])
    _write_custom(prim, "heldPoints", types.Point3fArray, values.vec3f_arrays(positions))
    _write_custom(prim, "forces", types.Vector3fArray, values.vec3f_arrays(forces))


def _write_custom(prim: Any, name: str, type_name: Any, samples: list[Any]) -> None:
    """Measured values are not keys: there is one in every frame."""
    set_samples(prim.CreateAttribute(f"layfigure:{name}", type_name, custom=True), range(len(samples)), samples)


def _bool_array(flags: Bools) -> Any:
    return Vt.BoolArray(flags.tolist())
