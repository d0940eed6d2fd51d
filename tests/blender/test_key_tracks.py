"""Recordings of a doll while a timeline plays, and the fewest keys as Blender plays them. Without Blender."""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

from layfigure import Mesh, Pose, rotation

sys.path.append(str(Path(__file__).resolve().parents[2] / "plugins/blender"))
from layfigure_blender import key_tracks, rotation_modes
from layfigure_blender.key_tracks import Recording, Tracks, reduce_keys
from layfigure_blender.link import Sample
from layfigure_blender.rig import Bone

FPS = 24.0
SPEED = 1.3  # [rad/s] of the only joint
EXACT = 1e-9


# ---------------------------------------------------------------- recording


def sample(time_s: float, received_at: float, angle: float | None = None) -> Sample:
    turned = rotation.from_vector(np.array([[0.0, 0.0, SPEED * time_s if angle is None else angle]]))
    pose = Pose(
        time_us=round(1e6 * time_s),
        server_id=1,
        content_hash=1,
        sequence=0,
        step=0,
        root_translation=np.array([time_s, 0.0, 0.0]),
        rotations=turned,
        rest_rotations=turned,
        torques=np.zeros((1, 3)),
        yielded=np.zeros(1, np.bool_),
    )
    return Sample(pose, received_at)


def angles_of(poses: list[Pose]) -> np.ndarray:
    return np.unwrap([rotation.to_vector(pose.rotations[0])[2] for pose in poses])


def test_frames_have_the_poses_of_their_times() -> None:
    """Poses at 60 Hz come with a lag that varies, frames are shown up to some ms late."""
    dice = np.random.default_rng(4)
    recording = Recording(FPS)
    events = [(100.0 + k / 60.0 + dice.uniform(0.002, 0.008), ("pose", k / 60.0)) for k in range(120)]
    events += [(100.5 + k / FPS + dice.uniform(0.0, 0.01), ("frame", 7 + k)) for k in range(24)]
    for now, (kind, value) in sorted(events):
        if kind == "pose":
            recording.add(sample(float(value), now))
        else:
            assert recording.show(int(value), now)
    poses = recording.poses()
    assert (recording.first_frame, len(poses), len(recording)) == (7, 24, 24)
    speeds = np.diff(angles_of(poses)) * FPS
    np.testing.assert_allclose(speeds, SPEED, rtol=1e-5)  # even, although nothing came evenly
    assert abs(angles_of(poses)[0] - SPEED * 0.5) < SPEED * 0.012  # and at its time, up to the lags above


def test_frames_that_playback_skipped_have_poses_too() -> None:
    recording = Recording(FPS)
    for k in range(80):
        recording.add(sample(k / 60.0, 100.0 + k / 60.0))
    for frame in (1, 2, 5, 6, 9, 12):
        assert recording.show(frame, 100.0 + (frame - 1) / FPS)
    np.testing.assert_allclose(angles_of(recording.poses()), SPEED * np.arange(12) / FPS, atol=1e-6)


def test_playback_slower_than_its_rate_keeps_what_was_seen() -> None:
    """Each frame is shown twice as long as it should be: what the doll did then is on it."""
    recording = Recording(FPS)
    for k in range(240):
        recording.add(sample(k / 60.0, 100.0 + k / 60.0))
    for frame in range(40):
        recording.show(frame, 100.0 + 2.0 * frame / FPS)
    np.testing.assert_allclose(angles_of(recording.poses()), SPEED * 2.0 * np.arange(40) / FPS, atol=1e-6)


def test_doll_at_rest_stays_until_it_moves() -> None:
    recording = Recording(FPS)
    for k in range(11):
        recording.add(sample(0.1 * k, 100.0 + 0.1 * k, angle=0.0))  # at rest ten poses in a second come
    recording.add(sample(1.1, 101.1, angle=0.5))
    for frame in range(27):
        recording.show(frame, 100.0 + frame / FPS)
    angles = angles_of(recording.poses())
    assert np.abs(angles[:25]).max() < EXACT
    assert angles[26] > 0.3


def test_restarted_server_goes_on_in_the_same_recording() -> None:
    """Its simulation time begins anew."""
    recording = Recording(FPS)
    for k in range(30):
        recording.add(sample(50.0 + k / 60.0, 100.0 + k / 60.0, angle=0.2))
    for k in range(60):
        recording.add(sample(k / 60.0, 101.0 + k / 60.0, angle=0.7))
    for frame in range(40):
        recording.show(frame, 100.0 + frame / FPS)
    angles = angles_of(recording.poses())
    np.testing.assert_allclose(angles[:11], 0.2, atol=1e-6)
    np.testing.assert_allclose(angles[25:], 0.7, atol=1e-6)


