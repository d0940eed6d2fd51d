import itertools
import math

import numpy as np
import pytest
from client_support import synthetic
from client_support.scripted_server import ScriptedServer

from layfigure import codec
from layfigure.bus import Bus
from layfigure.errors import LayfigureError, RefusedError
from layfigure.hand_motion import HandMotion, progress_of, schedule
from layfigure.player import Player, resolve_bones
from layfigure.session import (
    Action,
    Clutch,
    Fingertip,
    Grab,
    Hand,
    Key,
    Magnet,
    Move,
    Pin,
    Pinch,
    Release,
    Scale,
    Session,
    Softness,
    Touch,
    Unpin,
    Wait,
)
from layfigure.session_clock import POINTER_PATIENCE_S

RATE_HZ = synthetic.POSE_HZ


def session(*actions: Action, pointer: int = 0) -> Session:
    return Session("test", (Hand(pointer, actions),))


def play(bus: Bus, server: ScriptedServer, scripted: Session) -> float:
    server.clock = "lockstep"
    server.publish_poses(1)
    return Player(bus, scripted).play(lambda: False, lambda done, whole: None)


def test_schedule_many_short_waits_do_not_add_up_their_rounding() -> None:
    scheduled = schedule(Hand(0, (Wait(0.01),) * 100), RATE_HZ)
    assert scheduled[-1].end == 60


def test_schedule_short_move_takes_at_least_a_tick() -> None:
    scheduled = schedule(Hand(0, (Grab("A"), Move((0, 0, 1), 1e-6), Release())), RATE_HZ)
    assert [(each.start, each.end) for each in scheduled] == [(0, 0), (0, 1), (1, 1)]


@pytest.mark.parametrize("interpolation", ["linear", "minimum-jerk"])
def test_progress_of_both_kinds_start_at_0_and_end_at_1(interpolation: str) -> None:
    values = [progress_of(interpolation, s) for s in np.linspace(0.0, 1.0, 50)]
    assert (values[0], values[-1]) == (0.0, pytest.approx(1.0))
    assert all(a < b for a, b in itertools.pairwise(values))


def test_progress_of_minimum_jerk_starts_and_ends_at_rest() -> None:
    h = 1e-4
    assert progress_of("minimum-jerk", h) / h < 1e-6
    assert (1.0 - progress_of("minimum-jerk", 1.0 - h)) / h < 1e-6
    assert progress_of("minimum-jerk", 0.5) == pytest.approx(0.5)


def test_hand_motion_world_move_brings_the_held_point_there() -> None:
    motion = HandMotion(Hand(0, (Grab("A"), Move((5.0, 5.0, 5.0), 0.5, "world", "linear"), Release())), RATE_HZ)
    motion.grabbed(pointer=np.array([1.0, 0.0, 0.0]), held=np.array([1.5, 0.0, 0.0]))
    scheduled = motion.due(0)[1]
    assert isinstance(scheduled.action, Move)
    motion.begin_move(scheduled, scheduled.action)
    motion.advance(30, 30.0)
    assert motion.position is not None
    np.testing.assert_allclose(motion.position, [4.5, 5.0, 5.0])  # 0.5 short, as it was at the grab


def test_play_lockstep_orders_steps_up_to_each_pose(bus: Bus, server: ScriptedServer) -> None:
    assert play(bus, server, session(Wait(0.1))) == pytest.approx(0.1)
    counts = [int(c.arguments[0].values[0]) for c in server.commands if c.name == "step"]
    assert counts == [17, 17, 16, 17, 17, 16]
    assert (server.steps, server.poses) == (100, 7)


def test_play_lockstep_hand_moves_evenly_though_ticks_differ_in_steps(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Grab("LeftHand"), Move((0.3, 0.0, 0.0), 0.5, "grabbed", "linear"), Release()))
    counts = [int(c.arguments[0].values[0]) for c in server.commands if c.name == "step"]
    positions = np.array([pointer.position[0] for pointer in server.pointers])
    speeds = np.diff(positions)[1:-1] / np.array(counts)[1:-1]  # the last tick ends the move early
    np.testing.assert_allclose(speeds, 0.6e-3, rtol=1e-9)  # [m] a step of 1 ms


def test_play_actions_are_carried_out_in_order(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Key(), Grab("LeftHand"), Wait(1 / 60), Release(), Key()))
    assert server.command_names() == ["get_character", "key", "grab", "step", "release", "key"]


