# SPDX-License-Identifier: GPL-3.0-or-later
"""Armatures that are posed by a doll: sessions, and the timer that brings poses to them."""

from __future__ import annotations

import contextlib
import time
import traceback
import uuid
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from pathlib import Path

import bpy
import numpy as np

import layfigure
from layfigure import LayfigureError, RefusedError

from . import pose_writing, preferences, server
from .link import Link, Sample
from .own_server import OwnServer, Preparation
from .properties import NO_PLACE
from .rig import BoneMap, Floats, MisfitError, check_similarity, fitted, looks_alike
from .root_carrier import RootCarrier
from .session_armature import SessionArmature, evaluate
from .transfer import Transfer

LIVE_INTERVAL_S = 1.0 / 120.0  # twice the rate of most screens
AT_REST_S = 0.15  # without another pose; one comes at least ten times a second
IDLE_INTERVAL_S = 0.1
NO_GRAVITY = (0.0, 0.0, 0.0)  # a doll that is to have the armature's pose, and to keep what it is given, does not sag

Listener = Callable[["Session", Sample], None]
SettingsSource = Callable[[bpy.types.Object], Preparation | None]

_sessions: dict[str, Session] = {}
_listeners: list[Listener] = []
_settings_sources: list[SettingsSource] = []
_last_words: dict[str, str] = {}  # of sessions that ended by themselves, by the armature's name


