"""Recording in a window of Blender's, where the timeline does play."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from window_support import posing
from window_support.window import BlenderWindow

WRIST = "hand.L"
FAR = (-60.0, -260.0)  # [pixels] right and down: the arm is lifted past its yield
IS_PLAYING = "any(window.screen.is_animation_playing for window in bpy.context.window_manager.windows)"
KEYS = "len(curves())"
SAME = 1e-3  # [m] between the places of a bone that came to rest twice in one pose


CURVES = """
def curves():
    data = armature().animation_data
    return list(data.action.fcurves) if data and data.action else []
"""


def live_doll(blender: BlenderWindow, character: Path) -> None:
    posing.open_character(blender, character)
    blender.do(CURVES)
    posing.start(blender)
    posing.take_tool(blender)
    posing.settle(blender, WRIST)


def frames_of(blender: BlenderWindow) -> list[float]:
    found: list[float] = blender.ask("sorted({key.co[0] for curve in curves() for key in curve.keyframe_points})")
    return found


def test_drag_while_recording_is_on_the_frames_that_were_shown(blender: BlenderWindow, character: Path) -> None:
    live_doll(blender, character)
    blender.do("bpy.context.scene.frame_end = 100000")
    before = posing.head(blender, WRIST)
    blender.press_button("layfigure.record")
    blender.wait_for(IS_PLAYING)
    lifted = posing.drag(blender, WRIST, FAR)
    blender.screenshot("keys_1_recording")
    assert blender.ask(KEYS) == 0  # nothing is keyed while it records
    blender.press_button("layfigure.record_stop")
    blender.wait_for(f"{KEYS} >= 4 * 17")
    assert not blender.ask(IS_PLAYING)
    blender.screenshot("keys_2_recorded")
    frames = frames_of(blender)
    assert frames == list(np.arange(1.0, frames[-1] + 1.0))  # each one, also those that playback left out
    assert np.linalg.norm(lifted - before) > 0.03

    # one step of undo, which leaves the doll as it is; and what was recorded plays without the doll
    blender.undo()
    blender.wait_for(f"{KEYS} == 0")
    assert np.linalg.norm(posing.settle(blender, WRIST) - lifted) < SAME
    blender.redo()
    blender.wait_for(f"{KEYS} > 0")
    blender.press_button("layfigure.stop")
    blender.wait_for("sessions.all() == []")
    blender.do("bpy.context.scene.frame_set(1)")
    assert np.linalg.norm(posing.head(blender, WRIST) - before) < SAME
    blender.do(f"bpy.context.scene.frame_set({int(frames[-1])})")
    assert np.linalg.norm(posing.head(blender, WRIST) - lifted) < SAME


def test_recording_ends_with_the_scene_and_with_the_playback(blender: BlenderWindow, character: Path) -> None:
    posing.open_character(blender, character)
    blender.do(CURVES)
    blender.do("make_drawing_light()")
    blender.do_in_view("bpy.ops.layfigure.start('EXEC_DEFAULT', True)")  # a step of undo, as of the button
    blender.wait_for("[session.live for session in sessions.all()] == [True]")
    blender.do("bpy.context.scene.frame_end = 30")
    blender.do_in_view("bpy.ops.layfigure.record()")
    blender.wait_for(f"{KEYS} > 0")  # by itself, when the timeline begins anew
    assert frames_of(blender)[-1] <= 30.0
    assert not blender.ask(IS_PLAYING)
    blender.undo()
    blender.wait_for(f"{KEYS} == 0")
    blender.do("bpy.context.scene.frame_end = 100000; bpy.context.scene.frame_set(1)")
    blender.do_in_view("bpy.ops.layfigure.record()")
    blender.wait_for(IS_PLAYING)
    blender.wait_for("bpy.context.scene.frame_current > 5")
    blender.key("Escape")  # which goes back to the first frame
    blender.wait_for(f"{KEYS} > 0")
    assert not blender.ask(IS_PLAYING)
    frames = frames_of(blender)
    assert frames[0] == 1.0
    assert frames[-1] > 5.0  # a doll that rests has keys at these two alone
