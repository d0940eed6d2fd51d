"""Plays a session: moves pointers and sends commands to a server, in its clock.

Time goes by ticks, one per pose of the server. At the start of a tick the actions that are due are carried out; then
each hand that holds something is sent to where it is to be at the tick's end, and the tick passes. In lockstep the
player orders the steps, so the same session gives the same take.
"""

from __future__ import annotations

import contextlib
import difflib
import fnmatch
from collections.abc import Callable

import numpy as np

from layfigure import codec, rotation, skeleton
from layfigure.bus import Bus
from layfigure.connection import REPLY_TIMEOUT_S, Connection
from layfigure.errors import LayfigureError, RefusedError
from layfigure.expectation import Vector
from layfigure.hand_motion import HandMotion, Scheduled
from layfigure.judge import Judge
from layfigure.protocol import POSE_CHANNEL, Argument, Character, Floats, Pose
from layfigure.session import (
    Clutch,
    Command,
    Fingertip,
    Grab,
    Key,
    Magnet,
    Move,
    Pin,
    Pinch,
    Release,
    Scale,
    Server,
    Session,
    Softness,
    Touch,
    Unpin,
)
from layfigure.session_clock import LockstepClock, PointerMessages, RealtimeClock, SessionClock, wait_for_step

POSE_TIMEOUT_S = 5.0
WORLD_BASE = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # a device at the world's origin: x y z w x y z