class Session:
    """One armature and its doll. Keeps no reference to Blender's data, which undo and reload replace.

    Belongs to Blender's main thread. After start(): first its server loads, then the doll is driven to the pose that
    the armature has, and from then on, `live`, the armature has the doll's.
    """

    def __init__(self, armature: bpy.types.Object, to_world: Floats) -> None:
        self.id = uuid.uuid4().hex  # also in object.layfigure.session
        self.link: Link | None = None  # None while the server starts
        self.bones: BoneMap | None = None  # None until the doll is known
        self.place = NO_PLACE  # the doll's, in the server's history
        self.message = ""  # one line for the panel: what goes on, or what went wrong and the mend
        self.failed = False  # `message` is an error
        self._object = SessionArmature(armature, self.id)
        self._to_world = to_world
        self._own: OwnServer | None = None  # None: another's is used
        self._live = False
        self._run = 0  # id of the server's run whose poses are applied
        self._transfer = Transfer()
        self._carrier = RootCarrier()
        self._written: tuple[layfigure.Pose, Floats] | None = None
        self._seen: layfigure.Pose | None = None  # the newest, and since when it is that [monotonic s]
        self._seen_since = 0.0

    def armature(self) -> bpy.types.Object | None:
        """The armature's object, found by the session's id; None if it was deleted."""
        return self._object.find()

    @property
    def live(self) -> bool:
        """The doll's poses are applied."""
        return self._live and self._run != 0 and not self._transfer.under_way

    @property
    def busy(self) -> bool:
        """Something is on its way, and will come or fail."""
        return not self.failed and not self.live

    @property
    def applied(self) -> layfigure.Pose | None:
        """The pose that was written to the bones last; None if they may have another one."""
        return self._written[0] if self._written is not None else None

    @property
    def program(self) -> Path | None:
        """The server, if it is the session's own."""
        return self._own.program if self._own is not None else None

    @property
    def character(self) -> Path | None:
        """What was exported for the session's own server."""
        return self._own.character if self._own is not None else None

    @property
    def prepared(self) -> list[object]:
        """What the preparations of the session's own server returned."""
        return self._own.prepared if self._own is not None else []

    @property
    def server_pid(self) -> int | None:
        """Of the session's own server."""
        return self._own.pid if self._own is not None else None

    def to_server(self) -> Floats:
        """(4, 4): from the armature's space to the server's world, with the doll's placement taken out."""
        if self.bones is None:
            return self._to_world
        return self.bones.to_world @ np.linalg.inv(self.bones.placement)

    def world_to_server(self) -> Floats:
        """(4, 4): from Blender's world, as the armature is placed in it now, to the server's. A similarity.

        Raises MisfitError if the armature is gone.
        """
        armature = self.armature()
        if armature is None:
            raise MisfitError("the armature is gone")
        return self.to_server() @ np.linalg.inv(np.array(armature.matrix_world))

    def apply(self, sample: Sample) -> None:
        """Writes the pose to the bones, and calls the listeners. Nothing is keyed."""
        armature = self.armature()
        if armature is None or self.bones is None or armature.mode == "EDIT":
            return
        self._carrier.follow(armature, self.bones)
        matrices = self.bones.pose_matrices(sample.pose)
        pose_writing.write(armature, self.bones, matrices)
        self._written = sample.pose, matrices
        for listener in tuple(_listeners):
            listener(self, sample)

    def apply_again(self) -> None:
        """Writes what was written last, if animation has put its own pose in place of it."""
        armature = self.armature()
        if self._written is None or not self.live or armature is None or armature.mode == "EDIT":
            return
        animation = armature.animation_data
        if animation is not None and (animation.action is not None or animation.nla_tracks):
            pose_writing.write(armature, self.bones, self._written[1])

    def show_effect(self, timeout_s: float) -> None:
        """Waits for the pose that what was just sent to the doll brings about, and applies it: the redraw that comes
        shows it. Else that redraw shows what came before, and lasts a frame until the next one.
        """
        if self.live and self.link is not None and self.link.wait_for_effect(timeout_s):
            guarded(self, self.step)

    def push_pose(self) -> Future[None]:
        """Sends the pose that the bones have to the doll; the future is done when the doll has it.

        Until then no pose is applied. Its exception is a LayfigureError.
        """
        armature = self.armature()
        if armature is None or self.link is None or self.bones is None or self.link.state != "live":
            failed: Future[None] = Future()
            failed.set_exception(layfigure.UsageError(f"there is no doll yet: {self.message}"))
            return failed
        evaluate(armature)
        matrices = pose_writing.matrices_of(armature, self.bones.bones)
        self._carrier.begin_to_place(armature, self.bones)
        self._written = None
        self.place = NO_PLACE
        self._say("posing the doll as the armature is posed")
        return self._transfer.push(self.link, self.bones, matrices)

    def note_place(self, timeout_s: float = 1.0) -> None:
        """Asks the server for its place in its history, and writes it to the object: for operators that change the
        doll, before they return FINISHED, so that Blender's undo step and the doll's belong together. Where it is not
        told, an undo brings the doll to the pose that the armature has then."""
        if self.link is None:
            return
        self.place = NO_PLACE
        with contextlib.suppress(LayfigureError, FutureTimeoutError):
            reply = self.link.send("history").result(timeout_s)
            self.place = int(reply.values("place")[0])
        self._write_place()

    def go_to_place(self, place: int, run: str) -> None:
        """Brings the doll to where it was when Blender's undo step was made, which has been restored.

        Where the server does not know that place, the doll is driven to the pose that the armature has.
        """
        if self.link is None or not self._live:
            return
        if place == NO_PLACE or run != str(self._run):
            self.push_pose()
            return
        self._written = None
        self._transfer.travel(self.link, place)
        self.place = place

    def reconnect(self) -> None:
        """Connects anew; a server of the session's own that has ended is started again. Raises ServerError."""
        if self._own is not None:
            self._close_link()
            self._start_own()
        elif self.link is not None:
            self._connect(self.link.url)
        self._begin_anew()

    def stop(self, message: str = "") -> None:
        """Restores all but the pose, ends the server if it is the session's own, and forgets the session."""
        _sessions.pop(self.id, None)
        if message:
            _last_words[self._object.name] = message
        self._object.release()
        self._close_link()
        if self._own is not None:
            self._own.stop()
        _redraw()

    # --- beginning ---

    def begin(self, context: bpy.types.Context, armature: bpy.types.Object) -> None:
        """Raises ServerError or ExportError, upon which nothing has changed."""
        settings = preferences.of(context)
        if settings is not None and settings.url:
            self._object.mark(armature)
            self._connect(settings.url)
        else:
            program = server.find(settings.server_path if settings is not None else "")
            self._own = OwnServer(program, settings.pose_hz if settings is not None else server.USUAL_POSE_HZ)
            try:
                self._to_world = self._own.export(context, armature)
                self._object.mark(armature)
                self._start_own()
            except BaseException:
                self._own.stop()
                self._object.release()
                raise
        _last_words.pop(self._object.name, None)

    def _start_own(self) -> None:
        armature = self.armature()
        assert armature is not None
        assert self._own is not None
        self._own.start([job for source in _settings_sources if (job := source(armature)) is not None])
        self._say(self._own.progress)

    def _connect(self, url: str) -> None:
        self._close_link()
        self.link = Link(url)
        self.link.start()
        self._say(self.link.message)

    def _close_link(self) -> None:
        if self.link is not None:
            self.link.close()
        self.link = None

    def _begin_anew(self) -> None:
        """With the doll of another run of the server, which knows nothing of the former."""
        self._run = 0
        self._live = False
        self._transfer.forget()
        self._written = None

    # --- what the timer does ---

    def step(self) -> None:
        """Goes on by what has come since the last call."""
        armature = self.armature()
        if armature is None:
            self.stop("the armature was deleted, or its Start undone: the doll has ended")
        elif not self._object.has_the_same_bones(armature):
            self.stop("the armature's bones were edited or renamed: the doll has ended; start it again")
        else:
            self._step_connection(armature)

    def _step_connection(self, armature: bpy.types.Object) -> None:
        if self._own is not None:
            self._own.step()
        if self._own is not None and self._own.error is not None:
            self._take_the_servers_end(self._own.error)
        elif self.link is None:
            if self._own is not None and self._own.url is not None:
                self._connect(self._own.url)
            elif self._own is not None:
                self._say(self._own.progress)
        elif self.link.state in ("lost", "refused"):
            self._forget_what_is_on_its_way()
            self._fail(self.link.message)
        elif self.link.state == "live" and self.link.newest is not None:
            self._step_doll(armature, self.link.newest)
        elif self.link.failed_attempts:
            self._fail(self.link.message)
        else:
            self._say(self.link.message)

    def _forget_what_is_on_its_way(self) -> None:
        """A doll that may not have got its pose is to get that of the armature when it is met again."""
        if self._transfer.under_way:
            self._run = 0
        self._transfer.forget()

    def _take_the_servers_end(self, error: str) -> None:
        """One that does not get as far as a doll has nothing to go on with."""
        if not self._live:
            self.stop(error)
            return
        self._forget_what_is_on_its_way()
        self._fail(f"the server has ended: {error}. Reconnect starts it again")

    def _step_doll(self, armature: bpy.types.Object, sample: Sample) -> None:
        if sample.pose.server_id != self._run:
            self._meet(armature, sample)
        if self._transfer.under_way:
            self._step_transfer()
        if self.live:
            self._tell_how_it_goes()
            self._apply_news(sample)

    def _tell_how_it_goes(self) -> None:
        assert self.link is not None
        status = self.link.status
        if status is not None and status.state == "failed":
            self._fail(f"the simulation has stopped ({status.detail}): Rest Pose lets it go on")
        else:
            self._say("the doll is live")

    def _meet(self, armature: bpy.types.Object, sample: Sample) -> None:
        """A run of a server that is new to the session: its doll is to have the pose of the armature."""
        assert self.link is not None
        assert self.link.character is not None
        try:
            to_world = self._to_world
            if self._own is None:
                to_world = fitted(self.link.character, self._object.bones, self._to_world)
            self.bones = BoneMap(self.link.character, self._object.bones, to_world)
        except MisfitError as error:
            self.stop(str(error))
            return
        self._run = sample.pose.server_id
        self._transfer.meet_another_run()
        self._live = True
        if self._own is not None:  # another's is left as it is
            self.link.send("set", gravity=NO_GRAVITY)
        self.push_pose()
        pose_writing.mute(armature, self.bones)

    def _step_transfer(self) -> None:
        arrival = self._transfer.step()
        if arrival is None:
            return
        if isinstance(arrival.error, RefusedError):
            if arrival.way == "push":
                self.stop(f"the doll does not take the armature's pose: {arrival.error}")
            else:
                self.push_pose()
        elif arrival.error is not None:
            self._run = 0  # and try again
            self._transfer.forget()
            what = "the armature's pose" if arrival.way == "push" else "the pose that was undone or redone"
            self._fail(f"the doll did not take {what}: {arrival.error}")
        elif arrival.way == "push":
            assert self.bones is not None
            self._carrier.end_to_place(self.bones)

    def _apply_news(self, sample: Sample) -> None:
        """What nobody can see waits until the doll has come to rest: a pose that is applied has the window drawn, and
        while it draws, a motion of the mouse waits."""
        if not self._transfer.is_over_before(sample):
            return
        now = time.monotonic()
        if self._seen is None or not _are_equal(self._seen, sample.pose):
            self._seen, self._seen_since = sample.pose, now
        if self._written is not None and looks_alike(self._written[0], sample.pose):
            is_at_rest = now - self._seen_since >= AT_REST_S
            if not is_at_rest or _are_equal(self._written[0], sample.pose):
                return
        self.apply(sample)

    def mute_again(self) -> None:
        """After an undo, which brought back what was not muted when its step was made."""
        armature = self.armature()
        if armature is not None and self.bones is not None and self._live:
            pose_writing.mute(armature, self.bones)

    def _write_place(self) -> None:
        armature = self.armature()
        if armature is not None:
            armature.layfigure.place = self.place
            armature.layfigure.run = str(self._run)

    def _say(self, message: str) -> None:
        if self.message != message or self.failed:
            self.message, self.failed = message, False
            _redraw()

    def _fail(self, message: str) -> None:
        if self.message != message or not self.failed:
            self.message, self.failed = message, True
            _redraw()