@pytest.mark.parametrize("frame", [3, 1])
def test_frame_before_the_last_is_refused(frame: int) -> None:
    recording = Recording(FPS)
    recording.add(sample(0.0, 100.0))
    assert recording.show(3, 100.0)
    assert recording.show(4, 100.1)
    assert recording.show(4, 100.15)  # shown again, as by a redraw
    assert not recording.show(frame, 100.2)
    assert len(recording) == 2


def test_recording_without_poses_or_frames_is_empty() -> None:
    recording = Recording(FPS)
    assert len(recording) == 0
    assert recording.poses() == []
    recording.show(1, 100.0)
    assert recording.poses() == []
    recording = Recording(FPS)
    recording.add(sample(0.0, 100.0))
    assert recording.poses() == []


def test_one_frame_is_a_pose() -> None:
    recording = Recording(FPS)
    recording.add(sample(0.0, 100.0))
    recording.show(5, 100.0)
    assert len(recording.poses()) == 1


# ---------------------------------------------------------------- reduction


def arm(count: int = 4, length: float = 0.3) -> tuple[list[Bone], Mesh]:
    """Bones one behind the other, each with axes of its own, in a skin of points about them."""
    dice = np.random.default_rng(6)
    bones, points, joints = [], [], []
    for b in range(count):
        rest = np.eye(4)
        rest[:3, :3] = rotation.to_matrix(rotation.normalized(dice.normal(size=4)))
        rest[:3, 3] = [0.0, 0.0, length * b]
        bones.append(Bone(f"bone{b}", b - 1, rest))
        points.append(dice.uniform(-0.05, 0.05, (20, 3)) + np.array([0.0, 0.0, length * (b + 0.5)]))
        joints += [b] * 20
    return bones, skin(np.concatenate(points), joints)


def skin(points: np.ndarray, joints: list[int]) -> Mesh:
    return Mesh(
        name="skin",
        material=None,
        points=points.astype(np.float32),
        triangles=np.zeros((0, 3), np.int32),
        joint_indices=np.array(joints, np.int32)[:, None],
        joint_weights=np.ones((len(joints), 1), np.float32),
        normals=None,
        uvs=None,
        wedges=np.zeros((0, 3), np.int32),
    )


def swinging(bones: list[Bone], frames: int = 150, mover: int = 0) -> Tracks:
    dice = np.random.default_rng(7)
    seconds = np.arange(frames) / FPS
    vectors = np.stack(
        [
            dice.uniform(0.2, 0.7) * np.sin(dice.uniform(0.3, 1.2) * seconds + phase)[:, None] * dice.normal(size=3)
            for phase in range(len(bones))
        ],
        axis=1,
    )
    locations = np.zeros((frames, len(bones), 3))
    locations[:, mover] = 0.1 * np.stack([np.sin(seconds), np.cos(seconds), 0.2 * seconds], axis=1)
    return Tracks(rotation.from_vector(vectors), locations)


def skinned(bones: list[Bone], mesh: Mesh, tracks: Tracks) -> np.ndarray:
    """(F, V, 3) by Blender's own chain of matrices, straightforwardly."""
    posed = np.empty((len(tracks), len(bones), 4, 4))
    for b, bone in enumerate(bones):
        basis = np.tile(np.eye(4), (len(tracks), 1, 1))
        basis[:, :3, :3] = rotation.to_matrix(tracks.rotations[:, b])
        basis[:, :3, 3] = tracks.locations[:, b]
        above = posed[:, bone.parent] @ np.linalg.inv(bones[bone.parent].rest) if bone.parent >= 0 else np.eye(4)
        posed[:, b] = above @ bone.rest @ basis
    motions = posed @ np.linalg.inv(np.array([bone.rest for bone in bones]))
    points = np.concatenate([mesh.points.astype(np.float64), np.ones((len(mesh.points), 1))], axis=1)
    return np.einsum("fvij,vj->fvi", motions[:, mesh.joint_indices[:, 0]], points)[..., :3]


def played(modes: list[str], keys: key_tracks.ReducedKeys, frames: int) -> Tracks:
    """As Blender plays LINEAR keys: each curve by itself."""
    at = np.arange(frames)

    def lines(values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(at, keys.frames, column) for column in values.T], axis=1)

    turns = [rotation_modes.to_rotations(mode, lines(own)) for mode, own in zip(modes, keys.numbers, strict=True)]
    places = [lines(keys.locations[:, b]) for b in range(len(modes))]
    return Tracks(np.stack(turns, axis=1), np.stack(places, axis=1))


