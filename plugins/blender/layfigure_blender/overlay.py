# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws over the 3D views what hands do to live dolls. Without a live doll nothing is drawn, and nothing is asked."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import blf
import bpy
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader

from .overlay_picture import Hand, Label, Measures, Picture, hands_of, look_alike, picture
from .pins import PinList
from .seen_dolls import posable_sessions, seen_sessions, segments, view_of
from .sessions import Session
from .strokes import Triangles

FONT = 0  # Blender's own
FONT_SIZE = 13.0  # points of the screen
IDLE_S = 0.5  # between two looks for a live doll
LIVE_S = 1.0 / 30.0  # between two looks whether its hands moved
PINS_S = 0.5  # pins that others set, or an undo brought back, are seen after so long

# Blender 3 still tells shaders for two and three dimensions apart.
SHADER = "SMOOTH_COLOR" if bpy.app.version >= (4, 0, 0) else "3D_SMOOTH_COLOR"


class _Watch:
    """What is known of one session beside its link, and what was drawn of it."""

    def __init__(self, session: Session) -> None:
        assert session.link is not None
        self.link = session.link
        self.pins = PinList(session.link)
        self.pins.ask()
        self.measures = Measures.of(session.bones.character)
        self.drawn: list[Hand] = []
        self.drawn_pins: tuple[tuple[float, ...], ...] = ()
        self._asked_at = time.monotonic()
        self._sample = session.link.newest

    def look(self) -> None:
        """Whoever pins or undoes something moves the doll, or has just held it."""
        now = time.monotonic()
        if self.link.newest is not self._sample and now - self._asked_at >= PINS_S:
            self._sample, self._asked_at = self.link.newest, now
            self.pins.ask()

    def hands(self) -> list[Hand]:
        status = self.link.status
        return hands_of(self.link.forces.values(), status.devices if status is not None else ())

    def is_drawn_anew(self) -> bool:
        """Whether more has changed than bones, with which Blender draws anew by itself. Asked again it has not."""
        hands, pins = self.hands(), tuple((pin.number, *pin.position) for pin in self.pins.known)
        if pins == self.drawn_pins and look_alike(self.drawn, hands, self.measures):
            return False
        self.drawn, self.drawn_pins = hands, pins
        return True


_watches: dict[str, _Watch] = {}  # by the sessions' ids
_handle: Any = None


def pins_of(session: Session) -> PinList:
    return _watch_of(session).pins


def redraw() -> None:
    """All 3D views, soon, without their sidebars and bars: panels cost more than what is drawn here."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "WINDOW":
                        region.tag_redraw()


def _watch_of(session: Session) -> _Watch:
    watch = _watches.get(session.id)
    if watch is None or watch.link is not session.link:
        watch = _watches[session.id] = _Watch(session)
    return watch


def _look() -> float:
    """Called by a timer: forces and pins change while no pose does."""
    live = posable_sessions()
    for gone in _watches.keys() - {session.id for session in live}:
        del _watches[gone]
        redraw()
    for session in live:
        watch = _watch_of(session)
        watch.look()
        if watch.is_drawn_anew():
            redraw()
    return LIVE_S if live else IDLE_S


def _draw() -> None:
    """In the pixels of a region of a 3D view."""
    context = bpy.context
    if not posable_sessions() or not context.space_data.overlay.show_overlays:
        return
    for session in seen_sessions(context):
        drawn = picture_of(context, session)
        _draw_triangles(drawn.triangles)
        _draw_labels(drawn.labels, context.preferences.system.ui_scale)


def picture_of(context: bpy.types.Context, session: Session) -> Picture:
    """What a view shows of a session's hands: the mouse's, and those of devices."""
    watch = _watch_of(session)
    pins = np.reshape([pin.position for pin in watch.pins.known], (-1, 3))
    yielding = segments(session, list(_yielding_bones(session)))
    return picture(view_of(context, session), watch.hands(), pins, yielding, watch.measures.weight)


def _yielding_bones(session: Session) -> Iterator[str]:
    assert session.link is not None
    if session.link.newest is None:
        return
    for joint in np.flatnonzero(session.link.newest.pose.yielded):
        name = session.bones.bone_of_joint(int(joint))
        if name is not None:
            yield name


def _draw_triangles(triangles: Triangles) -> None:
    if not len(triangles.points):
        return
    shader = gpu.shader.from_builtin(SHADER)
    flat = np.zeros((len(triangles.points), 3), np.float32)
    flat[:, :2] = triangles.points
    batch = batch_for_shader(shader, "TRIS", {"pos": flat, "color": triangles.colors.astype(np.float32)})
    gpu.state.blend_set("ALPHA")
    batch.draw(shader)
    gpu.state.blend_set("NONE")


def _draw_labels(labels: tuple[Label, ...], scale: float) -> None:
    blf.enable(FONT, blf.SHADOW)
    blf.shadow(FONT, 3, 0.0, 0.0, 0.0, 0.8)
    if bpy.app.version >= (4, 0, 0):
        blf.size(FONT, FONT_SIZE * scale)
    else:
        blf.size(FONT, round(FONT_SIZE * scale), 72)
    for label in labels:
        blf.color(FONT, *label.color)
        blf.position(FONT, *label.place, 0.0)
        blf.draw(FONT, label.text)
    blf.disable(FONT, blf.SHADOW)


def register() -> None:
    global _handle
    _handle = bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_PIXEL")
    bpy.app.timers.register(_look, persistent=True)


def unregister() -> None:
    global _handle
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    bpy.types.SpaceView3D.draw_handler_remove(_handle, "WINDOW")
    _handle = None
    _watches.clear()
    redraw()
