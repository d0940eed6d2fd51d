import itertools
from collections.abc import Callable
from pathlib import Path

import pytest
from client_support import synthetic
from client_support.logs import write_log_of_servers
from client_support.scripted_server import ScriptedServer

from layfigure import codec
from layfigure.bus import Bus, read_events
from layfigure.errors import LayfigureError, TwoServersError
from layfigure.protocol import POSE_CHANNEL, STATUS_CHANNEL
from layfigure.recorder import Recorder
from layfigure.take import TakeBuilder
from layfigure.take_collector import read_take
from layfigure.take_files import finish_log, open_log


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "take.usda"


@pytest.fixture
def recorder(bus: Bus, server: ScriptedServer, out: Path) -> Recorder:
    recorder = Recorder(bus, open_log(out))
    recorder.start()
    return recorder


def after(polls: int) -> Callable[[], bool]:
    counter = itertools.count()
    return lambda: next(counter) >= polls


def run(recorder: Recorder, polls: int = 3, duration_s: float = 1e9) -> TakeBuilder:
    recorder.run(after(polls), duration_s, lambda take: None)
    return recorder.builder


def test_recorder_takes_poses_and_forces(recorder: Recorder, server: ScriptedServer) -> None:
    server.publish_poses(20)
    take = run(recorder).build()
    assert len(take.times_us) == 20
    assert take.pointers[0].attached.tolist() == [False] * 5 + [True] * 15


def test_recorder_log_holds_every_pose_before_the_take_has_it(
    recorder: Recorder, server: ScriptedServer, out: Path
) -> None:
    server.publish_poses(20)
    run(recorder)
    logged = [event for event in read_events(out.with_name("take.recording.lcmlog")) if event.channel == POSE_CHANNEL]
    assert [codec.decode_pose(event.data).sequence for event in logged] == list(range(20))


def test_recorder_finished_log_is_the_take(recorder: Recorder, server: ScriptedServer, out: Path) -> None:
    server.publish_poses(20)
    take = run(recorder).build()
    path = finish_log(recorder.log, out)
    assert path == out.with_name("take.lcmlog")
    assert (read_take(path).rotations == take.rotations).all()
    assert not out.with_name("take.recording.lcmlog").exists()


def test_recorder_ends_when_the_server_leaves(recorder: Recorder, server: ScriptedServer) -> None:
    server.publish_poses(2)
    server.publish_status("leaving")
    recorder.run(lambda: False, 1e9, lambda take: None)
    assert recorder.builder.pose_count == 2


def test_recorder_ends_after_its_duration_of_simulation_time(recorder: Recorder, server: ScriptedServer) -> None:
    def publish(take: TakeBuilder) -> None:
        server.publish_poses(1)

    recorder.run(lambda: False, 0.5, publish)
    assert recorder.builder.duration_s == pytest.approx(0.5, abs=0.02)


