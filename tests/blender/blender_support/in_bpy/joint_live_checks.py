"""Checks of joint properties with a live doll, inside Blender's Python: python joint_live_checks.py OUT.json FOLDER
CHARACTER.glb, with layfigure-server on PATH.

The checks build on each other: one doll, as somebody works on it. What one raises goes into OUT.json under its name.
"""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import world
from joint_checks import Layout, select
from layfigure_blender import asked_settings, joint_live, panel_joints, sessions
from layfigure_blender.doll_inspection import inspect, own_values
from layfigure_blender.joint_settings import (
    LAWS,
    Amount,
    DollSettings,
    JointSettings,
    mirrored,
)
from layfigure_blender.joint_values import JointValues, asked, changes, replied

TIMEOUT_S = 60.0  # for a machine under load; never waited for in a test that passes
TWICE = JointSettings(laws={"stiffness": Amount(2.0, is_factor=True)})
NOTHING = JointSettings()

Check = Callable[[], None]
CHECKS: dict[str, Check] = {}


def check(function: Check) -> Check:
    CHECKS[function.__name__] = function
    return function


def armature() -> bpy.types.Object:
    return next(found for found in bpy.data.objects if found.type == "ARMATURE")


def bone(name: str) -> bpy.types.PoseBone:
    return armature().pose.bones[name]


def session() -> sessions.Session:
    found = sessions.of(armature())
    assert found is not None, sessions.last_words(armature())
    return found


def run_until(condition: Callable[[], bool], what: str) -> None:
    """Calls what Blender's timers would."""
    deadline = time.monotonic() + TIMEOUT_S
    while not condition():
        sessions.tick()
        joint_live.flush()
        assert time.monotonic() < deadline, f"{what}: {session().message}"
        time.sleep(0.005)


def is_settled() -> bool:
    sender = joint_live.sender_of(armature())
    if sender is None or not session().live or not sender.is_idle:
        return False
    live = joint_live._live[session().id]
    return live.reading is None and not live.is_dirty and live.looked_at > settled_since


settled_since = 0.0


def settle() -> None:
    """Until all that was changed before has been looked at and answered."""
    global settled_since
    settled_since = time.monotonic()
    run_until(is_settled, "not all was sent")


def now() -> dict[str, JointValues]:
    """As the server has the joints."""
    link = session().link
    names = {index: joint.name for index, joint in enumerate(link.character.joints)}
    return replied(link.send("get_joints").result(TIMEOUT_S), names)


def own() -> dict[str, JointValues]:
    return dict(joint_live.values_of(armature()).joints)


def assert_as_asked(*names: str) -> None:
    server, chosen = now(), own()
    for name in names:
        expected = asked(chosen[name], asked_settings.joint_settings(bone(name)))
        assert changes(server[name], expected) == [], (name, changes(server[name], expected))


def drawn(name: str) -> str:
    layout = Layout()
    panel_joints.draw_joint(layout, armature(), bone(name))
    return " ".join(layout.texts)


@check
def a_start_has_the_settings() -> None:
    asked_settings.write_joint(bone("forearm.L"), TWICE)
    asked_settings.write_joint(bone("pelvis"), TWICE)  # the root, which has no joint
    asked_settings.write_joint(bone("thigh.L"), JointSettings(limits={"swing_y": (0.0, 1.0), "swing_z": (0.0, 0.0)}))
    asked_settings.write_joint(bone("hand.R"), JointSettings(numbers={"mass": 1e5}))
    asked_settings.write_doll(armature(), DollSettings("clay", {"total_mass": 2.0}))
    sessions.start(bpy.context, armature())
    run_until(lambda: session().live, "the doll is not live")
    text = session().character.with_suffix(".doll.toml").read_text()
    assert "forearm.L" in text
    assert "hand.R" not in text
    server = now()
    settle()
    assert sum(joint.mass for joint in session().link.character.joints) - 2.0 < 1e-9
    stiff = own()["forearm.L"].laws["stiffness"].unit
    assert math.isclose(server["forearm.L"].laws["stiffness"].unit, 2.0 * stiff, rel_tol=1e-9)
    assert_as_asked("forearm.L", "forearm.R", "shin.R")


