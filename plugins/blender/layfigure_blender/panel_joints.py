# SPDX-License-Identifier: GPL-3.0-or-later
"""The panels of the doll's material and of its joints; they only draw."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import bpy

from . import asked_settings, joint_live
from .joint_properties import LABELS
from .joint_settings import AXES, DOLL_NUMBERS, LAWS, LAWS_OF_AXES, LIMIT_AXES, UNITS
from .joint_values import JointValues, asked
from .operators_joints import active_bone, armature_of, selected_bones

_LETTERS_IN_A_LINE = 44  # of the sidebar as wide as Blender opens it
_DIGITS = 4


def draw_joint(layout: Any, armature: bpy.types.Object, bone: bpy.types.PoseBone) -> None:
    """What is asked of the bone's joint and, greyed, what the doll has of its own."""
    values = joint_live.values_of(armature)
    own = values.joints.get(bone.name) if values is not None else None
    if values is not None and own is None:
        draw_lines(layout, values.why_no_joint(bone.name), "INFO")
    draw_lines(layout, joint_live.refusal(armature, bone.name), "ERROR", alert=True)
    joint = bone.layfigure_joint
    then = asked(own, asked_settings.joint_settings(bone)) if own is not None else None
    column = layout.column()
    column.active = values is None or own is not None
    for law in LAWS:
        _draw_law(column, law, getattr(joint, law), own, then)
    _draw_limits(column, joint, own)
    _draw_locks(column, joint.locks, own)


def draw_lines(layout: Any, text: str, icon: str, *, alert: bool = False) -> None:
    """A message that may be longer than the panel is wide."""
    if not text:
        return
    column = layout.column(align=True)
    column.alert = alert
    for k, line in enumerate(textwrap.wrap(text, _LETTERS_IN_A_LINE)):
        column.label(text=line, icon=icon if k == 0 else "BLANK1")


def _draw_law(layout: Any, law: str, group: Any, own: JointValues | None, then: JointValues | None) -> None:
    box = layout.box().column(align=True)
    if law not in LAWS_OF_AXES:
        _draw_amount(box, LABELS[law], group, _text(law, own), _text(law, then))
        return
    head = box.row(align=True)
    if group.by_axis:
        head.label(text=LABELS[law])
    else:
        _draw_amount(head.column(align=True), LABELS[law], group.whole, _text(law, own), _text(law, then))
    head.prop(group, "by_axis", text="", icon="EMPTY_AXIS", toggle=True)
    if group.by_axis:
        for k, axis in enumerate(AXES):
            _draw_amount(box, LABELS[axis], getattr(group, axis), _text(law, own, k), _text(law, then, k))


def _draw_amount(layout: Any, label: str, group: Any, own: str, then: str) -> None:
    layout.prop(group, "override", text=label)
    if not group.override:
        _draw_own(layout.row(), own)
        return
    row = layout.row(align=True)  # below the name: beside it, a sidebar has no place
    row.prop(group, "kind", text="")
    if group.kind == "UNLIMITED":
        return
    row.prop(group, "factor" if group.kind == "FACTOR" else "value", text="")
    if own:
        _draw_own(layout.row(), f"{own} → {then}" if group.kind == "FACTOR" else f"own: {own}")


def _draw_own(row: Any, text: str) -> None:
    own = row.row()
    own.active = False  # greyed
    own.alignment = "RIGHT"
    own.label(text=text or "doll's own")


def _text(law: str, values: JointValues | None, axis: int | None = None) -> str:
    if values is None:
        return ""
    number = values.laws[law].unit if axis is None else values.laws[law].axes[axis]
    return "unlimited" if math.isinf(number) else f"{number:.{_DIGITS}g} {UNITS[law]}"


def _draw_limits(layout: Any, joint: Any, own: JointValues | None) -> None:
    box = layout.box().column(align=True)
    box.label(text="Limits")
    for axis in LIMIT_AXES:
        group = getattr(joint, f"limit_{axis}")
        row = box.row(align=True)
        row.prop(group, "override", text=LABELS[axis])
        if group.override:
            row.prop(group, "lower", text="")
            row.prop(group, "upper", text="")
        else:
            _draw_own(row, _range_text(own.limits[axis]) if own is not None else "")


def _range_text(limits: tuple[float, float]) -> str:
    if limits[0] <= -math.pi and limits[1] >= math.pi:
        return "no limit"
    lower, upper = map(math.degrees, limits)
    return f"{lower:.{_DIGITS}g}° to {upper:.{_DIGITS}g}°"


def _draw_locks(layout: Any, locks: Any, own: JointValues | None) -> None:
    box = layout.box().column(align=True)
    row = box.row(align=True)
    row.prop(locks, "override", text=LABELS["locks"])
    if locks.override:
        axes = box.row(align=True)
        for axis in AXES:
            axes.prop(locks, axis, toggle=True)
    elif own is not None:
        _draw_own(row, ", ".join(LABELS[axis] for axis in AXES if axis in own.locked) or "none")


