"""Fingertips over LCM: what a client of another kind than ours sends and gets."""

from __future__ import annotations

import math
from typing import Any

from server_support.client import Client, Connect
from server_support.process import StartServer

FOREARM = "forearm.L"
MIDDLE = (0.0, 0.03, 0.0)  # of the forearm, in its frame


def forearm(client: Client) -> tuple[float, ...]:
    """Where its middle is, in the world."""
    position = client.accepted("grab", pointer=15, bone=FOREARM, point=MIDDLE)["position"]
    client.accepted("release", pointer=15)
    return position


def pinch(client: Client) -> tuple[float, ...]:
    """Two fingertips hold the forearm, from behind and from the front."""
    client.accepted("step", count=250)
    x, y, z = forearm(client)
    for distance in (0.025, 0.010):
        for pointer, side in ((0, 1.0), (1, -1.0)):
            sequence = client.point((x, y + side * distance, z), pointer)
            if distance == 0.025:
                client.accepted("touch", pointer=pointer, stiffness=200, damping=1.5)
        client.accepted("step", count=250, pointer_sequence=(1, sequence))
    return (x, y, z)


def newest_force(client: Client, pointer: int) -> Any:
    return next(force for force in reversed(client.received["force_t"]) if force.pointer == pointer)


def test_pinch_forces_press_from_both_sides(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    pinch(client)
    left, right = newest_force(client, 0), newest_force(client, 1)
    for force in (left, right):
        assert (force.tool, bool(force.attached), bool(force.contact)) == ("touch", True, True)
        assert force.joint == right.joint >= 0
        assert list(force.hand_force) == [-f for f in force.force]
    assert left.force[1] < -0.3
    assert right.force[1] > 0.3


def test_pinch_of_a_client_that_vanished_is_held_and_can_be_released(
    start_server: StartServer, connect: Connect
) -> None:
    server = start_server("--clock", "lockstep")
    client = connect(server)
    x, y, z = pinch(client)
    for lift in range(1, 11):
        for pointer, side in ((0, 1.0), (1, -1.0)):
            sequence = client.point((x, y + side * 0.010, z + 0.002 * lift), pointer)
        client.accepted("step", count=50, pointer_sequence=(1, sequence))
    lifted = forearm(client)
    assert lifted[2] > z + 0.01
    del client  # its socket closes: the pointers stay where they were sent last
    other = connect(server)
    other.accepted("step", count=2000)
    held = forearm(other)
    assert math.dist(held, lifted) < 2e-3
    for pointer in (0, 1):
        other.accepted("release", pointer=pointer)
    other.accepted("step", count=1000)
    assert forearm(other)[2] < held[2] - 1e-3


def test_touch_and_pins_bad_are_refused_and_nothing_changes(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.point((0.5, 0.5, 0.5))
    cases: list[tuple[str, dict[str, Any], str]] = [
        ("touch", {"pointer": 3}, "no pose yet"),
        ("touch", {"radius": math.nan}, "radius"),
        ("touch", {"bone": FOREARM}, "bone"),
        ("release", {}, "holds nothing"),
        ("grab", {"reach": 0.01}, "from the skin"),
        ("grab", {"origin": (0, 0, 5), "direction": (0, 0, 1)}, "meets no skin"),
        ("pin", {"bone": "third arm"}, "third arm"),
        ("unpin", {"pin": 3}, "there is no pin 3"),
        ("set", {"scale": math.inf}, "scale"),
        ("set", {"magnet": 1}, "no fingertip"),
        ("set", {"softness": 0.5, "bone": "pelvis"}, "no joint of its own"),
    ]
    for name, arguments, word in cases:
        reply = client.command(name, **arguments)
        assert not reply.accepted, name
        assert word in reply.reason
    client.accepted("step", count=100)
    force = newest_force(client, 0)
    assert (force.tool, bool(force.attached), list(force.hand_force)) == ("none", False, [0.0, 0.0, 0.0])


def test_touch_inside_the_doll_is_refused(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    client.point(forearm(client))
    reply = client.command("touch")
    assert not reply.accepted
    assert "would begin inside something" in reply.reason


def test_grab_of_what_is_there_names_the_bone(start_server: StartServer, connect: Connect) -> None:
    client = connect(start_server("--clock", "lockstep"))
    x, y, z = forearm(client)
    results = client.accepted("grab", origin=(x, y - 1.0, z), direction=(0.0, 1.0, 0.0))
    client.accepted("get_character")
    joints = client.wait_for("character_t").joints
    assert joints[int(results["joint"][0])].name == FOREARM
    assert math.dist(results["position"], (x, y, z)) < 0.01
    assert 0.98 < results["distance"][0] < 1.0
