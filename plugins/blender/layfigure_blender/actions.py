# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of an armature's bones in its action, alike in all versions of Blender, with slots and without."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from . import rotation_modes
from .key_tracks import is_constant

Floats = NDArray[np.float64]

SAME_FRAME = 0.01  # frames nearer than this are the same one, as Blender itself has it when keys are inserted
_NUMBERS = ("co", "handle_left", "handle_right")  # (2) each
_CHOICES = ("interpolation", "easing", "handle_left_type", "handle_right_type", "type")
_AMOUNTS = {"back": 1.70158, "amplitude": 0.8, "period": 4.1}  # with Blender's own values for new keys
_WIDTHS = dict.fromkeys(_NUMBERS, 2)


_BONE_PATH = re.compile(r'pose\.bones\["(.*)"\]\.(?:rotation_(?:quaternion|euler|axis_angle)|location)')


class ActionError(Exception):
    """Why an armature cannot be keyed; one line, with the mend."""


def path_of(bone: str, name: str) -> str:
    return f'pose.bones["{bpy.utils.escape_identifier(bone)}"].{name}'


class BoneCurves:
    """The curves of bones in the action that an armature has, or gets."""

    def __init__(self, armature: bpy.types.Object, curves: Any, groups: Any) -> None:
        self._curves = curves
        self._groups = groups
        self._armature = armature

    @staticmethod
    def find(armature: bpy.types.Object) -> BoneCurves | None:
        """Those that are there; None if there is no action, or nothing in it that is for this armature."""
        data = armature.animation_data
        if data is None or data.action is None:
            return None
        action = data.action
        if not hasattr(action, "slots"):
            return BoneCurves(armature, action.fcurves, action.groups)
        bag = _channelbag(action, data.action_slot, ensure=False)
        return None if bag is None else BoneCurves(armature, bag.fcurves, bag.groups)

    @staticmethod
    def ensure(armature: bpy.types.Object) -> BoneCurves:
        """Makes an action, a slot and what else is missing. Raises ActionError."""
        BoneCurves.require_possible(armature)
        data = armature.animation_data_create()
        if data.action is None:
            return BoneCurves.new(armature, armature.name)
        action = data.action
        if not hasattr(action, "slots"):
            return BoneCurves(armature, action.fcurves, action.groups)
        if data.action_slot is None:
            data.action_slot = _slot_for(armature, action)
        bag = _channelbag(action, data.action_slot, ensure=True)
        return BoneCurves(armature, bag.fcurves, bag.groups)

    @staticmethod
    def require_possible(armature: bpy.types.Object) -> None:
        """Raises ActionError if what ensure() gives could not be keyed."""
        action = armature.animation_data.action if armature.animation_data is not None else None
        if action is not None and action.library is not None:
            raise ActionError(f"The action '{action.name}' is linked from another file: make it local, or unlink it")

    @staticmethod
    def new(armature: bpy.types.Object, name: str) -> BoneCurves:
        """In a new action, which takes the place of the armature's. Raises ActionError."""
        data = armature.animation_data_create()
        if data.use_tweak_mode:
            raise ActionError(
                f"A strip of '{armature.name}' is being tweaked: leave tweak mode (Tab) in the NLA editor"
            )
        if data.action is not None:
            data.action.use_fake_user = True  # nobody else may use it: it would be lost when the file is saved
        data.action = bpy.data.actions.new(name)
        return BoneCurves.ensure(armature)

    def curve(self, bone: str, name: str, index: int) -> Any | None:
        return self._curves.find(path_of(bone, name), index=index)

    def ensure_curve(self, bone: str, name: str, index: int) -> Any:
        path = path_of(bone, name)
        found = self._curves.find(path, index=index)
        if found is not None:
            return found
        curve = self._curves.new(path, index=index)
        curve.group = self._groups.get(bone) or self._groups.new(bone)
        return curve

    def has(self, bone: str, name: str) -> bool:
        return any(curve.data_path == path_of(bone, name) for curve in self._curves)

    def of_bones(self) -> set[str]:
        """The names of the bones whose rotation or location has keys."""
        found = (_BONE_PATH.fullmatch(curve.data_path) for curve in self._curves if len(curve.keyframe_points))
        return {bpy.utils.unescape_identifier(match[1]) for match in found if match}

    def key_span(self, bones: set[str]) -> Floats:
        """(F,) all whole frames of the scene from the first to the last key of these bones' rotations and locations."""
        at = [
            keys_of(curve)[[0, -1], 0]
            for curve in self._curves
            if (match := _BONE_PATH.fullmatch(curve.data_path))
            and bpy.utils.unescape_identifier(match[1]) in bones
            and len(curve.keyframe_points)
        ]
        data = self._armature.animation_data
        ends = [min(first for first, _ in at), max(last for _, last in at)]
        if data.use_tweak_mode:
            ends = [data.nla_tweak_strip_time_to_scene(float(end)) for end in ends]
        return np.arange(np.floor(ends[0]), np.ceil(ends[1]) + 1.0)

    def frame_of(self, scene_frame: float) -> float:
        """In the action's time, which is another one while a strip of the NLA is tweaked."""
        data = self._armature.animation_data
        return data.nla_tweak_strip_time_to_scene(scene_frame, invert=True) if data.use_tweak_mode else scene_frame


