"""What the server says to a wrong command line or a wrong file: one line, the right exit code, nothing on stdout."""

from __future__ import annotations

import json
import socket
import subprocess
from pathlib import Path

import pytest
from server_support.process import run_server

DONE, FAILED, USAGE = 0, 1, 2


def expect_one_line(done: subprocess.CompletedProcess[str], code: int, *words: str) -> None:
    assert done.returncode == code, done.stderr
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("layfigure-server: ")
    for word in words:
        assert word in done.stderr


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], ["CHARACTER"]),
        (["doll.glb", "--physics-hz", "0"], ["--physics-hz", "0", "20000"]),
        (["doll.glb", "--clock", "fast"], ["--clock", "fast", "lockstep"]),
        (["doll.glb", "--broker", "99999"], ["--broker", "99999", "65535"]),
        (["doll.glb", "--device", "none"], ["--device"]),
        (["doll.glb", "--log", "x.lcmlog"], ["--log"]),
    ],
)
def test_options_bad_refused_with_usage_code(binary: Path, options: list[str], words: list[str]) -> None:
    expect_one_line(run_server(binary, *options), USAGE, *words)


def test_character_missing_fails_naming_it(binary: Path, tmp_path: Path) -> None:
    missing = tmp_path / "missing.glb"
    expect_one_line(run_server(binary, missing, "--broker", 0), FAILED, str(missing))


@pytest.mark.parametrize("content", [b"", b"not a model\n", b"glTF\x02\x00\x00\x00\xff\xff\xff\xff"])
def test_character_broken_fails_naming_it(binary: Path, tmp_path: Path, content: bytes) -> None:
    broken = tmp_path / "broken.glb"
    broken.write_bytes(content)
    expect_one_line(run_server(binary, broken, "--broker", 0), FAILED, str(broken))


def test_settings_missing_fails_naming_them(binary: Path, character: Path, tmp_path: Path) -> None:
    missing = tmp_path / "missing.toml"
    expect_one_line(run_server(binary, character, "--doll", missing), FAILED, str(missing))


def test_settings_with_an_unknown_key_fail_naming_it(binary: Path, character: Path, tmp_path: Path) -> None:
    settings = tmp_path / "doll.toml"
    settings.write_text("softnes = 1.0\n")
    expect_one_line(run_server(binary, character, "--doll", settings), FAILED, str(settings), "softnes")


def test_port_busy_fails_naming_it(binary: Path, character: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as occupied:
        port = occupied.getsockname()[1]
        expect_one_line(run_server(binary, character, "--broker", port), FAILED, f"127.0.0.1:{port}", "in use")


def test_bus_unreachable_fails_naming_the_url(binary: Path, character: Path) -> None:
    with socket.socket() as deaf:  # holds its port and does not listen
        deaf.bind(("127.0.0.1", 0))
        url = f"tcpq://127.0.0.1:{deaf.getsockname()[1]}"
        expect_one_line(run_server(binary, character, "--lcm-url", url), FAILED, url)


def test_help_and_version_are_printed(binary: Path) -> None:
    help_text = run_server(binary, "--help")
    assert (help_text.returncode, help_text.stderr) == (DONE, "")
    for option in ("--broker", "--clock", "--physics-hz", "--pose-hz", "--inspect", "Examples:"):
        assert option in help_text.stdout
    version = run_server(binary, "--version")
    assert version.returncode == DONE
    assert version.stdout.startswith("layfigure-server ")


def test_inspect_describes_the_doll_without_serving(binary: Path, character: Path) -> None:
    text = run_server(binary, "--inspect", character)
    assert (text.returncode, text.stderr) == (DONE, "")
    assert "bodies" in text.stdout
    data = run_server(binary, "--inspect", character, "--json")
    assert data.returncode == DONE
    description = json.loads(data.stdout)
    assert description["bodies"]
    assert description["source_file"] == character.name


def test_duration_over_leaves_with_success(binary: Path, character: Path) -> None:
    done = run_server(binary, character, "--broker", 0, "--duration", 0.2)
    assert done.returncode == DONE
    assert done.stdout.startswith("listening on tcpq://127.0.0.1:")
