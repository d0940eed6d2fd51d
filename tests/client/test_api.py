"""What programs import from `layfigure`, as far as it needs no server."""

from __future__ import annotations

import inspect
import select
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from client_support import synthetic
from client_support.scripted_server import ScriptedServer

import layfigure
from layfigure import codec
from layfigure.arguments import arguments
from layfigure.bus import Bus
from layfigure.doll import Doll
from layfigure.pose_stream import PoseStream


@pytest.fixture
def doll(bus: Bus, server: ScriptedServer) -> Doll:
    server.publish_poses(1)  # from now on it tells the newest with the character
    return Doll(bus)


def wire(values: dict[str, Any]) -> list[tuple[str, str, tuple[float, ...]]]:
    return [(argument.name, argument.text, argument.values) for argument in arguments("set", values)]


def test_arguments_are_texts_numbers_and_arrays() -> None:
    given = {
        "bone": "neck",
        "axes": ["twist", "bend_y"],
        "pointer": 1,
        "clutch": True,
        "softness": np.float32(0.5),
        "rotations": np.eye(2),
        "left_out": None,
        "limits.twist": (-1, 1),
    }
    assert wire(given) == [
        ("bone", "neck", ()),
        ("axes", "twist bend_y", ()),
        ("pointer", "", (1.0,)),
        ("clutch", "", (1.0,)),
        ("softness", "", (0.5,)),
        ("rotations", "", (1.0, 0.0, 0.0, 1.0)),
        ("limits.twist", "", (-1.0, 1.0)),
    ]


@pytest.mark.parametrize("bad", [{"a": 1}, [[1.0], [1.0, 2.0]], b"bytes", object(), 1j], ids=repr)
def test_arguments_that_cannot_be_sent_are_named(bad: Any) -> None:
    with pytest.raises(layfigure.UsageError, match=r"'gravity' of 'set' is .*: expected a text, a number"):
        arguments("set", {"gravity": bad})


def test_command_reaches_the_server_with_its_arguments(doll: Doll, server: ScriptedServer) -> None:
    with pytest.raises(layfigure.UsageError, match="'bone' of 'grab'"):
        doll.command("grab", pointer=0, bone={})
    assert "grab" not in server.command_names()
    assert doll.command("grab", pointer=0, bone="hand").accepted
    assert "grab" in server.command_names()


@pytest.mark.parametrize("where", [[1.0, 2.0], [0, 0, np.nan], [0, 0, 0, 0, 0, 0, 0], "there", [[0, 0, 0]]], ids=str)
def test_pointers_are_refused_other_than_a_place_or_a_pose(doll: Doll, where: Any) -> None:
    with pytest.raises(layfigure.UsageError, match="pointer 3 is sent to"):
        doll.move_pointer(3, where)


def answer(doll: Doll, pending: layfigure.PendingReply) -> layfigure.Reply:
    """As a program's own loop gets it."""
    while pending.reply is None:
        pending.send_if_due()
        select.select([doll], [], [], pending.due_in_s)
        doll.pose()
    return pending.reply


def test_command_that_does_not_wait_is_answered_in_the_callers_loop(doll: Doll, server: ScriptedServer) -> None:
    pending = doll.begin("grab", bone="hand.L")
    assert pending.reply is None
    assert pending.due_in_s == 0.0
    assert server.command_names() == ["get_character"], "nothing is sent before the loop sends it"
    assert answer(doll, pending).accepted
    assert server.commands[-1].arguments[0].text == "hand.L"


def test_command_that_does_not_wait_is_sent_again_and_carried_out_once(doll: Doll, server: ScriptedServer) -> None:
    server.unanswered = 1
    answer(doll, doll.begin("key"))
    assert server.command_names()[-2:] == ["key", "key"]
    assert server.commands[-1].sequence == server.commands[-2].sequence


def test_command_that_does_not_wait_has_a_refusal_as_its_reply(doll: Doll, server: ScriptedServer) -> None:
    server.refusals["grab"] = "no bone is called 'tail'"
    reply = answer(doll, doll.begin("grab", bone="tail"))
    assert not reply.accepted
    assert reply.reason == "no bone is called 'tail'"
    with pytest.raises(layfigure.UsageError, match="'bone' of 'grab'"):
        doll.begin("grab", bone=object())


