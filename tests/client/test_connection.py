import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from client_support import synthetic
from client_support.scripted_server import ScriptedServer

from layfigure import messages
from layfigure.bus import Bus
from layfigure.connection import Connection
from layfigure.doll import Doll
from layfigure.errors import NoReplyError, ProtocolError, RefusedError, TwoServersError
from layfigure.protocol import (
    CHARACTER_CHANNEL,
    FORCE_CHANNEL,
    MESH_CHANNEL,
    POSE_CHANNEL,
    REPLY_CHANNEL,
    STATUS_CHANNEL,
    Argument,
)
from layfigure.servers import SILENT_AFTER_S, ServerWatch


def test_command_is_answered_once_for_each_sequence(bus: Bus, server: ScriptedServer) -> None:
    connection = Connection(bus)
    connection.command("key")
    connection.command("reset", Argument("a", values=(1.0,)))
    assert server.command_names() == ["key", "reset"]
    assert [command.sequence for command in server.commands] == [1, 2]
    assert {command.client_id for command in server.commands} == {connection.client_id}


def test_command_without_reply_is_sent_again_unchanged(bus: Bus, server: ScriptedServer) -> None:
    server.unanswered = 2
    Connection(bus).command("key")
    assert [command.sequence for command in server.commands] == [1, 1, 1]
    assert len({command.encode() for command in server.commands}) == 1


def test_command_without_server_gives_up_in_one_line(bus: Bus) -> None:
    with pytest.raises(NoReplyError, match=r"no server answered 'key' on 'memq://' within 0\.2 s"):
        Connection(bus).command("key", timeout_s=0.2)


def test_command_that_is_refused_raises_the_reason(bus: Bus, server: ScriptedServer) -> None:
    server.refusals["grab"] = "no bone is called 'tail'"
    with pytest.raises(RefusedError, match="no bone is called 'tail'"):
        Connection(bus).command("grab")


def test_connections_each_have_their_own_id(bus: Bus) -> None:
    assert Connection(bus).client_id != Connection(bus).client_id


def test_reply_to_another_client_is_not_taken(bus: Bus, server: ScriptedServer) -> None:
    first, second = Connection(bus), Connection(bus)
    first.command("key")
    server.unanswered = 1
    with pytest.raises(NoReplyError):
        second.command("key", timeout_s=0.2)


def test_fetch_character_decodes_the_skeleton(bus: Bus, server: ScriptedServer) -> None:
    character = Connection(bus).fetch_character()
    assert [joint.name for joint in character.joints] == synthetic.NAMES
    assert server.command_names() == ["get_character"]


def test_fetch_meshes_puts_chunks_together(bus: Bus, server: ScriptedServer) -> None:
    connection = Connection(bus)
    meshes = connection.fetch_meshes(connection.fetch_character())
    assert [len(mesh.points) for mesh in meshes] == [synthetic.RINGS * synthetic.SIDES]
    assert server.command_names() == ["get_character", "get_mesh"]


def test_fetch_meshes_lost_chunks_are_asked_for_again(bus: Bus, server: ScriptedServer) -> None:
    server.lost_chunks = {0, 3}
    connection = Connection(bus)
    meshes = connection.fetch_meshes(connection.fetch_character())
    assert len(meshes) == 1
    wanted = [argument for command in server.commands for argument in command.arguments]
    assert [(argument.name, list(argument.values)) for argument in wanted] == [("chunks", [0.0, 3.0])]


