"""A server in lockstep: a script decides when time passes."""

from __future__ import annotations

import math
from typing import Any

from server_support.client import Client, Connect
from server_support.process import StartServer

HAND = "hand.L"
STEPS_PER_KEY = 16


def play(client: Client) -> dict[tuple[str, int], bytes]:
    """Grabs a hand, lifts it, lets it go; returns the poses and forces, without what differs between runs."""
    client.accepted("get_character")  # and the newest pose, which may have come already
    held = client.accepted("grab", bone=HAND, mode="6dof")["position"]
    for key in range(1, 41):
        sequence = client.point((held[0], held[1], held[2] + 0.002 * key))
        client.accepted("step", count=STEPS_PER_KEY, pointer_sequence=(0, sequence))
    client.accepted("release")
    client.accepted("step", count=1000)
    names = ("pose_t", "force_t")
    return {(name, message.sequence): without_server_id(message) for name in names for message in client.received[name]}


def without_server_id(message: Any) -> bytes:
    message.server_id = 0
    data: bytes = message.encode()
    return data


def test_script_played_twice_gives_identical_bytes(start_server: StartServer, connect: Connect) -> None:
    takes = [play(connect(start_server("--clock", "lockstep"))) for _ in range(2)]
    assert len(takes[0]) > 100
    assert takes[0] == takes[1]


def test_poses_are_gapless_and_exactly_timed(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.accepted("get_character")
    client.accepted("step", count=2000)
    poses = {pose.sequence: pose for pose in client.received["pose_t"]}
    assert list(poses) == list(range(121))
    for pose in poses.values():
        assert pose.step == math.ceil(pose.sequence * 1000 / 60)
        assert pose.time_us == 1000 * pose.step
        assert all(abs(math.hypot(*rotation) - 1) < 1e-9 for rotation in pose.rotations)


def test_time_stands_still_without_steps(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    first = client.wait_for("status_t")
    last = client.wait_for("status_t", lambda status: status is not first)
    assert (first.steps, last.steps) == (0, 0)
    assert (first.clock, first.state) == ("lockstep", "running")


def test_command_repeated_is_answered_again_and_done_once(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    for _ in range(3):
        client.send_numbered(1, "step", count=7)
    client.wait_for("reply_t", lambda _: len(client.received["reply_t"]) == 3)
    replies = client.received["reply_t"]
    assert len({reply.encode() for reply in replies}) == 1
    client.send_numbered(2, "step")
    reply = client.wait_for("reply_t", lambda reply: reply.sequence == 2)
    assert reply.results[0].values == (8.0,)


def test_step_before_its_pointer_is_refused_with_what_to_do(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    reply = client.command("step", pointer_sequence=(0, 12))
    assert not reply.accepted
    assert reply.reason == "pointer 0: message 12 has not arrived; send it again"


def test_commands_bad_are_refused_and_the_server_goes_on(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    cases: list[tuple[str, dict[str, Any], str]] = [
        ("explode", {}, "explode"),
        ("grab", {"bone": "third arm"}, "third arm"),
        ("grab", {}, "bone"),
        ("grab", {"bone": HAND, "stiffness": math.nan}, "stiffness"),
        ("release", {"pointer": 99}, "pointer"),
        ("step", {"count": 1e6}, "count"),
        ("get_mesh", {"chunks": 1e9}, "chunks"),
        ("key", {"note": "hello"}, "note"),
    ]
    for name, arguments, word in cases:
        reply = client.command(name, **arguments)
        assert not reply.accepted
        assert word in reply.reason
    client.accepted("step")


def test_command_of_another_version_is_refused_naming_both(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.version = 99
    assert client.command("step").reason == "protocol version 99, this server speaks 1"
    client.version = 1
    assert client.accepted("step")["steps"] == (1.0,)


def test_garbage_on_the_bus_is_counted(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    for data in (b"", b"\0" * 8, b"\xff" * 1000, bytes(range(256)) * 100):
        client.publish("COMMAND", data)
        client.publish("POINTER", data)
    client.point((math.nan, 0.0, 0.0))
    client.point((0.0, 0.0, 0.0), pointer=16)
    status = client.wait_for("status_t", lambda status: status.bad_messages >= 10)
    assert status.bad_messages == 10
    client.accepted("step")


def test_character_and_mesh_agree(start_server: StartServer, connect: Connect, messages: Any) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.accepted("get_character")
    character = client.wait_for("character_t")
    assert HAND in [joint.name for joint in character.joints]
    assert all(joint.parent < index for index, joint in enumerate(character.joints))
    total = int(client.accepted("get_mesh")["chunks"][0])
    chunks = {chunk.index: bytes(chunk.bytes) for chunk in client.received["mesh_chunk_t"]}
    assert sorted(chunks) == list(range(total))
    data = b"".join(chunks[index] for index in range(total))
    assert len(data) == character.mesh_bytes
    meshes = messages.meshes_t.decode(data)
    assert meshes.content_hash == character.content_hash
    for mesh in meshes.meshes:
        assert max(max(indices) for indices in mesh.joint_indices) < character.joint_count
        assert all(abs(sum(weights) - 1) < 1e-5 for weights in mesh.joint_weights)


def test_chunk_asked_for_is_sent_alone(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.accepted("get_mesh", chunks=(1, 0))
    assert [chunk.index for chunk in client.received["mesh_chunk_t"]] == [1, 0]


def test_channel_prefix_separates_servers(start_server: StartServer, connect: Connect) -> None:
    server = start_server("--clock", "lockstep", "--channel-prefix", "left_")
    client = connect(server, "left_")
    client.accepted("step")
    other = connect(server)
    other.send("step")
    client.accepted("step")
    assert other.received["reply_t"] == []


def test_two_clients_are_told_apart(start_server: StartServer, connect: Connect) -> None:
    server = start_server("--clock", "lockstep")
    first, second = connect(server), connect(server)
    assert first.accepted("step")["steps"] == (1.0,)
    assert second.accepted("step")["steps"] == (2.0,)
    second.point((0.0, 0.0, 0.0))
    assert not first.command("step", pointer_sequence=(0, 1)).accepted
