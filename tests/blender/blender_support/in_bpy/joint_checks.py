"""Checks of the joint properties inside Blender's Python: python joint_checks.py OUT.json FOLDER, without a server.

Each check begins with an empty file and an armature; what it raises goes into OUT.json under its name.
"""

from __future__ import annotations

import json
import math
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import bpy
import world
from layfigure_blender import asked_settings, joint_live, joint_properties, panel_joints
from layfigure_blender.joint_settings import (
    AXES,
    LAWS,
    LIMIT_AXES,
    Amount,
    DollSettings,
    JointSettings,
    mirrored,
)
from layfigure_blender.settings_file import parse_settings, read_settings

NAMES = ("root", "arm.L", "arm.R", 'the "odd" 手\\', "*")
MANY = JointSettings(
    laws={
        "stiffness": (Amount(9.5), Amount(0.5, is_factor=True), None),
        "damping": Amount(0.1),
        "yield_torque": Amount(math.inf),
        "flow_damping": Amount(3.0, is_factor=True),
        "hardening": Amount(1e-5),
    },
    limits={"twist": (-30.0, 45.5), "swing_z": (-180.0, 180.0)},
    locked=frozenset({"bend_z", "twist"}),
    merge=False,
    shape="capsule",
    numbers={"friction": 0.7, "mass": 0.01},
)
NOTHING = JointSettings()

Check = Callable[[Path], None]
CHECKS: dict[str, Check] = {}


def check(function: Check) -> Check:
    CHECKS[function.__name__] = function
    return function


def make_armature(name: str = "rig") -> bpy.types.Object:
    data = bpy.data.armatures.new(name)
    made = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made)
    bpy.context.view_layer.objects.active = made
    bpy.ops.object.mode_set(mode="EDIT")
    for k, bone_name in enumerate(NAMES):
        bone = data.edit_bones.new(bone_name)
        bone.head = (0.2 * k, 0.0, 0.0)
        bone.tail = (0.2 * k, 0.0, 0.2)
        if k:
            bone.parent = data.edit_bones[NAMES[0]]
    bpy.ops.object.mode_set(mode="POSE")
    select(made)
    return made


def armature() -> bpy.types.Object:
    return bpy.context.view_layer.objects.active


def bone(name: str) -> bpy.types.PoseBone:
    return armature().pose.bones[name]


def settings(name: str) -> JointSettings:
    return asked_settings.joint_settings(bone(name))


def select(rig: bpy.types.Object, *names: str) -> None:
    """These bones alone; the first is the active one."""
    for pose_bone in rig.pose.bones:
        holder = pose_bone if hasattr(pose_bone, "select") else pose_bone.bone
        holder.select = pose_bone.name in names
    if names:
        rig.data.bones.active = rig.data.bones[names[0]]


class Layout:
    """Stands for Blender's UILayout, which cannot be had without a window: keeps the texts that are drawn."""

    def __init__(self, texts: list[str] | None = None) -> None:
        self.texts: list[str] = [] if texts is None else texts

    def __getattr__(self, _name: str) -> Any:
        return lambda *_args, **_named: Layout(self.texts)

    def label(self, text: str = "", **_: Any) -> None:
        self.texts.append(text)

    def prop(self, group: Any, name: str, text: str | None = None, **_: Any) -> None:
        assert name in group.bl_rna.properties, name
        self.texts.append(group.bl_rna.properties[name].name if text is None else text)


# --- the properties --------------------------------------------------------------------------------------------------


@check
def untouched_bones_ask_for_nothing(_folder: Path) -> None:
    assert all(settings(name) == NOTHING for name in NAMES)
    assert not bone("arm.L").is_property_set("layfigure_joint")
    _ = bone("arm.L").layfigure_joint.stiffness.whole.factor
    assert settings("arm.L") == NOTHING
    assert asked_settings.doll_settings(armature()) == DollSettings()


@check
def settings_are_kept_as_they_are_written(_folder: Path) -> None:
    for name in NAMES:
        asked_settings.write_joint(bone(name), MANY)
        assert settings(name) == MANY, settings(name)
    asked_settings.write_joint(bone("arm.L"), NOTHING)
    assert settings("arm.L") == NOTHING
    assert settings("arm.R") == MANY
    doll = DollSettings("wire armature", {"total_mass": 0.3, "poisson_ratio": -0.5, "hardening": 0.0})
    asked_settings.write_doll(armature(), doll)
    assert asked_settings.doll_settings(armature()).numbers == doll.numbers
    assert asked_settings.doll_settings(armature()).material == "wire armature"


