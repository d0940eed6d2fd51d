"""Undo, snapshots, locks and parameters over the bus."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from server_support.client import Client, Connect
from server_support.process import StartServer

HAND = "hand.L"


def pose(client: Client) -> Any:
    """The pose after one more step of time, as lists."""
    client.accepted("step", count=17)
    newest = client.received["pose_t"][-1]
    return [newest.root_translation, newest.rotations, newest.rest_rotations]


def lift(client: Client) -> None:
    held = client.accepted("grab", bone=HAND)["position"]
    for k in range(1, 31):
        sequence = client.point((held[0], held[1], held[2] + 0.01 * k))
        client.accepted("step", count=16, pointer_sequence=(0, sequence))
    client.accepted("release")
    client.accepted("step", count=2000)


def difference(a: Any, b: Any) -> float:
    """The largest of any number of the joints' quaternions; q and -q are the same."""

    def of(p: Any, q: Any, sign: float) -> float:
        return max(abs(x - sign * y) for x, y in zip(p, q, strict=True))

    return max(min(of(p, q, 1.0), of(p, q, -1.0)) for p, q in zip(a[1], b[1], strict=True))


def test_undo_and_redo_of_a_gesture(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.accepted("step", count=2000)
    before = pose(client)
    lift(client)
    after = pose(client)
    assert difference(before, after) > 0.05
    client.accepted("undo")
    assert difference(before, pose(client)) < 1e-3
    client.accepted("redo")
    assert difference(after, pose(client)) < 1e-3
    assert client.command("redo").reason == "there is nothing to do again"


def test_history_goes_to_places_on_other_branches(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.accepted("step", count=2000)
    before = pose(client)
    (start,) = client.accepted("history")["place"]
    lift(client)
    lifted = pose(client)
    (up,) = client.accepted("history", action="state")["place"]
    assert difference(before, lifted) > 0.05
    (back,) = client.accepted("undo")["place"]
    assert back == start
    client.accepted("mirror")
    client.accepted("history", action="go", place=up)
    assert difference(lifted, pose(client)) < 1e-3
    client.accepted("history", action="go", place=start)
    assert difference(before, pose(client)) < 1e-3
    refused = client.command("history", action="go", place=up + 100)
    assert not refused.accepted
    assert str(int(up) + 100) in refused.reason


def test_snapshot_survives_the_server(
    start_server: StartServer, connect: Connect, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    first = start_server("--clock", "lockstep")
    client = connect(first)
    lift(client)
    kept = pose(client)
    client.accepted("snapshot", name="lifted")
    first.process.kill()
    first.wait()
    client = connect(start_server("--clock", "lockstep"))
    assert [result.text for result in client.command("snapshot", action="list").results] == ["lifted"]
    client.accepted("snapshot", name="lifted", action="restore")
    assert difference(kept, pose(client)) < 1e-3
    client.accepted("snapshot", name="lifted", action="remove")
    assert not client.command("snapshot", name="lifted", action="restore").accepted


def test_damaged_snapshots_are_told_at_start_and_refused(
    start_server: StartServer, connect: Connect, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    client = connect(start_server("--clock", "lockstep"))
    client.accepted("snapshot", name="a")
    (file,) = (tmp_path / "layfigure").glob("*.snapshots")
    data = bytearray(file.read_bytes())
    data[-5] ^= 1
    file.write_bytes(bytes(data))
    server = start_server("--clock", "lockstep")
    client = connect(server)
    reply = client.command("snapshot", name="a", action="restore")
    assert "is damaged" in reply.reason
    client.accepted("shutdown")
    code, error = server.wait()
    assert code == 0
    assert "is damaged" in error


def test_parameters_are_told_in_the_character(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.accepted("get_character")
    names = [joint.name for joint in client.received["character_t"][-1].joints]
    made = client.received["character_t"][-1].joints[names.index(HAND)].stiffness
    client.accepted("set", bone=HAND, **{"stiffness.factor": 2.0})
    assert client.received["character_t"][-1].joints[names.index(HAND)].stiffness == 2.0 * made
    client.accepted("undo")
    assert client.received["character_t"][-1].joints[names.index(HAND)].stiffness == made


def test_mirror_twice_is_the_pose_again(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.accepted("get_character")
    lift(client)
    before = pose(client)
    client.accepted("mirror")
    assert difference(before, pose(client)) > 0.02
    client.accepted("mirror", side="both")
    assert difference(before, pose(client)) < 1e-3


def test_mirror_of_one_side_leaves_it(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.accepted("get_character")
    names = [joint.name for joint in client.received["character_t"][-1].joints]
    lift(client)
    before = pose(client)[1]
    client.accepted("mirror", side="left")
    after = pose(client)[1]

    def turned(bone: str) -> float:
        p, q = before[names.index(bone)], after[names.index(bone)]
        return 1.0 - abs(sum(x * y for x, y in zip(p, q, strict=True)))

    assert turned("upper_arm.L") < 1e-6
    assert turned("upper_arm.R") > 1e-4
