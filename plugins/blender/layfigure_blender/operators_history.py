# SPDX-License-Identifier: GPL-3.0-or-later
"""The doll's history: undo, redo, the mirror, snapshots.

Each of them that changes the doll is a step of Blender's undo too, which brings the doll with it: see
Session.note_place().
"""

from __future__ import annotations

from concurrent.futures import Future

import bpy
from bpy.app.handlers import persistent
from bpy.props import CollectionProperty, EnumProperty, IntProperty, PointerProperty, StringProperty

from layfigure import Reply

from . import sessions
from .commands import ChangesDoll, ask
from .link import Sample
from .live import live_session

LIST_INTERVAL_S = 0.1  # between two looks for the names of the snapshots
MOST_LETTERS = 64  # bytes of a snapshot's name, in the server

_listing: dict[str, Future[Reply]] = {}  # of snapshots, by session id
_listed: set[str] = set()  # sessions whose snapshots were asked for


def label_of(reply: Reply) -> str:
    return next((result.text for result in reply.results if result.name == "label"), "")


class LAYFIGURE_OT_undo(ChangesDoll, bpy.types.Operator):
    bl_idname = "layfigure.undo"
    bl_label = "Undo of the Doll"
    bl_description = "Put the doll back to before what a hand, or something else, last did to it"

    def execute(self, context: bpy.types.Context) -> set[str]:
        reply = self.change(context, "undo")
        if reply is None:
            return {"CANCELLED"}
        self.report({"INFO"}, f"Undone: {label_of(reply)}")
        return {"FINISHED"}


class LAYFIGURE_OT_redo(ChangesDoll, bpy.types.Operator):
    bl_idname = "layfigure.redo"
    bl_label = "Redo of the Doll"
    bl_description = "Do again to the doll what was undone last"

    def execute(self, context: bpy.types.Context) -> set[str]:
        reply = self.change(context, "redo")
        if reply is None:
            return {"CANCELLED"}
        self.report({"INFO"}, f"Done again: {label_of(reply)}")
        return {"FINISHED"}


class LAYFIGURE_OT_mirror(ChangesDoll, bpy.types.Operator):
    bl_idname = "layfigure.mirror"
    bl_label = "Mirror"
    bl_description = "Mirror the doll's pose, as a whole or of one side onto the other"

    side: EnumProperty(  # type: ignore[valid-type]
        name="Side",
        items=(
            ("both", "Both", "Exchange the poses of left and right"),
            ("left", "Left to Right", "The right side gets the pose of the left one, mirrored"),
            ("right", "Right to Left", "The left side gets the pose of the right one, mirrored"),
        ),
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.only_change(context, "mirror", side=self.side)


# ---------------------------------------------------------------- snapshots


class LayfigureSnapshot(bpy.types.PropertyGroup):
    """Its name is the snapshot's."""


class LayfigureSnapshots(bpy.types.PropertyGroup):
    """Of the window manager, window_manager.layfigure_snapshots: neither saved nor undone, as the server keeps them."""

    of: StringProperty(options={"HIDDEN"})  # type: ignore[valid-type]  # id of the session whose they are
    names: CollectionProperty(type=LayfigureSnapshot)  # type: ignore[valid-type]
    active: IntProperty(name="Snapshot")  # type: ignore[valid-type]


def chosen_snapshot(context: bpy.types.Context, session: sessions.Session) -> str:
    """The name that is active in the list; "" if there is none of this session."""
    known = context.window_manager.layfigure_snapshots
    return known.names[known.active].name if known.of == session.id and known.active < len(known.names) else ""


def show_snapshots(session_id: str, reply: Reply, chosen: str = "") -> None:
    known = bpy.context.window_manager.layfigure_snapshots
    known.of = session_id
    known.names.clear()
    names = [result.text for result in reply.results if result.name == "name"]
    for name in names:
        known.names.add().name = name
    known.active = names.index(chosen) if chosen in names else min(max(known.active, 0), max(len(names) - 1, 0))


class _HasSnapshots:
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return live_session(cls, context) is not None

    def refresh(self, session: sessions.Session, chosen: str = "") -> bool:
        reply = ask(self, session, "snapshot", action="list")
        if reply is not None:
            show_snapshots(session.id, reply, chosen)
        return reply is not None


class _OfChosenSnapshot(_HasSnapshots):
    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        session = live_session(cls, context)
        if session is not None and not chosen_snapshot(context, session):
            cls.poll_message_set("There is no snapshot: save one, or refresh the list")
            return False
        return session is not None

    def wanted(self, context: bpy.types.Context) -> str:
        return self.name or chosen_snapshot(context, sessions.active(context))


class LAYFIGURE_OT_snapshot_save(_HasSnapshots, bpy.types.Operator):
    bl_idname = "layfigure.snapshot_save"
    bl_label = "Save Snapshot"
    bl_description = "Keep the doll as it is under a name, beyond the end of the server and of Blender"
    bl_options = {"REGISTER"}  # noqa: RUF012

    name: StringProperty(name="Name", description="One that is there already is replaced", default="Pose")  # type: ignore[valid-type]

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context: bpy.types.Context) -> set[str]:
        name = self.name.strip()
        if not 0 < len(name.encode()) <= MOST_LETTERS:
            self.report(
                {"ERROR"}, f"The snapshot's name has {len(name.encode())} letters, expected 1 to {MOST_LETTERS}"
            )
            return {"CANCELLED"}
        session = sessions.active(context)
        done = ask(self, session, "snapshot", name=name) is not None and self.refresh(session, name)
        return {"FINISHED"} if done else {"CANCELLED"}


