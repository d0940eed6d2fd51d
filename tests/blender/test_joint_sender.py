"""How joint settings reach a live doll, without Blender: against a scripted link, and the real server."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from layfigure_blender.joint_sender import MOST_IN_FLIGHT, JointSender
from layfigure_blender.joint_settings import (
    AXES,
    LAWS,
    LAWS_OF_AXES,
    LIMIT_AXES,
    USUAL_MIRROR,
    Amount,
    JointSettings,
    MirrorRule,
    mirrored,
)
from layfigure_blender.joint_values import DollValues, JointValues, Law, Placed, asked, changes, mirror_rule, replied
from server_support.process import ServerProcess

import layfigure
from layfigure import Argument, NoReplyError, RefusedError, Reply

STIFF = JointSettings(laws={"stiffness": Amount(2.0, is_factor=True)})


def reply(**values: Any) -> Reply:
    results = tuple(Argument(name.replace("__", "."), values=tuple(map(float, v))) for name, v in values.items())
    return Reply(0, 0, "test", 0, True, "", results)


def joints_reply(count: int) -> Reply:
    values: dict[str, Any] = {"joints": range(count)}
    values |= {name: [1.0 + k for k in range(count)] for name in LAWS}
    values |= {f"{name}__ratios": [1.0, 2.0, 3.0] * count for name in LAWS_OF_AXES}
    values |= {f"limits__{axis}": [-math.inf, 0.5] * count for axis in LIMIT_AXES}
    values |= {"locked": [0, 1, 0] * count, "section_axes": [1, 0, 0, 0] * count, "limit_axes": [1, 0, 0, 0] * count}
    return reply(**values)


class ScriptedLink:
    """Keeps commands until the test answers them."""

    def __init__(self, count: int = 1) -> None:
        self.sent: list[tuple[str, dict[str, Any], Future[Reply]]] = []
        self.count = count

    def send(self, name: str, /, **arguments: Any) -> Future[Reply]:
        future: Future[Reply] = Future()
        self.sent.append((name, arguments, future))
        return future

    def take(self) -> list[tuple[str, dict[str, Any], Future[Reply]]]:
        taken, self.sent = self.sent, []
        return taken

    def tell_joints(self) -> None:
        """Answers get_joints, which must be all that was sent."""
        for name, _, future in self.take():
            assert name == "get_joints"
            future.set_result(joints_reply(self.count))


def ready_sender(link: ScriptedLink) -> JointSender:
    sender = JointSender(link, {k: f"b{k}" for k in range(link.count)})
    assert not sender.is_ready
    link.tell_joints()
    assert sender.update({})
    assert sender.is_ready
    return sender


# --- a scripted link -------------------------------------------------------------------------------------------------


def test_nothing_is_sent_for_joints_of_which_nothing_is_asked() -> None:
    link = ScriptedLink(3)
    sender = ready_sender(link)
    sender.update({})
    assert link.sent == []
    assert sender.is_idle
    assert sender.own is not None
    assert sender.own.joints["b1"].laws["stiffness"] == Law(2.0, (1.0, 2.0, 3.0))
    assert sender.own.joints["b1"].limits["twist"] == (-math.pi, 0.5)
    assert sender.own.joints["b1"].locked == {"bend_y"}


def test_one_command_is_under_way_and_then_the_newest_follows() -> None:
    link = ScriptedLink()
    sender = ready_sender(link)
    for k in range(1, 10):
        sender.update({"b0": JointSettings(laws={"hardening": Amount(float(k))})})
    ((name, arguments, future),) = link.take()
    assert (name, arguments) == ("set", {"bone": "b0", "hardening": 2.0})  # 1 is its own
    future.set_result(reply())
    sender.update({"b0": JointSettings(laws={"hardening": Amount(9.0)})})
    ((_, arguments, future),) = link.take()
    assert arguments == {"bone": "b0", "hardening": 9.0}
    future.set_result(reply())
    sender.update({"b0": JointSettings(laws={"hardening": Amount(9.0)})})
    assert link.sent == []
    assert sender.is_idle


def test_what_is_taken_back_is_the_dolls_own_again_once() -> None:
    link = ScriptedLink()
    sender = ready_sender(link)
    sender.update({"b0": STIFF})
    link.take()[0][2].set_result(reply())
    sender.update({})
    ((_, arguments, future),) = link.take()
    assert arguments == {"bone": "b0", "stiffness": 1.0}
    future.set_result(reply())
    for _ in range(3):
        sender.update({})
    assert link.sent == []


def test_a_refused_wish_is_kept_with_its_reason_and_not_sent_again() -> None:
    link = ScriptedLink()
    sender = ready_sender(link)
    sender.update({"b0": STIFF})
    link.take()[0][2].set_exception(RefusedError("too stiff"))
    assert sender.update({"b0": STIFF})
    assert sender.refusal("b0") == "too stiff"
    link.tell_joints()
    for _ in range(3):
        sender.update({"b0": STIFF})
    assert link.sent == []
    other = JointSettings(laws={"stiffness": Amount(3.0)})
    assert sender.update({"b0": other})
    assert sender.refusal("b0") == ""
    assert link.take()[0][1] == {"bone": "b0", "stiffness": 3.0}


def test_what_is_not_to_blame_for_a_refusal_is_done() -> None:
    link = ScriptedLink()
    sender = ready_sender(link)
    wish = JointSettings(STIFF.laws, {"twist": (-10.0, 10.0)}, frozenset({"twist"}))
    sender.update({"b0": wish})
    (_, _, together), (unlock, _, unlocked), (lock, axes, locked) = link.take()
    assert (unlock, lock, axes["axes"]) == ("unlock", "lock", "twist")
    together.set_exception(RefusedError("no"))
    unlocked.set_result(reply())
    locked.set_result(reply())
    sender.update({"b0": wish})
    (_, stiff, first), (_, limits, second) = link.take()
    assert "stiffness" in stiff
    assert "limits.twist" in limits
    first.set_result(reply())
    second.set_exception(RefusedError("limits.twist is bad"))
    sender.update({"b0": wish})
    assert sender.refusal("b0") == "limits.twist is bad"
    assert [name for name, _, _ in link.take()] == ["get_joints"]


def test_a_lost_reply_is_no_refusal_and_the_wish_is_sent_again() -> None:
    link = ScriptedLink()
    sender = ready_sender(link)
    sender.update({"b0": STIFF})
    link.take()[0][2].set_exception(NoReplyError("no server answered"))
    sender.update({"b0": STIFF})
    assert sender.refusal("b0") == ""
    sender.update({"b0": STIFF})
    link.tell_joints()
    sender.update({"b0": STIFF})
    assert link.take()[0][1]["stiffness"] == 2.0


def test_an_old_server_is_told_of_and_not_asked_again() -> None:
    link = ScriptedLink()
    sender = JointSender(link, {0: "b0"})
    for _, _, future in link.take():
        future.set_exception(RefusedError("unknown command 'get_joints'"))
    for _ in range(3):
        sender.update({"b0": STIFF})
    assert "unknown command 'get_joints'" in sender.trouble
    assert link.sent == []


def test_a_link_that_is_lost_at_first_is_asked_again() -> None:
    link = ScriptedLink()
    sender = JointSender(link, {0: "b0"})
    for _, _, future in link.take():
        future.set_exception(NoReplyError("no server answered"))
    sender.update({"b0": STIFF})
    assert sender.trouble
    link.tell_joints()
    sender.update({"b0": STIFF})
    assert not sender.trouble
    assert link.take()[0][0] == "set"


def test_after_undo_the_joints_are_looked_at_again_and_are_as_asked() -> None:
    link = ScriptedLink()
    sender = ready_sender(link)
    sender.update({"b0": STIFF})
    link.take()[0][2].set_result(reply())
    sender.update({"b0": STIFF})
    sender.look_again()
    link.tell_joints()  # the server undid the set
    sender.update({"b0": STIFF})
    assert link.take()[0][1] == {"bone": "b0", "stiffness": 2.0}


def test_what_is_newly_chosen_reaches_joints_that_were_as_chosen() -> None:
    link = ScriptedLink(2)
    sender = ready_sender(link)
    assert sender.own is not None
    soft = {bone: asked(own, JointSettings(laws={"damping": Amount(0.5)})) for bone, own in sender.own.joints.items()}
    sender.choose(DollValues(soft))
    sender.update({})
    commands = link.take()
    assert [arguments["bone"] for _, arguments, _ in commands] == ["b0", "b1"]
    for _, arguments, future in commands:
        assert arguments["damping"] == 0.5
        future.set_result(reply())
    sender.update({})
    assert sender.is_idle
    assert link.sent == []


def test_many_bones_are_sent_a_few_at_a_time() -> None:
    link = ScriptedLink(3 * MOST_IN_FLIGHT)
    sender = ready_sender(link)
    wishes = {f"b{k}": STIFF for k in range(link.count)}
    sent = set()
    for _ in range(10):
        sender.update(wishes)
        commands = link.take()
        assert len(commands) <= MOST_IN_FLIGHT
        for _, arguments, future in commands:
            assert arguments["bone"] not in sent
            sent.add(arguments["bone"])
            future.set_result(reply())
    assert sent == set(wishes)


@pytest.mark.parametrize("missing", ["stiffness", "limits.twist", "locked"])
def test_a_reply_without_all_numbers_is_refused(missing: str) -> None:
    whole = joints_reply(2)
    short = [Argument(r.name, values=r.values[:-1]) if r.name == missing else r for r in whole.results]
    with pytest.raises(layfigure.ProtocolError, match=missing):
        replied(Reply(0, 0, "test", 0, True, "", tuple(short)), {0: "a", 1: "b"})


# --- frames of the other side ----------------------------------------------------------------------------------------


def placed(x: float, limit_axes: np.ndarray, section_axes: np.ndarray) -> Placed:
    from layfigure.rotation import from_matrix

    values = JointValues(
        laws={},
        limits={},
        limit_axes=tuple(from_matrix(limit_axes)),
        section_axes=tuple(from_matrix(section_axes)),
    )
    return Placed(values, (x, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))


def test_mirror_rule_follows_the_axes() -> None:
    down = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])  # x down, y along y, z along x
    image = np.diag([-1.0, 1.0, 1.0]) @ down @ np.diag([1.0, -1.0, 1.0])
    turned = image @ np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # y where z was
    same = placed(0.1, down, down)
    assert mirror_rule(same, placed(-0.1, image, image)) == USUAL_MIRROR
    assert mirror_rule(same, placed(-0.1, image, turned)) == MirrorRule(
        USUAL_MIRROR.limits, ("twist", "bend_z", "bend_y")
    )
    rule = mirror_rule(same, placed(-0.1, turned, image))
    assert [axis for axis, _ in rule.limits] == ["twist", "swing_z", "swing_y"]
    skew = image @ np.array([[1.0, 0.0, 0.0], [0.0, 0.8, -0.6], [0.0, 0.6, 0.8]])
    assert mirror_rule(same, placed(-0.1, skew, skew)) == USUAL_MIRROR
    assert mirror_rule(same, placed(0.1, image, image)) == USUAL_MIRROR


# --- the real server -------------------------------------------------------------------------------------------------


class DirectLink:
    """A link that waits for each answer."""

    def __init__(self, doll: layfigure.Doll) -> None:
        self._doll = doll
        self.sent: list[str] = []

    def send(self, name: str, /, **arguments: Any) -> Future[Reply]:
        self.sent.append(name)
        future: Future[Reply] = Future()
        try:
            future.set_result(self._doll.command(name, **arguments))
        except layfigure.LayfigureError as error:
            future.set_exception(error)
        return future


@pytest.fixture
def doll(binary: Path, character: Path) -> Iterator[layfigure.Doll]:
    command = [binary, character, "--clock", "lockstep", "--broker", "0"]
    with ServerProcess(list(map(str, command))) as server, layfigure.connect(server.url) as connected:
        yield connected


def sender_for(doll: layfigure.Doll) -> tuple[JointSender, DirectLink]:
    link = DirectLink(doll)
    return JointSender(link, names_of(doll)), link


def names_of(doll: layfigure.Doll) -> dict[int, str]:
    return {index: joint.name for index, joint in enumerate(doll.character.joints)}


def settle(sender: JointSender, wishes: Mapping[str, JointSettings]) -> None:
    for _ in range(10):
        sender.update(wishes)
    assert sender.is_idle, sender.trouble


def now(doll: layfigure.Doll) -> dict[str, JointValues]:
    return replied(doll.command("get_joints"), names_of(doll))


WISHES = {
    "whole": JointSettings(laws={name: Amount(1.5, is_factor=True) for name in LAWS}),
    "value": JointSettings(laws={"damping": Amount(0.01), "yield_torque": Amount(math.inf)}),
    "axes": JointSettings(laws={name: (Amount(0.2), None, Amount(3.0, True)) for name in LAWS_OF_AXES}),
    "rigid": JointSettings(laws={"stiffness": Amount(math.inf)}),
    "limits": JointSettings(limits={"twist": (-20.0, 10.0), "swing_y": (-90.0, 100.0), "swing_z": (-180.0, 180.0)}),
    "locked": JointSettings(locked=frozenset({"twist", "bend_z"})),
}


@pytest.mark.parametrize("wish", WISHES)
def test_the_server_has_what_is_asked_and_then_its_own(wish: str, doll: layfigure.Doll) -> None:
    sender, _ = sender_for(doll)
    settle(sender, {})
    own = now(doll)
    settle(sender, {"forearm.R": WISHES[wish]})
    assert sender.refusal("forearm.R") == ""
    changed = now(doll)
    assert changes(changed["forearm.R"], asked(own["forearm.R"], WISHES[wish])) == []
    assert changes(own["forearm.R"], changed["forearm.R"]) != []
    assert [bone for bone in own if changes(own[bone], changed[bone])] == ["forearm.R"]
    settle(sender, {})
    assert changes(own["forearm.R"], now(doll)["forearm.R"]) == []


def test_the_servers_reason_is_kept_and_the_rest_done(doll: layfigure.Doll) -> None:
    sender, _ = sender_for(doll)
    none = JointSettings(laws={"yield_torque": (Amount(0.0), None, None), "damping": Amount(0.5)})
    settle(sender, {"forearm.R": none})
    assert "yield ratio = 0, expected > 0" in sender.refusal("forearm.R")
    assert now(doll)["forearm.R"].laws["damping"].unit == 0.5


def test_a_joint_that_somebody_else_locked_stays_so_unless_asked(doll: layfigure.Doll) -> None:
    sender, _ = sender_for(doll)
    settle(sender, {})
    doll.command("lock", bone="forearm.R")
    sender.look_again()
    settle(sender, {"hand.L": STIFF})
    assert now(doll)["forearm.R"].locked == set(AXES)


def test_undo_of_the_server_does_not_part_it_from_what_is_asked(doll: layfigure.Doll) -> None:
    sender, _ = sender_for(doll)
    wishes = {"hand.L": STIFF}
    settle(sender, wishes)
    stiff = now(doll)["hand.L"]
    doll.command("undo")
    assert changes(stiff, now(doll)["hand.L"]) != []
    sender.look_again()
    settle(sender, wishes)
    assert changes(stiff, now(doll)["hand.L"]) == []


def test_a_factor_is_of_the_dolls_own_also_where_a_settings_file_gave_it(
    binary: Path, character: Path, tmp_path: Path
) -> None:
    file = tmp_path / "a.toml"
    file.write_text('[joints."hand.L"]\nstiffness = {factor = 2.0}\n')
    command = [binary, character, "--doll", file, "--clock", "lockstep", "--broker", "0"]
    with ServerProcess(list(map(str, command))) as server, layfigure.connect(server.url) as doll:
        sender, link = sender_for(doll)
        settle(sender, {"hand.L": STIFF})
        assert set(link.sent) == {"get_joints"}
        assert sender.own is not None
        settle(sender, {})
        assert changes(now(doll)["hand.L"], sender.own.joints["hand.L"]) == []


PAIRS = ("upper_arm", "forearm", "hand", "thigh", "shin", "foot")
DEGREE = math.pi / 180.0


def images(doll: layfigure.Doll, values: Mapping[str, JointValues], name: str) -> tuple[Placed, Placed]:
    left, right = (
        Placed(values[n], tuple(joint.bind_translation), tuple(joint.bind_rotation))
        for n in (f"{name}.L", f"{name}.R")
        for joint in [doll.character.joints[doll.joint(n)]]
    )
    return left, right


@pytest.mark.parametrize("pair", PAIRS)
def test_the_axes_of_a_pair_are_each_others_image(pair: str, doll: layfigure.Doll) -> None:
    left, right = images(doll, now(doll), pair)
    assert mirror_rule(left, right) == mirror_rule(right, left) == USUAL_MIRROR


LOPSIDED = JointSettings(
    laws={"stiffness": (Amount(0.5, True), Amount(4.0, True), Amount(1.0, True))},
    limits={"twist": (-3.0, 25.0), "swing_y": (-80.0, 5.0), "swing_z": (-125.0, 4.0)},
)
FLIP = np.diag([-1.0, 1.0, 1.0])  # the doll's plane of symmetry is x = 0
PULLS = ((0.1, 0.0, 0.2), (-0.1, -0.2, 0.0), (0.0, 0.2, -0.1), (-0.2, 0.1, 0.1))  # [m] of the left hand
TURNS = ((1.2, 0.0, 0.0), (-1.2, 0.0, 0.0), (0.0, 1.0, 0.5), (0.0, -1.0, -0.5))  # rotation vectors [rad]
SYMMETRIC = 1e-4  # [m] over a doll of 0.3 m, of which the limits bend a joint by some 0.1 m
ASYMMETRIC = 5e-3  # [m]


def pull_both(doll: layfigure.Doll) -> float:
    """Hands pull and turn both arms far beyond their limits, to places that are each other's mirror images; returns how
    far from each other's images the arms come at the worst [m]."""
    from layfigure.rotation import from_vector

    positions = layfigure.world_poses(doll.character, doll.pose())[1]
    left, right = (positions[doll.joint(f"forearm.{side}")] for side in "LR")
    for pointer, side in enumerate("LR"):
        doll.move_pointer(pointer, (left, right)[pointer])
        doll.command("grab", pointer=pointer, bone=f"upper_arm.{side}", mode="6dof")
    worst = 0.0
    for pull, turn in zip(PULLS, TURNS, strict=True):
        image = -FLIP @ np.array(turn)  # of a rotation
        targets = {
            0: np.r_[left + pull, from_vector(np.array(turn))],
            1: np.r_[right + FLIP @ np.array(pull), from_vector(image)],
        }
        doll.step(400, targets)
        positions = layfigure.world_poses(doll.character, doll.pose())[1]
        for bone in ("forearm", "hand"):
            there, here = (positions[doll.joint(f"{bone}.{side}")] for side in "LR")
            worst = max(worst, float(np.linalg.norm(FLIP @ there - here)))
    return worst


@pytest.mark.parametrize(
    ("right", "is_symmetric"), [(mirrored(LOPSIDED), True), (LOPSIDED, False), (JointSettings(), False)]
)
def test_mirrored_settings_make_mirrored_poses(right: JointSettings, is_symmetric: bool, doll: layfigure.Doll) -> None:
    sender, _ = sender_for(doll)
    settle(sender, {"upper_arm.L": LOPSIDED, "upper_arm.R": right})
    assert sender.refusal("upper_arm.L") == sender.refusal("upper_arm.R") == ""
    worst = pull_both(doll)
    print(f"the arms are {1e3 * worst:.3f} mm from each other's mirror images")
    assert worst < SYMMETRIC if is_symmetric else worst > ASYMMETRIC
