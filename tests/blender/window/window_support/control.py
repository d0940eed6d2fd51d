"""Runs inside Blender: lets a test look at its state and set it, through a Unix socket.

    blender --python control.py -- SOCKET

Each line that comes is JSON, {"run": "statements", "value": "an expression"}; each answer is one line, {"value": ..} or
{"error": "the traceback"}. Both run on the main thread, from a timer, as bpy requires, within one namespace that stays,
and which begins with what this file defines. What a user does is done with mouse and keys instead, see window.py.

Operators that need a window, an area or a region are not called from the timer, which has none: a request with
"at_mouse": true is answered null at once, and then a second time when KEY is pressed, in the context that an operator
has there. To lend the timer a context with temp_override() has Blender 3.4 to 5.0 crash now and then beside a thread
that runs Python, such as an extension's: while an operator is called, it asks Python for the members of the context
without its lock.
"""

import contextlib
import json
import socket
import sys
import time
import traceback

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d
from mathutils import Vector

POLL_S = 0.005
KEY = "F8"  # which Blender has nothing else for
LINE_LIMIT = 1 << 20  # bytes

# --- what tests use -------------------------------------------------------------------------------------------------


def window():
    return bpy.context.window_manager.windows[0]


def view_area():
    return max((a for a in window().screen.areas if a.type == "VIEW_3D"), key=lambda area: area.width)


def region_of(area, kind):
    return next(region for region in area.regions if region.type == kind)


def in_view():
    """A context in the 3D view, as long as no thread runs Python."""
    area = view_area()
    return bpy.context.temp_override(window=window(), area=area, region=region_of(area, "WINDOW"))


def on_screen(point):
    """Where a point of the world is drawn: x to the right, y down, in pixels of the X display."""
    area = view_area()
    region = region_of(area, "WINDOW")
    place = location_3d_to_region_2d(region, area.spaces.active.region_3d, Vector(point))
    return [region.x + place.x, window().height - 1 - (region.y + place.y)]


def rectangle(kind):
    """The region of the 3D view on the X display: left, top, width, height in pixels."""
    region = region_of(view_area(), kind)
    return [region.x, window().height - (region.y + region.height), region.width, region.height]


def bone_head(bone):
    """Where the head of a bone of the only armature is in the world [m]."""
    item = armature()
    return list(item.matrix_world @ item.pose.bones[bone].head)


def armature():
    [item] = (item for item in bpy.context.scene.objects if item.type == "ARMATURE")
    return item


def load_character(path):
    """A scene with nothing but a glTF file's character, its armature selected, seen from its front."""
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    with in_view():
        bpy.ops.import_scene.gltf(filepath=path)
        for item in bpy.context.scene.objects:
            item.select_set(item.type == "ARMATURE")
        bpy.context.view_layer.objects.active = armature()
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_all()


def make_drawing_light():
    """As somebody sets it whose machine draws slowly: without anti-aliasing, and nothing but the view."""
    bpy.context.preferences.system.viewport_aa = "OFF"
    bpy.context.preferences.system.use_overlay_smooth_wire = False
    view_area().spaces.active.show_region_ui = False


def operator_under_mouse():
    """The Python call of the button that the mouse is over; empty if there is none. To be asked at the mouse."""
    manager = bpy.context.window_manager
    manager.clipboard = ""
    with contextlib.suppress(RuntimeError):  # there is no button, or none with an operator
        bpy.ops.ui.copy_python_command_button()
    return manager.clipboard


panel_draws = 0  # of the panels that are watched


def watch_panels(tab):
    """Counts the draws of the panels of one tab of the sidebar."""
    global panel_draws
    panel_draws = 0
    for panel in bpy.types.Panel.__subclasses__():
        if getattr(panel, "bl_category", "") == tab:
            panel.append(_count_panel)


def _count_panel(_panel, _context):
    global panel_draws
    panel_draws += 1


