"""Joints of a live doll in a window of Blender's: set, shown, undone and set again."""

from __future__ import annotations

from pathlib import Path

from window_support import posing
from window_support.legacy_addon import MODULE
from window_support.window import BlenderWindow

BONE = "forearm.L"
JOINT = f"armature().pose.bones[{BONE!r}].layfigure_joint"
SERVERS = f"joint_live.sender_of(armature()).now({BONE!r}).laws['hardening'].unit"


def set_hardening(blender: BlenderWindow, value: float) -> None:
    """As somebody types it: the change and Blender's undo step."""
    blender.do(f"{JOINT}.hardening.kind = 'VALUE'")
    blender.do(f"{JOINT}.hardening.override = True")
    blender.do(f"{JOINT}.hardening.value = {value}")
    blender.do(f"bpy.ops.ed.undo_push(message='hardening {value}')")


def test_joint_settings_reach_the_doll_and_follow_undo(blender: BlenderWindow, character: Path) -> None:
    posing.open_character(blender, character)
    blender.do(f"from {MODULE} import joint_live, panel_joints")
    blender.do_in_view("bpy.ops.object.mode_set(mode='POSE')")
    blender.do(f"armature().data.bones.active = armature().data.bones[{BONE!r}]")
    posing.start(blender)
    blender.wait_for("joint_live.sender_of(armature()) is not None")
    blender.wait_for("joint_live.sender_of(armature()).is_idle")
    blender.do("bpy.ops.ed.undo_push(message='started')")
    assert blender.ask(SERVERS) == 0.0
    set_hardening(blender, 0.25)
    blender.wait_for(f"{SERVERS} == 0.25")
    set_hardening(blender, 0.5)
    blender.wait_for(f"{SERVERS} == 0.5")
    blender.screenshot("joints_in_the_sidebar")

    left, top, width, height = blender.ask("rectangle('WINDOW')")
    blender.move([(left + width / 3, top + height / 2)])
    blender.key("ctrl+z")
    blender.wait_for(f"{SERVERS} == 0.25")
    blender.key("ctrl+z")
    blender.wait_for(f"{SERVERS} == 0.0")
    assert not blender.ask(f"{JOINT}.hardening.override")
    blender.key("shift+ctrl+z", "shift+ctrl+z")
    blender.wait_for(f"{SERVERS} == 0.5")
    assert blender.ask("[session.live for session in sessions.all()]") == [True]
    assert blender.ask("joint_live.trouble_of(armature())") == ""
