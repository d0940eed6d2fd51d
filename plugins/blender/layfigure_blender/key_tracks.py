# SPDX-License-Identifier: GPL-3.0-or-later
"""From poses to keys of bones: what each frame shows, and the fewest keys that show it. No bpy.

Leading axis F: frames; B: bones. A bone's rotation and location are those of Blender's matrix_basis, beside its rest
place on its parent, L_b = rest_parent^-1 rest_b:

    M_b = M_parent L_b T(location) R(rotation)

which is how Blender composes bones that inherit all of their parents' rotation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from layfigure import Character, Joint, Mesh, Pose, rotation
from layfigure.key_error import SkinDistance
from layfigure.key_fitting import Keys, fitted_keys, keys_at
from layfigure.key_reduction import Progress, silent
from layfigure.resample import Between, Frames
from layfigure.skinning import Skin

from . import rotation_modes
from .link import Sample
from .rig import Bone, nearest_rotations

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

LATE_S = 0.1  # a pose that comes so much later than its simulation time says: the server has dropped time, or is new
UNEVEN_FRAMES = 1.5  # how far playback may be from even time and count as even: a frame late, and its jitter
PLAYBACK_ROUNDING_M = 1e-5  # of Blender's single precision in its chains of bones and its skin, 1e-6 to 5e-6 m


@dataclass(frozen=True, eq=False)
class Tracks:
    """Of bones beside their parents."""

    rotations: Floats  # (F, B, 4)
    locations: Floats  # (F, B, 3), in the units of the armature

    def __len__(self) -> int:
        return len(self.rotations)


# ---------------------------------------------------------------- recording


class Recording:
    """Poses of a doll while a timeline plays, and which frame was shown when."""

    def __init__(self, frames_per_second: float) -> None:
        self._fps = frames_per_second
        self._samples: list[Sample] = []
        self._shown: list[tuple[int, float]] = []

    def add(self, sample: Sample) -> None:
        """What has been added already is left out."""
        if not self._samples or self._samples[-1].pose is not sample.pose:
            self._samples.append(sample)

    def show(self, frame: int, now_s: float) -> bool:
        """The timeline shows this frame from now on. False, and nothing else, if it is not after the one before: it
        has begun anew, or somebody has moved it."""
        if self._shown and frame <= self._shown[-1][0]:
            return frame == self._shown[-1][0]
        self._shown.append((frame, now_s))
        return True

    def __len__(self) -> int:
        """Frames from the first to the last that was shown."""
        return self._shown[-1][0] - self._shown[0][0] + 1 if self._shown and self._samples else 0

    @property
    def first_frame(self) -> int:
        return self._shown[0][0]

    def poses(self) -> list[Pose]:
        """One for each frame."""
        if not len(self):
            return []
        times_s = posed_at(self._samples)
        later = np.concatenate([[True], times_s[1:] > np.maximum.accumulate(times_s)[:-1]])
        poses = [sample.pose for sample, is_later in zip(self._samples, later, strict=True) if is_later]
        times_us = np.round(1e6 * times_s[later]).astype(np.int64)
        wanted_us = 1e6 * even_times(self._shown, self._fps)
        between = Between(times_us, np.clip(wanted_us, times_us[0], times_us[-1]))
        roots = between.linear(np.array([pose.root_translation for pose in poses]))
        turns = between.spherical(np.array([pose.rotations for pose in poses]))
        return [posed(poses[-1], root, turned) for root, turned in zip(roots, turns, strict=True)]


def posed_at(samples: Sequence[Sample]) -> Floats:
    """When each was posed, on the clock of `received_at` [s].

    Simulation time is evener than when messages come. The two differ by what the quickest message took; and by more
    after a server has dropped time, or another one, whose time begins anew, is in its place.
    """
    simulated = np.array([1e-6 * sample.pose.time_us for sample in samples])
    lags = np.array([sample.received_at for sample in samples]) - simulated
    offsets = np.empty(len(samples))
    start, quickest = 0, np.inf
    for index, lag in enumerate(lags):
        if lag > quickest + LATE_S:
            start, quickest = index, np.inf
        offsets[index] = quickest
        if lag < quickest:
            quickest = lag
            offsets[start : index + 1] = quickest
    return simulated + offsets


def posed(like: Pose, root_translation: Floats, rotations: Floats) -> Pose:
    """A pose of the same doll, of which nothing else is known."""
    return Pose(
        time_us=like.time_us,
        server_id=like.server_id,
        content_hash=like.content_hash,
        sequence=like.sequence,
        step=like.step,
        root_translation=root_translation,
        rotations=rotations,
        rest_rotations=rotations,
        torques=np.zeros((len(rotations), 3)),
        yielded=np.zeros(len(rotations), np.bool_),
    )


def even_times(shown: Sequence[tuple[int, float]], frames_per_second: float) -> Floats:
    """When each frame from the first to the last was there [s], of frames and when they were shown, rising.

    Playback that keeps its rate shows frames a little late, now and then one in place of two: then the times are those
    that it aims at. Playback that does not keep it, since the scene is heavy, has the times at which it showed them.
    """
    frames = np.array([frame for frame, _ in shown], np.float64)
    times = np.array([time_s for _, time_s in shown])
    wanted = np.arange(frames[0], frames[-1] + 1.0)
    lags = times - frames / frames_per_second
    if np.ptp(lags) <= UNEVEN_FRAMES / frames_per_second:
        return np.asarray(wanted / frames_per_second + np.median(lags), np.float64)
    return np.interp(wanted, frames, times)


# ---------------------------------------------------------------- reduction


class BlenderPlayback:
    """How bones turn between two keys that are LINEAR: each number of the rotation mode goes in a straight line."""

    def __init__(self, modes: Sequence[str], rests: Floats) -> None:
        """`rests` (B, 4): of the bones on their parents, whose part in the joints' local rotations is always there."""
        self._rests = rests
        self._groups = {mode: np.flatnonzero([mode == each for each in modes]) for mode in sorted(set(modes))}

    def basis(self, local: Floats) -> Floats:
        return rotation.multiply(rotation.conjugate(self._rests), local)

    def local(self, basis: Floats) -> Floats:
        return rotation.multiply(self._rests, basis)

    def between(self, first: Floats, last: Floats, part: Floats) -> Floats:
        a, b = self.basis(first), self.basis(last)
        turned = np.empty(np.broadcast_shapes(a.shape, b.shape))
        for mode, bones in self._groups.items():
            start, end = self._numbers(mode, a[..., bones, :], b[..., bones, :])
            turned[..., bones, :] = rotation_modes.to_rotations(mode, start + part[..., None] * (end - start))
        return self.local(turned)

    def turn(self, first: Floats, last: Floats) -> Floats:
        a, b = self.basis(first), self.basis(last)
        turns = np.empty(a.shape[:-1])
        for mode, bones in self._groups.items():
            if mode == rotation_modes.QUATERNION:
                turns[..., bones] = rotation.angle_between(a[..., bones, :], b[..., bones, :])
                continue
            start, end = self._numbers(mode, a[..., bones, :], b[..., bones, :])
            # each angle turns by itself at most; an axis that turns by x turns what is about it by 2 x at most, and x
            # is at most half pi times the way of its end
            weights = np.array([1.0, np.pi, np.pi, np.pi]) if mode == rotation_modes.AXIS_ANGLE else np.ones(3)
            turns[..., bones] = (weights * np.abs(end - start)).sum(axis=-1)
        return turns

    def _numbers(self, mode: str, first: Floats, last: Floats) -> tuple[Floats, Floats]:
        neutral = np.broadcast_to(rotation_modes.neutral(mode), (*first.shape[:-1], len(rotation_modes.neutral(mode))))
        if mode == rotation_modes.AXIS_ANGLE:
            both = rotation_modes.continuous(mode, np.stack([first.reshape(-1, 4), last.reshape(-1, 4)]))
            return both[0].reshape(neutral.shape), both[1].reshape(neutral.shape)
        start = rotation_modes.nearest(mode, first, neutral)
        return start, rotation_modes.nearest(mode, last, start)


