"""Takes imported onto armatures in Blender's own Python: beside what the doll did, and beside its live preview.

python take_scenes.py NAME FOLDER

FOLDER has, for some of them, takes and poses.npz, as the caller wrote them.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import bpy
import numpy as np
import world
from layfigure_blender import actions, pose_writing, sessions
from layfigure_blender.link import Sample
from layfigure_blender.rig import BoneMap, nearest_rotations

import layfigure
from layfigure import rotation

# Blender has its USD for Python where the package bpy does not look for it.
sys.path.append(str(Path(bpy.utils.resource_path("LOCAL")) / "python/lib/python3.11/site-packages"))

PLACE_TOLERANCE = 1e-5  # [m]
ANGLE_TOLERANCE = 1e-5  # [rad]
MOVED = 0.05  # [m]
POSES_SEEN = 60
PHYSICS_HZ = 1000  # with a frame for each step, all poses fall on frames, whenever they came
PLACEMENTS = {
    "as it was": lambda armature: None,
    "moved and turned": lambda armature: world.place(armature, 1.0, turned=True),
    "small, on a parent": lambda armature: world.place(armature, 0.01, turned=True, parented=True),
    "large": lambda armature: world.place(armature, 40.0),
}


def character_of(arrays: np.lib.npyio.NpzFile) -> layfigure.Character:
    joints = tuple(
        layfigure.Joint(str(name), int(parent), place, turn, bind_place, bind_turn, True, 1.0, 1.0, 1.0)
        for name, parent, place, turn, bind_place, bind_turn in zip(
            *(arrays[key] for key in ("names", "parents", "places", "turns", "bind_places", "bind_turns")), strict=True
        )
    )
    return layfigure.Character(0, 0, "doll", "", "", 0, 1000.0, 50.0, "lockstep", 0, joints)


def pose_of(root: np.ndarray, rotations: np.ndarray) -> layfigure.Pose:
    count = len(rotations)
    none = np.zeros((count, 3)), np.zeros(count, np.bool_)
    return layfigure.Pose(0, 0, 0, 0, 0, root, rotations, rotations, *none)


def largest_differences(armature: bpy.types.Object, expected: np.ndarray, names: list[str]) -> tuple[float, float]:
    """[m, rad] between the bones as they are played now and (B, 4, 4), bone -> armature."""
    bpy.context.view_layer.update()
    shown = np.array([armature.pose.bones[name].matrix for name in names])
    scale = float(np.cbrt(abs(np.linalg.det(np.array(armature.matrix_world)[:3, :3]))))
    places = scale * np.linalg.norm(shown[:, :3, 3] - expected[:, :3, 3], axis=1)
    turns = [rotation.from_matrix(nearest_rotations(each[:, :3, :3])) for each in (shown, expected)]
    return float(places.max()), float(rotation.angle_between(*turns).max())


def imports_match_what_the_doll_did(folder: Path) -> None:
    """Of all forms of a take, onto an armature that stands anywhere, at its own rate and at others."""
    arrays = np.load(folder / "poses.npz")
    character, seconds = character_of(arrays), arrays["seconds"]
    for take in sorted(folder.glob("take*.usd*")):
        if take.stem.endswith((".anim", ".character")):
            continue
        for name, put in PLACEMENTS.items():
            for fps in (50, 25) if name == "as it was" else (50,):
                import_one(take, put, character, seconds, arrays, fps)


def import_one(
    take: Path, put: object, character: layfigure.Character, seconds: np.ndarray, arrays: object, fps: int
) -> None:
    world.empty_file()
    armature = world.rig("doll")
    bones = BoneMap(character, pose_writing.bones_of(armature), np.array(armature.matrix_world))
    put(armature)
    scene = bpy.context.scene
    scene.render.fps, scene.frame_start = fps, 11
    armature.pose.bones["hand.L"].rotation_mode = "ZXY"
    armature.pose.bones["hand.R"].rotation_mode = "AXIS_ANGLE"
    armature.pose.bones["chest"].location = (0.1, 0.2, 0.3)
    old = actions.BoneCurves.ensure(armature)
    old.ensure_curve("chest", "rotation_quaternion", 0).keyframe_points.insert(1, 0.5)
    assert bpy.ops.layfigure.import_take(filepath=str(take)) == {"FINISHED"}
    action = armature.animation_data.action
    assert action.name == take.stem
    assert len(bpy.data.actions) == 2  # the one that was there is kept, as it was
    assert bpy.data.actions[armature.name].use_fake_user
    names = [bone.name for bone in bones.bones]
    worst = np.zeros(2)
    moved = []
    for index in range(0, len(seconds), 10):
        scene.frame_set(11 + round(seconds[index] * fps))
        pose = pose_of(arrays["roots"][index], arrays["rotations"][index])
        expected = bones.pose_matrices(pose)
        moved.append(expected[names.index("hand.L"), :3, 3])
        worst = np.maximum(worst, largest_differences(armature, expected, names))
    print(f"{take.name} at {fps}, {armature.scale[0]:g}: {worst[0]:.2e} m, {worst[1]:.2e} rad")
    assert np.ptp(np.array(moved), axis=0).max() > MOVED
    assert worst[0] < PLACE_TOLERANCE * max(1.0, armature.scale[0]), worst
    assert worst[1] < ANGLE_TOLERANCE, worst
    keys = {len(curve.keyframe_points) for curve in actions.BoneCurves.find(armature)._curves}
    frames = round(seconds[-1] * fps) + 1
    assert frames in keys
    assert keys <= {2, frames}, keys
    located = {curve.data_path for curve in actions.BoneCurves.find(armature)._curves if "location" in curve.data_path}
    assert located == {actions.path_of(bones.driven_names[0], "location")}


def record_of_a_live_doll_matches_its_preview(folder: Path) -> None:
    """What was seen while a take was recorded, of an armature that is rolled, scaled, turned and posed."""
    armature = world.rig("doll")
    world.roll_bones(armature, 3)
    world.place(armature, 0.2, turned=True, parented=True)
    world.pose_at_random(armature, ["upper_arm.R", "chest"], 0.4, 5)
    root = next(bone for bone in armature.pose.bones if bone.parent is None)
    root.location = (0.3, -0.2, 0.1)  # the doll stands elsewhere than in its own world
    session = world.start(armature)
    link = session.link
    names = [bone.name for bone in session.bones.bones]
    seen: list[tuple[layfigure.Pose, np.ndarray]] = []

    def note(_session: sessions.Session, sample: Sample) -> None:
        bpy.context.view_layer.update()
        seen.append((sample.pose, np.array([armature.pose.bones[name].matrix for name in names])))

    with layfigure.connect(link.url) as doll, doll.record(folder / "live.lcmlog") as recording:
        sessions.add_listener(note)
        place = layfigure.world_poses(link.character, link.newest.pose)[1][doll.joint("hand.L")]
        link.move_pointer(0, place)
        link.send("grab", pointer=0, bone="hand.L").result(world.TIMEOUT_S)
        deadline = time.monotonic() + world.TIMEOUT_S
        while len(seen) < POSES_SEEN:
            assert time.monotonic() < deadline, "too few poses came"
            turn = 2.0 * np.pi * len(seen) / POSES_SEEN
            link.move_pointer(0, place + 0.02 * np.array([0.0, np.cos(turn) - 1.0, np.sin(turn)]))
            doll.wait(0.005)
            sessions.tick()
        sessions.remove_listener(note)
        doll.wait(0.2)
        link.send("release", pointer=0).result(world.TIMEOUT_S)
    layfigure.write_usd(recording.take, folder / "live.usda", fps=PHYSICS_HZ)
    bpy.context.scene.render.fps = PHYSICS_HZ
    bpy.context.scene.frame_start = 1
    assert bpy.ops.layfigure.import_take(filepath=str(folder / "live.usda")) == {"FINISHED"}
    bpy.ops.layfigure.stop()
    frames = frames_of(recording.take, [pose for pose, _ in seen])
    shown = [matrices for _, matrices in seen]
    require_seen(armature, names, shown, frames)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "seen.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(folder / "seen.blend"))  # without a doll, but where it stood
    armature = bpy.context.view_layer.objects.active
    assert bpy.ops.layfigure.import_take(filepath=str(folder / "live.usda")) == {"FINISHED"}
    require_seen(armature, names, shown, frames)


def require_seen(armature: bpy.types.Object, names: list[str], seen: list[np.ndarray], frames: list[int]) -> None:
    worst = np.zeros(2)
    for expected, frame in zip(seen, frames, strict=True):
        bpy.context.scene.frame_set(1 + frame)
        worst = np.maximum(worst, largest_differences(armature, expected, names))
    path = np.array([expected[names.index("hand.L"), :3, 3] for expected in seen])
    print(f"{len(seen)} poses: {worst[0]:.2e} m, {worst[1]:.2e} rad")
    assert np.ptp(path, axis=0).max() > 0.1 * MOVED  # in the armature's units, of which five are a metre
    assert worst[0] < PLACE_TOLERANCE
    assert worst[1] < ANGLE_TOLERANCE


def frames_of(take: layfigure.Take, poses: list[layfigure.Pose]) -> list[int]:
    """Of poses of the take that have its simulation time, at a frame for each step of the physics."""
    found = ((pose, np.flatnonzero((take.rotations == pose.rotations).all(axis=(1, 2)))) for pose in poses)
    only = ((pose, same[0]) for pose, same in found if len(same) == 1)  # there are more of a doll at rest
    [origin_us] = {pose.time_us - int(take.times_us[index]) for pose, index in only}
    return [round((pose.time_us - origin_us) * PHYSICS_HZ / 1e6) for pose in poses]


def what_is_no_take_is_refused_in_one_line(folder: Path) -> None:
    armature = world.rig("doll")

    def refused(path: Path, *words: str) -> None:
        try:
            bpy.ops.layfigure.import_take(filepath=str(path))
        except RuntimeError as error:
            text = str(error).removeprefix("Error: ").strip()
        else:
            raise AssertionError(f"{path} was imported")
        assert text.count("\n") == 0, text
        assert all(word.lower() in text.lower() for word in words), text
        assert armature.animation_data is None or armature.animation_data.action is None
        assert len(bpy.data.actions) == 0

    refused(folder / "missing.usda", "no USD file", "missing.usda")
    for name, content in {"text.usda": b"hello", "empty.usdc": b"", "noise.usdz": bytes(range(256)) * 8}.items():
        (folder / name).write_bytes(content)
        refused(folder / name, "as USD", name)
    (folder / "cut.usdc").write_bytes((folder / "take_single.usdc").read_bytes()[:5000])
    refused(folder / "cut.usdc", "as USD", "cut.usdc")
    (folder / "cube.usda").write_text('#usda 1.0\ndef Cube "Cube" {}\n')
    refused(folder / "cube.usda", "no skeleton")
    (folder / "lost.usda").write_text((folder / "take_layered.usda").read_text().replace("take_layered.", "gone."))
    refused(folder / "lost.usda", "needs the file", "gone.anim.usdc")
    for bone in armature.data.bones:
        bone.name = f"other {bone.name}"
    refused(folder / "take_layered.usda", "none of its joints", "is a bone of")
    for bone in armature.data.bones:
        bone.name = bone.name.removeprefix("other ")
    world.select(armature)
    bpy.ops.object.mode_set(mode="EDIT")
    armature.data.edit_bones["hand.L"].head.x += 0.3
    bpy.ops.object.mode_set(mode="OBJECT")
    refused(folder / "take_layered.usda", "other proportions", "joint '")


def main() -> None:
    scene, folder = sys.argv[-2:]
    world.empty_file()
    with world.registered():
        globals()[scene](Path(folder))


if __name__ == "__main__":
    main()
