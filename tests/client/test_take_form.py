"""What is made of a take: marked keys, selected joints, layouts, frame rates, custom data."""

import argparse
import dataclasses
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from client_support import synthetic
from client_support.takes import make_builder, make_take
from pxr import Usd, UsdGeom, UsdSkel

from layfigure import codec
from layfigure.animation import animate
from layfigure.cli.take_form import frame_rate
from layfigure.errors import LayfigureError, UsageError
from layfigure.protocol import Argument, Reply
from layfigure.resample import resample
from layfigure.take import Take, TakeBuilder
from layfigure.take_form import TakeForm, selected_joints
from layfigure.usd.checks import check
from layfigure.usd.reader import SkinnedStage
from layfigure.usd.writer import write_take

FPS = 24.0
ANIMATION = "/Synthetic_arm/Animation"
MARKED = TakeForm(keys="marked")
FLOAT_TOLERANCE = 2e-7  # a few roundings of values near 1 to float


def key_reply(time_us: int, server_id: int = synthetic.SERVER_ID, accepted: bool = True, names: str = "time_us pose"):
    results = tuple(Argument(name, values=(1.0,)) for name in names.split())
    return Reply(time_us, server_id, "someone", 1, accepted, "" if accepted else "no", results)


def marked_take(*marks_us: int) -> Take:
    return dataclasses.replace(make_take(), marks_us=np.array(marks_us, np.int64))


AnimationOf = Callable[[Path], UsdSkel.Animation]


@pytest.fixture
def animation_of() -> AnimationOf:
    """Opens a file that stays open for the test."""
    stages = []

    def animation_of(path: Path) -> UsdSkel.Animation:
        stages.append(Usd.Stage.Open(str(path)))
        return UsdSkel.Animation(stages[-1].GetPrimAtPath(ANIMATION))

    return animation_of


# --- marked keys -----------------------------------------------------------------------------------------------------


def test_marked_keys_are_the_frames_nearest_to_the_marks(tmp_path: Path, animation_of: AnimationOf) -> None:
    take = marked_take(0, 20_000, 21_000, 500_000, 510_000, 999_999)
    animation = write_take(take, tmp_path / "take.usda", FPS, MARKED)
    assert animation.keys.tolist() == [0, 1, 12, 24]
    written = animation_of(tmp_path / "take.usda")
    assert written.GetRotationsAttr().GetTimeSamples() == [0.0, 1.0, 12.0, 24.0]
    assert written.GetTranslationsAttr().GetTimeSamples() == [0.0, 1.0, 12.0, 24.0]
    assert check(tmp_path / "take.usda").findings == ()


def test_marked_keys_without_a_mark_are_refused_with_the_mend(take: Take) -> None:
    with pytest.raises(LayfigureError, match="no key was marked: run 'layfigure key' while recording"):
        animate(take, FPS, MARKED)


def test_marked_key_alone_is_a_default_value(tmp_path: Path, animation_of: AnimationOf) -> None:
    write_take(marked_take(500_000), tmp_path / "take.usda", FPS, MARKED)
    written = animation_of(tmp_path / "take.usda")
    assert written.GetRotationsAttr().GetNumTimeSamples() == 0
    expected = resample(make_take(), FPS).rotations[12]
    rotations = [[q.GetReal(), *q.GetImaginary()] for q in written.GetRotationsAttr().Get()]
    np.testing.assert_allclose(np.abs(np.sum(rotations * expected, axis=1)), 1.0, atol=FLOAT_TOLERANCE)


def test_marked_keys_extent_holds_the_skin_between_keys(tmp_path: Path) -> None:
    write_take(marked_take(0, 500_000, 999_999), tmp_path / "take.usda", FPS, MARKED)
    write_take(make_take(), tmp_path / "every.usda", FPS)
    recorded = SkinnedStage(tmp_path / "every.usda")
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    for frame in range(25):
        low, high = np.array(UsdGeom.Boundable(stage.GetDefaultPrim()).GetExtentAttr().Get(frame))
        points = recorded.posed(frame)[0].points
        assert (points >= low - 1e-6).all()
        assert (points <= high + 1e-6).all()


def with_poses(count: int) -> TakeBuilder:
    builder = make_builder()
    for sequence in range(30, 30 + count):
        builder.add_pose(codec.decode_pose(synthetic.pose_message(sequence).encode()))
    return builder