def test_command_that_does_not_wait_gives_up_in_time(doll: Doll, server: ScriptedServer) -> None:
    server.unanswered = 100
    with pytest.raises(layfigure.NoReplyError, match=r"no server answered 'key' on 'memq://' within 0\.2 s"):
        answer(doll, doll.begin("key", timeout_s=0.2))
    server.unanswered = 0
    assert answer(doll, doll.begin("key")).accepted


def test_joint_of_an_unknown_name_is_refused(doll: Doll) -> None:
    assert [doll.joint(joint.name) for joint in doll.character.joints] == list(range(len(doll.character.joints)))
    with pytest.raises(layfigure.UsageError, match="no joint 'wing'"):
        doll.joint("wing")


def test_world_poses_are_those_of_the_bind_chain(doll: Doll) -> None:
    rotations, positions = layfigure.world_poses(doll.character, doll.pose())
    expected = synthetic.world_matrices(doll.pose().rotations, doll.pose().root_translation)
    np.testing.assert_allclose(positions, [matrix[:3, 3] for matrix in expected], atol=1e-12)
    assert rotations.shape == (len(expected), 4)


def test_pose_stream_gives_each_pose_once_and_counts_the_lost() -> None:
    stream = PoseStream(lambda condition: None, lambda: None, lambda: False, newest=False)
    for sequence in (4, 5, 5, 9):
        stream.add(pose(sequence))
    assert [each.sequence for each in stream] == [4, 5, 9]
    assert stream.skipped == 3
    stream.add(pose(0, server_id=synthetic.SERVER_ID + 1))  # restarted
    assert next(stream).sequence == 0
    assert stream.skipped == 3


def test_pose_stream_of_the_newest_leaves_out_the_others() -> None:
    stream = PoseStream(lambda condition: None, lambda: None, lambda: False, newest=True)
    for sequence in range(5):
        stream.add(pose(sequence))
    assert [each.sequence for each in stream] == [4]


def pose(sequence: int, server_id: int = synthetic.SERVER_ID) -> layfigure.Pose:
    return codec.decode_pose(synthetic.pose_message(sequence, server_id).encode())


def test_temporary_subscriptions_end_with_their_block(bus: Bus) -> None:
    kept: list[bytes] = []
    temporary: list[bytes] = []
    bus.subscribe("A", kept.append)
    with bus.temporary_subscriptions():
        bus.subscribe("A", temporary.append)
        bus.publish("A", b"1")
        bus.wait_until(lambda: bool(kept), 5.0)
    bus.publish("A", b"2")
    bus.wait_until(lambda: len(kept) == 2, 5.0)
    assert (kept, temporary) == ([b"1", b"2"], [b"1"])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"fps": 0.0}, "fps is 0"),
        ({"fps": float("nan")}, "fps is nan"),
        ({"tolerance_m": -1.0}, "tolerance_m is -1"),
        ({"meters_per_unit": 0.0}, "meters_per_unit is 0"),
        ({"keys": "some"}, "keys is 'some': expected every or marked or reduced"),
        ({"layout": "flat"}, "layout is 'flat'"),
        ({"up_axis": "X"}, "up_axis is 'X': expected Y or Z"),
        ({"joints": "arm"}, r"expected a list of names or patterns, \['arm'\]"),
        ({"joints": ["wing"]}, "no joint of .* matches 'wing'"),
    ],
)
def test_write_usd_bad_value_is_named_and_nothing_written(
    take: layfigure.Take, tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(layfigure.UsageError, match=message):
        layfigure.write_usd(take, tmp_path / "take.usda", **options)
    assert list(tmp_path.iterdir()) == []


def test_write_usd_other_suffix_or_folder_is_refused(take: layfigure.Take, tmp_path: Path) -> None:
    for out in ("take.fbx", "nowhere/take.usda"):
        with pytest.raises(layfigure.UsageError):
            layfigure.write_usd(take, tmp_path / out)


def test_all_public_names_are_there_and_documented() -> None:
    for name in layfigure.__all__:
        value = getattr(layfigure, name)
        assert inspect.isclass(value) or inspect.isfunction(value)
    for function in (layfigure.connect, layfigure.write_usd, layfigure.read_take, layfigure.world_poses):
        assert inspect.getdoc(function)
    methods = [value for name, value in vars(layfigure.Doll).items() if not name.startswith("_")]
    assert all(inspect.getdoc(method) for method in methods)


def test_import_does_not_load_usd_or_pictures() -> None:
    """They take a second that a program which only poses need not wait for."""
    code = "import sys, layfigure; print([m for m in ('pxr', 'vtkmodules', 'matplotlib') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
