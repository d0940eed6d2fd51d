# SPDX-License-Identifier: GPL-3.0-or-later
"""Posing by hand: the tool of the 3D view, and what its mouse and keys do. What they mean is told in grab.py."""

from __future__ import annotations

import time
from typing import Any

import bpy
import numpy as np
from bpy.props import BoolProperty

from . import overlay, sessions
from .grab import Grab, Outcome, Phase, free_pointer
from .picking import point_under
from .seen_dolls import Target, is_posable, joint_under, posable_sessions, seen_sessions, target_under, view_of
from .sessions import Session

TOOL = "layfigure.pose_doll"
TICK_S = 1.0 / 60.0  # between two looks for the server's answers, where the mouse rests
# The longest that a motion of the mouse waits for the pose that it brings about, so that the redraw that follows shows
# it, and not the next one: the 2 ms until it can be seen, and an interval of a server's 120 poses in a second.
EFFECT_S = 0.011
PIXELS_PER_NOTCH = 30.0  # points of the screen of a two-finger stroke that are a notch of a wheel

# What the panel and the status bar list.
KEYS = (
    ("Drag", "move"),
    ("Wheel", "deeper, nearer"),
    ("Shift", "slow"),
    ("Ctrl", "turn"),
    ("P", "pin"),
    ("X", "unpin"),
    ("Shift X", "unpin all"),
    ("S", "soften"),
    ("Right, Esc", "cancel"),
)


