"""The doll in hand in Blender's window: keys, views, and what may go wrong meanwhile."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from window_support import posing
from window_support.window import BlenderWindow

HAND, OTHER_HAND, CHEST = "hand.L", "hand.R", "chest"
NEAR = 2e-3  # [m]: what a pin gives way by
ON_SPOT = 1.5  # [pixels]: the mouse is on whole ones

# A hand that holds the doll by the mouse: it has the highest number.
HELD_FORCE = "[f for f in sessions.all()[0].link.forces.values() if f.attached][-1]"
PINS = "len(overlay.pins_of(sessions.all()[0]).known)"
TOOL = "bpy.context.workspace.tools.from_space_view3d_mode(bpy.context.mode).idname"


@pytest.fixture
def doll(blender: BlenderWindow, character: Path) -> BlenderWindow:
    """The project's doll, live, with the tool in hand."""
    posing.open_character(blender, character)
    blender.do("from layfigure_blender import overlay\narmature().show_in_front = True")
    posing.start(blender)
    blender.press_button("wm.tool_set_by_id")
    assert blender.ask(TOOL) == "layfigure.pose_doll"
    return blender


def distance(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.linalg.norm(a - b))


def lead(blender: BlenderWindow, begin: tuple[float, float], x: float, y: float, held: str = "") -> None:
    """The mouse, by so many pixels to the right and down."""
    blender.move(posing.way(begin, (x, y)), held=held)


def test_pinned_hand_stays_while_the_other_is_dragged(doll: BlenderWindow) -> None:
    begin = posing.take(doll, HAND)
    lead(doll, begin, -20.0, -120.0)
    doll.key("p")
    doll.wait_for(f"{PINS} == 1")
    doll.screenshot("grab_pinned")
    pinned = posing.let_go(doll, HAND)

    begin = posing.take(doll, OTHER_HAND)
    before = posing.head(doll, OTHER_HAND)
    lead(doll, begin, 60.0, -160.0)
    doll.screenshot("grab_one_pinned_one_dragged")
    posing.settle(doll, OTHER_HAND, before)
    assert distance(posing.head(doll, HAND), pinned) < NEAR
    posing.let_go(doll, OTHER_HAND)

    x, y = posing.seen_at(doll, HAND)
    doll.move([(x - 5.0, y), (x, y)])
    doll.key("x")
    doll.wait_for(f"{PINS} == 0")
    assert doll.ask("armature() is not None"), "X deletes what is selected in Blender"
    doll.screenshot("grab_unpinned")


def test_cancelled_drag_leaves_no_trace(doll: BlenderWindow) -> None:
    before = posing.settle(doll, HAND)
    steps = doll.ask("armature().layfigure.place")
    begin = posing.take(doll, HAND)
    doll.key("s")
    lead(doll, begin, 30.0, -150.0)
    doll.screenshot("grab_softened")
    posing.settle(doll, HAND, before)
    doll.click((begin[0] + 30.0, begin[1] - 150.0), button=3)
    doll.wait_for(f"not {posing.HELD}")
    assert distance(posing.settle(doll, HAND), before) < 1e-4
    doll.release()
    assert doll.ask("armature().layfigure.place") == steps


def test_click_selects_the_bone_and_moves_nothing(doll: BlenderWindow) -> None:
    doll.do_in_view("bpy.ops.object.mode_set(mode='POSE')")
    doll.press_button("wm.tool_set_by_id")
    before = posing.settle(doll, HAND)
    x, y = posing.seen_at(doll, HAND)
    doll.click((x, y))
    doll.wait_for("bpy.context.active_pose_bone is not None")
    assert doll.ask("bpy.context.active_pose_bone.name") in (HAND, "forearm.L")
    assert distance(posing.settle(doll, HAND), before) < 1e-6
    assert not doll.ask(posing.HELD)