def _slot_for(armature: bpy.types.Object, action: bpy.types.Action) -> Any:
    """One that nobody else is animated by."""
    for slot in armature.animation_data.action_suitable_slots:
        if all(user == armature for user in slot.users()):
            return slot
    return action.slots.new(id_type="OBJECT", name=armature.name)


def _channelbag(action: bpy.types.Action, slot: Any, ensure: bool) -> Any | None:
    """Of the action's first strip, of its first layer: there are no others yet."""
    if slot is None:
        return None
    if ensure:
        layer = action.layers[0] if len(action.layers) else action.layers.new("Layer")
        strip = layer.strips[0] if len(layer.strips) else layer.strips.new(type="KEYFRAME")
        return strip.channelbag(slot, ensure=True)
    strips = [strip for layer in action.layers for strip in layer.strips]
    return strips[0].channelbag(slot) if strips else None


# ---------------------------------------------------------------- values


def insert(curve: Any, frame: float, value: float, preferences: bpy.types.PreferencesEdit) -> None:
    """One key as the user's preferences have new ones; one that is there already gets the value alone."""
    count = len(curve.keyframe_points)
    key = curve.keyframe_points.insert(frame, value)
    if len(curve.keyframe_points) > count:
        key.interpolation = preferences.keyframe_new_interpolation_type
        key.handle_left_type = key.handle_right_type = preferences.keyframe_new_handle_type
    curve.update()


def value_before(curve: Any, frame: float) -> float | None:
    """Of the last key before the frame, or else of the first after it; None if there is neither."""
    frames = keys_of(curve)[:, 0]
    others = np.flatnonzero(np.abs(frames - frame) > SAME_FRAME)
    if not len(others):
        return None
    before = others[frames[others] < frame]
    nearest = before[-1] if len(before) else others[0]
    return float(curve.keyframe_points[int(nearest)].co[1])


def keys_of(curve: Any) -> Floats:
    """(N, 2) frames and values."""
    flat = np.empty(2 * len(curve.keyframe_points), np.float32)
    curve.keyframe_points.foreach_get("co", flat)
    return flat.reshape(-1, 2).astype(np.float64)