def test_recorder_waits_for_a_lost_server_and_goes_on(
    recorder: Recorder, server: ScriptedServer, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("layfigure.servers.SILENT_AFTER_S", 0.05)
    server.publish_poses(5)
    run(recorder, polls=4)
    assert "lost the server: waiting" in caplog.text
    reborn = ScriptedServer(server.bus, server_id=99)
    reborn.publish_poses(5)
    monkeypatch.setattr("layfigure.servers.SILENT_AFTER_S", 2.0)
    take = run(recorder).build()
    assert len(take.times_us) == 10
    assert take.restarts == 1
    assert recorder.elapsed_s > take.duration_s


def test_recorder_duration_counts_the_time_without_a_server(
    recorder: Recorder, server: ScriptedServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("layfigure.servers.SILENT_AFTER_S", 0.05)
    server.publish_poses(2)
    recorder.run(lambda: False, 0.4, lambda take: None)
    assert recorder.elapsed_s >= 0.4


def test_recorder_second_server_is_refused_and_its_poses_dropped(recorder: Recorder, server: ScriptedServer) -> None:
    rival = ScriptedServer(server.bus, server_id=99)
    server.publish_poses(5)
    rival.publish_poses(2)
    server.publish_poses(1)
    with pytest.raises(TwoServersError, match="two servers"):
        run(recorder)
    take = recorder.builder.build()
    assert len(take.times_us) == 5


def test_recorder_second_server_at_the_start_is_refused(bus: Bus, server: ScriptedServer, out: Path) -> None:
    ScriptedServer(bus, server_id=99)
    with pytest.raises(TwoServersError):
        Recorder(bus, open_log(out)).start()


def test_recorder_of_a_chosen_server_leaves_the_other_out(out: Path) -> None:
    with Bus("memq://", server_id=2) as bus:
        one, other = ScriptedServer(bus, server_id=1), ScriptedServer(bus, server_id=2)
        recorder = Recorder(bus, open_log(out))
        recorder.start()
        for _ in range(5):
            one.publish_poses(2)
            other.publish_poses(1)
        one.publish_status("leaving")
        take = run(recorder).build()
        assert len(take.times_us) == 5
        assert (take.lost_poses, take.restarts, recorder.server_left) == (0, 0, False)
    logged = [
        codec.decode_pose(event.data) for event in read_events(recorder.log.path) if event.channel == POSE_CHANNEL
    ]
    assert [(pose.server_id, pose.sequence) for pose in logged] == [(2, number) for number in range(5)]


def test_read_take_of_a_log_of_two_servers_takes_the_chosen_one(tmp_path: Path) -> None:
    write_log_of_servers(tmp_path / "bus.lcmlog", (1, 2), poses=10)
    for server_id in (1, 2):
        take = read_take(tmp_path / "bus.lcmlog", server=server_id)
        assert (take.character.server_id, len(take.times_us), take.restarts) == (server_id, 10, 0)
    with pytest.raises(TwoServersError, match="2 and 1: choose one with --server ID"):
        read_take(tmp_path / "bus.lcmlog")
    with pytest.raises(LayfigureError, match="holds no whole character of the server 3"):
        read_take(tmp_path / "bus.lcmlog", server=3)


def test_recorder_other_character_ends_the_take_but_keeps_it(recorder: Recorder, server: ScriptedServer) -> None:
    server.publish_poses(5)
    server.content_hash = 5
    server.publish_character()
    with pytest.raises(LayfigureError, match="changed the character"):
        run(recorder)
    assert recorder.builder.pose_count == 5


def test_recorder_garbage_on_every_channel_is_left_out(recorder: Recorder, server: ScriptedServer) -> None:
    server.publish_poses(1)
    for channel in (POSE_CHANNEL, STATUS_CHANNEL):
        server.bus.publish(channel, b"\x00" * 50)
    server.publish_poses(1)
    assert run(recorder).pose_count == 2
    assert server.bus.bad_messages > 0


def test_open_log_cut_off_recordings_are_set_aside(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    out = tmp_path / "take.usda"
    for _ in range(2):
        (tmp_path / "take.recording.lcmlog").write_bytes(b"precious")
        open_log(out).discard()
    assert (tmp_path / "take.cut-off-1.lcmlog").read_bytes() == b"precious"
    assert (tmp_path / "take.cut-off-2.lcmlog").read_bytes() == b"precious"
    assert "cut off" in caplog.text


def test_open_log_second_recorder_is_refused(tmp_path: Path) -> None:
    first = open_log(tmp_path / "take.usda")
    with pytest.raises(LayfigureError, match="another recorder"):
        open_log(tmp_path / "take.usda")
    first.close()


def test_open_log_second_recorder_with_data_is_refused(recorder: Recorder, server: ScriptedServer, out: Path) -> None:
    server.publish_poses(2)
    run(recorder)
    with pytest.raises(LayfigureError, match="another recorder"):
        open_log(out)
    assert out.with_name("take.recording.lcmlog").stat().st_size > 1000


def test_synthetic_pose_rate_matches_the_character() -> None:
    assert synthetic.pose_message(60).time_us == 1_000_000
