"""What `layfigure` does to a doll: one command message each, its reply printed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from e2e_support import RunClient
from server_support.process import ServerProcess, StartServer

HAND = "hand.L"


def run(client: RunClient, server: ServerProcess, *arguments: object) -> str:
    result = client(*arguments, "--lcm-url", server.url)
    assert (result.returncode, result.stderr) == (0, "")
    return result.stdout


def refused(client: RunClient, server: ServerProcess, *arguments: object) -> str:
    result = client(*arguments, "--lcm-url", server.url)
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1
    return result.stderr


def test_each_editing_command_prints_its_reply(start_server: StartServer, client: RunClient, tmp_path: Path) -> None:
    server = start_server("--clock", "lockstep")
    assert run(client, server, "set", "--bone", "*.L", "stiffness.factor=2", "limits.twist=-30,30").startswith(
        "set: done at 0.000 s, joints "
    )
    assert "label lock hand.L" not in run(client, server, "lock", HAND, "--axes", "twist", "bend_y")
    assert "label lock hand.L" in run(client, server, "undo")
    assert "label lock hand.L" in run(client, server, "redo", "--branch", "0")
    assert "place 1" in run(client, server, "history", "--go", "1")
    assert run(client, server, "history").rstrip().endswith("place 1")
    run(client, server, "redo")
    run(client, server, "unlock")
    run(client, server, "snapshot", "as made")
    assert "name as made" in run(client, server, "snapshot", "--list")
    run(client, server, "snapshot", "as made", "--restore")
    run(client, server, "mirror", "--side", "left")
    (tmp_path / "pose.json").write_text(json.dumps({HAND: [0.9553364891256, 0.0, 0.2955202066613, 0.0]}))
    assert "driven 1" in run(client, server, "load-pose", tmp_path / "pose.json", "--duration", "0.2")
    run(client, server, "load-pose", "--cancel")
    run(client, server, "set", "gravity=0,0,-1.6")
    run(client, server, "reset", "--all")
    run(client, server, "snapshot", "as made", "--remove")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("lock", "nobody"), "no bone is called 'nobody'"),
        (("set", "--bone", HAND, "stiffness=-1"), "expected 0 to inf"),
        (("set", "--bone", HAND, "limits.twist=-30000,30"), "limits.twist"),
        (("undo",), "there is nothing to undo"),
        (("redo",), "there is nothing to do again"),
        (("history", "--go", "9"), "the history has no place 9"),
        (("snapshot", "nothing", "--restore"), "there is no snapshot 'nothing'"),
    ],
)
def test_what_the_server_refuses_is_told_in_one_line(
    start_server: StartServer, client: RunClient, arguments: tuple[str, ...], reason: str
) -> None:
    assert reason in refused(client, start_server("--clock", "lockstep"), *arguments)


@pytest.mark.parametrize(
    "arguments",
    [
        ("set",),
        ("set", "stiffness"),
        ("set", "stiffness=hard"),
        ("lock",),
        ("lock", HAND, "--axes", "roll"),
        ("snapshot",),
        ("snapshot", "a", "--list"),
        ("snapshot", "a", "--restore", "--remove"),
        ("redo", "--branch", "-1"),
        ("history", "--go", "-1"),
        ("history", "--go", "start"),
        ("mirror", "--side", "up"),
        ("load-pose",),
        ("load-pose", "a.json", "--cancel"),
        ("load-pose", "a.json", "--duration", "nan"),
    ],
)
def test_wrong_usage_is_told_without_a_server(client: RunClient, arguments: tuple[str, ...]) -> None:
    result = client(*arguments)
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "content", ["", "[]", "{}", '{"hand.L": 1}', '{"hand.L": [1, 0, 0]}', '{"hand.L": [1, 0, 0, "a"]}']
)
def test_pose_file_that_is_none_is_told_in_one_line(client: RunClient, tmp_path: Path, content: str) -> None:
    (tmp_path / "pose.json").write_text(content)
    result = client("load-pose", "pose.json")
    assert result.returncode == 1
    assert "pose.json" in result.stderr
    assert len(result.stderr.splitlines()) == 1
