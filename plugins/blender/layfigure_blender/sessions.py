# SPDX-License-Identifier: GPL-3.0-or-later
"""Armatures that are posed by a doll: sessions, and the timer that brings poses to them."""

from __future__ import annotations

import contextlib
import functools
import shutil
import tempfile
import traceback
import uuid
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError
from pathlib import Path

import bpy
import numpy as np

import layfigure
from layfigure import LayfigureError, RefusedError

from . import export, pose_writing, preferences, server
from .background import call_all, in_background
from .link import Link, Sample
from .properties import NO_PLACE
from .pushing import PosePush
from .rig import Bone, BoneMap, Floats, MisfitError, check_similarity, fitted

LIVE_INTERVAL_S = 1.0 / 120.0  # twice the rate of poses and of most screens
IDLE_INTERVAL_S = 0.1
NO_GRAVITY = (0.0, 0.0, 0.0)  # a doll that is to have the armature's pose, and to keep what it is given, does not sag

Listener = Callable[["Session", Sample], None]
Preparation = Callable[[Path, Path], object]  # (the server's program, the exported character); without bpy
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
        self._name = armature.name
        self._armature_bones = pose_writing.bones_of(armature)
        self._to_world = to_world
        self._server: server.ServerProcess | None = None
        self._folder: Path | None = None  # of what was exported
        self._program: Path | None = None
        self._preparation: Future | None = None  # of the settings file, before the server starts
        self.prepared: list[object] = []  # what the preparations returned
        self._pose_hz = 60.0
        self._live = False
        self._run = 0  # id of the server's run whose poses are applied
        self._push: PosePush | None = None
        self._travel: Future[layfigure.Reply] | None = None  # to a place of the history
        self._arrived_us = 0  # there, in the simulation's time: older poses are of before
        self._written: tuple[layfigure.Pose, Floats] | None = None
        self._parent_at_placement: Floats | None = None
        self._placement = np.eye(4)
        self._was_in_edit_mode = False

    def armature(self) -> bpy.types.Object | None:
        """The armature's object, found by the session's id; None if it was deleted."""
        known = bpy.data.objects.get(self._name)
        if known is None or known.layfigure.session != self.id:
            known = next((item for item in bpy.data.objects if item.layfigure.session == self.id), None)
        if known is None or known.type != "ARMATURE" or not known.users_scene:
            return None
        self._name = known.name
        return known

    @property
    def live(self) -> bool:
        """The doll's poses are applied."""
        return self._live and self._run != 0 and self._push is None and self._travel is None

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
        return self._program

    @property
    def character(self) -> Path | None:
        """What was exported for the session's own server."""
        return self._folder / "character.glb" if self._folder is not None else None

    @property
    def server_pid(self) -> int | None:
        """Of the session's own server."""
        return self._server.pid if self._server is not None else None

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
        self._follow_what_carries_the_root(armature)
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

    def push_pose(self) -> Future[None]:
        """Sends the pose that the bones have to the doll; the future is done when the doll has it.

        Until then no pose is applied. Its exception is a LayfigureError.
        """
        armature = self.armature()
        if armature is None or self.link is None or self.bones is None or self.link.state != "live":
            failed: Future[None] = Future()
            failed.set_exception(layfigure.UsageError(f"there is no doll yet: {self.message}"))
            return failed
        _evaluate(armature)
        matrices = pose_writing.matrices_of(armature, self.bones.bones)
        self._parent_at_placement = np.array(pose_writing.parent_matrix(armature, self.bones, self.bones.root))
        self._written = None
        self.place = NO_PLACE
        self._push = PosePush(self.link, self.bones, matrices)
        self._say("posing the doll as the armature is posed")
        return self._push.future

    def note_place(self, timeout_s: float = 1.0) -> None:
        """Asks the server for its place in its history, and writes it to the object: for operators that change the
        doll, before they return FINISHED, so that Blender's undo step and the doll's belong together."""
        if self.link is None:
            return
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
        self._travel = self.link.send("history", action="go", place=place)
        self.place = place

    def reconnect(self) -> None:
        """Connects anew; a server of the session's own that has ended is started again. Raises ServerError."""
        if self._program is not None:
            if self._server is not None:
                self._server.stop()
            self._close_link()
            self._prepare()
        elif self.link is not None:
            self._connect(self.link.url)
        self._begin_anew()

    def stop(self, message: str = "") -> None:
        """Restores all but the pose, ends the server if it is the session's own, and forgets the session."""
        _sessions.pop(self.id, None)
        self._preparation = None
        if message:
            _last_words[self._name] = message
        for item in bpy.data.objects:  # also a duplicate, which has its id
            if item.layfigure.session == self.id:
                release(item)
        self._close_link()
        if self._server is not None:
            self._server.stop()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
        _redraw()

    # --- beginning ---

    def begin(self, context: bpy.types.Context, armature: bpy.types.Object) -> None:
        """Raises ServerError, ExportError."""
        settings = preferences.of(context)
        if settings is not None and settings.url:
            self._connect(settings.url)
        else:
            self._program = server.find(settings.server_path if settings is not None else "")
            self._pose_hz = settings.pose_hz if settings is not None else 60.0
            self._export(context, armature)
        armature.layfigure.session = self.id
        armature.layfigure.place = NO_PLACE
        if self._program is not None:
            self._prepare()
        _last_words.pop(self._name, None)

    def _export(self, context: bpy.types.Context, armature: bpy.types.Object) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="layfigure-", dir=bpy.app.tempdir or None))
        try:
            self._to_world = export.export_character(context, armature, self._folder / "character.glb").to_world
        except BaseException:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    def _prepare(self) -> None:
        """Settings are tried on the server's program first, on a thread: that may take as long as its start."""
        armature, program, character = self.armature(), self._program, self.character
        assert armature is not None
        assert program is not None
        assert character is not None
        jobs = [job for source in _settings_sources if (job := source(armature)) is not None]
        self.prepared = []
        character.with_suffix(".doll.toml").unlink(missing_ok=True)  # of the start before
        if not jobs:
            self._start_server()
            return
        calls = [functools.partial(job, program, character) for job in jobs]
        self._preparation = in_background(functools.partial(call_all, calls), "settings")
        self._say("trying the settings of the doll")

    def _step_preparation(self) -> None:
        assert self._preparation is not None
        if not self._preparation.done():
            return
        preparation, self._preparation = self._preparation, None
        error = preparation.exception()
        if error is None:
            self.prepared = preparation.result()
            self._start_server()
        elif isinstance(error, LayfigureError | OSError):
            self.stop(str(error))
        else:
            raise error

    def _start_server(self) -> None:
        assert self._program is not None
        assert self._folder is not None
        self._server = server.ServerProcess(self._program, self._folder / "character.glb", pose_hz=self._pose_hz)
        self._say(self._server.progress)

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
        self._push = self._travel = self._written = None

    # --- what the timer does ---

    def step(self) -> None:
        """Goes on by what has come since the last call."""
        armature = self.armature()
        if armature is None:
            self.stop("the armature was deleted, or its Start undone: the doll has ended")
        elif not self._are_bones_the_same(armature):
            self.stop("the armature's bones were edited or renamed: the doll has ended; start it again")
        else:
            self._step_connection(armature)

    def _step_connection(self, armature: bpy.types.Object) -> None:
        if self._preparation is not None:
            self._step_preparation()
        elif self._server is not None and self._server.error is not None:
            self._take_the_servers_end(self._server.error)
        elif self.link is None:
            if self._server is not None and self._server.url is not None:
                self._connect(self._server.url)
            elif self._server is not None:
                self._say(self._server.progress)
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
        if self._push is not None or self._travel is not None:
            self._run = 0
        self._push = self._travel = None

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
        if self._push is not None:
            self._step_push()
        elif self._travel is not None:
            self._step_travel()
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
            if self._server is None:
                to_world = fitted(self.link.character, self._armature_bones, self._to_world)
            self.bones = BoneMap(self.link.character, self._armature_bones, to_world)
        except MisfitError as error:
            self.stop(str(error))
            return
        self._run = sample.pose.server_id
        self._arrived_us = 0
        self._live = True
        if self._server is not None:  # another's is left as it is
            self.link.send("set", gravity=NO_GRAVITY)
        self.push_pose()
        pose_writing.mute(armature, self.bones.driven_names)

    def _step_push(self) -> None:
        assert self._push is not None
        self._push.step()
        if not self._push.done:
            return
        error = self._push.future.exception()
        if isinstance(error, RefusedError):
            self.stop(f"the doll does not take the armature's pose: {error}")
        elif error is not None:
            self._forget_what_is_on_its_way()  # and try again
            self._fail(f"the doll did not take the armature's pose: {error}")
        else:
            assert self.bones is not None
            self._push = None
            self._placement = self.bones.placement

    def _step_travel(self) -> None:
        assert self._travel is not None
        if not self._travel.done():
            return
        error = self._travel.exception()
        if isinstance(error, RefusedError):
            self._travel = None
            self.push_pose()
        elif error is not None:
            self._forget_what_is_on_its_way()
            self._fail(str(error))
        else:
            self._arrived_us = self._travel.result().time_us
            self._travel = None

    def _apply_news(self, sample: Sample) -> None:
        is_news = self._written is None or not _are_equal(self._written[0], sample.pose)
        if is_news and sample.pose.time_us >= self._arrived_us:
            self.apply(sample)

    def _follow_what_carries_the_root(self, armature: bpy.types.Object) -> None:
        """Bones above the doll's root are not the doll's: it goes where they go."""
        assert self.bones is not None
        if self._parent_at_placement is None:
            return
        now = np.array(pose_writing.parent_matrix(armature, self.bones, self.bones.root))
        self.bones.placement = now @ np.linalg.inv(self._parent_at_placement) @ self._placement

    def _are_bones_the_same(self, armature: bpy.types.Object) -> bool:
        """Looked at after edit mode; names always, as bones are found by them."""
        in_edit_mode = armature.mode == "EDIT"
        was_in_edit_mode, self._was_in_edit_mode = self._was_in_edit_mode, in_edit_mode
        if in_edit_mode:
            return True
        if any(bone.name not in armature.pose.bones for bone in self._armature_bones):
            return False
        return not was_in_edit_mode or _same_bones(self._armature_bones, pose_writing.bones_of(armature))

    def mute_again(self) -> None:
        """After an undo, which brought back what was not muted when its step was made."""
        armature = self.armature()
        if armature is not None and self.bones is not None and self._live:
            pose_writing.mute(armature, self.bones.driven_names)

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


def _same_bones(a: Sequence[Bone], b: Sequence[Bone]) -> bool:
    if [(bone.name, bone.parent) for bone in a] != [(bone.name, bone.parent) for bone in b]:
        return False
    return np.array_equal([bone.rest for bone in a], [bone.rest for bone in b])


def _evaluate(armature: bpy.types.Object) -> None:
    """What was set of its bones shows in their matrices, in whatever scene it is."""
    scenes = armature.users_scene
    layers = [bpy.context.view_layer] if bpy.context.scene in scenes else [scene.view_layers[0] for scene in scenes[:1]]
    for layer in layers:
        layer.update()


def release(armature: bpy.types.Object) -> None:
    """Takes all traces of a session off it."""
    if armature.type == "ARMATURE":
        pose_writing.unmute(armature)
    for name in ("session", "place", "run"):
        armature.layfigure.property_unset(name)


def _redraw() -> None:
    """The panels, of which a message is none that Blender knows of."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