def test_play_grab_sends_the_whole_name_and_only_what_is_given(bus: Bus, server: ScriptedServer) -> None:
    play(
        bus,
        server,
        session(Grab("LeftHand", stiffness=300.0), Release(), Grab("thumb.L", (1, 2, 3), "6dof"), Release()),
    )
    grabs = [{a.name: a.text or list(a.values) for a in c.arguments} for c in server.commands if c.name == "grab"]
    assert grabs == [
        {"pointer": [0.0], "bone": "mixamorig:LeftHand", "mode": "3dof", "stiffness": [300.0]},
        {"pointer": [0.0], "bone": "thumb.L", "mode": "6dof", "point": [1.0, 2.0, 3.0]},
    ]


def test_play_grab_puts_the_pointer_on_the_bone_first(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Grab("LeftHand"), Release()))
    position = synthetic.world_matrices(synthetic.pose_rotations(0.0), synthetic.root_translation(0.0))[2][:3, 3]
    np.testing.assert_allclose(server.pointers[0].position, position, atol=1e-12)


def test_play_move_relative_to_the_grab_ends_where_it_should(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Grab("LeftHand"), Move((0.1, 0.2, 0.3), 0.5), Move((0.0, 0.0, 0.0), 0.25), Release()))
    positions = np.array([pointer.position for pointer in server.pointers])
    assert len(positions) == 1 + 30 + 15
    np.testing.assert_allclose(positions[30] - positions[0], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(positions[-1], positions[0])
    s = np.minimum(np.ceil(np.arange(31) * 1000 / 60) / 500, 1.0)  # poses come after whole steps of 1 ms
    expected = (10 * s**3 - 15 * s**4 + 6 * s**5)[:, None] * [0.1, 0.2, 0.3]
    np.testing.assert_allclose(positions[:31] - positions[0], expected, atol=1e-12)


def test_play_world_move_uses_where_the_server_holds(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Grab("LeftHand"), Move((1.0, 2.0, 4.0), 0.1, "world"), Release()))
    first, last = server.pointers[0].position, server.pointers[-1].position
    np.testing.assert_allclose(np.subtract(last, first), [0.0, 0.0, 1.0])  # the server answers that it holds (1, 2, 3)


def test_play_steps_name_the_pointer_message_they_need(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Wait(1 / 60), Grab("LeftHand"), Wait(2 / 60), Release(), pointer=3))
    needed = [
        list(argument.values)
        for command in server.commands
        if command.name == "step"
        for argument in command.arguments
        if argument.name == "pointer_sequence"
    ]
    assert needed == [[3.0, 2.0], [3.0, 3.0]]
    assert [pointer.sequence for pointer in server.pointers] == [1, 2, 3]


def test_play_two_hands_move_at_the_same_time(bus: Bus, server: ScriptedServer) -> None:
    actions = (Grab("LeftHand"), Move((0.0, 0.0, 0.1), 0.5), Release())
    play(bus, server, Session("two", (Hand(0, actions), Hand(1, (Grab("LeftArm"), *actions[1:])))))
    assert [c.name for c in server.commands].count("step") == 30
    assert [p.pointer for p in server.pointers[2:]] == [0, 1] * 30


def test_play_refused_grab_says_which_hand_and_when(bus: Bus, server: ScriptedServer) -> None:
    server.refusals["grab"] = "bone 'thumb.L' has no body"
    with pytest.raises(LayfigureError, match=r"hand with pointer 0 at 0\.50 s: bone 'thumb\.L' has no body"):
        play(bus, server, session(Wait(0.5), Grab("thumb.L"), Release()))


def test_play_asks_again_for_the_first_pose_when_it_is_lost(bus: Bus, server: ScriptedServer) -> None:
    server.lost_answers = 2
    assert play(bus, server, session(Wait(1 / 60))) == pytest.approx(1 / 60)
    assert server.command_names() == [*["get_character"] * 3, "step"]


def test_play_refused_step_is_tried_again_then_given_up_and_lets_go(bus: Bus, server: ScriptedServer) -> None:
    server.refusals["step"] = "pointer 0: message 2 has not arrived; send it again"
    with pytest.raises(RefusedError, match="has not arrived"):
        play(bus, server, session(Grab("LeftHand"), Wait(1.0), Release()))
    assert server.command_names() == ["get_character", "grab", *["step"] * len(POINTER_PATIENCE_S), "release"]
    assert len(server.pointers) == 1 + len(POINTER_PATIENCE_S)