def replace(curve: Any, span: tuple[float, float], frames: Floats, values: Floats, interpolation: str) -> None:
    """Keys in place of those in the span of frames, first and last included; those outside stay as they are."""
    points = curve.keyframe_points
    old = {name: _get(points, name) for name in (*_NUMBERS, *_CHOICES, *_AMOUNTS)}
    stays = (old["co"][:, 0] < span[0] - SAME_FRAME) | (old["co"][:, 0] > span[1] + SAME_FRAME)
    key = bpy.types.Keyframe.bl_rna.properties
    new = {
        "co": np.stack([frames, values], axis=1),
        "handle_left": np.stack([frames, values], axis=1),
        "handle_right": np.stack([frames, values], axis=1),
        "interpolation": np.full(len(frames), key["interpolation"].enum_items[interpolation].value),
        "handle_left_type": np.full(len(frames), key["handle_left_type"].enum_items["AUTO_CLAMPED"].value),
        "handle_right_type": np.full(len(frames), key["handle_right_type"].enum_items["AUTO_CLAMPED"].value),
    }
    new.update({name: np.full(len(frames), amount) for name, amount in _AMOUNTS.items()})
    for name in ("easing", "type"):
        new[name] = np.full(len(frames), key[name].enum_items[key[name].default].value)
    merged = {name: np.concatenate([old[name][stays], new[name]]) for name in old}
    order = np.argsort(merged["co"][:, 0], kind="stable")
    _resize(points, len(order))
    for name, numbers in merged.items():
        kind = np.intc if name in _CHOICES else np.float32
        points.foreach_set(name, np.ascontiguousarray(numbers[order], kind).ravel())
    curve.update()


def _get(points: Any, name: str) -> NDArray[Any]:
    width = _WIDTHS.get(name, 1)
    flat = np.empty(width * len(points), np.intc if name in _CHOICES else np.float32)
    points.foreach_get(name, flat)
    return flat.reshape(-1, width) if width > 1 else flat


def _resize(points: Any, count: int) -> None:
    while len(points) > count:
        points.remove(points[len(points) - 1], fast=True)
    if len(points) < count:
        points.add(count - len(points))


def write(
    curves: BoneCurves,
    bone: bpy.types.PoseBone,
    numbers: dict[str, Floats],
    frames: Sequence[float] | Floats,
    span: tuple[float, float] | None = None,
) -> None:
    """LINEAR keys of one bone: (F, n) by the property's name, of scene frames, rising, in place of all in the span,
    by default from the first to the last of them. What does not change has keys at these two alone."""
    at = np.array([curves.frame_of(float(frame)) for frame in frames])
    first, last = (frames[0], frames[-1]) if span is None else span
    span = (curves.frame_of(float(first)), curves.frame_of(float(last)))
    for name, columns in numbers.items():
        for index, column in enumerate(columns.T):
            curve = curves.ensure_curve(bone.name, name, index)
            kept = np.unique([0, len(at) - 1]) if is_constant(column) else np.arange(len(at))
            replace(curve, span, at[kept], column[kept], "LINEAR")


def rotation_numbers(
    curves: BoneCurves | None, bone: bpy.types.PoseBone, rotations: Floats, first_frame: float
) -> dict[str, Floats]:
    """(F, n) of rotations (F, 4) in the bone's own mode, near to the key before the first of these frames."""
    mode = bone.rotation_mode
    name = rotation_modes.property_of(mode)
    before = None if curves is None else numbers_before(curves, bone, first_frame)
    column = None if before is None else before[None]
    return {name: rotation_modes.continuous(mode, rotations[:, None], column)[:, 0]}


def numbers_before(curves: BoneCurves, bone: bpy.types.PoseBone, scene_frame: float) -> Floats | None:
    """The rotation's numbers in the key before the frame, or after it; None if not all of them are keyed."""
    name = rotation_modes.property_of(bone.rotation_mode)
    count = len(rotation_modes.neutral(bone.rotation_mode))
    found = [curves.curve(bone.name, name, index) for index in range(count)]
    frame = curves.frame_of(scene_frame)
    values = [None if curve is None else value_before(curve, frame) for curve in found]
    return None if None in values else np.array(values, np.float64)


def channel(curves: BoneCurves, bone: bpy.types.PoseBone, name: str, frames: Sequence[float] | Floats) -> Floats:
    """(F, n): what a property of the bone is in these frames of the scene, by its curves, else as it is now."""
    now = np.array(getattr(bone, name), np.float64)
    result = np.repeat(now[None], len(frames), axis=0)
    for index in range(len(now)):
        curve = curves.curve(bone.name, name, index)
        if curve is not None:
            result[:, index] = [curve.evaluate(curves.frame_of(float(frame))) for frame in frames]
    return result