def start(context: bpy.types.Context, armature: bpy.types.Object) -> Session:
    """Raises ServerError, MisfitError or ExportError, each in one line, upon which nothing has changed."""
    if of(armature) is not None:
        raise MisfitError(f"'{armature.name}' is posed by a doll already")
    if armature.mode == "EDIT":
        raise MisfitError("the armature is being edited: leave edit mode first")
    if armature.data.pose_position == "REST":
        raise MisfitError(
            "the armature shows its rest position: switch to Pose Position, in the armature's data properties"
        )
    if armature.library is not None:
        raise MisfitError(
            f"'{armature.name}' is linked from another file and cannot be posed: make a library override of it"
        )
    to_world = np.array(armature.matrix_world)
    check_similarity(to_world)
    session = Session(armature, to_world)
    session.begin(context, armature)
    _sessions[session.id] = session
    if not bpy.app.timers.is_registered(tick):
        bpy.app.timers.register(tick, first_interval=0.0, persistent=True)
    return session


def of(item: bpy.types.Object | None) -> Session | None:
    """The session of an armature's object, or of the armature that a mesh is bound to."""
    if item is None:
        return None
    if item.type == "MESH":
        armature = item.find_armature()
        return of(armature) if armature is not None else None
    session = _sessions.get(item.layfigure.session)
    return session if session is not None and session.armature() == item else None