@check
def keys_alone_are_written(_folder: Path) -> None:
    asked_settings.write_joint(bone("arm.L"), MANY)
    asked_settings.write_joint(bone("arm.L"), NOTHING, ("stiffness", "limits", "weight"))
    left = settings("arm.L")
    assert left.laws.keys() == MANY.laws.keys() - {"stiffness"}
    assert left.limits == {}
    assert left.locked == MANY.locked
    assert left.numbers == {"friction": 0.7}


@check
def what_is_switched_off_is_remembered_and_not_asked(_folder: Path) -> None:
    amount = bone("arm.L").layfigure_joint.damping.whole
    amount.kind, amount.value, amount.override = "VALUE", 0.5, True
    assert settings("arm.L").laws == {"damping": Amount(0.5)}
    amount.override = False
    assert settings("arm.L") == NOTHING
    amount.override = True
    assert settings("arm.L").laws == {"damping": Amount(0.5)}


@check
def bad_values_cannot_be_entered(_folder: Path) -> None:
    joint = bone("arm.L").layfigure_joint
    joint.stiffness.whole.value = -1.0
    assert joint.stiffness.whole.value == 0.0
    joint.stiffness.whole.factor = 0.0
    assert joint.stiffness.whole.factor > 0.0
    joint.stiffness.whole.factor = 1e30
    assert joint.stiffness.whole.factor == 1e6
    joint.limit_twist.lower = 1.0
    assert joint.limit_twist.lower == 0.0
    joint.limit_twist.upper = 400.0
    assert joint.limit_twist.upper <= math.pi + 1e-6
    for group, name in ((joint.damping.whole, "kind"), (joint, "shape"), (armature().layfigure_doll, "material")):
        try:
            setattr(group, name, "UNLIMITED" if name == "kind" else "cheese")
        except TypeError:
            continue
        raise AssertionError(name)


@check
def what_is_no_number_is_asked_as_it_is_and_is_equal_to_itself(_folder: Path) -> None:
    amount = bone("arm.L").layfigure_joint.damping.whole
    amount.kind, amount.value, amount.override = "VALUE", math.nan, True
    asked = settings("arm.L").laws.get("damping")
    assert asked is not None
    assert settings("arm.L") == settings("arm.L")


@check
def limits_begin_without_any_and_are_angles(_folder: Path) -> None:
    limit = bone("arm.L").layfigure_joint.limit_swing_y
    limit.override = True
    assert settings("arm.L").limits == {"swing_y": (-180.0, 180.0)}
    limit.lower = math.radians(-12.5)
    assert settings("arm.L").limits == {"swing_y": (-12.5, 180.0)}
    assert limit.bl_rna.properties["lower"].subtype == "ANGLE"


@check
def an_own_value_is_where_a_switch_begins(_folder: Path) -> None:
    from layfigure_blender.joint_values import JointValues, Law

    own = JointValues(
        laws={name: Law(2.0, (1.0, 2.0, 3.0)) for name in LAWS},
        limits=dict.fromkeys(LIMIT_AXES, (-0.5, 0.25)),
        locked=frozenset({"bend_y"}),
    )
    joint = bone("arm.L").layfigure_joint
    for group in (joint.stiffness.bend_z, joint.hardening, joint.limit_twist, joint.locks):
        _, part = joint_properties.owner(group, None)
        joint_properties.start_from(group, part, own)
    assert joint.stiffness.bend_z.value == 6.0
    assert joint.hardening.value == 2.0
    assert abs(joint.limit_twist.lower + 0.5) < 1e-6
    assert [getattr(joint.locks, axis) for axis in AXES] == [False, True, False]


@check
def they_are_saved_and_copied(folder: Path) -> None:
    asked_settings.write_joint(bone(NAMES[3]), MANY)
    asked_settings.write_doll(armature(), DollSettings("clay", {"total_mass": 0.3}))
    copy = armature().copy()
    bpy.context.collection.objects.link(copy)
    assert asked_settings.joint_settings(copy.pose.bones[NAMES[3]]) == MANY
    asked_settings.write_joint(copy.pose.bones[NAMES[3]], NOTHING)
    assert settings(NAMES[3]) == MANY
    file = folder / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.open_mainfile(filepath=str(file))
    assert asked_settings.doll_settings(bpy.data.objects["rig"]) == DollSettings(
        "clay", {"total_mass": 0.3}, {NAMES[3]: MANY}
    )


