"""The command `layfigure` as a process: exit codes, one-line errors, signals, kill -9."""

import os
import signal
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from client_support.broker import Broker
from client_support.cli import Cli, assert_one_line_error, cli_command, cli_environment
from client_support.recording import WAIT_S, Recording, wait_for_poses
from client_support.scripted_server import ScriptedServer
from pxr import Usd

from layfigure.bus import Bus
from layfigure.protocol import POSE_CHANNEL
from layfigure.take_collector import read_take
from layfigure.usd.checks import check


@pytest.fixture
def recording(tmp_path: Path, broker: Broker) -> Iterator[Recording]:
    recording = Recording(tmp_path, broker)
    yield recording
    recording.end()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_record_signal_finishes_the_take(recording: Recording, tmp_path: Path, number: int) -> None:
    assert recording.first_line == "recording 'Synthetic arm' (4 joints) to 'take.usda'; Ctrl-C ends it\n"
    recording.publish(61, tmp_path / "take.recording.lcmlog")
    code, output, errors = recording.finish(number)
    assert (code, output, errors) == (0, "take.usda: 25 frames at 24 fps, 61 poses, 1.00 s\n", "")
    names = ["take.anim.usdc", "take.character.usdc", "take.lcmlog", "take.usda"]
    assert sorted(path.name for path in tmp_path.iterdir()) == names
    assert check(tmp_path / "take.usda").findings == ()


def test_record_leaving_server_finishes_the_take(recording: Recording, tmp_path: Path) -> None:
    recording.publish(10, tmp_path / "take.recording.lcmlog")
    recording.leave()
    code, output, _ = recording.finish(None)
    assert code == 0
    assert "10 poses" in output


def test_record_killed_leaves_the_log_and_the_earlier_take_whole(
    recording: Recording, tmp_path: Path, broker: Broker
) -> None:
    earlier = dict.fromkeys(("take.usda", "take.anim.usdc", "take.character.usdc"), b"earlier")
    for name, content in earlier.items():
        (tmp_path / name).write_bytes(content)
    recording.publish(30, tmp_path / "take.recording.lcmlog")
    code, _, _ = recording.finish(signal.SIGKILL)
    assert code == -signal.SIGKILL
    assert {name: (tmp_path / name).read_bytes() for name in earlier} == earlier
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        [*earlier, "take.recording.lcmlog", "take.recording.usdc"]
    )
    assert len(read_take(tmp_path / "take.recording.lcmlog").times_us) == 30

    again = Recording(tmp_path, broker)
    try:
        assert "take.cut-off-1.lcmlog" in again.first_line
        assert len(read_take(tmp_path / "take.cut-off-1.lcmlog").times_us) == 30
    finally:
        again.end()


def test_record_killed_at_any_moment_of_finishing_leaves_whole_files(tmp_path: Path, broker: Broker) -> None:
    """Whatever stands under the final names can be opened by USD, or is not there."""
    for attempt in range(6):
        recording = Recording(tmp_path, broker, out=f"take{attempt}.usda")
        try:
            recording.publish(200, tmp_path / f"take{attempt}.recording.lcmlog")
            recording.process.send_signal(signal.SIGINT)
            time.sleep(0.05 * attempt)
            recording.finish(signal.SIGKILL)
        finally:
            recording.end()
    for path in [*tmp_path.glob("take*.usda"), *tmp_path.glob("take*.usdc")]:
        assert Usd.Stage.Open(str(path)), path
    for path in tmp_path.glob("take*.usda"):
        assert check(path).findings == ()


def test_record_lost_broker_reconnects_and_goes_on(tmp_path: Path) -> None:
    with Broker() as broker:
        recording = Recording(tmp_path, broker)
        recording.publish(10, tmp_path / "take.recording.lcmlog")
        recording.server.stop()
        recording._serving.join(WAIT_S)
    try:
        assert recording.process.stderr is not None
        assert "lost the server: waiting for it" in recording.process.stderr.readline()
        with Broker(broker.port) as reborn:
            server = ScriptedServer(Bus(reborn.url), server_id=99)
            assert reborn.wait_for_subscription(POSE_CHANNEL)
            server.publish_poses(10)
            assert "the server is back" in recording.process.stderr.readline()
            wait_for_poses(tmp_path / "take.recording.lcmlog", 20)
            code, output, _ = recording.finish()
        assert code == 0
        assert "20 poses" in output
        assert check(tmp_path / "take.usda").findings == ()
    finally:
        recording.end()


def test_record_without_any_pose_fails_and_leaves_nothing(recording: Recording, tmp_path: Path) -> None:
    code, output, errors = recording.finish()
    assert (code, output) == (1, "")
    assert errors == "layfigure: nothing was recorded: no pose arrived\n"
    assert list(tmp_path.iterdir()) == []


