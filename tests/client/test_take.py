import dataclasses
import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from client_support import synthetic
from client_support.logs import write_log

from layfigure import codec, messages
from layfigure.analysis import summarize
from layfigure.bus import Event, EventLogWriter
from layfigure.errors import LayfigureError, ProtocolError
from layfigure.protocol import (
    CHARACTER_CHANNEL,
    Pose,
)
from layfigure.resample import resample
from layfigure.take import Take, TakeBuilder
from layfigure.take_collector import read_take

PERIOD_US = 16667
BYTES_PER_POSE = 24  # its time, and that again of a list that makes room for twice what it holds


def pose(sequence: int, **changes: object) -> Pose:
    return dataclasses.replace(codec.decode_pose(synthetic.pose_message(sequence).encode()), **changes)


def test_builder_without_poses_is_refused(builder: TakeBuilder) -> None:
    with pytest.raises(LayfigureError, match="no pose arrived"):
        builder.build()


def test_builder_late_first_pose_starts_at_time_zero(builder: TakeBuilder) -> None:
    for sequence in (30, 31):
        builder.add_pose(pose(sequence))
    assert builder.build().times_us.tolist() == [0, pose(31).time_us - pose(30).time_us]


def test_builder_gap_in_sequence_counts_lost_poses(builder: TakeBuilder) -> None:
    for sequence in (0, 1, 5, 6):
        builder.add_pose(pose(sequence))
    assert builder.build().lost_poses == 3


def test_builder_repeated_pose_is_taken_once(builder: TakeBuilder) -> None:
    for sequence in (0, 1, 1, 0, 2):
        builder.add_pose(pose(sequence))
    take = builder.build()
    assert len(take.times_us) == 3
    assert take.lost_poses == 0


def test_builder_restarted_server_goes_on_one_period_later(builder: TakeBuilder) -> None:
    builder.add_pose(pose(6))
    for sequence in (0, 1):
        builder.add_pose(pose(sequence, server_id=5))
    take = builder.build()
    assert take.times_us.tolist() == [0, PERIOD_US, PERIOD_US + pose(1).time_us]
    assert take.restarts == 1
    assert take.lost_poses == 0


def test_builder_time_set_back_goes_on_one_period_later(builder: TakeBuilder) -> None:
    builder.add_pose(pose(6))
    builder.add_pose(pose(7, time_us=0))
    assert builder.build().times_us.tolist() == [0, PERIOD_US]


def test_builder_drop_run_forgets_that_servers_poses_and_forces(builder: TakeBuilder) -> None:
    builder.add_pose(pose(0))
    builder.add_pose(pose(0, server_id=5))
    builder.add_force(dataclasses.replace(codec.decode_force(synthetic.force_message(0).encode()), server_id=5))
    builder.drop_run(5)
    take = builder.build()
    assert len(take.times_us) == 1
    assert [len(track.times_us) for track in take.pointers] == [0]


def test_builder_duration_ends_at_the_first_pose_not_before_it(builder: TakeBuilder) -> None:
    for sequence in range(20):
        builder.add_pose(pose(sequence))
    assert builder.build(0.1).times_us[-1] == 100_000
    assert builder.build(0.101).times_us[-1] == 117_000
    assert len(builder.build(9.0).times_us) == 20


def test_builder_long_take_keeps_its_poses_out_of_memory(builder: TakeBuilder) -> None:
    """Else an hour at 240 Hz is some gigabytes."""
    first, force = pose(0), codec.decode_force(synthetic.force_message(0).encode())

    def add(sequences: range) -> None:
        for sequence in sequences:
            time_us = sequence * PERIOD_US
            builder.add_pose(dataclasses.replace(first, sequence=sequence, time_us=time_us))
            builder.add_force(dataclasses.replace(force, time_us=time_us))

    add(range(100))
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        add(range(100, 5100))
        grown = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert grown / 5000 < BYTES_PER_POSE
    take = builder.build()
    assert len(take.times_us) == len(take.pointers[0].times_us) == 5100
    np.testing.assert_array_equal(take.rotations[5000], first.rotations)
    assert take.pointers[0].times_us[-1] == 5099 * PERIOD_US


def test_builder_drop_run_then_poses_again_takes_the_later_ones(builder: TakeBuilder) -> None:
    for sequence in range(3):
        builder.add_pose(pose(sequence))
    builder.add_pose(pose(0, server_id=5))
    builder.drop_run(5)
    builder.add_pose(pose(3))
    take = builder.build()
    np.testing.assert_array_equal(take.rotations[3], pose(3).rotations)
    assert take.times_us.tolist() == [pose(sequence).time_us for sequence in range(4)]


def test_builder_folder_that_cannot_be_written_to_is_refused(take: Take, tmp_path: Path) -> None:
    with pytest.raises(LayfigureError, match=r"cannot keep the take's poses in '.*none'.*No such file"):
        TakeBuilder(take.character, (), tmp_path / "none")


