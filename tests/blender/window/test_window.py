"""The extension in a window of Blender's, under a mouse: what a user does, from Start to Stop."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from window_support import posing
from window_support.posing import Position
from window_support.window import BlenderWindow

WRIST, OTHER_WRIST = "hand.L", "hand.R"
FAR = (-60.0, -260.0)  # [pixels] right and down: the arm is lifted past its yield
A_LITTLE = (0.0, -12.0)  # [pixels]: it is not
SAME = 1e-3  # [m] between the places of a bone in one pose
LIFTED = 0.03  # [m], at least, when what was pulled past its yield is let go; the arm is 0.14 m long
JOINTS = 17  # of the doll


def distance(a: Position, b: Position) -> float:
    return float(np.linalg.norm(a - b))


def test_story_of_posing(blender: BlenderWindow, character: Path) -> None:
    """Start, drag past the yield, let go, key, undo three times, stop: all by mouse and keys."""
    posing.open_character(blender, character)
    blender.screenshot("1_character")
    posing.start(blender)
    posing.take_tool(blender)
    at_rest = posing.settle(blender, WRIST)
    blender.screenshot("2_live")
    assert distance(posing.drag(blender, WRIST, A_LITTLE), at_rest) < SAME  # it springs back

    blender.do("flows = []; sessions.add_listener(lambda _, sample: flows.append(bool(sample.pose.yielded.any())))")
    dragged = posing.pull(blender, WRIST, posing.take(blender, WRIST), FAR)
    blender.screenshot("3_dragged")
    lifted = posing.let_go(blender, WRIST)
    blender.screenshot("4_let_go")
    assert blender.ask("any(flows)")
    assert distance(dragged, at_rest) > 2 * LIFTED
    assert distance(lifted, at_rest) > LIFTED  # it stays
    other_at_rest = posing.head(blender, OTHER_WRIST)
    both_lifted = posing.drag(blender, OTHER_WRIST, (-FAR[0], FAR[1]))
    assert distance(both_lifted, other_at_rest) > LIFTED

    keys = "bool(armature().animation_data and armature().animation_data.action)"
    assert not blender.ask(keys)  # nothing is keyed unless it is asked for
    blender.press_button("layfigure.key_pose")
    blender.wait_for(keys)
    assert blender.ask("len(armature().animation_data.action.fcurves)") >= 4 * JOINTS
    blender.screenshot("5_keyed")

    blender.undo()
    blender.wait_for(f"not {keys}")
    assert distance(posing.settle(blender, OTHER_WRIST), both_lifted) < SAME  # the keys are undone, not the pose
    blender.undo()
    assert distance(posing.settle(blender, OTHER_WRIST, both_lifted), other_at_rest) < SAME
    with_one_arm = posing.head(blender, WRIST)
    assert distance(with_one_arm, lifted) < SAME
    blender.undo()
    assert distance(posing.settle(blender, WRIST, with_one_arm), at_rest) < SAME
    blender.screenshot("6_undone")
    blender.redo()
    redone = posing.settle(blender, WRIST, at_rest)
    assert distance(redone, lifted) < SAME

    server = blender.ask("sessions.all()[0].server_pid")
    assert Path(f"/proc/{server}").exists()
    blender.press_button("layfigure.stop")
    blender.wait_for("sessions.all() == []")
    assert not Path(f"/proc/{server}").exists()
    assert distance(posing.head(blender, WRIST), redone) < SAME
    blender.screenshot("7_stopped")