class DrawWatch:
    """Notes when a draw of the 3D view was on the screen, and where a bone was in it."""

    def __init__(self, bone):
        self.begin = bone_head(bone)
        self.draws = []  # (monotonic time [s], x, y, z [m])
        self.always = False  # one draw is to follow the other, as if the bone were posed with Blender's own tools
        self._bone = bone
        self._drawn = []
        self._handle = bpy.types.SpaceView3D.draw_handler_add(self._note, (), "WINDOW", "POST_PIXEL")

    def _note(self):
        """While it is drawn. A timer's turn comes next after all of the window was, and was brought to the screen."""
        self._drawn.append(bone_head(self._bone))
        if not bpy.app.timers.is_registered(self._show):
            bpy.app.timers.register(self._show, first_interval=0.0)

    def _show(self):
        self.draws += [(time.monotonic(), *place) for place in self._drawn]
        self._drawn.clear()
        if self.always:
            self.pose_again()

    def pose_again(self):
        """To the same pose; Blender evaluates and draws all that shows it."""
        bone = armature().pose.bones[self._bone]
        bone.rotation_quaternion = bone.rotation_quaternion

    def close(self):
        bpy.types.SpaceView3D.draw_handler_remove(self._handle, "WINDOW")


# --- the socket -----------------------------------------------------------------------------------------------------


class Control:
    def __init__(self, path):
        self._listener = socket.socket(socket.AF_UNIX)
        self._listener.bind(path)
        self._listener.listen(1)
        self._listener.setblocking(False)
        self._peer = None
        self._received = b""
        self._at_mouse = None  # a request that waits for the key

    def poll(self):
        """Answers all that has come."""
        with contextlib.suppress(BlockingIOError):
            if self._peer is None:
                self._peer, _ = self._listener.accept()
                self._peer.setblocking(False)
            while part := self._peer.recv(LINE_LIMIT):
                self._received += part
        while b"\n" in self._received:
            line, _, self._received = self._received.partition(b"\n")
            request = json.loads(line)
            if request.get("at_mouse"):
                self._at_mouse = request
                self._answer({"value": None})
            else:
                self._answer(evaluate(request))
        return POLL_S

    def answer_at_mouse(self):
        request, self._at_mouse = self._at_mouse, None
        self._answer(evaluate(request))

    def _answer(self, answer):
        self._peer.setblocking(True)
        self._peer.sendall(json.dumps(answer, default=plain).encode() + b"\n")
        self._peer.setblocking(False)


class WM_OT_answer_at_mouse(bpy.types.Operator):  # noqa: N801, as Blender asks for it
    """Answer the request that waits for the key"""

    bl_idname = "wm.answer_at_mouse"
    bl_label = "Answer at Mouse"
    bl_options = {"INTERNAL"}  # noqa: RUF012

    def invoke(self, _context, _event):
        control.answer_at_mouse()
        return {"FINISHED"}


def plain(number):
    """A scalar of NumPy's as Python's, for JSON."""
    return number.item()


def evaluate(request):
    try:
        exec(request["run"], globals())
        return {"value": eval(request["value"], globals())}
    except Exception:  # whatever it is, the test is to see it
        return {"error": traceback.format_exc()}


if not hasattr(np, "bool"):  # as Debian's glTF importer asks for it, and NumPy 1.24 to 1.26 do not have it
    np.bool = bool
bpy.context.preferences.view.show_splash = False
bpy.context.preferences.view.use_save_prompt = False
bpy.context.preferences.view.smooth_view = 0  # views are where they are to be at once
control = Control(sys.argv[-1])
bpy.utils.register_class(WM_OT_answer_at_mouse)
keymap = bpy.context.window_manager.keyconfigs.addon.keymaps.new("Window")
keymap.keymap_items.new(WM_OT_answer_at_mouse.bl_idname, KEY, "PRESS")
bpy.app.timers.register(control.poll, persistent=True)