class Player:
    """Plays `session` on the server of `bus`, and lets `judge` see what comes of it."""

    def __init__(self, bus: Bus, session: Session, judge: Judge | None = None) -> None:
        self._bus = bus
        self._connection = Connection(bus)
        self._session = session
        self._judge = judge
        self._pose: Pose | None = None
        self._sent: set[int] = set()  # pointers
        self._pins: dict[int, list[float]] = {}  # numbers of the pins on each joint
        self._devices: dict[int, str] = {}  # of the server, by the pointers that they move
        bus.subscribe(POSE_CHANNEL, self._on_pose)

    def play(self, stop: Callable[[], bool], progress: Callable[[float, float], None]) -> float:
        """Returns the time played [s], shorter than the session if `stop()` became true.

        `progress` gets the time played and the whole time. Raises LayfigureError when a bone is unknown, or, with the
        hand and the time, when the server refuses an action or is lost; hands then let go if they still can.
        """
        character = self._connection.fetch_character()
        check_server(character, self._session.server)
        joints = resolve_bones(character, self._session)
        if self._judge is not None:
            self._judge.begin(character, joints)
        pose = self._wait_for_pose(character)
        self._devices = {device.pointer: device.name for device in self._connection.newest_status().devices}
        clock = self._clock(character, pose)
        hands = [HandMotion(hand, character.pose_hz) for hand in self._session.hands]
        ticks = max(hand.ticks for hand in hands)
        tick = 0
        try:
            self._reset_maps()
            self._observe(tick)
            while not stop():
                for hand in hands:
                    self._act(hand, tick, character, joints, clock)
                if tick == ticks:
                    break
                tick += 1
                self._pass_tick(hands, tick, clock)
                self._check_same_server(pose)
                self._observe(tick)
                progress(tick / character.pose_hz, ticks / character.pose_hz)
        finally:
            self._let_go(hands)
            with contextlib.suppress(LayfigureError):
                self._reset_maps(timeout_s=1.0)
        return tick / character.pose_hz

    def _pass_tick(self, hands: list[HandMotion], tick: int, clock: SessionClock) -> None:
        for hand in hands:
            hand.advance(tick, clock.end_of_tick())
        clock.tick(lambda: self._send_pointers(hands))
        if isinstance(clock, LockstepClock) and self._judge is not None:
            wait_for_step(self._connection, lambda: self._pose, clock.steps_done)

    def _observe(self, tick: int) -> None:
        if self._judge is not None:
            assert self._pose is not None
            self._judge.observe(tick, self._pose, self._sent)

    def _clock(self, character: Character, pose: Pose) -> SessionClock:
        if character.clock == "lockstep":
            return LockstepClock(self._connection, character, pose.step)
        return RealtimeClock(self._connection, character)

    def _wait_for_pose(self, character: Character) -> Pose:
        self._connection.wait_for_pose(character, lambda: self._pose is not None, POSE_TIMEOUT_S)
        assert self._pose is not None
        return self._pose

    def _check_same_server(self, first_pose: Pose) -> None:
        if self._connection.watch.current != first_pose.server_id:
            raise LayfigureError("the server was restarted in the middle of the session: play it again")

    def _act(
        self, hand: HandMotion, tick: int, character: Character, joints: dict[str, int], clock: SessionClock
    ) -> None:
        for scheduled in hand.due(tick):
            try:
                if isinstance(scheduled.action, Command):
                    self._command(scheduled.action, tick / character.pose_hz, clock)
                else:
                    self._carry_out(hand, scheduled, character, joints)
            except LayfigureError as error:
                when = f"hand with pointer {hand.pointer} at {tick / character.pose_hz:.2f} s"
                raise LayfigureError(f"{when}: {error}") from error

    def _carry_out(self, hand: HandMotion, scheduled: Scheduled, character: Character, joints: dict[str, int]) -> None:
        match scheduled.action:
            case Grab() as grab:
                self._grab(hand, grab, character, joints[grab.bone])
            case Touch() as touch:
                place = self._point_position(character, joints[touch.bone], touch.point) + np.array(touch.offset)
                self._touch(hand, hand.pointer, place, touch.fingertip)
                hand.touched(place)
            case Pinch() as pinch:
                self._pinch(hand, scheduled, pinch, self._point_position(character, joints[pinch.bone], pinch.point))
            case Move() as move:
                hand.begin_move(scheduled, move)
            case Release():
                for pointer in hand.holding:
                    self._connection.command("release", _pointer(pointer))
                hand.released()
            case Pin() as pin:
                self._pin(pin, character, joints[pin.bone])
            case Unpin() as unpin:
                self._unpin(unpin, joints)
            case Softness() as softness:
                of_bone = [] if softness.bone is None else [_bone(character, joints[softness.bone])]
                self._connection.command("set", Argument("softness", values=(softness.factor,)), *of_bone)
            case Scale() as scale:
                self._require_no_device(hand)
                self._set(hand.pointers, "scale", scale.scale)
                for hand_map in hand.maps.values():
                    hand_map.set_scale(scale.scale)
            case Clutch() as clutch:
                self._require_no_device(hand)
                self._set(hand.pointers, "clutch", float(clutch.held))
                for hand_map in hand.maps.values():
                    hand_map.set_clutch(clutch.held)
            case Magnet() as magnet:
                self._set(hand.holding, "magnet", float(magnet.on))
            case Key():
                self._connection.command("key")

    def _command(self, command: Command, time_s: float, clock: SessionClock) -> None:
        reply = self._connection.ask(command.name, *command.arguments)
        if command.answer is None and not reply.accepted:
            raise RefusedError(f"the server refuses '{command.name}': {reply.reason}")
        if command.answer is not None and self._judge is not None:
            self._judge.answered(command.answer, reply, time_s)
        if command.name == "step" and reply.accepted:
            clock.stepped(int(reply.values("steps")[0]))

    def _grab(self, hand: HandMotion, grab: Grab, character: Character, joint: int) -> None:
        """Sends the pointer to the bone first: the server keeps the offset that the two have at the grab."""
        pointer = hand.maps[hand.pointer].to_hand(self._joint_position(character, joint))
        self._send(hand, hand.pointer, pointer)
        arguments = [_pointer(hand.pointer), _bone(character, joint), Argument("mode", text=grab.mode)]
        if grab.point is not None:
            arguments.append(Argument("point", values=grab.point))
        for name, value in (("stiffness", grab.stiffness), ("damping", grab.damping)):
            if value is not None:
                arguments.append(Argument(name, values=(value,)))
        reply = self._connection.command("grab", *arguments)
        hand.grabbed(pointer, np.array(reply.values("position")))

    def _touch(self, hand: HandMotion, pointer: int, world: Floats, fingertip: Fingertip) -> None:
        """Sends the pointer there first: its fingertip comes out where it is."""
        self._send(hand, pointer, hand.maps[pointer].to_hand(world))
        arguments = [_pointer(pointer)]
        for name in ("radius", "friction", "stiffness", "damping"):
            if (value := getattr(fingertip, name)) is not None:
                arguments.append(Argument(name, values=(value,)))
        if fingertip.magnet:
            arguments.append(Argument("magnet", values=(1.0,)))
        self._connection.command("touch", *arguments)

    def _pinch(self, hand: HandMotion, scheduled: Scheduled, pinch: Pinch, middle: Floats) -> None:
        along = np.array(pinch.along) / np.linalg.norm(pinch.along)
        places = {hand.pointer: middle + 0.5 * pinch.width * along, pinch.second: middle - 0.5 * pinch.width * along}
        self._touch(hand, hand.pointer, places[hand.pointer], pinch.fingertip)
        try:
            self._touch(hand, pinch.second, places[pinch.second], pinch.fingertip)
        except LayfigureError:
            self._connection.command("release", _pointer(hand.pointer))
            raise
        hand.begin_pinch(scheduled, places)

    def _pin(self, pin: Pin, character: Character, joint: int) -> None:
        arguments = [_bone(character, joint), Argument("mode", text=pin.mode), Argument("hold", text=pin.hold)]
        if pin.point is not None:
            arguments.append(Argument("point", values=pin.point))
        reply = self._connection.command("pin", *arguments)
        self._pins.setdefault(joint, []).extend(reply.values("pin"))

    def _unpin(self, unpin: Unpin, joints: dict[str, int]) -> None:
        if unpin.bone is None:
            self._connection.command("unpin")
            self._pins.clear()
            return
        for number in self._pins.pop(joints[unpin.bone], []):
            self._connection.command("unpin", Argument("pin", values=(number,)))

    def _set(self, pointers: tuple[int, ...], name: str, value: float, timeout_s: float = REPLY_TIMEOUT_S) -> None:
        for pointer in pointers:
            self._connection.command("set", _pointer(pointer), Argument(name, values=(value,)), timeout_s=timeout_s)

    def _reset_maps(self, timeout_s: float = REPLY_TIMEOUT_S) -> None:
        """The hands whose maps the session needs, or has changed, are where the world is. Devices keep their maps:
        their hands are told where to be in the world.
        """
        for hand in self._session.hands:
            if not hand.uses_map or not self._bus.connected:
                continue
            for pointer in set(hand.pointers) - set(self._devices):
                for name, values in (("clutch", (0.0,)), ("scale", (1.0,)), ("base", WORLD_BASE)):
                    self._connection.command(
                        "set", _pointer(pointer), Argument(name, values=values), timeout_s=timeout_s
                    )

    def _require_no_device(self, hand: HandMotion) -> None:
        for pointer in hand.pointers:
            if pointer in self._devices:
                raise LayfigureError(
                    f"pointer {pointer} is moved by a device, {self._devices[pointer]}: leave scale and clutch to it"
                )

    def _send(self, hand: HandMotion, pointer: int, position: Floats) -> int:
        hand.maps[pointer].sent(position)
        self._sent.add(pointer)
        return self._connection.send_pointer(pointer, position)

    def _point_position(self, character: Character, joint: int, point: Vector) -> Floats:
        """A point of a bone, in the world."""
        assert self._pose is not None
        rotations, positions = skeleton.world_poses(
            character, self._pose.root_translation[None], self._pose.rotations[None]
        )
        return np.asarray(positions[0, joint] + rotation.rotate(rotations[0, joint], np.array(point)))

    def _joint_position(self, character: Character, joint: int) -> Floats:
        assert self._pose is not None
        _, positions = skeleton.world_poses(character, self._pose.root_translation[None], self._pose.rotations[None])
        return np.asarray(positions[0, joint])

    def _send_pointers(self, hands: list[HandMotion]) -> PointerMessages:
        return [
            (pointer, self._send(hand, pointer, position)) for hand in hands for pointer, position in hand.targets()
        ]

    def _let_go(self, hands: list[HandMotion]) -> None:
        """After a failure or an interruption; the failure that led here matters more than one on the way out."""
        for hand in hands:
            for pointer in hand.holding:
                if not self._bus.connected:
                    return
                with contextlib.suppress(LayfigureError):
                    self._connection.command("release", _pointer(pointer), timeout_s=1.0)

    def _on_pose(self, data: bytes) -> None:
        pose = codec.decode_pose(data)
        self._connection.watch.hear(pose.server_id)
        self._pose = pose


