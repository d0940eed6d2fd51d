"""Two servers on one bus: told apart by whom a message is meant for, else refused."""

from __future__ import annotations

import time

from server_support.client import Client, Connect
from server_support.process import StartServer

HAND = "hand.L"
NO_ANSWER_S = 0.4


def listen(client: Client) -> None:
    end = time.monotonic() + NO_ANSWER_S
    while time.monotonic() < end:
        client.poll()


def two_servers(start_server: StartServer, connect: Connect) -> tuple[Client, int, int]:
    """A client that has heard both, each of which has heard the other."""
    first = start_server("--clock", "lockstep")
    client = connect(first)
    one = client.wait_for("status_t").server_id  # whose broker both use
    start_server("--clock", "lockstep", "--lcm-url", first.url)
    other = client.wait_for("status_t", lambda status: status.server_id != one).server_id
    listen(client)
    return client, one, other


def test_command_to_one_of_two_servers_is_carried_out_by_that_one(start_server: StartServer, connect: Connect) -> None:
    client, one, other = two_servers(start_server, connect)
    for server_id in (one, other, one):
        client.server_id = server_id
        reply = client.command("step", count=10)
        assert (reply.accepted, reply.server_id) == (True, server_id)
    assert client.command("step").results[0].values == (21.0,)
    listen(client)
    replies = client.received["reply_t"]
    assert [reply.server_id for reply in replies] == [one, other, one, one]  # the one that is not meant says nothing


def test_command_to_whichever_of_two_servers_is_refused_by_both_and_names_them(
    start_server: StartServer, connect: Connect
) -> None:
    client, one, other = two_servers(start_server, connect)
    client.command("step", count=10)
    client.wait_for("reply_t", lambda reply: reply.server_id == one)
    client.wait_for("reply_t", lambda reply: reply.server_id == other)
    for reply in client.received["reply_t"]:
        assert not reply.accepted
        assert reply.reason.startswith("two servers speak on this bus, ")
        assert str(one) in reply.reason
        assert str(other) in reply.reason
    client.server_id = one
    assert client.accepted("step")["steps"] == (1.0,)  # nothing had changed


def test_pointer_to_another_server_moves_nothing(start_server: StartServer, connect: Connect) -> None:
    client, one, other = two_servers(start_server, connect)
    client.server_id = other
    sequence = client.point((0.0, 0.0, 1.0))
    client.server_id = one
    reply = client.command("step", pointer_sequence=(0, sequence))
    assert not reply.accepted
    assert "has not arrived" in reply.reason
    client.server_id = other
    client.accepted("step", pointer_sequence=(0, sequence))


def test_server_whose_rival_has_left_takes_commands_to_whichever_again(
    start_server: StartServer, connect: Connect
) -> None:
    client, one, other = two_servers(start_server, connect)
    client.server_id = other
    client.accepted("shutdown")
    client.wait_for("status_t", lambda status: (status.server_id, status.state) == (other, "leaving"))
    listen(client)
    client.server_id = 0
    assert client.command("step").server_id == one