def active(context: bpy.types.Context) -> Session | None:
    """The session of the context's object."""
    return of(context.object)


def all() -> list[Session]:  # noqa: A001
    return list(_sessions.values())


def last_words(item: bpy.types.Object | None) -> str:
    """Why the session of this armature has ended by itself; empty if it has not."""
    return _last_words.get(item.name, "") if item is not None else ""


def forget_last_words() -> None:
    _last_words.clear()


def tick() -> float | None:
    """What the timer calls: applies what is new; returns the seconds until it is to be called again, None: no more."""
    for session in all():
        guarded(session, session.step)
    if not _sessions:
        return None
    return LIVE_INTERVAL_S if any(session.link is not None for session in all()) else IDLE_INTERVAL_S


def add_listener(listener: Listener) -> None:
    """Calls it, on the main thread, after each pose that was applied."""
    _listeners.append(listener)


def remove_listener(listener: Listener) -> None:
    _listeners.remove(listener)


def add_settings_source(source: SettingsSource) -> None:
    """What it returns is called on a thread before the server starts: it may write CHARACTER.doll.toml beside the
    character that was exported. A LayfigureError of it is why there is no start."""
    _settings_sources.append(source)


def remove_settings_source(source: SettingsSource) -> None:
    _settings_sources.remove(source)


def guarded(session: Session, action: Callable[[], None]) -> None:
    """A mistake of this program's ends the session that it happened in, and no other."""
    try:
        action()
    except Exception as error:  # whatever it is: an exception would end the timer, and all sessions with it
        traceback.print_exc()
        session.stop(f"an unexpected error, see the console: {error}. The doll has ended")


def _are_equal(a: layfigure.Pose, b: layfigure.Pose) -> bool:
    return np.array_equal(a.rotations, b.rotations) and np.array_equal(a.root_translation, b.root_translation)


def _redraw() -> None:
    """The panels, of which a message is none that Blender knows of."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
