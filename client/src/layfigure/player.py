"""Plays a session: moves pointers and sends commands to a server, in its clock.

Time goes by ticks, one per pose of the server. At the start of a tick the actions that are due are carried out; then
each hand that holds something is sent to where it is to be at the tick's end, and the tick passes. In lockstep the
player orders the steps, so the same session gives the same take.
"""

from __future__ import annotations

import contextlib
import difflib
from collections.abc import Callable

import numpy as np

from layfigure import codec, skeleton
from layfigure.bus import Bus
from layfigure.connection import Connection
from layfigure.errors import LayfigureError, NoReplyError
from layfigure.hand_motion import HandMotion, Scheduled
from layfigure.protocol import POSE_CHANNEL, Argument, Character, Floats, Pose
from layfigure.session import Grab, Key, Move, Release, Session
from layfigure.session_clock import LockstepClock, PointerMessages, RealtimeClock, SessionClock

POSE_TIMEOUT_S = 5.0


class Player:
    """Plays `session` on the server of `bus`."""

    def __init__(self, bus: Bus, session: Session) -> None:
        self._bus = bus
        self._connection = Connection(bus)
        self._session = session
        self._pose: Pose | None = None
        bus.subscribe(POSE_CHANNEL, self._on_pose)

    def play(self, stop: Callable[[], bool], progress: Callable[[float, float], None]) -> float:
        """Returns the time played [s], shorter than the session if `stop()` became true.

        `progress` gets the time played and the whole time. Raises LayfigureError when a bone is unknown, or, with the
        hand and the time, when the server refuses an action or is lost; hands then let go if they still can.
        """
        character = self._connection.fetch_character()
        joints = resolve_bones(character, self._session)
        pose = self._wait_for_pose(character)
        clock = self._clock(character, pose)
        hands = [HandMotion(hand, character.pose_hz) for hand in self._session.hands]
        ticks = max(hand.ticks for hand in hands)
        tick = 0
        try:
            while not stop():
                for hand in hands:
                    self._act(hand, tick, character, joints)
                if tick == ticks:
                    break
                tick += 1
                self._pass_tick(hands, tick, clock)
                self._check_same_server(pose)
                progress(tick / character.pose_hz, ticks / character.pose_hz)
        finally:
            self._let_go(hands)
        return tick / character.pose_hz

    def _pass_tick(self, hands: list[HandMotion], tick: int, clock: SessionClock) -> None:
        for hand in hands:
            hand.advance(tick, clock.end_of_tick())
        clock.tick(lambda: self._send_pointers(hands))

    def _clock(self, character: Character, pose: Pose) -> SessionClock:
        if character.clock == "lockstep":
            return LockstepClock(self._connection, character, pose.step)
        return RealtimeClock(self._connection, character)

    def _wait_for_pose(self, character: Character) -> Pose:
        if not self._bus.wait_until(lambda: self._pose is not None, POSE_TIMEOUT_S):
            raise NoReplyError(f"no pose of '{character.name}' arrived within {POSE_TIMEOUT_S:g} s")
        assert self._pose is not None
        return self._pose

    def _check_same_server(self, first_pose: Pose) -> None:
        if self._connection.watch.current != first_pose.server_id:
            raise LayfigureError("the server was restarted in the middle of the session: play it again")

    def _act(self, hand: HandMotion, tick: int, character: Character, joints: dict[str, int]) -> None:
        for scheduled in hand.due(tick):
            try:
                self._carry_out(hand, scheduled, character, joints)
            except LayfigureError as error:
                when = f"hand with pointer {hand.pointer} at {tick / character.pose_hz:.2f} s"
                raise LayfigureError(f"{when}: {error}") from error

    def _carry_out(self, hand: HandMotion, scheduled: Scheduled, character: Character, joints: dict[str, int]) -> None:
        match scheduled.action:
            case Grab() as grab:
                self._grab(hand, grab, character, joints[grab.bone])
            case Move() as move:
                hand.begin_move(scheduled, move)
            case Release():
                self._connection.command("release", Argument("pointer", values=(hand.pointer,)))
                hand.released()
            case Key():
                self._connection.command("key")

    def _grab(self, hand: HandMotion, grab: Grab, character: Character, joint: int) -> None:
        """Sends the pointer to the bone first: the server keeps the offset that the two have at the grab."""
        pointer = self._joint_position(character, joint)
        self._connection.send_pointer(hand.pointer, pointer)
        arguments = [
            Argument("pointer", values=(hand.pointer,)),
            Argument("bone", text=character.joints[joint].name),
            Argument("mode", text=grab.mode),
        ]
        if grab.point is not None:
            arguments.append(Argument("point", values=grab.point))
        for name, value in (("stiffness", grab.stiffness), ("damping", grab.damping)):
            if value is not None:
                arguments.append(Argument(name, values=(value,)))
        reply = self._connection.command("grab", *arguments)
        hand.grabbed(pointer, np.array(reply.values("position")))

    def _joint_position(self, character: Character, joint: int) -> Floats:
        assert self._pose is not None
        _, positions = skeleton.world_poses(character, self._pose.root_translation[None], self._pose.rotations[None])
        return np.asarray(positions[0, joint])

    def _send_pointers(self, hands: list[HandMotion]) -> PointerMessages:
        return [
            (hand.pointer, self._connection.send_pointer(hand.pointer, hand.position))
            for hand in hands
            if hand.position is not None
        ]

    def _let_go(self, hands: list[HandMotion]) -> None:
        """After a failure or an interruption; the failure that led here matters more than one on the way out."""
        for hand in hands:
            if hand.position is not None and self._bus.connected:
                with contextlib.suppress(LayfigureError):
                    self._connection.command("release", Argument("pointer", values=(hand.pointer,)), timeout_s=1.0)

    def _on_pose(self, data: bytes) -> None:
        pose = codec.decode_pose(data)
        self._connection.watch.hear(pose.server_id)
        self._pose = pose


def resolve_bones(character: Character, session: Session) -> dict[str, int]:
    """The joint of each bone that the session names. A name without a rig's prefix finds one with it.

    Raises LayfigureError for an unknown or ambiguous name.
    """
    names = [action.bone for hand in session.hands for action in hand.actions if isinstance(action, Grab)]
    return {name: _resolve(character, name) for name in names}


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