def test_builder_marks_are_told_from_the_takes_first_pose_on() -> None:
    builder = make_builder()
    builder.add_mark(key_reply(400_000))  # before any pose
    builder = with_poses(20)
    for time_us in (499_999, 500_000, 700_000, 700_000):
        builder.add_mark(key_reply(time_us))
    builder.add_mark(key_reply(800_000, server_id=99))
    assert builder.build().marks_us.tolist() == [0, 200_000]


def test_builder_marks_behind_the_duration_are_left_out() -> None:
    builder = with_poses(20)
    for time_us in (600_000, 800_000):
        builder.add_mark(key_reply(time_us))
    assert builder.build(0.2).marks_us.tolist() == [100_000]


@pytest.mark.parametrize(
    ("reply", "marks"),
    [
        (key_reply(1), True),
        (key_reply(1, accepted=False), False),
        (key_reply(1, names="steps"), False),
        (key_reply(1, names="pose"), False),
    ],
)
def test_reply_marks_a_key_if_it_answers_that_command(reply: Reply, marks: bool) -> None:
    assert reply.marks_key == marks


# --- selected joints -------------------------------------------------------------------------------------------------


def test_selected_joints_alone_move(tmp_path: Path, take: Take, animation_of: AnimationOf) -> None:
    write_take(take, tmp_path / "take.usda", FPS, TakeForm(joints=("*Hand",)))
    written = animation_of(tmp_path / "take.usda")
    rests, moving = synthetic.rest_rotations(), resample(take, FPS).rotations
    for frame in (0, 10, 24):
        rotations = np.array([[q.GetReal(), *q.GetImaginary()] for q in written.GetRotationsAttr().Get(frame)])
        expected = rests.copy()
        expected[2] = moving[frame, 2]
        np.testing.assert_allclose(np.abs(np.sum(rotations * expected, axis=1)), 1.0, atol=FLOAT_TOLERANCE)
    assert written.GetTranslationsAttr().GetNumTimeSamples() == 0  # the root rests: a default
    np.testing.assert_allclose(written.GetTranslationsAttr().Get()[0], synthetic.OFFSETS[0], atol=FLOAT_TOLERANCE)
    assert check(tmp_path / "take.usda").findings == ()


def test_selected_root_moves_with_its_translation(take: Take) -> None:
    frames = animate(take, FPS, TakeForm(joints=("mixamorig:Hips",))).frames
    np.testing.assert_array_equal(frames.root_translations, resample(take, FPS).root_translations)
    rests = np.repeat(synthetic.rest_rotations()[None, 1:], 25, axis=0)
    np.testing.assert_allclose(frames.rotations[:, 1:], rests, atol=1e-15)


def test_selected_joints_of_several_patterns_are_all_of_them(take: Take) -> None:
    assert selected_joints(take.character, ("*Arm", "thumb.?")).tolist() == [False, True, False, True]
    assert selected_joints(take.character, ()).all()


@pytest.mark.parametrize("pattern", ["nose", "*lefthand", "", "mixamorig"])
def test_selected_joints_pattern_of_none_is_refused(take: Take, pattern: str) -> None:
    with pytest.raises(
        UsageError, match=f"no joint of 'Synthetic arm' matches '.*{pattern[1:]}': it has 'mixamorig:Hips'"
    ):
        selected_joints(take.character, ("*Arm", pattern))


# --- layouts ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["take.usd", "take.usda", "take.usdc", "take.usdz"])
def test_single_layout_is_one_file_that_shows_the_same(take: Take, tmp_path: Path, name: str) -> None:
    (tmp_path / "single").mkdir()
    write_take(take, tmp_path / "single" / name, FPS, TakeForm(layout="single"))
    assert [path.name for path in (tmp_path / "single").iterdir()] == [name]
    assert check(tmp_path / "single" / name).findings == ()
    write_take(take, tmp_path / "layered.usda", FPS)
    single, layered = SkinnedStage(tmp_path / "single" / name), SkinnedStage(tmp_path / "layered.usda")
    assert (single.first_frame, single.last_frame, single.fps) == (0.0, 24.0, FPS)
    for frame in (0, 7.5, 24):
        np.testing.assert_array_equal(single.posed(frame)[0].points, layered.posed(frame)[0].points)
    stage = Usd.Stage.Open(str(tmp_path / "single" / name))
    assert stage.GetDefaultPrim().IsA(UsdSkel.Root)
    assert Usd.ModelAPI(stage.GetDefaultPrim()).GetKind() == "component"