@pytest.mark.parametrize(
    "modes",
    [["QUATERNION"] * 4, ["XYZ"] * 4, ["AXIS_ANGLE"] * 4, ["QUATERNION", "ZYX", "AXIS_ANGLE", "YXZ"]],
    ids=lambda modes: "-".join(sorted(set(modes))),
)
@pytest.mark.parametrize("mover", [0, 2])
@pytest.mark.parametrize("meters_per_unit", [1.0, 0.01])
def test_reduced_keys_hold_the_tolerance_as_blender_plays_them(
    modes: list[str], mover: int, meters_per_unit: float
) -> None:
    bones, mesh = arm()
    tracks = swinging(bones, mover=mover)
    tolerance = 2e-3 * meters_per_unit
    keys = reduce_keys(bones, modes, tracks, [mesh], meters_per_unit, tolerance)
    recorded = skinned(bones, mesh, tracks)
    errors = np.linalg.norm(skinned(bones, mesh, played(modes, keys, len(tracks))) - recorded, axis=-1)
    error = meters_per_unit * errors.max()
    assert error <= tolerance
    assert abs(error - keys.error_m) < 1e-6  # what is told is what is
    assert error > 0.3 * tolerance
    assert (keys.frames[0], keys.frames[-1]) == (0, len(tracks) - 1)
    assert len(keys.frames) < len(tracks) / 3


def test_looser_tolerance_needs_fewer_keys() -> None:
    bones, mesh = arm()
    tracks = swinging(bones)
    counts = [
        len(reduce_keys(bones, ["QUATERNION"] * 4, tracks, [mesh], 1.0, tolerance).frames)
        for tolerance in (2e-4, 1e-3, 5e-3, 2e-2)
    ]
    assert all(more > fewer for more, fewer in itertools.pairwise(counts))


@pytest.mark.parametrize("mode", ["QUATERNION", "XYZ", "AXIS_ANGLE"])
def test_rest_between_gestures_that_touches_no_rotation_at_all(mode: str) -> None:
    """An axis that nobody can tell while nothing is turned must not be played."""
    bones, mesh = arm(2)
    angles = np.concatenate(
        [np.linspace(0.0, 0.8, 20), np.linspace(0.8, 0.0, 20), np.zeros(300), np.linspace(0, 0.9, 30)]
    )
    vectors = np.zeros((len(angles), 2, 3))
    vectors[:340, 1, 0] = angles[:340]
    vectors[340:, 1, 2] = angles[340:]
    tracks = Tracks(rotation.from_vector(vectors), np.zeros((len(angles), 2, 3)))
    keys = reduce_keys(bones, [mode] * 2, tracks, [mesh], 1.0, 1e-3)
    errors = skinned(bones, mesh, played([mode] * 2, keys, len(tracks))) - skinned(bones, mesh, tracks)
    assert np.linalg.norm(errors, axis=-1).max() <= 1e-3
    assert len(keys.frames) < 40


def test_doll_that_rests_has_one_key() -> None:
    bones, mesh = arm()
    tracks = Tracks(np.tile([0.6, 0.8, 0.0, 0.0], (50, 4, 1)), np.zeros((50, 4, 3)))
    keys = reduce_keys(bones, ["XYZ"] * 4, tracks, [mesh], 1.0, 1e-3)
    assert list(keys.frames) == [0]
    assert keys.error_m < 1e-6


def test_single_frame_has_one_key() -> None:
    bones, mesh = arm()
    tracks = swinging(bones, frames=1)
    assert list(reduce_keys(bones, ["QUATERNION"] * 4, tracks, [mesh], 1.0, 1e-3).frames) == [0]


def test_whole_turns_between_keys_are_not_lost() -> None:
    """Fast spins need a key before half a turn is over."""
    bones, mesh = arm(1)
    angles = 1.2 * np.arange(60)  # [rad], far more than a turn in all
    tracks = Tracks(rotation.from_vector(np.array([0.0, 0.0, 1.0]) * angles[:, None, None]), np.zeros((60, 1, 3)))
    for mode in ("QUATERNION", "XYZ", "AXIS_ANGLE"):
        keys = reduce_keys(bones, [mode], tracks, [mesh], 1.0, 1e-3)
        errors = skinned(bones, mesh, played([mode], keys, 60)) - skinned(bones, mesh, tracks)
        assert np.linalg.norm(errors, axis=-1).max() <= 1e-3
