"""Clients, devices and servers of another protocol version: one line says so, and nothing else happens."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable
from types import ModuleType

import lcm
import pytest
from server_support.client import Client, Connect
from server_support.process import ServerProcess, StartServer

OTHER = 2
WHAT = f"protocol version {OTHER}, this server speaks 1"
INNER = {"argument_t", "device_t", "image_t", "joint_t", "material_t", "mesh_t", "meshes_t"}  # parts of messages


def end(client: Client, server: ServerProcess) -> list[str]:
    """The lines that the server has written, after it has left; without that on its character."""
    client.accepted("shutdown")
    code, errors = server.wait()
    assert code == 0
    return [line for line in errors.splitlines() if "remarks on the character" not in line]


def pointer(client: Client, _messages: ModuleType) -> None:
    client.version = OTHER
    client.point((0.0, 0.0, 0.5))
    client.version = 1


def status(client: Client, messages: ModuleType) -> None:
    """Of another server, which is no rival: what is for whichever is for this one."""
    message = messages.status_t()
    message.protocol_version = OTHER
    message.server_id = 99
    message.state = "running"
    client.publish("STATUS", message.encode())


@pytest.mark.parametrize("send", [pointer, status])
def test_message_of_another_version_is_told_in_a_line_and_changes_nothing(
    start_server: StartServer, connect: Connect, messages: ModuleType, send: Callable[[Client, ModuleType], None]
) -> None:
    server = start_server("--clock", "lockstep")
    client = connect(server)
    send(client, messages)
    told = client.wait_for("status_t", lambda status: status.server_id != 99 and status.bad_messages > 0)
    assert (told.bad_messages, told.steps, told.state) == (1, 0, "running")
    reply = client.command("step", pointer_sequence=(0, 1))
    assert "message 1 has not arrived" in reply.reason
    assert client.accepted("step")["steps"] == (1.0,)
    kind = send.__name__
    assert end(client, server) == [f"layfigure-server: refused a {kind} message: {WHAT} (1 bad messages so far)"]


def test_command_of_another_version_is_answered_and_changes_nothing(
    start_server: StartServer, connect: Connect
) -> None:
    server = start_server("--clock", "lockstep")
    client = connect(server)
    client.version = OTHER
    for name in ("step", "shutdown", "no such"):
        reply = client.command(name)
        assert (reply.accepted, reply.reason, reply.protocol_version) == (False, WHAT, 1)
    client.version = 1
    assert client.accepted("step")["steps"] == (1.0,)
    assert end(client, server) == []


def test_device_of_another_version_is_told_in_a_line_and_moves_nothing(
    start_server: StartServer, connect: Connect, messages: ModuleType
) -> None:
    server = start_server("--device", "lcm")
    client = connect(server)
    state = messages.spidar_state_t()
    state.protocol_version = OTHER
    state.device_id = "0"
    state.sequence = 1
    state.kind = 1
    state.position = [0.1, 0.1, 0.1]
    state.rotation = [1.0, 0.0, 0.0, 0.0]
    device = lcm.LCM(server.url)
    before = client.wait_for("force_t").target
    device.publish("SPIDAR_STATE", state.encode())
    time.sleep(0.3)
    client.received["force_t"].clear()
    assert client.wait_for("force_t").target == before
    (told,) = client.wait_for("status_t", lambda status: status.steps > 0).devices
    assert told.state != "ok"
    (line,) = [line for line in end(client, server) if "version" in line]
    assert "refused a state: " in line
    assert WHAT in line


def test_types_all_begin_with_the_version(messages: ModuleType) -> None:
    """What is checked before anything else of a message is at the same place in each, but in what is inside others."""
    for name in dir(messages):
        if not name.endswith("_t") or name in INNER:
            continue
        message = getattr(importlib.import_module(messages.__name__), name)()
        message.protocol_version = 0x01020304
        assert message.encode()[8:12] == b"\1\2\3\4", name