# --- custom data -----------------------------------------------------------------------------------------------------


def test_custom_data_is_left_out_unless_asked_for(take: Take, tmp_path: Path, animation_of: AnimationOf) -> None:
    write_take(take, tmp_path / "take.usda", FPS)
    names = [attribute.GetName() for attribute in animation_of(tmp_path / "take.usda").GetPrim().GetAttributes()]
    assert [name for name in names if name.startswith("layfigure:")] == []


def test_custom_data_is_in_every_frame_whatever_the_keys(tmp_path: Path, animation_of: AnimationOf) -> None:
    form = TakeForm(keys="marked", custom_data=True)
    write_take(marked_take(500_000), tmp_path / "take.usda", FPS, form)
    prim = animation_of(tmp_path / "take.usda").GetPrim()
    yielded = np.array([prim.GetAttribute("layfigure:yielded").Get(frame) for frame in range(25)])
    assert np.flatnonzero(yielded[:, 1]).tolist() == [5, 6, 7, 8]  # poses 10 to 19 of 60 a second
    assert not yielded[:, [0, 2, 3]].any()
    assert list(prim.GetAttribute("layfigure:pointers").Get()) == [0]
    held = [prim.GetAttribute("layfigure:heldJoints").Get(frame)[0] for frame in range(25)]
    assert held == [-1, -1, -1] + [2] * 22  # from pose 5 on
    forces = np.array([prim.GetAttribute("layfigure:forces").Get(frame)[0] for frame in range(25)])
    np.testing.assert_allclose(forces[12], [10.0 * np.sin(3.0), 0.0, 5.0], atol=1e-6)
    assert (forces[:2] == 0.0).all()
    assert check(tmp_path / "take.usda").findings == ()


def test_custom_data_of_a_take_without_pointers_has_none(take: Take, tmp_path: Path, animation_of: AnimationOf) -> None:
    write_take(dataclasses.replace(take, pointers=()), tmp_path / "take.usda", FPS, TakeForm(custom_data=True))
    assert not animation_of(tmp_path / "take.usda").GetPrim().HasAttribute("layfigure:forces")


# --- frame rates -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "rate"),
    [
        ("24", 24.0),
        ("12.5", 12.5),
        ("25/2", 12.5),
        ("23.976", 24000 / 1001),
        ("23.98", 24000 / 1001),
        ("24000/1001", 24000 / 1001),
        ("29.97", 30000 / 1001),
        ("59.94", 60000 / 1001),
        ("23.9", 23.9),
        ("30", 30.0),
    ],
)
def test_frame_rate_usual_names_are_exact(text: str, rate: float) -> None:
    assert frame_rate(text) == rate


@pytest.mark.parametrize("text", ["0", "-24", "nan", "inf", "1/0", "24/", "", "fast", "1e9", "0/5"])
def test_frame_rate_bad_one_is_refused(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match=f"'{text}' is not a number"):
        frame_rate(text)


@pytest.mark.parametrize("name", ["23.976", "29.97", "59.94", "25", "7.3"])
def test_frames_of_any_rate_are_at_their_exact_times(tmp_path: Path, name: str) -> None:
    """Far from the start too: rounded rates would be a frame off after some minutes."""
    rate = frame_rate(name)
    count = 6001
    base = make_take(poses=1)
    seconds = np.arange(count) / 10.0  # ten minutes at ten poses a second
    take = dataclasses.replace(
        base,
        times_us=(seconds * 1e6).astype(np.int64),
        root_translations=np.stack([0.01 * seconds, 0.0 * seconds, 0.0 * seconds], axis=1),
        rotations=np.repeat(base.rotations, count, axis=0),
    )
    frames = resample(take, rate)
    exact = Fraction(*{"23.976": (24000, 1001), "29.97": (30000, 1001), "59.94": (60000, 1001)}.get(name, (0, 1)))
    exact = exact or Fraction(name)
    assert len(frames) == int(600 * exact) + 1
    expected = [float(0.01 * frame / exact) for frame in range(len(frames))]
    np.testing.assert_allclose(frames.root_translations[:, 0], expected, atol=1e-8)


def test_frame_rate_is_that_of_the_stage(take: Take, tmp_path: Path) -> None:
    write_take(take, tmp_path / "take.usda", frame_rate("29.97"))
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == 30000 / 1001
    assert stage.GetEndTimeCode() == 29.0