def test_record_duration_ends_it(tmp_path: Path, broker: Broker) -> None:
    recording = Recording(tmp_path, broker, "--duration", "0.5")
    try:
        recording._publisher.publish_poses(61)
        code, output, _ = recording.finish(None)
        assert code == 0
        assert "take.usda: " in output
    finally:
        recording.end()


def unused_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return int(listener.getsockname()[1])


@pytest.mark.parametrize(
    "command",
    [["record", "t.usda"], ["play", "s.toml"], ["status"], ["key"], ["reset"], ["shutdown"], ["step"]],
)
def test_cli_no_server_fails_in_one_line(cli: Cli, tmp_path: Path, command: list[str]) -> None:
    (tmp_path / "s.toml").write_text("[[hand]]\npointer = 0\ndo = [{ wait = 1 }]\n")
    port = unused_port()
    result = cli(*command, "--lcm-url", f"tcpq://127.0.0.1:{port}")
    assert_one_line_error(result, 1, f"tcpq://127.0.0.1:{port}", "connection refused", f"--broker {port}")
    assert [path.name for path in tmp_path.iterdir()] == ["s.toml"]


def test_cli_broker_without_server_fails_in_one_line(cli: Cli, broker: Broker, tmp_path: Path) -> None:
    result = cli("record", "t.usda", "--lcm-url", broker.url)
    assert_one_line_error(result, 1, "no server answered 'get_character'", broker.url)
    assert list(tmp_path.iterdir()) == []


def test_cli_something_else_at_the_port_fails_in_one_line(cli: Cli) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def answer() -> None:
            client, _ = listener.accept()
            client.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
            client.close()

        thread = threading.Thread(target=answer, daemon=True)
        thread.start()
        result = cli("status", "--lcm-url", f"tcpq://127.0.0.1:{listener.getsockname()[1]}")
        thread.join(WAIT_S)
    assert_one_line_error(result, 1, "not an LCM broker")


def test_cli_silent_port_fails_in_one_line(cli: Cli) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        result = cli("status", "--lcm-url", f"tcpq://127.0.0.1:{listener.getsockname()[1]}")
    assert_one_line_error(result, 1, "no server at")