def test_play_stopped_early_lets_go(bus: Bus, server: ScriptedServer) -> None:
    server.clock = "lockstep"
    server.publish_poses(1)
    player = Player(bus, session(Grab("LeftHand"), Wait(10.0), Release()))
    played = player.play(lambda: server.steps >= 100, lambda done, whole: None)
    assert played == pytest.approx(0.1)
    assert server.command_names()[-1] == "release"


def test_play_restarted_server_is_noticed(bus: Bus, server: ScriptedServer) -> None:
    def restart(done: float, whole: float) -> None:
        server.server_id = 77

    server.clock = "lockstep"
    server.publish_poses(1)
    with pytest.raises(LayfigureError, match="restarted in the middle"):
        Player(bus, session(Wait(1.0))).play(lambda: False, restart)


def test_play_realtime_sends_pointers_and_no_steps(bus: Bus, server: ScriptedServer) -> None:
    server.publish_poses(1)
    played = Player(bus, session(Grab("LeftHand"), Wait(0.2), Release())).play(lambda: False, lambda done, whole: None)
    assert played == pytest.approx(0.2)
    assert server.command_names() == ["get_character", "grab", "release"]
    assert len(server.pointers) == 1 + 12


def test_play_progress_reaches_the_whole_time(bus: Bus, server: ScriptedServer) -> None:
    seen: list[tuple[float, float]] = []
    server.clock = "lockstep"
    server.publish_poses(1)
    Player(bus, session(Wait(0.5))).play(lambda: False, lambda done, whole: seen.append((done, whole)))
    assert len(seen) == 30
    assert seen[-1] == (pytest.approx(0.5), pytest.approx(0.5))
    assert not math.isnan(seen[0][0])


def test_resolve_bones_unknown_name_suggests_similar_ones() -> None:
    character = codec.decode_character(synthetic.character_message().encode())
    with pytest.raises(LayfigureError, match=r"no bone 'LeftHnd'; similar: mixamorig:LeftHand"):
        resolve_bones(character, session(Grab("LeftHnd"), Release()))


def test_resolve_bones_ambiguous_name_is_refused() -> None:
    message = synthetic.character_message()
    message.joints[3].name = "other:LeftHand"
    character = codec.decode_character(message.encode())
    with pytest.raises(LayfigureError, match="could be mixamorig:LeftHand, other:LeftHand"):
        resolve_bones(character, session(Grab("LeftHand"), Release()))
    assert resolve_bones(character, session(Grab("other:LeftHand"), Release())) == {"other:LeftHand": 3}


def given(command: object) -> dict[str, object]:
    return {argument.name: argument.text or tuple(argument.values) for argument in command.arguments}


def sent(server: ScriptedServer, name: str) -> list[dict[str, object]]:
    return [given(command) for command in server.commands if command.name == name]


def test_play_touch_sends_the_pointer_before_the_fingertip_comes_out(bus: Bus, server: ScriptedServer) -> None:
    touch = Touch("LeftHand", (0.0, 0.1, 0.0), fingertip=Fingertip(radius=0.01, magnet=True))
    play(bus, server, session(touch, Move((0.0, -0.05, 0.0), 0.1, "grabbed", "linear"), Magnet(False), Release()))
    assert sent(server, "touch") == [{"pointer": (0.0,), "radius": (0.01,), "magnet": (1.0,)}]
    first, last = server.pointers[0].position, server.pointers[-1].position
    np.testing.assert_allclose(np.array(last) - np.array(first), [0.0, -0.05, 0.0], atol=1e-12)
    assert {"pointer": (0.0,), "magnet": (0.0,)} in sent(server, "set")
    assert sent(server, "release") == [{"pointer": (0.0,)}]


def test_play_pinch_closes_two_pointers_and_moves_both(bus: Bus, server: ScriptedServer) -> None:
    pinch = Pinch("LeftHand", 2, (0.0, 2.0, 0.0), width=0.1, close=0.04, duration_s=0.1)
    play(bus, server, session(pinch, Move((0.0, 0.0, 0.2), 0.1), Release()))
    assert [command["pointer"] for command in sent(server, "touch")] == [(0.0,), (2.0,)]
    paths = {number: np.array([p.position for p in server.pointers if p.pointer == number]) for number in (0, 2)}
    apart = paths[0] - paths[2]
    np.testing.assert_allclose(apart[0], [0.0, 0.1, 0.0], atol=1e-12)
    np.testing.assert_allclose(apart[-1], [0.0, 0.04, 0.0], atol=1e-12)
    middle = 0.5 * (paths[0] + paths[2])
    np.testing.assert_allclose(middle[-1] - middle[0], [0.0, 0.0, 0.2], atol=1e-12)
    assert [command["pointer"] for command in sent(server, "release")] == [(0.0,), (2.0,)]


