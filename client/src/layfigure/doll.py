"""A server's doll as a Python object: what `import layfigure` is for.

Units are SI, the world is right-handed and Z up; positions are (3) arrays [m], rotations unit quaternions w x y z.
Everything that goes wrong outside of the program is a LayfigureError, whose message is one line. Every method that
waits has a timeout.
"""

from __future__ import annotations

import contextlib
import functools
import os
import threading
import time
import weakref
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import ArrayLike

from layfigure import codec, skeleton
from layfigure.arguments import ArgumentValue, arguments
from layfigure.bus import Bus
from layfigure.connection import IDENTITY, MESH_TIMEOUT_S, REPLY_TIMEOUT_S, Connection, PendingReply
from layfigure.errors import BusError, LayfigureError, NoReplyError, ProtocolError, TwoServersError, UsageError
from layfigure.player import Player
from layfigure.pose_stream import PoseStream
from layfigure.protocol import (
    FORCE_CHANNEL,
    POSE_CHANNEL,
    REPLY_CHANNEL,
    Character,
    Floats,
    Force,
    Mesh,
    Pose,
    Reply,
    Status,
)
from layfigure.recorder import RECONNECT_EVERY_S, Recorder
from layfigure.recording import Recording
from layfigure.servers import is_server_id
from layfigure.session import Session
from layfigure.session_clock import LockstepClock, wait_for_step
from layfigure.session_file import load_session
from layfigure.take_files import open_log

STEP_TIMEOUT_S = 60.0
_POLL_S = 0.1

Pointers = Mapping[int, ArrayLike]
"""Where pointers, by their numbers, are to be in the world: x y z [m], or x y z and a rotation w x y z."""


def connect(
    url: str | None = None, *, prefix: str = "", server: int | None = None, timeout_s: float = REPLY_TIMEOUT_S
) -> Doll:
    """Connects to the server on the LCM bus at `url`, by default $LCM_DEFAULT_URL, else multicast on this machine.

    `prefix` is what the server's channel names start with. `server` chooses one of several on one bus, by the
    `server_id` of its messages and of `layfigure status`; it is a new one each time that a server is started.

    Raises BusError if there is no such bus, NoReplyError if no server, or not that one, answers on it within
    `timeout_s`, UsageError for an id that no server can have.
    """
    if server is not None and not is_server_id(server):
        raise UsageError(f"server is {server}: expected a server's id, as 'layfigure status' prints it")
    bus = Bus(url, prefix, server)
    try:
        return Doll(bus, timeout_s)
    except BaseException:
        bus.close()
        raise