def test_fetch_meshes_slow_chunks_are_not_asked_for_again(
    bus: Bus, server: ScriptedServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One comes each time that the client has waited for as long as it waits for lost ones."""
    chunks = synthetic.chunk_messages()
    server.lost_chunks = {chunk.index for chunk in chunks}
    connection = Connection(bus)
    character = connection.fetch_character()
    wait_until = bus.wait_until

    def wait_shortly(condition: Callable[[], bool], timeout_s: float) -> bool:
        if chunks:
            bus.publish(MESH_CHANNEL, chunks.pop().encode())
        return wait_until(condition, min(timeout_s, 0.01))

    monkeypatch.setattr(bus, "wait_until", wait_shortly)
    assert len(connection.fetch_meshes(character)) == 1
    assert server.command_names() == ["get_character", "get_mesh"]


def test_fetch_meshes_that_never_come_gives_up(bus: Bus, server: ScriptedServer) -> None:
    server.lost_chunks = set(range(1000))
    connection = Connection(bus)
    with pytest.raises(NoReplyError, match="did not arrive whole"):
        connection.fetch_meshes(connection.fetch_character(), timeout_s=0.3)


@pytest.fixture
def one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages come as through a socket that holds no more than one."""
    monkeypatch.setattr("layfigure.bus.bus._MAX_BATCH", 1)


@pytest.mark.usefixtures("one_by_one")
def test_own_work_with_a_mesh_is_not_counted_as_the_servers_silence(bus: Bus, server: ScriptedServer) -> None:
    """A recorder takes in what comes before the reply does: a large mesh for longer than a reply is waited for."""
    limit_s = 0.3
    chunks: list[float] = []

    def take_in(_: bytes) -> None:
        chunks.append(time.monotonic())
        time.sleep(2.0 * limit_s / len(synthetic.chunk_messages()))

    bus.subscribe(MESH_CHANNEL, take_in)
    connection = Connection(bus)
    connection.fetch_character()
    connection.command("get_mesh", timeout_s=limit_s)
    assert chunks[-1] - chunks[0] > limit_s
    assert server.command_names() == ["get_character", "get_mesh"]


@pytest.mark.usefixtures("one_by_one")
def test_client_that_is_flooded_gives_up_as_well(bus: Bus, server: ScriptedServer) -> None:
    """It never comes to wait: each message that it handles brings another one."""

    def answer(data: bytes) -> None:
        time.sleep(0.01)
        bus.publish(FORCE_CHANNEL, data)

    server.unanswered = 1000
    bus.subscribe(FORCE_CHANNEL, answer)
    bus.publish(FORCE_CHANNEL, b"")
    with pytest.raises(NoReplyError):
        Connection(bus).command("key", timeout_s=0.05)


def test_bad_message_is_counted_and_left_out(bus: Bus, server: ScriptedServer) -> None:
    connection = Connection(bus)
    bus.publish(STATUS_CHANNEL, b"garbage")
    bus.publish(CHARACTER_CHANNEL, b"")
    server.publish_status()
    assert connection.wait_for_status().state == "running"
    assert bus.bad_messages == 2


def test_server_of_another_version_is_told_in_the_line_that_fails(bus: Bus, caplog: pytest.LogCaptureFixture) -> None:
    connection = Connection(bus)
    status = synthetic.status_message()
    status.protocol_version = 2
    for _ in range(5):
        bus.publish(STATUS_CHANNEL, status.encode())
    with pytest.raises(NoReplyError, match=r"no server is heard .* cannot be read \(status_t of protocol version 2, "):
        connection.wait_for_status(timeout_s=0.2)
    assert [record.getMessage() for record in caplog.records] == [
        "bad message left out: status_t of protocol version 2, expected 1"
    ]
    assert connection.watch.current is None


MESSAGES_OF_SERVERS = {
    CHARACTER_CHANNEL: lambda: synthetic.character_message(99, content_hash=5),
    MESH_CHANNEL: lambda: synthetic.chunk_messages(server_id=99)[0],
    POSE_CHANNEL: lambda: synthetic.pose_message(7, 99, content_hash=5),
    FORCE_CHANNEL: lambda: synthetic.force_message(7, 99),
    STATUS_CHANNEL: lambda: synthetic.status_message("leaving", 99),
    REPLY_CHANNEL: lambda: _reply(99),
}


def _reply(server_id: int):
    reply = messages.reply_t()
    reply.server_id = server_id
    reply.accepted = True
    return reply


@pytest.mark.parametrize("channel", MESSAGES_OF_SERVERS)
def test_messages_of_another_version_are_told_in_a_line_and_change_nothing(
    channel: str, bus: Bus, server: ScriptedServer, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    server.publish_poses(3)
    doll = Doll(bus)
    server.publish_poses(1)
    with doll.record(tmp_path / "take.lcmlog") as recording:
        before = doll.pose()
        message = MESSAGES_OF_SERVERS[channel]()
        message.protocol_version = 2
        for _ in range(3):
            bus.publish(channel, message.encode())
        bus.wait_until(lambda: False, 0.1)
        assert doll.pose() is before
        assert doll.character.content_hash == synthetic.CONTENT_HASH
        server.publish_poses(1)
        assert bus.wait_until(lambda: doll.pose().sequence == before.sequence + 1, 1.0)
        assert recording.take.restarts == 0
    lines = {record.getMessage() for record in caplog.records}
    assert lines == {f"bad message left out: {type(message).__name__} of protocol version 2, expected 1"}
    assert len(caplog.records) == 1


def test_two_servers_at_once_are_refused(bus: Bus) -> None:
    one, other = ScriptedServer(bus, server_id=1), ScriptedServer(bus, server_id=2)
    connection = Connection(bus)
    for server in (one, other, one):
        server.publish_status()
    with pytest.raises(TwoServersError, match="two servers"):
        bus.wait_until(lambda: connection.watch.silent, 1.0)


@pytest.fixture
def choosy_bus() -> Iterator[Bus]:
    """Of a client that has chosen server 2."""
    with Bus("memq://", server_id=2) as bus:
        yield bus


def test_chosen_server_alone_is_commanded_and_heard(choosy_bus: Bus) -> None:
    one, other = ScriptedServer(choosy_bus, server_id=1), ScriptedServer(choosy_bus, server_id=2)
    connection = Connection(choosy_bus)
    for number in range(3):
        one.publish_status()
        other.publish_status()
        assert connection.wait_for_status().server_id == 2
        assert connection.command("key").server_id == 2
        assert len(other.commands) == number + 1
    one.publish_character()
    assert connection.fetch_character().server_id == 2
    connection.listen_for_rivals()
    assert {command.server_id for command in one.commands} == {2}


def test_chosen_server_gets_the_pointers(choosy_bus: Bus) -> None:
    server = ScriptedServer(choosy_bus, server_id=2)
    Connection(choosy_bus).send_pointer(0, np.zeros(3))
    choosy_bus.poll(0.1)
    assert [pointer.server_id for pointer in server.pointers] == [2]


def test_chosen_server_that_is_not_there_is_named(choosy_bus: Bus) -> None:
    ScriptedServer(choosy_bus, server_id=1).publish_status()
    connection = Connection(choosy_bus)
    with pytest.raises(
        NoReplyError, match=r"no server of the id 2 answered 'key' on 'memq://' within 0\.2 s: .*status"
    ):
        connection.command("key", timeout_s=0.2)
    with pytest.raises(NoReplyError, match=r"no server of the id 2 is heard"):
        connection.wait_for_status(timeout_s=0.1)


def test_cut_off_messages_are_bad_whichever_server_is_chosen(choosy_bus: Bus) -> None:
    Connection(choosy_bus)
    choosy_bus.publish(STATUS_CHANNEL, b"short")
    choosy_bus.publish(STATUS_CHANNEL, synthetic.status_message(server_id=1).encode()[:40])  # another's, unread
    choosy_bus.publish(STATUS_CHANNEL, synthetic.status_message(server_id=2).encode()[:40])
    choosy_bus.wait_until(lambda: False, 0.1)
    assert choosy_bus.bad_messages == 2


def test_rivals_are_listened_for_where_no_server_is_chosen(bus: Bus) -> None:
    one, other = ScriptedServer(bus, server_id=1), ScriptedServer(bus, server_id=2)
    connection = Connection(bus)
    for server in (one, other, one):
        server.publish_status()
    with pytest.raises(TwoServersError, match=r"2 and 1: choose one with --server ID"):
        connection.listen_for_rivals()


def test_reply_values_missing_result_is_a_protocol_error(bus: Bus, server: ScriptedServer) -> None:
    reply = Connection(bus).command("grab")
    assert reply.values("position") == (1.0, 2.0, 3.0)
    with pytest.raises(ProtocolError, match="no 'steps'"):
        reply.values("steps")
    assert len(server.commands) == 1


def test_server_watch_restarted_server_is_followed() -> None:
    watch = ServerWatch()
    watch.hear(1)
    watch.hear(2)
    assert watch.current == 2


def test_server_watch_silence_is_noticed_and_ends() -> None:
    now = [100.0]
    watch = ServerWatch(clock=lambda: now[0])
    watch.hear(1)
    now[0] += SILENT_AFTER_S - 0.1
    assert not watch.silent
    now[0] += 0.2
    assert watch.silent
    watch.hear(1)
    assert not watch.silent
