"""Several clients of one server: of which the pointer is, whose the commands are."""

from __future__ import annotations

from typing import Any

from server_support.client import Client, Connect
from server_support.process import StartServer

HAND = "hand.L"
LOCKSTEP = ("--clock", "lockstep")
STEPS_PER_POSE = 20  # more than there are


def target_after_steps(client: Client) -> float:
    """How high pointer 0 is to be, as the server tells it with the pose of these steps."""
    steps = client.accepted("step", count=STEPS_PER_POSE)["steps"][0]
    force = client.wait_for(
        "force_t", lambda force: force.pointer == 0 and force.time_us > (steps - STEPS_PER_POSE) * 1000
    )
    return float(force.target[2])


def test_pointer_that_two_clients_move_follows_the_message_that_came_last(
    start_server: StartServer, connect: Connect
) -> None:
    server = start_server(*LOCKSTEP)
    one, other = connect(server), connect(server)
    for height in (0.1, 0.2, 0.3):
        one.point((0.0, 0.0, height))
    one.accepted("step", pointer_sequence=(0, 3))
    assert target_after_steps(one) == 0.3
    other.accepted("step", pointer_sequence=(0, other.point((0.0, 0.0, 0.5))))  # its first, after three of the other's
    assert target_after_steps(one) == 0.5
    one.accepted("step", pointer_sequence=(0, one.point((0.0, 0.0, 0.4))))
    assert target_after_steps(other) == 0.4


def test_step_that_waits_for_a_pointer_which_another_client_has_moved_is_refused(
    start_server: StartServer, connect: Connect
) -> None:
    server = start_server(*LOCKSTEP)
    one, other = connect(server), connect(server)
    mine = one.point((0.0, 0.0, 0.1))
    one.accepted("step", pointer_sequence=(0, mine))
    other.accepted("step", pointer_sequence=(0, other.point((0.0, 0.0, 0.2))))
    refused = one.command("step", pointer_sequence=(0, mine))
    assert not refused.accepted
    assert f"or client '{other.id}' has moved the pointer since" in refused.reason
    assert one.accepted("step", pointer_sequence=(0, one.point((0.0, 0.0, 0.1))))["steps"] == (3.0,)


def test_two_hands_of_two_clients_do_not_touch_each_other(start_server: StartServer, connect: Connect) -> None:
    server = start_server(*LOCKSTEP)
    one, other = connect(server), connect(server)
    one.accepted("grab", bone=HAND, pointer=0)
    other.accepted("grab", bone="hand.R", pointer=1)
    assert "pointer 0" in other.command("grab", bone="hand.R", pointer=0).reason  # is taken
    other.accepted("release", pointer=1)
    one.accepted("step", count=STEPS_PER_POSE)
    held = {force.pointer: force.attached for force in one.received["force_t"]}
    assert held == {0: True, 1: False}


def replies_to(client: Client, count: int) -> dict[int, Any]:
    """The first reply to each of its commands."""
    client.wait_for("reply_t", lambda reply: (reply.client_id, reply.sequence) == (client.id, count))
    return {reply.sequence: reply for reply in reversed(client.received["reply_t"]) if reply.client_id == client.id}


def test_commands_of_two_clients_with_equal_numbers_are_each_carried_out_once(
    start_server: StartServer, connect: Connect
) -> None:
    each = 50  # fewer than are remembered
    server = start_server(*LOCKSTEP)
    clients = (connect(server), connect(server))
    for _ in range(each):
        for steps, client in enumerate(clients, start=1):
            client.send("step", count=steps)
    first = [replies_to(client, each) for client in clients]
    assert all(reply.accepted for replies in first for reply in replies.values())
    done = sorted(reply.results[0].values[0] for replies in first for reply in replies.values())
    assert (len(set(done)), done[-1]) == (2 * each, 3.0 * each)
    for client, replies in zip(clients, first, strict=True):
        for number in range(1, each + 1):
            client.received["reply_t"].clear()
            client.send_numbered(number, "step", count=7)  # whatever it says now
            again = client.wait_for("reply_t", lambda reply, client=client: reply.client_id == client.id)
            assert (again.sequence, again.results[0].values) == (number, replies[number].results[0].values)
    assert clients[0].accepted("step")["steps"] == (3.0 * each + 1,)