class Doll:
    """The doll of one server; made by connect(), to be closed, or used as a context manager.

    A Doll belongs to the thread that made it, any other gets a UsageError: each thread may connect for itself. Messages
    are handled inside its methods, so one that is not called for long loses poses: what is slow is better done in
    another thread. A lost connection is taken up again by the next call; a server that was restarted with the same
    character is the same doll.
    """

    def __init__(self, bus: Bus, timeout_s: float = REPLY_TIMEOUT_S) -> None:
        self._bus = bus
        self._thread = threading.get_ident()
        self._closed = False
        self._connection = Connection(bus)
        self._pose: Pose | None = None
        self._forces: dict[int, Force] = {}
        self._server_id = 0
        self._steps_done = 0  # of that server
        self._streams: weakref.WeakSet[PoseStream] = weakref.WeakSet()
        self._meshes: tuple[Mesh, ...] | None = None
        self._recorder: Recorder | None = None
        self._recording: Recording | None = None
        self._character: Character | None = None
        bus.subscribe(POSE_CHANNEL, self._on_pose)
        bus.subscribe(FORCE_CHANNEL, self._on_force)
        bus.subscribe(REPLY_CHANNEL, self._on_reply)
        self._character = self._connection.fetch_character(timeout_s)
        self._connection.wait_for_pose(self._character, lambda: self._pose is not None, timeout_s)
        assert self._pose is not None
        self._check(self._pose, self._character)

    def __enter__(self) -> Doll:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Leaves the bus; the server and what it holds stay as they are. May be called again, from any thread."""
        self._closed = True
        self._bus.close()

    @property
    def character(self) -> Character:
        """The skeleton: J joints, parents before children, with their rest and bind poses."""
        assert self._character is not None
        return self._character

    @property
    def meshes(self) -> tuple[Mesh, ...]:
        """The skin in the bind pose, fetched once, within 20 s. Raises NoReplyError."""
        if self._meshes is None:
            self._catch_up()
            self._meshes = self._connection.fetch_meshes(self.character, MESH_TIMEOUT_S)
        return self._meshes

    def joint(self, name: str) -> int:
        """The index of a joint in all arrays of joints. Raises UsageError for an unknown name."""
        for index, joint in enumerate(self.character.joints):
            if joint.name == name:
                return index
        raise UsageError(f"'{self.character.name}' has no joint '{name}'")

    def pose(self) -> Pose:
        """The newest pose that has arrived. Does not wait."""
        self._catch_up()
        assert self._pose is not None
        return self._pose

    def force(self, pointer: int) -> Force | None:
        """The newest force on a pointer that has arrived; None if there was none. Does not wait."""
        self._catch_up()
        return self._forces.get(pointer)

    @property
    def forces(self) -> Mapping[int, Force]:
        """The newest forces that have been handled, by their pointers."""
        return dict(self._forces)

    @property
    def newest_status(self) -> Status | None:
        """The newest heartbeat that has been handled, None before the first. Does not wait."""
        return self._connection.status

    @property
    def silent(self) -> bool:
        """Nothing was heard of the server for so long that it must be gone."""
        return self._connection.watch.silent

    def status(self, timeout_s: float = REPLY_TIMEOUT_S) -> Status:
        """The next heartbeat; there are ten in a second. Raises NoReplyError."""
        self._catch_up()
        return self._connection.wait_for_status(timeout_s)

    def command(self, name: str, /, *, timeout_s: float = REPLY_TIMEOUT_S, **values: ArgumentValue) -> Reply:
        """Sends any command of the server and returns its answer; it is carried out once, whatever is lost on the way.

        Arguments are named as the server names them: texts, numbers, truth values, arrays of numbers, such as
        command("grab", pointer=0, bone="hand.L", point=[0, 0, 0.1]). Names with dots are given as
        command("set", bone="neck", **{"limits.twist": [-0.5, 0.5]}). None leaves an argument out.

        Raises RefusedError with the server's reason, upon which nothing has changed, NoReplyError after `timeout_s`,
        UsageError for a value that cannot be sent.
        """
        given = arguments(name, values)
        self._catch_up()
        return self._connection.command(name, *given, timeout_s=timeout_s)

    def begin(self, name: str, /, *, timeout_s: float = REPLY_TIMEOUT_S, **values: ArgumentValue) -> PendingReply:
        """As command(), but does not wait: a loop of the caller's own calls its send_if_due() until it has its reply.

        A refusal is a reply as well. One command at a time: a second one may begin when the first has its reply or is
        given up. See fileno() for such a loop. Raises UsageError for a value that cannot be sent.
        """
        given = arguments(name, values)
        self._catch_up()
        return self._connection.begin(name, *given, timeout_s=timeout_s)

    def fileno(self) -> int:
        """For select.poll(): readable when messages have come, which pose() and all other methods handle.

        It changes when the connection is taken up again. Raises BusError if that cannot be done.
        """
        self._catch_up()
        return self._bus.fileno()

    def move_pointer(self, pointer: int, where: ArrayLike) -> None:
        """Sends a pointer to x y z [m, world], or to x y z and a rotation w x y z; does not wait.

        The newest place counts; what the pointer holds follows by its spring.
        Raises UsageError for other than three or seven finite numbers.
        """
        position, rotation = _placement(pointer, where)
        self._catch_up()
        self._connection.send_pointer(pointer, position, rotation)

    def next_pose(self, pointers: Pointers | None = None, *, timeout_s: float = REPLY_TIMEOUT_S) -> Pose:
        """Sends the pointers and lets time pass up to the server's next pose, which is returned.

        In lockstep it orders the steps up to there, so a loop of it is the same each time; in realtime it waits for the
        next pose that comes. Raises NoReplyError after `timeout_s`.
        """
        if self.character.clock == "lockstep":
            return self._advance(None, pointers or {}, timeout_s)
        before = self.pose()
        for pointer, where in (pointers or {}).items():
            self.move_pointer(pointer, where)
        self._wait(lambda: self._pose is not before, timeout_s)
        return self.pose()

    def step(self, count: int = 1, pointers: Pointers | None = None, *, timeout_s: float = STEP_TIMEOUT_S) -> Pose:
        """Advances a server in lockstep by physics steps, and returns the newest pose that there is then.

        The pointers have arrived before the first of the steps. As poses come at the character's `pose_hz`, the pose is
        not always of the last step: see its `step`. Raises UsageError if the server runs in realtime or `count` is not
        from 1, NoReplyError after `timeout_s`.
        """
        if self.character.clock != "lockstep":
            raise UsageError("the server runs in realtime, there is nothing to step: start it with --clock lockstep")
        if count < 1:
            raise UsageError(f"count of steps is {count}: expected a whole number from 1")
        return self._advance(count, pointers or {}, timeout_s)

    def poses(self, timeout_s: float = REPLY_TIMEOUT_S, *, newest: bool = False) -> PoseStream:
        """An iterator over the poses that come from now on, until the server leaves; see PoseStream.

        With `newest` a slow loop gets the newest pose each time, and not those in between. A lost server is waited for;
        NoReplyError if no pose comes within `timeout_s`, as in lockstep unless somebody orders steps. A doll at rest
        sends ten poses in a second.
        """
        self._catch_up()
        stream = PoseStream(
            functools.partial(self._wait, timeout_s=timeout_s),
            self._catch_up_if_it_can,
            lambda: self._server_left,
            newest=newest,
        )
        self._streams.add(stream)
        return stream

    def wait(self, seconds: float) -> None:
        """Handles messages for so long by the wall clock, which keeps recordings whole.

        Raises BusError if the connection is lost at the end of it.
        """
        self._catch_up()
        self._listen(lambda: False, seconds)
        if not self._bus.connected:
            raise BusError(f"lost the connection to '{self._bus.url}'")

    @contextlib.contextmanager
    def record(self, log: str | os.PathLike[str]) -> Iterator[Recording]:
        """Records all that happens in the `with` block, whichever methods of the doll are called there.

        Every message goes to the event log first, LOG.recording.lcmlog, which is renamed to `log` in the end: of it,
        read_take() and `layfigure export` make the same take, also after a crash. Give the recording's `take` to
        write_usd(). A second block records another take. Raises UsageError if one is being recorded, LayfigureError if
        the log cannot be written, TwoServersError.
        """
        out = Path(log)
        if out.suffix != ".lcmlog" or not out.parent.is_dir():
            raise UsageError(f"'{out}': expected the name of an event log, .lcmlog, in a folder that is there")
        if self._recording is not None:
            raise UsageError("a take is being recorded already: end its block first")
        self._catch_up()
        recorder = self._begin_recording(out)
        self._recording = recording = Recording(recorder, out)
        try:
            yield recording
        except TwoServersError:
            recorder.drop_rival()
            raise
        finally:
            self._recording = None
            recording.finish()

    def play(self, session: Session | str | os.PathLike[str], *, stop: Callable[[], bool] = lambda: False) -> float:
        """Lets the scripted hands of a session pose the doll, a TOML file as of `layfigure play`.

        `stop` is asked in each tick. Returns the time played [s]. Raises LayfigureError for a session that cannot be
        read or played; hands then let go.
        """
        script = session if isinstance(session, Session) else load_session(Path(session))
        self._catch_up()
        with self._bus.temporary_subscriptions():
            return Player(self._bus, script).play(stop, lambda _done, _all: None)

    @property
    def _server_left(self) -> bool:
        status = self._connection.status
        return status is not None and status.state == "leaving"

    def _check_use(self) -> None:
        if threading.get_ident() != self._thread:
            raise UsageError("this doll belongs to the thread that connected it: connect another one in this thread")
        if self._closed:
            raise UsageError("this doll is closed: connect again")

    def _catch_up(self) -> None:
        """Takes what has come, and reconnects if the connection turns out to be lost."""
        self._check_use()
        try:
            self._bus.poll(0.0)
        except BusError:
            self._bus.connect()

    def _catch_up_if_it_can(self) -> None:
        with contextlib.suppress(BusError):
            self._catch_up()

    def _wait(self, condition: Callable[[], bool], timeout_s: float) -> None:
        self._check_use()
        if not self._listen(condition, timeout_s):
            mend = self._why_no_pose_came()
            raise NoReplyError(f"no pose came from '{self._bus.url}' within {timeout_s:g} s: {mend}")

    def _why_no_pose_came(self) -> str:
        if self.character.clock == "lockstep":
            return "order steps with step() or next_pose()"
        return "is layfigure-server running there?"

    def _listen(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Handles messages until the condition holds, through losses of the bus; False after `timeout_s`."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            remaining = deadline - time.monotonic()
            if remaining <= 0.0:
                return False
            try:
                if not self._bus.connected:
                    self._bus.connect()
                self._bus.poll(min(remaining, _POLL_S))
            except BusError:
                time.sleep(min(remaining, RECONNECT_EVERY_S))
        return True

    def _advance(self, count: int | None, pointers: Pointers, timeout_s: float) -> Pose:
        placements = {pointer: _placement(pointer, where) for pointer, where in pointers.items()}
        self._catch_up()
        clock = LockstepClock(self._connection, self.character, self._steps_done)

        def send_pointers() -> list[tuple[int, int]]:
            return [
                (pointer, self._connection.send_pointer(pointer, position, rotation))
                for pointer, (position, rotation) in placements.items()
            ]

        clock.advance(clock.steps_to_next_pose if count is None else count, send_pointers, timeout_s)
        wait_for_step(self._connection, self._pose_of_this_run, clock.newest_pose_step)
        return self.pose()

    def _pose_of_this_run(self) -> Pose | None:
        return self._pose if self._pose is not None and self._pose.server_id == self._server_id else None

    def _begin_recording(self, out: Path) -> Recorder:
        log = open_log(out)
        recorder = self._recorder
        try:
            if recorder is None:
                recorder = Recorder(self._bus, log)
                recorder.start()
            else:
                recorder.resume(log)
            self._connection.command("get_character")  # upon which the pose that there is comes again
        except BaseException:
            if recorder is not None:
                recorder.pause()
            log.discard()
            raise
        self._recorder = recorder
        return recorder

    def _on_pose(self, data: bytes) -> None:
        """Of several that have come, those before the newest are read for streams alone, which give each."""
        if self._streams:
            self._take_pose(data)
        else:
            self._bus.postpone(self._take_pose, data)

    def _take_pose(self, data: bytes) -> None:
        pose = codec.decode_pose(data)
        self._connection.watch.hear(pose.server_id)
        if self._character is not None:
            self._check(pose, self._character)
        self._note_steps(pose.server_id, pose.step)
        self._pose = pose
        for stream in self._streams:
            stream.add(pose)

    def _check(self, pose: Pose, character: Character) -> None:
        if pose.content_hash != character.content_hash:
            raise LayfigureError(f"the server changed the character '{character.name}': connect again")
        if len(pose.rotations) != len(character.joints):
            raise ProtocolError(f"pose of {len(pose.rotations)} joints, expected {len(character.joints)}")

    def _on_force(self, data: bytes) -> None:
        force = codec.decode_force(data)
        self._forces[force.pointer] = force

    def _on_reply(self, data: bytes) -> None:
        """Steps may be ordered by anybody."""
        reply = codec.decode_reply(data)
        for result in reply.results:
            if result.name == "steps" and result.values:
                self._note_steps(reply.server_id, int(result.values[0]))

    def _note_steps(self, server_id: int, steps: int) -> None:
        """A restarted server counts anew."""
        self._steps_done = max(steps, self._steps_done) if server_id == self._server_id else steps
        self._server_id = server_id


def world_poses(character: Character, pose: Pose) -> tuple[Floats, Floats]:
    """Rotations (J, 4), joint -> world, and positions (J, 3) [m] of the joints in the world. Any thread may call it."""
    rotations, positions = skeleton.world_poses(character, pose.root_translation[None], pose.rotations[None])
    return rotations[0], positions[0]


def _placement(pointer: int, where: ArrayLike) -> tuple[Floats, Floats]:
    """Position and unit rotation."""
    try:
        numbers = np.asarray(where, np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    fits = numbers.shape in ((3,), (7,)) and bool(np.isfinite(numbers).all())
    length = float(np.linalg.norm(numbers[3:])) if fits and len(numbers) > 3 else 1.0
    if not fits or length == 0.0:
        raise UsageError(f"pointer {pointer} is sent to {where!r}: expected x y z, or x y z and a rotation w x y z")
    return numbers[:3], numbers[3:] / length if len(numbers) > 3 else IDENTITY
