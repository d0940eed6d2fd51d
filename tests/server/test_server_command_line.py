"""What the server says to a wrong command line or a wrong file: one line, the right exit code, nothing on stdout."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
from pathlib import Path
from typing import Any

import pytest
from server_support.process import TIMEOUT_S, run_server

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
        (["doll.glb", "--device", "phantom"], ["--device", "phantom", "spidar-g6"]),
        (["doll.glb", "--log"], ["--log"]),
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


def copy_of(character: Path, folder: Path) -> Path:
    """A character of its own, beside which settings may be put."""
    return Path(shutil.copy(character, folder / "doll.glb"))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('[joints."*Nose*"]\nstiffness = 1\n', [":1: ", "matches no bone"]),
        ('[joints."*"]\nstiffness = -1\n', [":2: ", "stiffness = -1, expected [0, inf]"]),
        ('[joints."*"]\nlocked = ["roll"]\n', [":2: ", "unknown axis 'roll'"]),
        ("total_mass = nan\n", [":1: ", "total_mass = nan, expected"]),
        ("not TOML\n", [":1: ", "not TOML"]),
    ],
)
def test_settings_of_joints_bad_fail_naming_file_line_and_what_is_allowed(
    binary: Path, character: Path, tmp_path: Path, content: str, words: list[str]
) -> None:
    settings = tmp_path / "doll.toml"
    settings.write_text(content)
    expect_one_line(run_server(binary, "--inspect", character, "--doll", settings), FAILED, str(settings), *words)


def test_settings_folder_fails_naming_it(binary: Path, character: Path, tmp_path: Path) -> None:
    expect_one_line(run_server(binary, character, "--doll", tmp_path), FAILED, str(tmp_path), "a folder")


def test_settings_beside_the_character_are_used_and_told(binary: Path, character: Path, tmp_path: Path) -> None:
    own = copy_of(character, tmp_path)
    settings = tmp_path / "doll.doll.toml"
    settings.write_text("total_mass = 3.5\n")
    done = run_server(binary, "--inspect", own, "--json")
    assert done.returncode == DONE
    assert done.stderr == f"layfigure-server: using the settings beside the character: {settings}\n"
    description = json.loads(done.stdout)
    assert description["settings"]["source"] == str(settings)
    assert description["mass"] == pytest.approx(3.5)


def test_settings_named_come_before_those_beside_the_character(binary: Path, character: Path, tmp_path: Path) -> None:
    own = copy_of(character, tmp_path)
    (tmp_path / "doll.doll.toml").write_text("broken\n")
    named = tmp_path / "named.toml"
    named.write_text("total_mass = 2.5\n")
    done = run_server(binary, "--inspect", own, "--doll", named, "--json")
    assert (done.returncode, done.stderr) == (DONE, "")
    assert json.loads(done.stdout)["mass"] == pytest.approx(2.5)


def test_settings_beside_the_character_that_are_bad_fail(binary: Path, character: Path, tmp_path: Path) -> None:
    own = copy_of(character, tmp_path)
    (tmp_path / "doll.doll.toml").mkdir()
    done = run_server(binary, own, "--broker", 0)
    assert (done.returncode, done.stdout) == (FAILED, "")
    assert done.stderr.splitlines()[-1].endswith("doll.doll.toml: a folder, expected a settings file")


def doll_of(description: dict[str, Any]) -> dict[str, Any]:
    """All that the doll is, without where its settings come from."""
    return {key: description[key] for key in ("bones", "mass", "root_pin")} | {
        "bodies": [{key: value for key, value in body.items() if key != "reasons"} for body in description["bodies"]]
    }


def test_settings_written_are_found_and_make_the_same_doll(binary: Path, character: Path, tmp_path: Path) -> None:
    own = copy_of(character, tmp_path)
    first = run_server(binary, "--inspect", own, "--json", "--write-settings")
    settings = tmp_path / "doll.doll.toml"
    assert first.returncode == DONE
    assert first.stderr == f"layfigure-server: settings written: {settings}\n"
    second = run_server(binary, "--inspect", own, "--json")
    assert "using the settings" in second.stderr
    before, after = json.loads(first.stdout), json.loads(second.stdout)
    assert doll_of(before) == doll_of(after)
    assert after["settings"]["source"] == str(settings)
    reasons = after["bodies"][1]["reasons"]
    assert reasons["stiffness"].startswith("line ")


def test_settings_written_over_a_file_need_force(binary: Path, character: Path, tmp_path: Path) -> None:
    target = tmp_path / "mine.toml"
    target.write_text("# mine\n")
    command = ("--inspect", character, "--write-settings", target)
    expect_one_line(run_server(binary, *command), FAILED, str(target), "--force")
    assert target.read_text() == "# mine\n"
    assert run_server(binary, *command, "--force").returncode == DONE
    assert "[joints." in target.read_text()


def test_settings_written_into_a_folder_that_is_not_there_fail(binary: Path, character: Path, tmp_path: Path) -> None:
    target = tmp_path / "none" / "doll.toml"
    expect_one_line(run_server(binary, "--inspect", character, "--write-settings", target), FAILED, str(target))


def test_settings_written_where_nothing_may_be_written_fail(binary: Path, character: Path) -> None:
    target = Path("/proc/doll.toml")  # refuses the superuser too
    expect_one_line(run_server(binary, "--inspect", character, "--write-settings", target), FAILED, str(target))


def test_settings_written_over_the_character_are_a_wrong_usage(binary: Path, character: Path) -> None:
    before = character.read_bytes()
    done = run_server(binary, "--inspect", character, "--write-settings", character, "--force")
    expect_one_line(done, USAGE, str(character), ".toml")
    assert character.read_bytes() == before


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
    for option in ("--broker", "--clock", "--physics-hz", "--pose-hz", "--inspect", "--write-settings", "Examples:"):
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
    assert description["settings"]["source"] is None


def test_inspect_with_geometry_describes_what_can_be_drawn(binary: Path, character: Path) -> None:
    done = run_server(binary, "--inspect", character, "--json", "--geometry")
    assert done.returncode == DONE
    description = json.loads(done.stdout)
    geometry = description["geometry"]
    assert len(geometry["bodies"]) == len(description["bodies"])
    assert len(geometry["body_of_triangle"]) == len(geometry["triangles"]) > 100
    corners = {corner for triangle in geometry["triangles"] for corner in triangle}
    assert max(corners) < len(geometry["vertices"])
    sections = [body["section"] for body in geometry["bodies"]]
    estimated = [body["section"]["estimated"] for body in description["bodies"]]
    assert [not section for section in sections] == estimated


def test_duration_over_leaves_with_success(binary: Path, character: Path) -> None:
    done = run_server(binary, character, "--broker", 0, "--duration", 0.2)
    assert done.returncode == DONE
    assert done.stdout.startswith("listening on tcpq://127.0.0.1:")


def test_server_that_ends_with_its_input_leaves_when_that_is_closed(binary: Path, character: Path) -> None:
    command = [binary, character, "--broker", "0", "--end-with-input"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        assert server.stdout.readline().startswith(b"listening on ")
        server.stdin.write(b"what stands there is left out\n")
        server.stdin.flush()
        with pytest.raises(subprocess.TimeoutExpired):
            server.wait(0.5)
        server.stdin.close()
        assert server.wait(TIMEOUT_S) == DONE


def test_server_whose_input_ended_while_it_loads_leaves(binary: Path, character: Path) -> None:
    command = [binary, character, "--broker", "0", "--end-with-input"]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT_S, check=False)
    assert done.returncode == DONE


def test_server_does_not_mind_its_input_unless_told(binary: Path, character: Path) -> None:
    command = [binary, character, "--broker", "0", "--duration", "0.5"]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT_S, check=False)
    assert done.returncode == DONE
    assert b"listening on " in done.stdout
