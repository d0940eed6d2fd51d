"""One hold of the mouse, on a link that a test answers by itself: what is sent, in which order, and how it ends."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from blender_support.views import front_view, shifted
from layfigure_blender.grab import HOLD_AFTER_S, MOST_POINTERS, SOFT, TURNING, Grab, Outcome, Phase, free_pointer
from layfigure_blender.pins import PinList

from layfigure import Argument, BusError, Device, Force, NoReplyError, ProtocolError, RefusedError, Reply, rotation

VIEW = front_view()
HELD = np.array([0.2, 0.0, 1.1])
MOUSE = VIEW.pixels(HELD)
POINTER = np.array([5.0, 6.0, 7.0, 0.6, 0.8, 0.0, 0.0])  # where an earlier grab has left it
NEAR = 1e-9
BONE = {"bone": "hand.L", "point": [0.0, 0.1, 0.0]}
RAY = {"origin": [0.0, -4.0, 1.0], "direction": [0.0, 1.0, 0.0]}


@dataclass
class Command:
    name: str
    arguments: dict[str, Any]
    future: Future[Reply] = field(default_factory=Future)

    def accept(self, **results: Any) -> None:
        values = tuple(Argument(name, values=tuple(np.ravel(value))) for name, value in results.items())
        self.future.set_result(Reply(0, 1, "client", 1, True, "", values))

    def refuse(self, reason: str) -> None:
        self.future.set_exception(RefusedError(reason))


@dataclass
class Joint:
    name: str
    stiffness: float


@dataclass
class Character:
    joints: list[Joint]


class FakeLink:
    """Takes note of what is sent; the test answers."""

    def __init__(self) -> None:
        self.state, self.message = "live", ""
        self.forces: dict[int, Force] = {}
        self.status = None
        self.character = Character([Joint("hips", 0.0), Joint("hand.L", 0.5)])
        self.commands: list[Command] = []
        self.places: list[tuple[int, np.ndarray, np.ndarray]] = []

    def send(self, name: str, /, **arguments: Any) -> Future[Reply]:
        self.commands.append(Command(name, arguments))
        return self.commands[-1].future

    def move_pointer(self, pointer: int, position: np.ndarray, rotation: np.ndarray) -> None:
        self.places.append((pointer, np.array(position), np.array(rotation)))

    def unanswered(self, name: str) -> Command:
        return next(c for c in self.commands if c.name == name and not c.future.done())

    @property
    def names(self) -> list[str]:
        return [command.name for command in self.commands]


@pytest.fixture
def link() -> FakeLink:
    return FakeLink()


def press(link: FakeLink, *ways: dict[str, Any]) -> Grab:
    return Grab(link, PinList(link), 9, ways or (BONE,), MOUSE, 10.0, click_radius=3.0)


def answer_grab(link: FakeLink, grab: Grab) -> None:
    link.unanswered("history").accept(place=[4])
    link.unanswered("pin").accept(pin=[], joint=[], position=[])
    link.unanswered("grab").accept(joint=[1], position=HELD, point=[0.0, 0.1, 0.0], pointer=POINTER)
    grab.poll(10.1)


def holding(link: FakeLink) -> Grab:
    """Held by a motion of 10 pixels to the right and back."""
    grab = press(link)
    grab.mouse(VIEW, shifted(MOUSE, 10.0, 0.0))
    grab.mouse(VIEW, MOUSE)
    answer_grab(link, grab)
    assert grab.phase is Phase.HOLDING
    return grab


def force(attached: bool) -> Force:
    zero = np.zeros(3)
    return Force(0, 1, 0, 9, "grab" if attached else "none", attached, attached, 1, zero, zero, *[zero] * 4)


GRABBED = {"joint": [1], "position": HELD, "point": [0.0, 0.1, 0.0], "pointer": POINTER}


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        *(({name: value for name, value in GRABBED.items() if name != left}, f"'{left}'") for left in GRABBED),
        ({**GRABBED, "pointer": POINTER[:3]}, "3 numbers of 'pointer', expected 7"),
        ({**GRABBED, "joint": [2]}, "joint 2 is held, expected 0 to 1"),
    ],
)
def test_answer_that_is_not_understood_ends_it_with_a_line(link: FakeLink, answer: dict[str, Any], told: str) -> None:
    grab = press(link)
    grab.mouse(VIEW, shifted(MOUSE, 10.0, 0.0))
    link.unanswered("history").accept(place=[4])
    link.unanswered("grab").accept(**answer)
    grab.poll(10.1)
    assert (grab.phase, grab.outcome) == (Phase.ENDED, Outcome.LOST)
    assert told in grab.note
    assert "\n" not in grab.note
    assert link.names[-1] == "release"
    grab.mouse(VIEW, MOUSE)
    grab.release()
    assert link.places == []


@pytest.mark.parametrize("error", [ProtocolError("of another version"), NoReplyError("no answer within 2 s")])
def test_no_answer_to_a_grab_ends_it_with_a_line(link: FakeLink, error: Exception) -> None:
    grab = press(link)
    grab.mouse(VIEW, shifted(MOUSE, 10.0, 0.0))
    link.unanswered("history").future.set_exception(error)
    link.unanswered("grab").future.set_exception(error)
    grab.poll(10.1)
    assert (grab.outcome, grab.note) == (Outcome.LOST, str(error))
    assert link.names[-1] == "release"


def test_pins_that_are_told_otherwise_are_none(link: FakeLink) -> None:
    pins = PinList(link)
    pins.ask()
    link.unanswered("pin").accept(pin=[1, 2], joint=[0])
    assert pins.known == ()


# --- pressing -------------------------------------------------------------------------------------------------------


def test_click_sends_nothing(link: FakeLink) -> None:
    grab = press(link)
    grab.mouse(VIEW, shifted(MOUSE, 1.0, 2.0))
    grab.poll(10.0 + 0.5 * HOLD_AFTER_S)
    grab.release()
    assert (grab.phase, grab.outcome) == (Phase.ENDED, Outcome.CLICKED)
    assert link.commands == []
    assert link.places == []


def test_cancelled_before_it_moves_sends_nothing(link: FakeLink) -> None:
    grab = press(link)
    grab.cancel()
    assert grab.outcome is Outcome.CANCELLED
    assert link.commands == []


def test_button_that_stays_down_takes_hold(link: FakeLink) -> None:
    grab = press(link)
    grab.poll(10.0 + HOLD_AFTER_S)
    assert link.names == ["history", "pin", "grab"]
    assert link.commands[2].arguments == {"pointer": 9, **BONE}


@pytest.mark.parametrize("action", ["pin", "unpin", "unpin_all", "soften"])
def test_key_takes_hold(link: FakeLink, action: str) -> None:
    getattr(press(link), action)()
    assert link.names == ["history", "pin", "grab"]


def test_second_way_is_tried_when_the_first_is_refused_and_then_it_missed(link: FakeLink) -> None:
    grab = press(link, RAY, BONE)
    grab.mouse(VIEW, shifted(MOUSE, 10.0, 0.0))
    link.unanswered("grab").refuse("the ray meets no skin")
    grab.poll(10.1)
    assert link.commands[-1].arguments == {"pointer": 9, **BONE}
    link.unanswered("grab").refuse("bone 'hand.L' cannot be held")
    grab.poll(10.2)
    assert (grab.outcome, grab.note) == (Outcome.MISSED, "bone 'hand.L' cannot be held")
    assert link.places == []


# --- holding --------------------------------------------------------------------------------------------------------


def test_what_came_before_the_answer_is_done_after_it(link: FakeLink) -> None:
    grab = press(link)
    grab.mouse(VIEW, shifted(MOUSE, 30.0, 0.0))
    grab.mouse(VIEW, shifted(MOUSE, 50.0, -20.0))
    grab.pin()
    assert link.places == []
    answer_grab(link, grab)
    assert grab.target is not None
    np.testing.assert_allclose(VIEW.pixels(grab.target), shifted(MOUSE, 50.0, -20.0), atol=1e-6)
    assert link.unanswered("pin").arguments == {
        "bone": "hand.L",
        "point": pytest.approx([0.0, 0.1, 0.0]),
        "mode": "3dof",
    }


def test_pointer_keeps_the_distance_from_the_held_point_that_it_had(link: FakeLink) -> None:
    grab = holding(link)
    grab.mouse(VIEW, shifted(MOUSE, 40.0, 30.0))
    pointer, position, turned = link.places[-1]
    assert pointer == 9
    np.testing.assert_allclose(position - POINTER[:3], [0.2, 0.0, 0.15], atol=NEAR)  # 1 px is 5 mm there
    np.testing.assert_allclose(turned, POINTER[3:], atol=NEAR)


def test_wheel_moves_in_depth(link: FakeLink) -> None:
    grab = holding(link)
    grab.wheel(VIEW, 1.0)
    assert link.places[-1][1][1] - POINTER[1] == pytest.approx(0.05 * 4.0)


def test_turning_holds_the_rotation_from_then_on(link: FakeLink) -> None:
    grab = holding(link)
    grab.mouse(VIEW, shifted(MOUSE, 20.0, 0.0), turn=True)
    grab.mouse(VIEW, shifted(MOUSE, 30.0, 0.0), turn=True)
    assert [c.arguments for c in link.commands if c.name == "set"] == [
        {"pointer": 9, "mode": "6dof", "angular_stiffness": TURNING * 0.5}
    ]
    assert grab.holds_rotation
    _, position, turned = link.places[-1]
    np.testing.assert_allclose(position, POINTER[:3], atol=NEAR)
    turn = rotation.multiply(turned, rotation.conjugate(POINTER[3:]))
    np.testing.assert_allclose(rotation.to_vector(turn), [0.0, 0.0, 0.3], atol=NEAR)
    grab.pin()
    assert link.unanswered("pin").arguments["mode"] == "6dof"


def test_pin_again_pins_where_it_is_now_and_unpin_takes_those_of_the_bone(link: FakeLink) -> None:
    grab = holding(link)
    grab.pin()
    made, listed = link.commands[-2:]
    made.accept(pin=[7], joint=[1], position=HELD)
    listed.accept(pin=[3, 7], joint=[0, 1], position=[*HELD, *HELD])
    assert grab.pinned
    grab.pin()
    assert link.names[-3:] == ["unpin", "pin", "pin"]
    assert link.commands[-3].arguments == {"pin": 7}
    link.commands[-1].accept(pin=[3, 8], joint=[0, 1], position=[*HELD, *HELD])
    grab.unpin()
    assert link.names[-2:] == ["unpin", "pin"]
    assert link.commands[-2].arguments == {"pin": 8}
    link.commands[-1].accept(pin=[3], joint=[0], position=HELD)
    assert not grab.pinned
    grab.unpin_all()
    assert link.commands[-2].arguments == {}


def test_soften_toggles_and_letting_go_makes_firm_again(link: FakeLink) -> None:
    grab = holding(link)
    grab.soften()
    grab.soften()
    grab.soften()
    assert [c.arguments["softness"] for c in link.commands if c.name == "set"] == [SOFT, 1.0, SOFT]
    grab.release()
    assert link.names[-2:] == ["release", "set"]
    assert link.commands[-1].arguments == {"softness": 1.0}


def test_refused_key_is_told_and_the_hold_goes_on(link: FakeLink) -> None:
    grab = holding(link)
    grab.pin()
    link.commands[-2].refuse("no body carries the bone")
    grab.poll(10.3)
    assert grab.note == "no body carries the bone"
    assert grab.phase is Phase.HOLDING


# --- the end --------------------------------------------------------------------------------------------------------


def test_release_ends_when_the_server_has_let_go(link: FakeLink) -> None:
    grab = holding(link)
    grab.release()
    assert link.unanswered("release").arguments == {"pointer": 9}
    grab.poll(10.3)
    assert grab.phase is Phase.LETTING_GO
    grab.mouse(VIEW, shifted(MOUSE, 500.0, 0.0))
    places = len(link.places)
    link.unanswered("release").accept()
    grab.poll(10.4)
    assert (grab.phase, grab.outcome, grab.note) == (Phase.ENDED, Outcome.RELEASED, "")
    assert len(link.places) == places


def test_release_before_the_answer_lets_go_after_it(link: FakeLink) -> None:
    grab = press(link)
    grab.mouse(VIEW, shifted(MOUSE, 30.0, 0.0))
    grab.release()
    assert "release" not in link.names
    answer_grab(link, grab)
    assert link.names[-1] == "release"
    assert len(link.places) == 1


def test_cancel_goes_back_to_the_place_before_the_grab(link: FakeLink) -> None:
    grab = holding(link)
    grab.pin()
    grab.cancel()
    go = link.unanswered("history")
    assert go.arguments == {"action": "go", "place": (4.0,)}
    go.accept(place=[4], released=[9])
    grab.poll(10.3)
    assert grab.outcome is Outcome.CANCELLED
    assert "release" not in link.names


def test_cancel_of_a_grab_that_was_no_step_of_its_own_lets_go(link: FakeLink) -> None:
    """Another hand took hold right before: the place is the same, and nothing was put away."""
    grab = holding(link)
    grab.cancel()
    link.unanswered("history").accept(place=[4])
    grab.poll(10.3)
    assert grab.outcome is Outcome.CANCELLED
    assert link.names[-1] == "release"


def test_cancel_to_a_forgotten_place_lets_go_and_says_why(link: FakeLink) -> None:
    grab = holding(link)
    grab.cancel()
    link.unanswered("history").refuse("the history has no place 4")
    grab.poll(10.3)
    assert (grab.outcome, grab.note) == (Outcome.RELEASED, "the history has no place 4")
    assert link.names[-1] == "release"


@pytest.mark.parametrize("state", ["lost", "refused", "closed", "connecting"])
@pytest.mark.parametrize("phase", [Phase.PRESSED, Phase.ASKED, Phase.HOLDING, Phase.LETTING_GO])
def test_lost_server_ends_it_with_the_links_message(link: FakeLink, phase: Phase, state: str) -> None:
    grab = press(link) if phase in (Phase.PRESSED, Phase.ASKED) else holding(link)
    if phase is Phase.ASKED:
        grab.wheel(VIEW, 1.0)
    if phase is Phase.LETTING_GO:
        grab.release()
    assert grab.phase is phase
    link.state, link.message = state, "the server is gone"
    grab.poll(10.3)
    assert (grab.phase, grab.outcome, grab.note) == (Phase.ENDED, Outcome.LOST, "the server is gone")
    sent, places = len(link.commands), len(link.places)
    for late in (grab.release, grab.cancel, grab.pin, grab.soften, lambda: grab.mouse(VIEW, MOUSE)):
        late()
    grab.poll(10.4)
    assert (len(link.commands), len(link.places)) == (sent, places)


def test_answer_that_never_comes_ends_it(link: FakeLink) -> None:
    grab = press(link)
    grab.wheel(VIEW, 1.0)
    link.unanswered("grab").future.set_exception(BusError("lost the connection"))
    grab.poll(10.3)
    assert (grab.outcome, grab.note) == (Outcome.LOST, "lost the connection")


def test_what_another_program_takes_out_of_the_hand_ends_it(link: FakeLink) -> None:
    grab = holding(link)
    link.forces[9] = force(False)  # of before
    grab.poll(10.3)
    link.forces[9] = force(True)
    grab.poll(10.4)
    assert grab.phase is Phase.HOLDING
    link.forces[9] = force(False)
    grab.poll(10.5)
    assert grab.outcome is Outcome.RELEASED
    assert "let go" in grab.note


# --- pointers -------------------------------------------------------------------------------------------------------


def test_free_pointer_is_the_highest_that_neither_a_device_nor_a_hand_has(link: FakeLink) -> None:
    @dataclass
    class Status:
        devices: tuple[Device, ...]

    device = Device("spidar-g6", 15, "ok", "", 0, 1.0, 0.0, 0.0, 0.0, 1e3, 1e3, 0, 1.0, 1.0, 1.0, False)
    assert free_pointer(None, {}) == MOST_POINTERS - 1
    assert free_pointer(Status((device,)), {14: force(True), 13: force(False)}) == 13  # type: ignore[arg-type]
    assert free_pointer(None, {number: force(True) for number in range(MOST_POINTERS)}) is None
