"""What may go wrong while a doll is dragged in Blender's window: no crash, no traceback, a line that tells the mend."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from window_support import posing
from window_support.window import BlenderWindow, OpenBlender

WRIST = "hand.L"
UP = (-30.0, -150.0)  # [pixels] right and down
ON = (0.0, -60.0)  # [pixels] further
MOVED = 0.01  # [m], at least, by any of them
NO_SESSION = "sessions.all() == []"


@pytest.fixture
def dragging(blender: BlenderWindow, character: Path) -> BlenderWindow:
    """A wrist is held, and has been lifted."""
    posing.open_character(blender, character)
    posing.start(blender)
    posing.take_tool(blender)
    posing.pull(blender, WRIST, posing.take(blender, WRIST), UP)
    return blender


def drag_moves_it(blender: BlenderWindow) -> None:
    """Whatever has happened, the doll can be posed."""
    before = posing.settle(blender, WRIST)
    lifted = posing.pull(blender, WRIST, posing.take(blender, WRIST), ON)
    assert np.linalg.norm(lifted - before) > MOVED
    posing.let_go(blender, WRIST)


def is_gone(pid: int) -> bool:
    return not Path(f"/proc/{pid}").exists()


def test_killed_server_is_told_and_started_again(dragging: BlenderWindow) -> None:
    blender = dragging
    os.kill(blender.ask("sessions.all()[0].server_pid"), signal.SIGKILL)
    blender.wait_for("sessions.all()[0].failed")
    assert "Reconnect" in blender.ask("sessions.all()[0].message")
    blender.move(posing.way(posing.seen_at(blender, WRIST), ON))
    blender.release()
    blender.screenshot("server_killed")
    lifted = posing.head(blender, WRIST)

    blender.press_button("layfigure.reconnect")
    blender.wait_for("sessions.all()[0].live")
    assert np.linalg.norm(posing.settle(blender, WRIST) - lifted) < MOVED  # the new doll has the armature's pose
    drag_moves_it(blender)


def test_file_that_is_loaded_while_dragging_ends_the_doll(dragging: BlenderWindow, tmp_path: Path) -> None:
    blender, file = dragging, str(tmp_path / "scene.blend")
    server = blender.ask("sessions.all()[0].server_pid")
    blender.do(f"bpy.ops.wm.save_as_mainfile(filepath={file!r})")
    blender.do(f"bpy.ops.wm.open_mainfile(filepath={file!r})")
    blender.wait_for(NO_SESSION)
    assert is_gone(server)
    blender.move(posing.way(posing.seen_at(blender, WRIST), ON))
    blender.release()
    assert blender.ask("armature().layfigure.session") == ""

    blender.do("view_area().spaces.active.show_region_ui = True")
    posing.start(blender)
    drag_moves_it(blender)


def test_armature_that_is_deleted_while_dragging_ends_the_doll(dragging: BlenderWindow) -> None:
    blender = dragging
    server = blender.ask("sessions.all()[0].server_pid")
    x, y = posing.seen_at(blender, WRIST)
    blender.do("bpy.data.objects.remove(armature())")
    blender.wait_for(NO_SESSION)
    blender.move(posing.way((x, y), ON))
    blender.release()
    assert is_gone(server)
    blender.screenshot("armature_deleted")


def test_armature_that_is_renamed_while_dragging_goes_on(dragging: BlenderWindow) -> None:
    blender = dragging
    blender.do("armature().name = 'somebody else'")
    before = posing.head(blender, WRIST)
    assert np.linalg.norm(posing.pull(blender, WRIST, posing.seen_at(blender, WRIST), ON) - before) > MOVED
    posing.let_go(blender, WRIST)
    assert blender.ask("[session.live for session in sessions.all()]") == [True]


def test_two_blenders_pose_dolls_of_their_own(open_blender: OpenBlender, character: Path) -> None:
    blenders = [open_blender(), open_blender()]
    for blender in blenders:
        posing.open_character(blender, character)
        posing.start(blender)
        posing.take_tool(blender)
    one, other = blenders
    assert one.ask("sessions.all()[0].link.url") != other.ask("sessions.all()[0].link.url")
    still = posing.settle(other, WRIST)
    drag_moves_it(one)
    assert np.linalg.norm(posing.settle(other, WRIST) - still) < posing.REST
    drag_moves_it(other)