def test_play_pins_are_unpinned_by_their_numbers(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Pin("LeftHand"), Pin("LeftHand", hold="rigid"), Unpin("LeftHand"), Unpin(None)))
    assert [command["hold"] for command in sent(server, "pin")] == ["stiff", "rigid"]
    assert sent(server, "unpin") == [{"pin": (7.0,)}, {"pin": (7.0,)}, {}]


def test_play_softness_names_the_bone(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Softness(0.5), Softness(0.25, "LeftHand"), Wait(0.1)))
    plain, of_bone = sent(server, "set")
    assert plain == {"softness": (0.5,)}
    assert of_bone["softness"] == (0.25,)
    assert str(of_bone["bone"]).endswith("LeftHand")


def test_play_without_scale_or_fingertips_sets_nothing(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Grab("LeftHand"), Wait(0.1), Release()))
    assert "set" not in server.command_names()


def test_play_scale_and_clutch_are_undone_at_the_end(bus: Bus, server: ScriptedServer) -> None:
    play(bus, server, session(Scale(2.0), Grab("LeftHand"), Clutch(True), Clutch(False), Release()))
    settings = sent(server, "set")
    assert [s["scale"] for s in settings if "scale" in s] == [(1.0,), (2.0,), (1.0,)]
    assert [s["clutch"] for s in settings if "clutch" in s] == [(0.0,), (1.0,), (0.0,), (0.0,)]
    assert "base" in settings[-1]


@pytest.mark.parametrize("action", [Scale(2.0), Clutch(True)])
def test_play_scale_or_clutch_of_a_devices_pointer_is_refused(bus: Bus, server: ScriptedServer, action: Action) -> None:
    server.devices = {0: "SPIDAR-G6X3 (simulated)"}
    with pytest.raises(LayfigureError, match=r"pointer 0 is moved by a device, SPIDAR-G6X3 \(simulated\)"):
        play(bus, server, session(Grab("LeftHand"), action, Release()))
    assert not any({"scale", "clutch", "base"} & settings.keys() for settings in sent(server, "set"))
    assert server.command_names().count("release") == 1, "the hand lets go"


def test_play_scale_of_another_pointer_than_the_devices_is_set(bus: Bus, server: ScriptedServer) -> None:
    server.devices = {1: "SPIDAR-G6X3 (simulated)"}
    play(bus, server, session(Scale(2.0), Grab("LeftHand"), Release()))
    assert (2.0,) in [settings.get("scale") for settings in sent(server, "set")]


def test_play_failure_puts_both_fingertips_away(bus: Bus, server: ScriptedServer) -> None:
    server.refusals["key"] = "no"
    pinch = Pinch("LeftHand", 2, (0.0, 1.0, 0.0), width=0.1, close=0.04, duration_s=0.1)
    with pytest.raises(LayfigureError):
        play(bus, server, session(pinch, Key(), Release()))
    assert [command["pointer"] for command in sent(server, "release")] == [(0.0,), (2.0,)]


def test_hand_motion_world_move_with_a_scale_brings_the_held_point_there() -> None:
    motion = HandMotion(Hand(0, (Grab("A"), Move((5.0, 5.0, 5.0), 0.5, "world", "linear"), Release())), RATE_HZ)
    hand_map = motion.maps[0]
    hand_map.sent(np.array([1.0, 0.0, 0.0]))
    motion.grabbed(pointer=np.array([1.0, 0.0, 0.0]), held=np.array([1.5, 0.0, 0.0]))
    hand_map.set_scale(2.0)
    scheduled = motion.due(0)[1]
    assert isinstance(scheduled.action, Move)
    motion.begin_move(scheduled, scheduled.action)
    motion.advance(30, 30.0)
    assert motion.position is not None
    np.testing.assert_allclose(hand_map.to_world(motion.position), [4.5, 5.0, 5.0])