@dataclass(frozen=True, eq=False)
class ReducedKeys:
    frames: Ints  # (N) indices of frames, rising
    numbers: tuple[Floats, ...]  # of each bone's rotation mode (N, n)
    locations: Floats  # (N, B, 3)
    error_m: float  # of the farthest vertex in any frame, as Blender plays the keys


def reduce_keys(
    bones: Sequence[Bone],
    modes: Sequence[str],
    tracks: Tracks,
    meshes: Sequence[Mesh],
    meters_per_unit: float,
    tolerance_m: float,
    tell: Progress = silent,
) -> ReducedKeys:
    """The fewest LINEAR keys, of all bones in the same frames, for which no vertex of the skin is farther than the
    tolerance, > 0, from where the tracks have it, in any frame.

    `meshes` have their points in the armature's space, and in its units, as they were bound; joints are bones.
    About 2 ms for a frame of 50 bones and 13 000 vertices, see layfigure.key_reduction.
    """
    reduction = _Reduction(bones, modes, tracks, meshes, meters_per_unit)
    return reduction.reduced(tolerance_m, tell)


class _Reduction:
    def __init__(
        self,
        bones: Sequence[Bone],
        modes: Sequence[str],
        tracks: Tracks,
        meshes: Sequence[Mesh],
        meters_per_unit: float,
    ) -> None:
        self._modes = modes
        self._tracks = tracks
        rests = np.array([bone.rest for bone in bones], np.float64)
        turns = rotation.from_matrix(nearest_rotations(rests[:, :3, :3]))
        places = meters_per_unit * rests[:, :3, 3]
        above = [bone.parent for bone in bones]
        self._of_parents = np.array([turns[p] if p >= 0 else [1.0, 0.0, 0.0, 0.0] for p in above])
        origins = np.array([places[p] if p >= 0 else np.zeros(3) for p in above])
        self._offsets = rotation.rotate(rotation.conjugate(self._of_parents), places - origins)  # (B, 3)
        self._playback = BlenderPlayback(modes, rotation.multiply(rotation.conjugate(self._of_parents), turns))
        self._rests = rotation.multiply(rotation.conjugate(self._of_parents), turns)
        self._scale = meters_per_unit
        character = _character(bones, turns, places)
        scaled = [_scaled(mesh, meters_per_unit) for mesh in meshes]
        self._rotations = self._playback.local(tracks.rotations)
        translations = self._translations(tracks.locations)
        moving = np.flatnonzero(np.ptp(tracks.locations, axis=0).any(axis=-1))
        self._movers = moving if len(moving) else np.zeros(1, np.intp)
        self._moved = translations[:, self._movers].reshape(len(tracks), -1)
        self._distance = SkinDistance(
            character, Skin(character, scaled), self._rotations, translations, self._movers.tolist(), self._playback
        )

    def reduced(self, tolerance_m: float, tell: Progress) -> ReducedKeys:
        aim_m = tolerance_m - min(PLAYBACK_ROUNDING_M, 0.5 * tolerance_m)
        frames = Frames(1.0, self._moved, self._rotations)
        keys = fitted_keys(self._distance, frames, aim_m, tell)
        while True:
            made = self._as_blender_has_them(keys)
            errors = self._errors(made)
            failing = ~self._distance.within(errors, aim_m)
            if not failing.any():
                return ReducedKeys(made.frames, made.numbers, made.locations, float(errors.max()))
            tell("keys: some are added")
            keys = self._with_more(keys, np.where(failing, errors, 0.0))

    def _as_blender_has_them(self, keys: Keys) -> ReducedKeys:
        basis = self._playback.basis(keys.rotations)
        numbers = tuple(
            rotation_modes.continuous(mode, basis[:, b : b + 1])[:, 0].astype(np.float32).astype(np.float64)
            for b, mode in enumerate(self._modes)
        )
        locations = self._tracks.locations[keys.frames].copy()
        moved = keys.root_translations.reshape(len(keys.frames), -1, 3)
        locations[:, self._movers] = self._locations(moved, self._movers)
        return ReducedKeys(keys.frames, numbers, locations.astype(np.float32).astype(np.float64), 0.0)

    def _errors(self, keys: ReducedKeys) -> Floats:
        """(F) of the farthest vertex, with the numbers played as Blender does it."""
        frames = np.arange(len(self._tracks))
        basis = np.stack(
            [
                rotation_modes.to_rotations(mode, _played(keys.frames, numbers, frames))
                for mode, numbers in zip(self._modes, keys.numbers, strict=True)
            ],
            axis=1,
        )
        locations = _played(keys.frames, keys.locations.reshape(len(keys.frames), -1), frames)
        translations = self._translations(locations.reshape(len(frames), -1, 3))
        return self._distance.of_poses(
            self._playback.local(basis), translations[:, self._movers].reshape(len(frames), -1)
        )

    def _with_more(self, keys: Keys, errors: Floats) -> Keys:
        """A key, of what was recorded, where it is worst between two keys; or at a key that was moved too far."""
        starts = np.searchsorted(keys.frames, np.arange(len(errors)), side="right") - 1
        worst = [
            frames[np.argmax(errors[frames])]
            for start in np.unique(starts)
            if errors[frames := np.flatnonzero(starts == start)].any()
        ]
        recorded = keys_at(Frames(1.0, self._moved, self._rotations), np.array(worst, np.intp))
        kept = ~np.isin(keys.frames, worst)
        order = np.argsort(np.concatenate([keys.frames[kept], recorded.frames]))
        return Keys(
            np.concatenate([keys.frames[kept], recorded.frames])[order],
            np.concatenate([keys.rotations[kept], recorded.rotations])[order],
            np.concatenate([keys.root_translations[kept], recorded.root_translations])[order],
        )

    def _translations(self, locations: Floats) -> Floats:
        """(F, B, 3) of bones beside their parents [m], of locations in the bones' own axes."""
        return np.asarray(self._offsets + self._scale * rotation.rotate(self._rests, locations), np.float64)

    def _locations(self, translations: Floats, bones: Ints) -> Floats:
        inverse = rotation.conjugate(self._rests[bones])
        return rotation.rotate(inverse, translations - self._offsets[bones]) / self._scale