def draw_body(layout: Any, bone: bpy.types.PoseBone) -> None:
    """What the next start takes."""
    joint = bone.layfigure_joint
    column = layout.column()
    column.use_property_split = True
    column.prop(joint, "merge")
    column.prop(joint, "shape")
    column.prop(joint, "weight")
    if joint.weight != "OWN":
        column.prop(joint, joint.weight)
    row = column.row(heading="Friction")
    row.prop(joint.friction, "override", text="")
    value = row.row()
    value.active = joint.friction.override
    value.prop(joint.friction, "value", text="")


def draw_tools(layout: Any, armature: bpy.types.Object) -> None:
    """For many bones at once."""
    count = len(selected_bones(armature))
    column = layout.column(align=True)
    column.label(text=f"{count} bones selected" if count != 1 else "1 bone selected")
    column.prop(armature.layfigure_doll, "edit_selected")
    column.prop(armature.pose, "use_mirror_x")
    column.operator("layfigure.joints_copy", icon="COPYDOWN")
    column.operator("layfigure.joints_mirror", icon="MOD_MIRROR")
    column.operator_menu_enum("layfigure.joints_material", "material", icon="MATERIAL")
    row = column.row(align=True)
    row.operator("layfigure.joints_clear", text="Clear Selected", icon="X").scope = "SELECTED"
    row.operator("layfigure.joints_clear", text="Clear All").scope = "ALL"


class _JointPanel:
    bl_label = "Layfigure Joint"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        armature = armature_of(context)
        return armature is not None and active_bone(armature) is not None

    def draw(self, context: bpy.types.Context) -> None:
        armature = armature_of(context)
        bone = active_bone(armature)
        self.layout.label(text=bone.name, icon="BONE_DATA")
        draw_joint(self.layout, armature, bone)


class LAYFIGURE_PT_bone(_JointPanel, bpy.types.Panel):
    """Properties > Bone."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "bone"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012


class LAYFIGURE_PT_joint(_JointPanel, bpy.types.Panel):
    """The sidebar, in pose mode: elsewhere no bone is seen to be active."""

    bl_label = "Joint"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Layfigure"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.mode == "POSE" and super().poll(context)


class _BodyPanel:
    bl_label = "Body"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    def draw(self, context: bpy.types.Context) -> None:
        draw_body(self.layout, active_bone(armature_of(context)))


class LAYFIGURE_PT_bone_body(_BodyPanel, bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "bone"
    bl_parent_id = "LAYFIGURE_PT_bone"


class LAYFIGURE_PT_joint_body(_BodyPanel, bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Layfigure"
    bl_parent_id = "LAYFIGURE_PT_joint"


class _ToolsPanel:
    bl_label = "Bones"

    def draw(self, context: bpy.types.Context) -> None:
        draw_tools(self.layout, armature_of(context))


class LAYFIGURE_PT_bone_tools(_ToolsPanel, bpy.types.Panel):
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "bone"
    bl_parent_id = "LAYFIGURE_PT_bone"


class LAYFIGURE_PT_joint_tools(_ToolsPanel, bpy.types.Panel):
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Layfigure"
    bl_parent_id = "LAYFIGURE_PT_joint"


class LAYFIGURE_PT_doll(bpy.types.Panel):
    """What is asked of the whole doll."""

    bl_label = "Material"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Layfigure"
    bl_options = {"DEFAULT_CLOSED"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return armature_of(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        armature = armature_of(context)
        doll = armature.layfigure_doll
        layout = self.layout
        draw_lines(layout, joint_live.trouble_of(armature), "ERROR", alert=True)
        layout.prop(doll, "material")
        _draw_number(layout, doll, "total_mass")
        box = layout.box().column(align=True)
        for name in DOLL_NUMBERS:
            if name != "total_mass":
                _draw_number(box, doll, name)
        layout.label(text="Weights change at the next start", icon="INFO")
        row = layout.row(align=True)
        row.operator("layfigure.joints_read", text="Read", icon="IMPORT")
        row.operator("layfigure.joints_write", text="Write", icon="EXPORT")


def _draw_number(layout: Any, doll: Any, name: str) -> None:
    group = getattr(doll, name)
    row = layout.row(align=True)
    row.prop(group, "override", text="")
    value = row.row()
    value.active = group.override
    value.prop(group, "value")


classes = (
    LAYFIGURE_PT_doll,
    LAYFIGURE_PT_joint,
    LAYFIGURE_PT_joint_body,
    LAYFIGURE_PT_joint_tools,
    LAYFIGURE_PT_bone,
    LAYFIGURE_PT_bone_body,
    LAYFIGURE_PT_bone_tools,
)
