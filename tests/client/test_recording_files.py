"""The files of a recording: logs that give the same USD again, several takes, full disks, read-only folders."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from client_support import synthetic
from client_support.broker import Broker
from client_support.cli import Cli, assert_one_line_error
from client_support.logs import write_log
from client_support.recording import Recording, wait_for_poses
from client_support.scripted_server import ScriptedServer
from client_support.takes import make_builder
from pxr import Usd, UsdSkel

from layfigure import codec
from layfigure.bus import Bus, Event, EventLogWriter, read_events
from layfigure.connection import Connection
from layfigure.errors import LayfigureError
from layfigure.protocol import CHARACTER_CHANNEL, MESH_CHANNEL
from layfigure.recorder import Recorder
from layfigure.take import TakeBuilder
from layfigure.take_collector import read_take
from layfigure.take_files import finish_log, numbered, open_log
from layfigure.usd.checks import check
from layfigure.usd.working_file import APPEND_EVERY_US, SAVE_EVERY_US, WorkingFile

FORMS = {
    "every": [],
    "reduced": ["--keys", "reduced", "--tolerance-mm", "2"],
    "marked": ["--keys", "marked"],
    "single": ["--layout", "single", "--custom-data", "--fps", "29.97"],
    "part": ["--joints", "*Hand", "--duration", "0.4"],
}


@pytest.fixture
def again(tmp_path: Path) -> Path:
    (tmp_path / "again").mkdir()
    return tmp_path / "again"


@pytest.mark.parametrize("form", FORMS)
def test_export_of_the_log_equals_what_was_recorded(
    tmp_path: Path, again: Path, broker: Broker, cli: Cli, form: str
) -> None:
    recording = Recording(tmp_path, broker, *FORMS[form])
    try:
        recording.publish(20, tmp_path / "take.recording.lcmlog")
        recording.server.time_us = 250_000
        with Bus(broker.url) as bus:
            Connection(bus).command("key")
        if form == "part":
            recording._publisher.publish_poses(41)
            code, output, errors = recording.finish(None)
        else:
            recording.publish(41, tmp_path / "take.recording.lcmlog")
            code, output, errors = recording.finish()
    finally:
        recording.end()
    assert (code, errors) == (0, "")
    result = cli("export", "take.lcmlog", "again/take.usda", *FORMS[form])
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout == f"again/{output}"
    names = sorted(path.name for path in again.iterdir())
    assert names == sorted(path.name for path in tmp_path.glob("take.*") if path.suffix != ".lcmlog")
    for name in names:
        assert (tmp_path / name).read_bytes() == (again / name).read_bytes(), name
    assert check(tmp_path / "take.usda").findings == ()
    if form == "marked":
        assert output.startswith("take.usda: 1 key of 25 frames")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    write_log(tmp_path / "take.lcmlog", 61)
    return tmp_path / "take.lcmlog"


@pytest.mark.parametrize("cut", [1, 100, 700, 20_000])
def test_export_of_a_truncated_log_is_the_take_up_to_there(tmp_path: Path, log: Path, cli: Cli, cut: int) -> None:
    log.write_bytes(log.read_bytes()[:-cut])
    poses = len(read_take(log).times_us)
    result = cli("export", "take.lcmlog", "take.usda")
    assert (result.returncode, result.stderr) == (0, "")
    assert f"{poses} poses" in result.stdout
    assert 30 < poses <= 61
    assert check(tmp_path / "take.usda").findings == ()


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"", "no whole character"), (b"no log" * 100, "no whole character"), (b"\xed\xa1\xda\x01", "no whole character")],
)
def test_export_of_what_is_no_log_fails_in_one_line(tmp_path: Path, cli: Cli, content: bytes, words: str) -> None:
    (tmp_path / "a.lcmlog").write_bytes(content)
    assert_one_line_error(cli("export", "a.lcmlog", "take.usda"), 1, "a.lcmlog", words)
    assert [path.name for path in tmp_path.iterdir()] == ["a.lcmlog"]


def test_export_without_marks_fails_in_one_line(log: Path, cli: Cli) -> None:
    assert_one_line_error(cli("export", log, "take.usda", "--keys", "marked"), 1, "no key was marked")


def test_export_of_joints_that_are_not_there_is_a_usage_error(log: Path, cli: Cli) -> None:
    assert_one_line_error(cli("export", log, "take.usda", "--joints", "tail"), 2, "'tail'", "'mixamorig:Hips'")


@pytest.mark.parametrize("out", ["/proc/take.usda", "/sys/take.usda"])
def test_export_to_a_read_only_folder_fails_in_one_line(log: Path, cli: Cli, out: str) -> None:
    assert_one_line_error(cli("export", log, out), 1, f"cannot write '{out}': ")


def test_record_to_a_read_only_folder_fails_in_one_line(broker: Broker, cli: Cli) -> None:
    assert_one_line_error(cli("record", "/sys/take.usda", "--lcm-url", broker.url), 1, "cannot write '/sys/take")


def test_log_holds_the_character_and_each_chunk_once_and_first(
    bus: Bus, server: ScriptedServer, tmp_path: Path
) -> None:
    recorder = Recorder(bus, open_log(tmp_path / "take.usda"))
    recorder.start()
    for _ in range(3):
        server.publish_poses(2)
        server.publish_character()
        Connection(bus).fetch_meshes(recorder.character)
        bus.wait_until(lambda: False, 0.02)
    channels = [event.channel for event in read_events(finish_log(recorder.log, tmp_path / "take.usda"))]
    chunks = len(synthetic.chunk_messages())
    assert channels[: chunks + 1] == [CHARACTER_CHANNEL] + [MESH_CHANNEL] * chunks
    assert not {CHARACTER_CHANNEL, MESH_CHANNEL} & set(channels[chunks + 1 :])


def test_log_of_a_second_take_is_whole_by_itself(bus: Bus, server: ScriptedServer, tmp_path: Path) -> None:
    recorder = Recorder(bus, open_log(tmp_path / "a.usda"))
    recorder.start()
    server.publish_poses(10)
    bus.wait_until(lambda: False, 0.02)
    recorder.pause()
    first = finish_log(recorder.log, tmp_path / "a.usda")
    server.publish_poses(5)  # between the takes
    bus.wait_until(lambda: False, 0.02)
    recorder.resume(open_log(tmp_path / "b.usda"))
    server.publish_poses(7)
    bus.wait_until(lambda: False, 0.02)
    second = finish_log(recorder.log, tmp_path / "b.usda")
    one, other = read_take(first), read_take(second)
    assert (len(one.times_us), len(other.times_us)) == (10, 7)
    assert (other.times_us[0], other.lost_poses) == (0, 0)
    assert len(other.meshes) == 1


def test_takes_are_begun_and_ended_by_lines(tmp_path: Path, broker: Broker) -> None:
    (tmp_path / "take_002.usda").write_text("an earlier one")
    recording = Recording(tmp_path, broker, "--takes")
    try:
        assert recording.first_line.endswith("to 'take_001.usda'; Enter ends it, Ctrl-C all\n")
        recording.publish(10, tmp_path / "take_001.recording.lcmlog")
        assert recording.throw_switch() == "waiting; Enter begins the next take, Ctrl-C ends\n"
        assert check(tmp_path / "take_001.usda").findings == ()
        assert "to 'take_003.usda'" in recording.throw_switch()
        recording._publisher.publish_poses(5)
        wait_for_poses(tmp_path / "take_003.recording.lcmlog", 5)
        code, output, errors = recording.finish()
    finally:
        recording.end()
    assert (code, errors) == (0, "")
    assert [line.split(":")[0] for line in output.splitlines()] == ["take_001.usda", "take_003.usda"]
    assert "5 poses" in output
    assert (tmp_path / "take_002.usda").read_text() == "an earlier one"
    assert check(tmp_path / "take_003.usda").findings == ()
    assert list(tmp_path.glob("*recording*")) == []


def test_numbered_names_are_those_of_no_take_and_no_log(tmp_path: Path) -> None:
    for name in ("take_001.usda", "take_003.lcmlog"):
        (tmp_path / name).touch()
    names = numbered(tmp_path / "take.usda")
    assert [next(names).name for _ in range(3)] == ["take_002.usda", "take_004.usda", "take_005.usda"]


# A limit of the files' size stands for the disk's.


def test_record_whose_log_has_no_more_room_ends_and_keeps_what_came(tmp_path: Path, broker: Broker) -> None:
    recording = Recording(tmp_path, broker, largest_file=30_000)
    try:
        recording._publisher.publish_poses(600)
        code, output, errors = recording.finish(None)
    finally:
        recording.end()
    assert code == 1
    assert errors == "layfigure: cannot write 'take.recording.lcmlog': the disk is full\n"
    poses = len(read_take(tmp_path / "take.lcmlog").times_us)
    assert f"{poses} poses" in output
    assert 10 < poses < 600
    assert check(tmp_path / "take.usda").findings == ()


def test_record_without_room_for_the_usd_ends_with_one_line_and_keeps_the_log(tmp_path: Path, broker: Broker) -> None:
    options = ("--layout", "single", "--custom-data", "--fps", "3000")
    recording = Recording(tmp_path, broker, *options, largest_file=200_000)
    try:
        recording.publish(61, tmp_path / "take.recording.lcmlog")
        code, output, errors = recording.finish()
    finally:
        recording.end()
    assert (code, output) == (1, "")
    last = errors.splitlines()[-1]
    assert last.startswith("layfigure: cannot write 'take.usda': Error occurred writing file: File too large")
    assert last.endswith("all that was received is kept as 'take.recording.lcmlog'")
    assert all("warning: cannot write 'take.recording.usdc'" in line for line in errors.splitlines()[:-1])
    assert [path.name for path in tmp_path.iterdir()] == ["take.recording.lcmlog"]
    assert len(read_take(tmp_path / "take.recording.lcmlog").times_us) == 61


def test_event_log_that_is_full_holds_whole_events_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = EventLogWriter(tmp_path / "a.lcmlog")
    log.write(Event(1, "A", b"x" * 100))
    write = os.write
    monkeypatch.setattr(os, "write", lambda file, data: write(file, data[:20]))
    with pytest.raises(LayfigureError, match=r"a\.lcmlog': the disk is full"):
        log.write(Event(2, "A", b"y" * 100))
    monkeypatch.undo()
    log.write(Event(3, "A", b"z" * 100))
    log.close()
    assert [event.time_us for event in read_events(log.path)] == [1, 3]


@pytest.fixture
def working(tmp_path: Path) -> Iterator[WorkingFile]:
    builder = make_builder()
    working = WorkingFile(tmp_path / "w.usdc", builder._character, builder._meshes, 24.0)
    yield working
    working.remove()


def test_working_file_is_a_whole_take_at_every_save(working: WorkingFile, tmp_path: Path) -> None:
    builder = make_builder()
    assert check(tmp_path / "w.usdc").findings == ()  # before the first pose
    for sequence in range(150):
        builder.add_pose(codec.decode_pose(synthetic.pose_message(sequence).encode()))
        working.update(builder)
        if sequence in (61, 130):
            copy = tmp_path / f"copy{sequence}.usdc"
            copy.write_bytes((tmp_path / "w.usdc").read_bytes())
            assert check(copy).findings == ()
    stage = Usd.Stage.Open(str(copy))
    animation = UsdSkel.Animation(stage.GetPrimAtPath("/Synthetic_arm/Animation"))
    pose_s = builder.motion_since(0).times_us[130] * 1e-6
    last = stage.GetEndTimeCode()
    assert 24.0 * (pose_s - 1e-6 * (SAVE_EVERY_US + APPEND_EVERY_US)) - 1.0 <= last <= 24.0 * pose_s
    assert last > 30.0
    assert animation.GetRotationsAttr().GetTimeSamples() == [float(frame) for frame in range(round(last) + 1)]
    written = [[q.GetReal(), *q.GetImaginary()] for q in animation.GetRotationsAttr().Get(30.0)]
    expected = synthetic.pose_rotations(30 / 24.0)
    for q, wanted in zip(written, expected, strict=True):
        assert abs(sum(a * b for a, b in zip(q, wanted, strict=True))) == pytest.approx(1.0, abs=1e-6)


def test_working_file_saves_of_a_long_take_are_a_share_of_it_apart(
    working: WorkingFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    saved_s: list[float] = []
    hour = SimpleNamespace(pose_count=1)
    monkeypatch.setattr(working, "_save", lambda: saved_s.append(hour.duration_s))
    monkeypatch.setattr(working, "_append", lambda builder: None)
    for step in range(1, 3600 * 20):
        hour.duration_s = 0.05 * step
        working.update(cast(TakeBuilder, hour))
    gaps = np.diff(saved_s)
    assert gaps[:100].max() < 0.3
    assert gaps.max() < 0.006 * 3600.0
    frames = np.array(saved_s) * 240.0
    assert 24.0 * frames.sum() < 1.1 * 4800.0 * frames[-1]  # bytes of tables, as the working file says
    assert saved_s[-1] > 3600.0 * 0.99


def test_working_file_is_set_aside_with_its_log(tmp_path: Path) -> None:
    (tmp_path / "take.recording.lcmlog").write_bytes(b"precious")
    (tmp_path / "take.recording.usdc").write_bytes(b"precious too")
    open_log(tmp_path / "take.usda").discard()
    assert (tmp_path / "take.cut-off-1.lcmlog").read_bytes() == b"precious"
    assert (tmp_path / "take.cut-off-1.usdc").read_bytes() == b"precious too"


def test_record_killed_leaves_a_log_and_a_working_file_that_open(tmp_path: Path, broker: Broker, cli: Cli) -> None:
    recording = Recording(tmp_path, broker)
    try:
        recording.publish(150, tmp_path / "take.recording.lcmlog")
        recording.finish(signal.SIGKILL)
    finally:
        recording.end()
    assert check(tmp_path / "take.recording.usdc").findings == ()
    assert cli("export", "take.recording.lcmlog", "take.usda").stdout.startswith("take.usda: 60 frames")
    assert check(tmp_path / "take.usda").findings == ()