@check
def they_are_allowed_in_library_overrides(folder: Path) -> None:
    asked_settings.write_joint(bone("arm.L"), JointSettings(laws={"damping": Amount(0.1)}))
    library = folder / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(library), link=True) as (_, to):
        to.objects = ["rig"]
    linked = bpy.data.objects["rig"]
    bpy.context.scene.collection.objects.link(linked)
    made = linked.override_create(remap_local_usages=True)
    assert asked_settings.joint_settings(made.pose.bones["arm.L"]).laws == {"damping": Amount(0.1)}
    asked_settings.write_joint(made.pose.bones["arm.L"], MANY)
    asked_settings.write_joint(made.pose.bones["arm.R"], MANY)
    asked_settings.write_doll(made, DollSettings("clay", {"total_mass": 0.3}))
    user = folder / "user.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(user))
    bpy.ops.wm.open_mainfile(filepath=str(user))
    again = next(found for found in bpy.data.objects if found.library is None)
    assert asked_settings.doll_settings(again) == DollSettings(
        "clay", {"total_mass": 0.3}, {"arm.L": MANY, "arm.R": MANY}
    ), asked_settings.doll_settings(again)


# --- many bones ------------------------------------------------------------------------------------------------------


@check
def symmetric_edits_go_to_the_other_side(_folder: Path) -> None:
    for option in (armature().pose, armature().data):
        option.use_mirror_x = True
        limit = bone("arm.L").layfigure_joint.limit_twist
        limit.lower, limit.upper, limit.override = math.radians(-10.0), math.radians(20.0), True
        assert settings("arm.R").limits == {"twist": (-20.0, 10.0)}, settings("arm.R")
        bone("arm.R").layfigure_joint.stiffness.twist.override = True
        bone("arm.R").layfigure_joint.stiffness.by_axis = True
        bone("arm.R").layfigure_joint.locks.bend_y = True
        bone("arm.R").layfigure_joint.locks.override = True
        bone("arm.R").layfigure_joint.weight = "mass"
        assert mirrored(settings("arm.R")) == settings("arm.L") != NOTHING
        option.use_mirror_x = False
        for name in ("arm.L", "arm.R"):
            asked_settings.write_joint(bone(name), NOTHING)
    bone("arm.L").layfigure_joint.limit_twist.override = True
    assert settings("arm.R") == NOTHING
    assert settings("root") == NOTHING


@check
def an_edit_changes_its_own_key_of_the_other_side_alone(_folder: Path) -> None:
    asked_settings.write_joint(bone("arm.R"), MANY)
    armature().pose.use_mirror_x = True
    amount = bone("arm.L").layfigure_joint.hardening
    amount.kind, amount.value, amount.override = "VALUE", 0.25, True
    assert settings("arm.R").laws == {**MANY.laws, "hardening": Amount(0.25)}
    assert settings("arm.R").limits == MANY.limits


@check
def edits_go_to_all_selected_bones_if_they_are_to(_folder: Path) -> None:
    select(armature(), "arm.L", "*")
    bone("arm.L").layfigure_joint.hardening.override = True
    assert settings("*") == NOTHING
    armature().layfigure_doll.edit_selected = True
    bone("arm.L").layfigure_joint.hardening.factor = 3.0
    assert settings("*").laws == {"hardening": Amount(3.0, is_factor=True)}
    bone("root").layfigure_joint.hardening.override = True  # is not selected: on its own
    assert settings("*").laws == {"hardening": Amount(3.0, is_factor=True)}
    armature().pose.use_mirror_x = True
    bone("arm.L").layfigure_joint.hardening.factor = 4.0
    assert settings("arm.R").laws == settings("*").laws == {"hardening": Amount(4.0, is_factor=True)}


@check
def copy_clear_and_mirror_are_operators(_folder: Path) -> None:
    asked_settings.write_joint(bone("arm.L"), MANY)
    select(armature(), "arm.L", "*", "root")
    assert bpy.ops.layfigure.joints_copy() == {"FINISHED"}
    assert settings("*") == settings("root") == MANY
    assert settings("arm.R") == NOTHING
    assert bpy.ops.layfigure.joints_clear(keys="limits") == {"FINISHED"}
    assert settings("*").limits == settings("arm.L").limits == {}
    assert settings("*").laws == MANY.laws
    select(armature(), "arm.L")
    assert bpy.ops.layfigure.joints_mirror() == {"FINISHED"}
    assert settings("arm.R") == mirrored(settings("arm.L"))
    assert bpy.ops.layfigure.joints_clear(scope="ALL") == {"FINISHED"}
    assert asked_settings.all_joint_settings(armature()) == {}
    assert bpy.ops.layfigure.joints_copy() == {"CANCELLED"}
    select(armature(), "root")
    assert bpy.ops.layfigure.joints_mirror() == {"CANCELLED"}
    asked_settings.write_joint(bone("arm.L"), MANY)
    armature().pose.use_mirror_x = True
    select(armature(), "arm.L", "*")
    assert bpy.ops.layfigure.joints_copy(keys="locks") == {"FINISHED"}
    assert settings("arm.R") == settings("*") == JointSettings(locked=MANY.locked), settings("arm.R")