@check
def the_panel_tells_own_values_and_reasons() -> None:
    unit = own()["forearm.L"].laws["stiffness"].unit
    assert f"{unit:.4g} N m/rad → {2.0 * unit:.4g} N m/rad" in drawn("forearm.L"), drawn("forearm.L")
    assert "-5° to 150°" in drawn("forearm.R"), drawn("forearm.R")
    assert "root, which has no joint" in drawn("pelvis"), drawn("pelvis")
    assert "left out at the start:" in drawn("hand.R"), drawn("hand.R")


@check
def edits_reach_the_live_doll() -> None:
    amount = bone("shin.L").layfigure_joint.yield_torque.whole
    amount.kind, amount.factor, amount.override = "FACTOR", 3.0, True
    bone("shin.L").layfigure_joint.locks.override = True
    bone("shin.L").layfigure_joint.locks.twist = True
    limit = bone("shin.L").layfigure_joint.limit_swing_y
    limit.override = True
    assert limit.upper < math.pi  # begins with the doll's own
    limit.upper = math.radians(70.0)
    settle()
    assert now()["shin.L"].locked == {"twist"}
    assert math.isclose(now()["shin.L"].limits["swing_y"][1], math.radians(70.0), rel_tol=1e-9)
    assert_as_asked("shin.L")


@check
def the_newest_of_many_edits_is_what_the_doll_has() -> None:
    for k in range(1, 60):
        bone("foot.L").layfigure_joint.hardening.kind = "VALUE"
        bone("foot.L").layfigure_joint.hardening.value = 0.01 * k
        bone("foot.L").layfigure_joint.hardening.override = True
        joint_live.flush()
    settle()
    assert now()["foot.L"].laws["hardening"].unit == 0.59


@check
def what_is_taken_back_is_the_dolls_own() -> None:
    bpy.context.view_layer.objects.active = armature()
    bpy.ops.object.mode_set(mode="POSE")
    select(armature(), "shin.L", "foot.L", "forearm.L")
    assert bpy.ops.layfigure.joints_clear() == {"FINISHED"}
    settle()
    server = now()
    for name in ("shin.L", "foot.L", "forearm.L"):
        assert changes(server[name], own()[name]) == []


@check
def scripts_that_no_callback_tells_of_are_seen() -> None:
    joint = bone("shin.R").layfigure_joint
    with joint_live.spreading(bpy.data.objects[0]):
        pass
    live = joint_live._live[session().id]
    joint.hardening.kind, joint.hardening.value, joint.hardening.override = "VALUE", 0.25, True
    live.is_dirty = False
    run_until(lambda: now()["shin.R"].laws["hardening"].unit == 0.25, "not seen")


@check
def symmetric_edits_reach_both_sides() -> None:
    armature().pose.use_mirror_x = True
    limit = bone("upper_arm.L").layfigure_joint.limit_twist
    limit.override = True
    limit.lower, limit.upper = math.radians(-10.0), math.radians(20.0)
    armature().pose.use_mirror_x = False
    settle()
    server = now()
    left, right = server["upper_arm.L"].limits["twist"], server["upper_arm.R"].limits["twist"]
    assert math.isclose(left[0], -right[1], rel_tol=1e-9)
    assert math.isclose(left[1], -right[0], rel_tol=1e-9)
    assert mirrored(asked_settings.joint_settings(bone("upper_arm.L"))) == asked_settings.joint_settings(
        bone("upper_arm.R")
    )


@check
def a_refused_value_stays_with_the_servers_reason() -> None:
    law = bone("hand.L").layfigure_joint.yield_torque
    law.by_axis = True
    law.twist.kind, law.twist.value, law.twist.override = "VALUE", 0.0, True
    bone("hand.L").layfigure_joint.hardening.override = True
    bone("hand.L").layfigure_joint.hardening.kind = "VALUE"
    bone("hand.L").layfigure_joint.hardening.value = 0.125
    law.twist.value = 0.0
    settle()
    assert "yield ratio = 0" in joint_live.refusal(armature(), "hand.L")
    assert "yield ratio = 0" in drawn("hand.L")
    assert now()["hand.L"].laws["hardening"].unit == 0.125
    assert asked_settings.joint_settings(bone("hand.L")).laws["yield_torque"][0] == Amount(0.0)
    law.twist.override = False
    settle()
    assert joint_live.refusal(armature(), "hand.L") == ""