class LAYFIGURE_OT_snapshot_restore(_OfChosenSnapshot, ChangesDoll, bpy.types.Operator):
    bl_idname = "layfigure.snapshot_restore"
    bl_label = "Restore Snapshot"
    bl_description = "Put the doll back to how it was kept"

    name: StringProperty(name="Name", options={"SKIP_SAVE"})  # type: ignore[valid-type]  # empty: the active one

    def execute(self, context: bpy.types.Context) -> set[str]:
        return self.only_change(context, "snapshot", name=self.wanted(context), action="restore")


class LAYFIGURE_OT_snapshot_remove(_OfChosenSnapshot, bpy.types.Operator):
    bl_idname = "layfigure.snapshot_remove"
    bl_label = "Remove Snapshot"
    bl_description = "Forget the snapshot"
    bl_options = {"REGISTER"}  # noqa: RUF012

    name: StringProperty(name="Name", options={"SKIP_SAVE"})  # type: ignore[valid-type]  # empty: the active one

    def execute(self, context: bpy.types.Context) -> set[str]:
        session = sessions.active(context)
        removed = ask(self, session, "snapshot", name=self.wanted(context), action="remove") is not None
        return {"FINISHED"} if self.refresh(session) and removed else {"CANCELLED"}


class LAYFIGURE_OT_snapshot_refresh(_HasSnapshots, bpy.types.Operator):
    bl_idname = "layfigure.snapshot_refresh"
    bl_label = "Refresh Snapshots"
    bl_description = "Read the names of the snapshots that are kept of this character"
    bl_options = {"REGISTER"}  # noqa: RUF012

    def execute(self, context: bpy.types.Context) -> set[str]:
        return {"FINISHED"} if self.refresh(sessions.active(context)) else {"CANCELLED"}


def on_sample(session: sessions.Session, _sample: Sample) -> None:
    """Asks once, without waiting, what snapshots there are."""
    if session.id in _listed:
        return
    _listed.add(session.id)
    _listing[session.id] = session.link.send("snapshot", action="list")
    if not bpy.app.timers.is_registered(take_lists):
        bpy.app.timers.register(take_lists, first_interval=LIST_INTERVAL_S)


def take_lists() -> float | None:
    """A timer, until all that was asked is answered."""
    for session_id, listing in list(_listing.items()):
        if listing.done():
            del _listing[session_id]
            if listing.exception() is None:
                show_snapshots(session_id, listing.result())
    return LIST_INTERVAL_S if _listing else None


@persistent
def on_load(*_: object) -> None:
    _listing.clear()
    _listed.clear()


classes = (
    LayfigureSnapshot,
    LayfigureSnapshots,
    LAYFIGURE_OT_undo,
    LAYFIGURE_OT_redo,
    LAYFIGURE_OT_mirror,
    LAYFIGURE_OT_snapshot_save,
    LAYFIGURE_OT_snapshot_restore,
    LAYFIGURE_OT_snapshot_remove,
    LAYFIGURE_OT_snapshot_refresh,
)


def register() -> None:
    bpy.types.WindowManager.layfigure_snapshots = PointerProperty(type=LayfigureSnapshots)
    sessions.add_listener(on_sample)
    bpy.app.handlers.load_pre.append(on_load)


def unregister() -> None:
    bpy.app.handlers.load_pre.remove(on_load)
    sessions.remove_listener(on_sample)
    if bpy.app.timers.is_registered(take_lists):
        bpy.app.timers.unregister(take_lists)
    del bpy.types.WindowManager.layfigure_snapshots
    on_load()