def test_builder_disk_that_is_full_keeps_the_poses_before(
    builder: TakeBuilder, monkeypatch: pytest.MonkeyPatch
) -> None:
    for sequence in range(3):
        builder.add_pose(pose(sequence))
    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", lambda *_: 1)
        with pytest.raises(LayfigureError, match="disk is full"):
            builder.add_pose(pose(3))
    take = builder.build()
    assert len(take.times_us) == 3
    np.testing.assert_array_equal(take.rotations[2], pose(2).rotations)


def test_builder_pose_of_other_character_is_refused(builder: TakeBuilder) -> None:
    with pytest.raises(LayfigureError, match="changed the character"):
        builder.add_pose(pose(0, content_hash=1))


def test_builder_pose_with_wrong_joint_count_is_refused(builder: TakeBuilder) -> None:
    short = pose(0)
    with pytest.raises(ProtocolError, match="3 joints, expected 4"):
        builder.add_pose(dataclasses.replace(short, rotations=short.rotations[:3]))


def test_resample_at_pose_times_returns_the_poses(take: Take) -> None:
    frames = resample(take, synthetic.POSE_HZ / 3)
    assert len(frames) == 21
    for frame in (0, 7, 20):
        # poses come at the first step after their time: up to 1 ms late, turning at 4 rad/s
        np.testing.assert_allclose(np.abs(frames.rotations[frame]), np.abs(take.rotations[3 * frame]), atol=2.1e-3)


def test_resample_between_poses_follows_the_motion(take: Take) -> None:
    frames = resample(take, 24.0)
    assert len(frames) == 25
    for frame in range(25):
        expected = synthetic.pose_rotations(frame / 24.0)
        # slerp over a 60th of a second of the fastest joint's motion, whose axis is fixed
        assert np.abs(np.sum(frames.rotations[frame] * expected, axis=1)) == pytest.approx(1.0, abs=1e-7)
        np.testing.assert_allclose(frames.root_translations[frame], synthetic.root_translation(frame / 24.0), atol=1e-6)


def test_resample_single_pose_gives_one_frame(builder: TakeBuilder) -> None:
    builder.add_pose(pose(0))
    frames = resample(builder.build(), 24.0)
    assert len(frames) == 1
    np.testing.assert_allclose(np.linalg.norm(frames.rotations, axis=-1), 1.0, atol=1e-15)


def test_summarize_take_lists_bodies_with_a_parent_most_loaded_first(take: Take) -> None:
    summaries = summarize(take)
    assert [summary.name for summary in summaries] == ["mixamorig:LeftHand", "mixamorig:LeftArm"]
    hand, arm = summaries
    assert (hand.yielded, arm.yielded) == (False, True)
    assert hand.yield_torque == 1.5
    assert hand.largest_torque == pytest.approx(float(np.hypot(0.2, 5.0 * np.sin(1.0))), rel=1e-6)
    assert hand.rest_after_deg == pytest.approx(0.0, abs=1e-6)
    assert hand.moved_deg == pytest.approx(360.0 - np.degrees(4.0), abs=0.3)


def test_read_take_log_of_a_recording_equals_the_take(take: Take, tmp_path: Path) -> None:
    write_log(tmp_path / "a.lcmlog", 61)
    read = read_take(tmp_path / "a.lcmlog")
    for name in ("times_us", "root_translations", "rotations", "rest_rotations", "torques", "yielded"):
        np.testing.assert_array_equal(getattr(read, name), getattr(take, name))
    np.testing.assert_array_equal(read.pointers[0].forces, take.pointers[0].forces)
    assert read.last_status is not None
    assert read.last_status.realtime_factor == 12.5


def test_read_take_log_cut_in_the_middle_of_an_event_reads_up_to_there(tmp_path: Path) -> None:
    write_log(tmp_path / "a.lcmlog", 10)
    whole = (tmp_path / "a.lcmlog").read_bytes()
    (tmp_path / "b.lcmlog").write_bytes(whole[:-700])  # into the last pose
    assert len(read_take(tmp_path / "b.lcmlog").times_us) == 9


@pytest.mark.parametrize("content", [b"", b"not a log at all, only some text" * 10, b"\xed\xa1\xda\x01"])
def test_read_take_file_that_is_no_recording_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.lcmlog").write_bytes(content)
    with pytest.raises(LayfigureError, match=r"a\.lcmlog.*holds no whole character"):
        read_take(tmp_path / "a.lcmlog")


def test_read_take_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LayfigureError, match="no event log"):
        read_take(tmp_path / "none.lcmlog")


def test_codec_pose_of_other_type_is_refused() -> None:
    with pytest.raises(ProtocolError, match="not a whole pose_t"):
        codec.decode_pose(messages.status_t().encode())


def test_read_take_garbage_between_the_messages_is_left_out(tmp_path: Path) -> None:
    write_log(tmp_path / "a.lcmlog", 5)
    whole = (tmp_path / "a.lcmlog").read_bytes()
    log = EventLogWriter(tmp_path / "b.lcmlog")
    log.write(Event(1, CHARACTER_CHANNEL, b"garbage"))
    log.close()
    (tmp_path / "b.lcmlog").write_bytes((tmp_path / "b.lcmlog").read_bytes() + whole)
    assert len(read_take(tmp_path / "b.lcmlog").times_us) == 5