@check
def a_material_of_the_whole_doll_reaches_all_joints_at_once() -> None:
    clay = own()["head"]
    armature().layfigure_doll.material = "wood"
    settle()
    program, character = session().program, session().character
    expected = own_values(str(program), character, asked_settings.doll_settings(armature()).without_joints())
    assert changes(own()["head"], clay) != []
    server = now()
    assert changes(server["head"], expected.joints["head"]) == []
    assert_as_asked("head", "hand.L", "upper_arm.L")


@check
def a_material_of_selected_bones_is_as_if_the_doll_were_of_it() -> None:
    select(armature(), "foot.R", "pelvis")
    assert bpy.ops.layfigure.joints_material(material="wire armature") == {"FINISHED"}
    settle()
    wire = inspect(str(session().program), session().character, DollSettings("wire armature", {"total_mass": 2.0}))
    server = now()
    expected = asked(own()["foot.R"], asked_settings.joint_settings(bone("foot.R")))
    assert changes(server["foot.R"], expected) == []
    for name in LAWS:
        assert math.isclose(server["foot.R"].laws[name].unit, wire.joints["foot.R"].laws[name].unit, rel_tol=1e-3), name
    assert asked_settings.joint_settings(bone("foot.R")).numbers.keys() == {"density"}
    assert asked_settings.joint_settings(bone("pelvis")) == TWICE


@check
def bad_settings_of_the_whole_doll_are_told() -> None:
    weight = armature().layfigure_doll.total_mass
    before = weight.value
    bone("hand.R").layfigure_joint.mass = 0.01
    weight.value = 0.005
    settle()
    assert "total_mass" in joint_live.trouble_of(armature())
    weight.value = before
    settle()
    assert joint_live.trouble_of(armature()) == ""


@check
def a_server_that_is_started_again_has_the_settings() -> None:
    os.kill(session().server_pid, signal.SIGKILL)
    run_until(lambda: session().failed, "the end is not noticed")
    bone("neck").layfigure_joint.hardening.kind = "VALUE"
    bone("neck").layfigure_joint.hardening.value = 0.75
    bone("neck").layfigure_joint.hardening.override = True
    session().reconnect()
    run_until(lambda: session().live, "the doll is not live again")
    settle()
    assert now()["neck"].laws["hardening"].unit == 0.75
    assert_as_asked("neck", "upper_arm.L", "upper_arm.R", "head")


@check
def after_a_reset_of_all_the_doll_is_as_asked() -> None:
    limit = bone("hand.L").layfigure_joint.limit_twist
    limit.override, limit.upper = True, math.radians(33.0)
    settle()
    session().link.send("reset", all=1).result(TIMEOUT_S)
    joint_live.sender_of(armature()).look_again()
    settle()
    assert_as_asked("hand.L")


@check
def the_next_start_has_them() -> None:
    session().stop()
    joint_live.flush()
    assert joint_live.sender_of(armature()) is None
    sessions.start(bpy.context, armature())
    run_until(lambda: session().live, "the doll is not live")
    server = now()
    settle()
    for name in ("neck", "hand.L", "upper_arm.R"):
        expected = asked(own()[name], asked_settings.joint_settings(bone(name)))
        assert changes(server[name], expected) == [], name


@check
def a_start_that_the_settings_forbid_says_why() -> None:
    session().stop()
    armature().layfigure_doll.total_mass.value = 0.005
    sessions.start(bpy.context, armature())
    run_until(lambda: sessions.of(armature()) is None, "it started")
    assert "the doll's settings: total_mass = 0.005" in sessions.last_words(armature()), sessions.last_words(armature())


def results(folder: Path, character: Path) -> Iterator[tuple[str, str]]:
    world.empty_file()
    with world.registered():
        bpy.ops.import_scene.gltf(filepath=str(character))
        for name, function in CHECKS.items():
            try:
                function()
                yield name, ""
            except Exception:
                yield name, traceback.format_exc()


if __name__ == "__main__":
    out, folder, character = map(Path, sys.argv[1:])
    out.write_text(json.dumps(dict(results(folder, character))))
