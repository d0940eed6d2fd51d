"""Servers and clients that come, go and fail."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from e2e_support import REPOSITORY, ClientProcess, RunClient, StartClient, wait_for_hold, wait_for_poses
from server_support.process import StartServer, keepable_port

from layfigure.take_collector import read_take
from layfigure.usd.checks import check

HOLD = '[[hand]]\npointer = 0\ndo = [{ grab = "hand.L" }, { wait = 100 }, { release = true }]\n'


def one_line(errors: str) -> str:
    assert len(errors.splitlines()) == 1, errors
    return errors


def start_recording(start_client: StartClient, url: str, poses: int, folder: Path) -> ClientProcess:
    recorder = start_client("record", "take.usda", "--lcm-url", url)
    assert recorder.error_line().startswith("recording 'doll'")
    wait_for_poses(folder / "take.recording.lcmlog", poses)
    return recorder


def test_record_realtime_server_that_is_terminated_gives_a_good_take(
    start_server: StartServer, start_client: StartClient, tmp_path: Path
) -> None:
    server = start_server()
    recorder = start_recording(start_client, server.url, 30, tmp_path)
    server.process.send_signal(signal.SIGTERM)
    code, output, errors = recorder.finish()
    assert (code, errors) == (0, "")
    assert output.startswith("take.usda: ")
    assert check(tmp_path / "take.usda").findings == ()
    assert server.wait()[0] == 0


def test_record_ctrl_c_again_and_again_while_it_writes_loses_nothing(
    start_server: StartServer, start_client: StartClient, tmp_path: Path
) -> None:
    recorder = start_recording(start_client, start_server().url, 60, tmp_path)
    signals = 0
    while recorder.process.poll() is None and not (tmp_path / "take.lcmlog").exists():
        recorder.process.send_signal(signal.SIGINT)
        signals += 1
        time.sleep(0.002)
    recorder.finish()
    assert signals > 5
    assert len(read_take(tmp_path / "take.lcmlog").times_us) >= 60
    assert check(tmp_path / "take.usda").findings == ()
    assert {path.name for path in tmp_path.iterdir()} == {
        *("take.usda", "take.anim.usdc", "take.character.usdc", "take.lcmlog")
    }


def test_record_killed_and_restarted_server_goes_on_in_the_same_take(
    start_server: StartServer, start_client: StartClient, tmp_path: Path
) -> None:
    port = keepable_port()
    server = start_server("--broker", port)
    recorder = start_recording(start_client, server.url, 10, tmp_path)
    server.process.kill()
    assert "lost the server: waiting for it" in recorder.error_line()
    start_server("--broker", port)
    assert "the server is back" in recorder.error_line()
    wait_for_poses(tmp_path / "take.recording.lcmlog", 60)
    assert recorder.finish(signal.SIGINT)[0] == 0
    assert read_take(tmp_path / "take.lcmlog").restarts == 1
    assert check(tmp_path / "take.usda").findings == ()


def test_record_killed_leaves_the_earlier_take_and_every_message(
    start_server: StartServer, start_client: StartClient, tmp_path: Path
) -> None:
    server = start_server()
    start_recording(start_client, server.url, 5, tmp_path).finish(signal.SIGINT)
    names = ("take.usda", "take.anim.usdc", "take.character.usdc", "take.lcmlog")
    before = {name: (tmp_path / name).read_bytes() for name in names}
    start_recording(start_client, server.url, 20, tmp_path).finish(signal.SIGKILL)
    assert {name: (tmp_path / name).read_bytes() for name in names} == before
    assert len(read_take(tmp_path / "take.recording.lcmlog").times_us) >= 20


def test_record_duration_ends_a_realtime_take(start_server: StartServer, client: RunClient, tmp_path: Path) -> None:
    result = client("record", "take.usda", "--fps", 30, "--duration", 0.5, "--lcm-url", start_server().url)
    assert result.returncode == 0, result.stderr
    assert "16 frames at 30 fps" in result.stdout
    assert read_take(tmp_path / "take.lcmlog").lost_poses == 0


def test_record_two_servers_on_one_bus_are_refused(
    start_server: StartServer, start_client: StartClient, client: RunClient, tmp_path: Path
) -> None:
    first = start_server()
    recorder = start_recording(start_client, first.url, 5, tmp_path)
    start_server("--lcm-url", first.url)
    code, _, errors = recorder.finish()
    assert code == 1
    assert "two servers" in one_line(errors)
    assert check(tmp_path / "take.usda").findings == ()  # what came before is kept
    result = client("record", "other.usda", "--lcm-url", first.url)
    assert result.returncode == 1
    assert "two servers" in one_line(result.stderr)
    assert not (tmp_path / "other.usda").exists()


def test_record_prefixes_keep_two_servers_apart(start_server: StartServer, client: RunClient, tmp_path: Path) -> None:
    first = start_server("--channel-prefix", "A_")
    start_server("--lcm-url", first.url, "--channel-prefix", "B_")
    for prefix in ("A_", "B_"):
        options = ("--duration", 0.3, "--lcm-url", first.url, "--channel-prefix", prefix)
        result = client("record", f"{prefix}.usda", *options)
        assert result.returncode == 0, result.stderr
        assert check(tmp_path / f"{prefix}.usda").findings == ()


def test_play_realtime_takes_the_sessions_time(start_server: StartServer, client: RunClient, session: Path) -> None:
    server = start_server()
    start = time.monotonic()
    result = client("play", session, "--lcm-url", server.url)
    assert (result.returncode, result.stderr) == (0, "")
    assert time.monotonic() - start > 5.0


def test_play_interrupted_lets_go(
    start_server: StartServer, start_client: StartClient, client: RunClient, tmp_path: Path
) -> None:
    server = start_server()
    (tmp_path / "hold.toml").write_text(HOLD)
    recorder = start_recording(start_client, server.url, 5, tmp_path)
    player = start_client("play", "hold.toml", "--lcm-url", server.url)
    wait_for_hold(tmp_path / "take.recording.lcmlog", True)
    code, _, errors = player.finish(signal.SIGINT)
    assert code == 1
    assert "interrupted after" in one_line(errors)
    wait_for_hold(tmp_path / "take.recording.lcmlog", False)
    recorder.finish(signal.SIGINT)
    (track,) = read_take(tmp_path / "take.lcmlog").pointers
    assert track.attached.any()
    assert not track.attached[-1]


def test_play_server_that_dies_fails_in_one_line(
    start_server: StartServer, start_client: StartClient, tmp_path: Path
) -> None:
    server = start_server()
    (tmp_path / "hold.toml").write_text(HOLD)
    start_recording(start_client, server.url, 1, tmp_path)
    player = start_client("play", "hold.toml", "--lcm-url", server.url)
    wait_for_hold(tmp_path / "take.recording.lcmlog", True)
    server.process.kill()
    code, output, errors = player.finish()
    assert (code, output) == (1, "")
    assert "lost the connection" in one_line(errors)


@pytest.mark.parametrize(
    ("actions", "words"),
    [
        ('{ grab = "tail" }, { release = true }', "has no bone 'tail'"),
        ('{ grab = "chest", stiffness = 1e300 }, { release = true }', "stiffness"),
    ],
)
def test_play_impossible_session_fails_in_one_line(
    start_server: StartServer, client: RunClient, tmp_path: Path, actions: str, words: str
) -> None:
    (tmp_path / "bad.toml").write_text(f"[[hand]]\npointer = 0\ndo = [{actions}]\n")
    result = client("play", "bad.toml", "--lcm-url", start_server().url)
    assert (result.returncode, result.stdout) == (1, "")
    assert words in one_line(result.stderr)


def test_commands_are_answered_by_the_server(start_server: StartServer, client: RunClient) -> None:
    server = start_server("--clock", "lockstep")
    url = ("--lcm-url", server.url)
    assert "state: running" in client("status", *url).stdout
    assert client("step", 50, *url).stdout == "step: done at 0.050 s, steps 50\n"
    assert client("key", *url).stdout.startswith("key: done at 0.050 s")
    assert client("reset", *url).stdout.startswith("reset: done")
    assert client("shutdown", *url).returncode == 0
    assert server.wait()[0] == 0
    dead = client("status", *url)
    assert dead.returncode == 1
    assert "no server at" in one_line(dead.stderr)


def test_step_on_a_realtime_server_is_refused_with_the_reason(start_server: StartServer, client: RunClient) -> None:
    result = client("step", "--lcm-url", start_server().url)
    assert (result.returncode, result.stdout) == (1, "")
    assert "lockstep" in one_line(result.stderr)


DEMO = REPOSITORY / "assets/demo.py"


@pytest.mark.parametrize("option", ["--server", "--character", "--session"])
def test_demo_missing_file_fails_in_one_line(binary: Path, character: Path, tmp_path: Path, option: str) -> None:
    options = {"--server": binary, "--character": character, "--out": tmp_path / "out", option: "none"}
    arguments = [str(text) for pair in options.items() for text in pair]
    result = subprocess.run([sys.executable, DEMO, *arguments], capture_output=True, text=True, check=False, timeout=60)
    assert (result.returncode, result.stdout) == (1, "")
    assert "no file 'none'" in one_line(result.stderr)
    assert not (tmp_path / "out").exists()


def test_demo_broken_character_fails_without_a_traceback(binary: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.glb").write_bytes(b"nothing")
    arguments = ["--server", binary, "--character", tmp_path / "bad.glb", "--out", tmp_path / "out"]
    result = subprocess.run([sys.executable, DEMO, *arguments], capture_output=True, text=True, check=False, timeout=60)
    assert result.returncode == 1
    assert "bad.glb" in result.stdout
    assert one_line(result.stderr) == "demo: layfigure-server ended before it was ready\n"
    assert list((tmp_path / "out").iterdir()) == []