def _played(keys: Ints, numbers: Floats, frames: Ints) -> Floats:
    """(F, n) of numbers (N, n) at keys, in straight lines."""
    return np.stack([np.interp(frames, keys, column) for column in numbers.T], axis=1)


def _character(bones: Sequence[Bone], turns: Floats, places: Floats) -> Character:
    """The armature as the skin's mathematics has skeletons; of it only the bind pose and the parents are asked for."""
    joints = tuple(
        Joint(
            name=bone.name,
            parent=bone.parent,
            rest_translation=place,
            rest_rotation=turn,
            bind_translation=place,
            bind_rotation=turn,
            is_body=True,
            mass=0.0,
            stiffness=0.0,
            yield_torque=0.0,
        )
        for bone, turn, place in zip(bones, turns, places, strict=True)
    )
    return Character(
        time_us=0,
        server_id=0,
        name="",
        source_file="",
        source_folder="",
        content_hash=0,
        physics_hz=0.0,
        pose_hz=0.0,
        clock="",
        mesh_bytes=0,
        joints=joints,
    )


def _scaled(mesh: Mesh, factor: float) -> Mesh:
    return replace(mesh, points=np.asarray(mesh.points * factor, np.float32))


def is_constant(numbers: Floats) -> bool:
    """Of one curve, in single precision as Blender keeps it."""
    return bool(np.ptp(numbers.astype(np.float32)) == 0.0)