class LAYFIGURE_OT_grab(bpy.types.Operator):
    """Hold the doll at a bone or at its skin, and drag it"""

    bl_idname = "layfigure.grab"
    bl_label = "Pose Doll"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.space_data is not None and context.space_data.type == "VIEW_3D" and bool(seen_sessions(context))

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if context.region_data is None:
            return {"PASS_THROUGH"}
        mouse = (event.mouse_region_x, event.mouse_region_y)
        target = target_under(context, mouse)
        if target is None:
            return {"PASS_THROUGH"}
        if not self._press(context, target, mouse):
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(TICK_S, window=context.window)
        context.window_manager.modal_handler_add(self)
        self._tell(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self._session.armature() is None:
            self.report({"WARNING"}, "The doll's armature is gone")
            self.cancel(context)
            return {"CANCELLED"}
        self._hear(context, event)
        self._grab.poll(time.monotonic())
        if self._grab.phase is Phase.ENDED:
            return self._finish(context, event)
        if self._grab.phase is Phase.HOLDING and event.type == "MOUSEMOVE":  # the newest: those before are INBETWEEN
            self._session.show_effect(EFFECT_S)
        self._tell(context)
        # Playback, and what else has a timer, goes on.
        return {"PASS_THROUGH"} if event.type.startswith("TIMER") else {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends it: its view is closed, another file comes."""
        self._grab.cancel()
        self._clean_up(context)

    def _press(self, context: bpy.types.Context, target: Target, mouse: tuple[float, float]) -> bool:
        link = target.session.link
        assert link is not None
        pointer = free_pointer(link.status, link.forces)
        if pointer is None:
            self.report({"WARNING"}, "All pointers of the server are in use: release one")
            return False
        radius = context.preferences.inputs.drag_threshold_mouse * context.preferences.system.ui_scale
        self._session = target.session
        self._pressed = mouse
        self._told = ""
        self._grab = Grab(
            link,
            overlay.pins_of(target.session),
            pointer,
            target.ways,
            mouse,
            time.monotonic(),
            click_radius=radius,
            why_no_way=target.why_none,
        )
        return True

    def _hear(self, context: bpy.types.Context, event: bpy.types.Event) -> None:
        grab, kind = self._grab, event.type
        held = {"slow": event.shift, "turn": event.ctrl}
        if kind in {"MOUSEMOVE", "INBETWEEN_MOUSEMOVE"}:
            grab.mouse(self._view(context), (event.mouse_region_x, event.mouse_region_y), **held)
        elif kind in {"WHEELUPMOUSE", "WHEELDOWNMOUSE"}:
            grab.wheel(self._view(context), 1.0 if kind == "WHEELUPMOUSE" else -1.0, **held)
        elif kind == "TRACKPADPAN":
            way = (event.mouse_y - event.mouse_prev_y) / context.preferences.system.ui_scale
            grab.wheel(self._view(context), way / PIXELS_PER_NOTCH, **held)
        elif kind == "LEFTMOUSE" and event.value == "RELEASE":
            grab.release()
        elif event.value == "PRESS":
            self._hear_key(kind, event.shift)

    def _hear_key(self, key: str, shift: bool) -> None:
        if key in {"RIGHTMOUSE", "ESC"}:
            self._grab.cancel()
        elif key == "P":
            self._grab.pin()
        elif key == "X":
            (self._grab.unpin_all if shift else self._grab.unpin)()
        elif key == "S":
            self._grab.soften()

    def _view(self, context: bpy.types.Context) -> Any:
        return view_of(context, self._session)

    def _tell(self, context: bpy.types.Context) -> None:
        """In the status bar, if it is news: each text that is set is drawn anew, and the whole window shown anew."""
        states = [self._held_name()]
        states += (
            ["pinned"] * self._grab.pinned + ["soft"] * self._grab.softened + ["turning"] * self._grab.holds_rotation
        )
        text = ", ".join(filter(None, states))
        keys = "   ".join(f"{key}: {meaning}" for key, meaning in KEYS)
        line = "   |   ".join(filter(None, [text, keys, self._grab.note]))
        if line != self._told:
            self._told = line
            context.workspace.status_text_set(line)

    def _held_name(self) -> str:
        joint = self._grab.joint
        return "" if joint is None else self._session.bones.character.joints[joint].name

    def _finish(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        self._clean_up(context)
        outcome, note = self._grab.outcome, self._grab.note
        if note:
            self.report({"INFO"} if outcome is Outcome.MISSED else {"WARNING"}, note)
        if outcome is Outcome.RELEASED:
            self._session.note_place()
            return {"FINISHED"}
        if outcome is Outcome.CLICKED:
            _select(self._pressed, extend=event.shift)
        return {"CANCELLED"}

    def _clean_up(self, context: bpy.types.Context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        overlay.redraw()


class LAYFIGURE_OT_unpin(bpy.types.Operator):
    """Take the pins off the bone under the mouse, or off the whole doll"""

    bl_idname = "layfigure.unpin"
    bl_label = "Unpin Doll"
    bl_options = {"UNDO"}  # noqa: RUF012

    all: BoolProperty(  # type: ignore[valid-type]
        name="All", description="All pins of the doll, wherever the mouse is", default=False, options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return bool(posable_sessions())

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self.all:
            return self.execute(context)
        if context.region_data is None:
            return {"CANCELLED"}
        mouse = (event.mouse_region_x, event.mouse_region_y)
        for session in seen_sessions(context):
            numbers = _pins_under(context, session, mouse)
            if numbers:
                return self._unpin(session, numbers)
        self.report({"INFO"}, "There is no pin under the mouse")
        return {"CANCELLED"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        session = sessions.active(context)
        if session is None or not is_posable(session):
            session = posable_sessions()[0]  # poll() has seen it
        numbers = [pin.number for pin in overlay.pins_of(session).known]
        if not numbers:
            self.report({"INFO"}, "The doll has no pins")
            return {"CANCELLED"}
        return self._unpin(session, numbers)

    def _unpin(self, session: Session, numbers: list[int]) -> set[str]:
        assert session.link is not None
        for number in numbers:
            session.link.send("unpin", pin=number)
        overlay.pins_of(session).ask()
        session.note_place()
        overlay.redraw()
        return {"FINISHED"}


def _pins_under(context: bpy.types.Context, session: Session, mouse: tuple[float, float]) -> list[int]:
    """The pin whose marker is there, else those of the bone that is."""
    pins, view = overlay.pins_of(session), view_of(context, session)
    marker = point_under(view, mouse, np.reshape([pin.position for pin in pins.known], (-1, 3)))
    if marker is not None:
        return [pins.known[marker].number]
    joint = joint_under(context, session, view, mouse)
    return [pin.number for pin in pins.of_joint(joint)] if joint is not None else []


def _select(pixel: tuple[float, float], extend: bool) -> None:
    """What a click selects in Blender's own tools; an undo step of its own."""
    place = tuple(round(c) for c in pixel)
    bpy.ops.view3d.select("EXEC_DEFAULT", True, location=place, toggle=extend, deselect_all=not extend)


class _PoseDollTool(bpy.types.WorkSpaceTool):
    bl_space_type = "VIEW_3D"
    bl_idname = TOOL
    bl_label = "Pose Doll"
    bl_description = "Drag the bones or the skin of a live Layfigure doll"
    bl_icon = "ops.pose.relax"
    bl_widget = None
    # Alt is left to the views' navigation with a mouse of two buttons.
    bl_keymap = (
        *(
            ("layfigure.grab", {"type": "LEFTMOUSE", "value": "PRESS", "shift": shift, "ctrl": ctrl}, None)
            for shift in (False, True)
            for ctrl in (False, True)
        ),
        ("layfigure.unpin", {"type": "X", "value": "PRESS"}, None),
        ("layfigure.unpin", {"type": "X", "value": "PRESS", "shift": True}, {"properties": [("all", True)]}),
    )

    def draw_settings(context: bpy.types.Context, layout: bpy.types.UILayout, _tool: Any) -> None:  # noqa: N805
        if not posable_sessions():
            layout.label(text="No doll is live: start one in the sidebar's tab Layfigure", icon="INFO")


class PoseDollInObjectMode(_PoseDollTool):
    bl_context_mode = "OBJECT"


class PoseDollInPoseMode(_PoseDollTool):
    bl_context_mode = "POSE"


TOOLS = (PoseDollInObjectMode, PoseDollInPoseMode)

classes = (LAYFIGURE_OT_grab, LAYFIGURE_OT_unpin)


def register() -> None:
    for tool in TOOLS:
        bpy.utils.register_tool(tool, separator=True)


def unregister() -> None:
    for tool in reversed(TOOLS):
        bpy.utils.unregister_tool(tool)