@pytest.mark.parametrize("url", ["bogus://x", "tcpq://127.0.0.1:99999", "tcpq://127.0.0.1:port", "nonsense"])
def test_cli_bad_url_fails_in_one_line(cli: Cli, url: str) -> None:
    assert_one_line_error(cli("status", "--lcm-url", url), 1, url)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ([], "COMMAND"),
        (["fly"], "fly"),
        (["record"], "OUT"),
        (["record", "take.fbx"], "take.fbx"),
        (["record", "none/take.usda"], "none"),
        (["record", "take.usda", "--fps", "0"], "'0' is not a number greater than 0"),
        (["record", "take.usda", "--fps", "nan"], "nan"),
        (["record", "take.usda", "--fps", "fast"], "fast"),
        (["record", "take.usda", "--fps", "1/0"], "1/0"),
        (["record", "take.usda", "--fps", "1e9"], "1e9"),
        (["record", "take.usda", "--keys", "some"], "some"),
        (["record", "take.usda", "--keys", "reduced", "--tolerance-mm", "0"], "'0'"),
        (["record", "take.usda", "--keys", "reduced", "--tolerance-mm", "-1"], "-1"),
        (["record", "take.usda", "--keys", "reduced", "--tolerance-mm", "nan"], "nan"),
        (["record", "take.usda", "--tolerance-mm", "1"], "--tolerance-mm is for --keys reduced"),
        (["record", "take.usda", "--layout", "flat"], "flat"),
        (["record", "take.usda", "--joints"], "--joints"),
        (["record", "take.usda", "--duration", "-1"], "-1"),
        (["export"], "TAKE.lcmlog"),
        (["export", "take.lcmlog"], "OUT"),
        (["export", "take.lcmlog", "take.fbx"], "take.fbx"),
        (["export", "take.lcmlog", "none/take.usda"], "none"),
        (["export", "take.lcmlog", "take.usda", "--tolerance-mm", "1"], "--keys reduced"),
        (["export", "take.lcmlog", "take.usda", "--takes"], "--takes"),
        (["record", "take.usda", "--speed", "2"], "--speed"),
        (["record", "take.usda", "--channel-prefix", "a b"], "'a b'"),
        (["record", "take.usda", "--channel-prefix", "x" * 50], "prefix"),
        (["record", "take.usda", "--server", "0"], "'0' is not a server's id"),
        (["status", "--server", "-5"], "-5"),
        (["play", "s.toml", "--server", str(1 << 63)], "is not a server's id"),
        (["export", "take.lcmlog", "take.usda", "--server", "doll"], "'doll' is not a server's id"),
        (["play"], "SESSION"),
        (["play", "s.toml", "--junit", "r.xml"], "needs --expect"),
        (["play", "s.toml", "--expect", "--junit", "none/r.xml"], "there is no folder 'none'"),
        (["step", "0"], "'0'"),
        (["step", "-3"], "-3"),
        (["step", "many"], "many"),
        (["check"], "IN.usd"),
        (["preview", "a.usda"], "--out"),
        (["preview", "a.usda", "-o", "a.jpg"], "a.jpg"),
        (["preview", "a.usda", "-o", "none/a.png"], "none"),
        (["preview", "a.usda", "-o", "a.png", "--size", "10"], "'10' is not a size"),
        (["preview", "a.usda", "-o", "a.png", "--fps", "10"], "--fps is for GIFs"),
        (["preview", "a.usda", "-o", "a.png", "--frames", "1,x"], "1,x"),
        (["plot", "a.lcmlog", "-o", "a.svg"], "a.svg"),
        (["inspect", "a.glb"], "--out"),
        (["inspect", "a.glb", "-o", "a.jpg"], "a.jpg"),
        (["inspect", "a.glb", "-o", "none/a.png"], "none"),
    ],
)
def test_cli_bad_arguments_are_usage_errors(cli: Cli, tmp_path: Path, arguments: list[str], word: str) -> None:
    assert_one_line_error(cli(*arguments), 2, word)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "arguments",
    [
        ["check", "none.usda"],
        ["preview", "none.usda", "-o", "a.png"],
        ["plot", "none.lcmlog", "-o", "a.png"],
        ["export", "none.lcmlog", "a.usda"],
        ["play", "none.toml"],
        ["play", "none.toml", "--expect", "--junit", "r.xml"],
    ],
)
def test_cli_missing_file_fails_in_one_line(cli: Cli, tmp_path: Path, arguments: list[str]) -> None:
    assert_one_line_error(cli(*arguments), 1, arguments[1])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "command",
    [
        [],
        *(
            [name]
            for name in ("record", "export", "play", "check", "preview", "plot", "inspect", "status", "key", "step")
        ),
    ],
)
def test_cli_help_shows_usage(cli: Cli, command: list[str]) -> None:
    result = cli(*command, "--help")
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("usage: layfigure")
    if command in ([], ["record"], ["export"], ["play"], ["check"], ["preview"], ["plot"], ["inspect"]):
        assert "example" in result.stdout


def test_cli_version_is_the_packages(cli: Cli) -> None:
    from layfigure import __version__

    assert cli("--version").stdout == f"layfigure {__version__}\n"


def test_cli_commands_print_the_reply(cli: Cli, broker: Broker) -> None:
    server = ScriptedServer(Bus(broker.url))
    thread = server.serve()
    try:
        url = ("--lcm-url", broker.url)
        assert "realtime_factor: 12.5" in cli("status", *url).stdout
        assert cli("key", *url).stdout == "key: done at 0.000 s, time_us 0, pose -1\n"
        assert cli("step", 20, *url).stdout == "step: done at 0.000 s, steps 20\n"
        server.refusals["reset"] = "not now"
        assert_one_line_error(cli("reset", *url), 1, "not now")
    finally:
        server.stop()
        thread.join(WAIT_S)
    assert server.command_names() == ["key", "step", "reset"]


def test_cli_play_interrupted_lets_go(tmp_path: Path, broker: Broker) -> None:
    server = ScriptedServer(Bus(broker.url))
    server.poses = 1
    thread = server.serve()
    (tmp_path / "s.toml").write_text(
        '[[hand]]\npointer = 0\ndo = [{ grab = "LeftHand" }, { wait = 100 }, { release = true }]\n'
    )
    player = subprocess.Popen(
        cli_command("play", "s.toml", "--lcm-url", broker.url),
        cwd=tmp_path,
        env=cli_environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        deadline = time.monotonic() + WAIT_S
        while "grab" not in server.command_names() and time.monotonic() < deadline:
            time.sleep(0.02)
        player.send_signal(signal.SIGINT)
        output, errors = player.communicate(timeout=WAIT_S)
    finally:
        server.stop()
        thread.join(WAIT_S)
    assert (player.returncode, output) == (1, "")
    assert "interrupted after" in errors
    assert server.command_names()[-1] == "release"


def test_cli_output_to_a_closed_pipe_is_no_traceback(tmp_path: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    process = subprocess.run(
        cli_command("--help"), cwd=tmp_path, env=cli_environment(), stdout=write, stderr=subprocess.PIPE, check=False
    )
    os.close(write)
    assert b"Traceback" not in process.stderr