@pytest.mark.parametrize("view", ["user", "orthographic", "camera", "quad", "local"])
def test_held_skin_is_under_the_mouse_in_any_view(doll: BlenderWindow, view: str) -> None:
    doll.do("armature().show_in_front = False; armature().hide_set(True)")
    doll.do("bpy.context.view_layer.objects.active = armature()")
    prepare = {
        "user": "bpy.ops.view3d.view_orbit(type='ORBITLEFT'); region_3d().view_perspective = 'PERSP'",
        "orthographic": "bpy.ops.view3d.view_axis(type='RIGHT')",
        "camera": (
            "bpy.ops.object.camera_add(location=(0.3, -0.9, 0.4), rotation=(1.2, 0, 0.3))\n"
            "bpy.context.object.data.shift_x = 0.1\n"
            "bpy.context.scene.camera = bpy.context.object\n"
            "region_3d().view_perspective = 'CAMERA'\n"
            "bpy.context.view_layer.objects.active = armature()"
        ),
        "quad": "bpy.ops.screen.region_quadview()",
        "local": "[o.select_set(o.type == 'MESH') for o in bpy.context.scene.objects]\nbpy.ops.view3d.localview()",
    }
    doll.do("region_3d = lambda: view_area().spaces.active.region_3d")
    doll.do_in_view(prepare[view])
    begin = posing.seen_in_new_view(doll, CHEST)
    doll.move([(begin[0] - 5.0, begin[1]), begin])
    doll.press()
    doll.wait_for(posing.HELD)
    lead(doll, begin, 40.0, -30.0)
    x, y = np.add(begin, [40.0, -30.0])
    doll.do(f"away = lambda p: max(abs(p[0] - {x}), abs(p[1] - {y}))")
    doll.wait_for(f"away(on_screen({HELD_FORCE}.target.tolist())) < {ON_SPOT}")
    doll.screenshot(f"grab_view_{view}")
    posing.let_go(doll, CHEST)


def test_wheel_shift_and_ctrl_do_what_they_say(doll: BlenderWindow) -> None:
    begin = posing.take(doll, HAND)
    depth, height = doll.ask(f"{HELD_FORCE}.target.tolist()[1:]")
    for _ in range(3):
        doll.press(4)
        doll.release(4)
    doll.wait_for(f"{HELD_FORCE}.target[1] > {depth} + 0.001")  # it is seen from in front, along y
    lead(doll, begin, 0.0, -100.0, held="shift")
    posing.settle(doll, HAND)
    slow = doll.ask(f"{HELD_FORCE}.target[2]") - height
    assert slow > 0.0
    lead(doll, (begin[0], begin[1] - 100.0), 0.0, -100.0)
    doll.wait_for(f"{HELD_FORCE}.target[2] - {height} > 5 * {slow}")
    posing.settle(doll, HAND)
    placed = np.array(doll.ask(f"{HELD_FORCE}.target.tolist()"))
    lead(doll, (begin[0], begin[1] - 200.0), 60.0, 0.0, held="ctrl")
    doll.wait_for(f"any({HELD_FORCE}.torque)")
    doll.screenshot("grab_turned")
    assert distance(np.array(doll.ask(f"{HELD_FORCE}.target.tolist()")), placed) < NEAR
    posing.let_go(doll, HAND)


def test_view_is_navigated_between_grabs_and_playback_goes_on_meanwhile(doll: BlenderWindow) -> None:
    view = "[list(row) for row in view_area().spaces.active.region_3d.view_matrix]"
    before = doll.ask(view)
    x, y = posing.seen_at(doll, HAND)
    doll.move([(x, y)])
    doll.press(2)
    lead(doll, (x, y), 60.0, 10.0)
    doll.release(2)
    doll.wait_for(f"{view} != {before!r}")
    doll.do_in_view("bpy.ops.screen.animation_play()")
    posing.take(doll, HAND)
    frame = doll.ask("bpy.context.scene.frame_current")
    doll.wait_for(f"bpy.context.scene.frame_current != {frame}")
    assert doll.ask(posing.HELD)
    posing.let_go(doll, HAND)
    doll.do_in_view("bpy.ops.screen.animation_cancel()")


def test_server_that_is_killed_amid_a_drag_ends_it(doll: BlenderWindow) -> None:
    begin = posing.take(doll, HAND)
    lead(doll, begin, 10.0, -60.0)
    os.kill(doll.ask("sessions.all()[0].server_pid"), signal.SIGKILL)
    doll.wait_for("sessions.all()[0].failed")
    lead(doll, begin, 50.0, -60.0)
    doll.release()
    doll.screenshot("grab_server_killed")
    doll.press_button("layfigure.reconnect")  # keys and mouse are free again
    doll.wait_for("sessions.all()[0].live")
    posing.take(doll, HAND)
    posing.let_go(doll, HAND)


def test_armature_that_is_deleted_amid_a_drag_ends_it(doll: BlenderWindow) -> None:
    begin = posing.take(doll, HAND)
    lead(doll, begin, 10.0, -60.0)
    doll.do("bpy.data.objects.remove(armature())")
    doll.wait_for("sessions.all() == []")
    lead(doll, begin, 50.0, -60.0)
    doll.release()
    doll.screenshot("grab_armature_deleted")
    assert doll.process.poll() is None