def resolve_bones(character: Character, session: Session) -> dict[str, int]:
    """The joint of each bone that the session names. A name without a rig's prefix finds one with it.

    Raises LayfigureError for an unknown or ambiguous name.
    """
    named = [action for hand in session.hands for action in hand.actions]
    quantities = [expectation.quantity for expectation in session.all_expectations]
    bones = [getattr(each, "bone", None) for each in (*named, *quantities)]
    return {name: _resolve(character, name) for name in bones if name is not None}


def check_server(character: Character, wanted: Server) -> None:
    """Raises LayfigureError if the session is for another server."""
    if wanted.character is not None and not fnmatch.fnmatchcase(character.name, wanted.character):
        raise LayfigureError(
            f"the session is for the character '{wanted.character}', the server has '{character.name}'"
        )
    if wanted.clock is not None and wanted.clock != character.clock:
        raise LayfigureError(f"the session needs a server with --clock {wanted.clock}, this one has {character.clock}")
    for name in ("physics_hz", "pose_hz"):
        value, there = getattr(wanted, name), getattr(character, name)
        if value is not None and value != there:
            option = name.replace("_", "-")
            raise LayfigureError(f"the session needs a server with --{option} {value:g}, this one has {there:g}")


def _pointer(pointer: int) -> Argument:
    return Argument("pointer", values=(pointer,))


def _bone(character: Character, joint: int) -> Argument:
    return Argument("bone", text=character.joints[joint].name)


def _resolve(character: Character, name: str) -> int:
    known = [joint.name for joint in character.joints]
    matches = [j for j, full in enumerate(known) if full == name] or [
        j for j, full in enumerate(known) if full.rpartition(":")[2] == name
    ]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise LayfigureError(f"bone '{name}' could be {', '.join(known[j] for j in matches)}: give the whole name")
    near = difflib.get_close_matches(name, known, n=3, cutoff=0.4) or known[:3]
    raise LayfigureError(f"'{character.name}' has no bone '{name}'; similar: {', '.join(near)}")