@check
def operators_go_without_an_armature(_folder: Path) -> None:
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = None
    for name in ("copy", "clear", "mirror", "material", "write", "read"):
        assert not getattr(bpy.ops.layfigure, f"joints_{name}").poll(), name


# --- files -----------------------------------------------------------------------------------------------------------


@check
def settings_files_are_written_and_read(folder: Path) -> None:
    for name in NAMES[1:]:
        asked_settings.write_joint(bone(name), MANY)
    asked_settings.write_doll(armature(), DollSettings("clay", {"total_mass": 0.3}))
    before = asked_settings.doll_settings(armature())
    file = folder / "rig.doll.toml"
    assert bpy.ops.layfigure.joints_write(filepath=str(file)) == {"FINISHED"}
    assert read_settings(file) == before
    bpy.ops.layfigure.joints_clear(scope="ALL")
    asked_settings.write_joint(bone("root"), MANY)  # which the file does not name
    assert bpy.ops.layfigure.joints_read(filepath=str(file)) == {"FINISHED"}
    assert asked_settings.doll_settings(armature()) == before
    assert joint_live.settings_text_of(armature()).count("[joints.") == len(NAMES) - 1
    assert parse_settings(joint_live.settings_text_of(armature()), "f") == before


@check
def patterns_of_a_file_are_spread_over_the_bones(folder: Path) -> None:
    file = folder / "patterns.toml"
    file.write_text('[joints."arm.?"]\nhardening = 2\n[joints."arm.L"]\nhardening = 3\n[joints."leg*"]\ndamping = 1\n')
    assert bpy.ops.layfigure.joints_read(filepath=str(file)) == {"FINISHED"}
    assert settings("arm.L").laws == {"hardening": Amount(3.0)}
    assert settings("arm.R").laws == {"hardening": Amount(2.0)}
    assert asked_settings.all_joint_settings(armature()).keys() == {"arm.L", "arm.R"}


def report_of(operator: Any, path: Path) -> str:
    """The error that it reports, which scripts get as an exception."""
    try:
        operator(filepath=str(path))
    except RuntimeError as error:
        return str(error)
    return ""


@check
def bad_files_change_nothing_and_are_told(folder: Path) -> None:
    asked_settings.write_joint(bone("arm.L"), MANY)
    file = folder / "bad.toml"
    file.write_text('[joints."arm.L"]\nstiffness = -1\n')
    assert "stiffness = -1" in report_of(bpy.ops.layfigure.joints_read, file)
    assert "cannot be read" in report_of(bpy.ops.layfigure.joints_read, folder / "none.toml")
    assert "cannot be written" in report_of(bpy.ops.layfigure.joints_write, folder / "none/x.toml")
    assert settings("arm.L") == MANY


# --- panels ----------------------------------------------------------------------------------------------------------


@check
def panels_draw_without_a_doll(_folder: Path) -> None:
    asked_settings.write_joint(bone("arm.L"), MANY)
    select(armature(), "arm.L", "*")
    for name in NAMES:
        layout = Layout()
        panel_joints.draw_joint(layout, armature(), bone(name))
        panel_joints.draw_body(layout, bone(name))
        panel_joints.draw_tools(layout, armature())
        assert "Stiffness" in layout.texts
        assert "2 bones selected" in layout.texts
        assert ("doll's own" in layout.texts) or name == "arm.L"


def results(folder: Path) -> Iterator[tuple[str, str]]:
    with world.registered():
        for name, function in CHECKS.items():
            bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
            make_armature()
            here = folder / name
            here.mkdir()
            try:
                function(here)
                yield name, ""
            except Exception:
                yield name, traceback.format_exc()
    left = [name for name in ("layfigure_joint",) if hasattr(bpy.types.PoseBone, name)]
    left += [name for name in dir(bpy.types) if name.lower().startswith("layfigure")]
    yield "nothing_is_left_behind", ", ".join(left)


if __name__ == "__main__":
    out, folder = map(Path, sys.argv[1:])
    out.write_text(json.dumps(dict(results(folder))))
