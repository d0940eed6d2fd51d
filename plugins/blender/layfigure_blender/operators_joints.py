# SPDX-License-Identifier: GPL-3.0-or-later
"""What is done to the joint settings of many bones at once: copied, taken back, made of a material, kept in a file."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper, ImportHelper

from layfigure import LayfigureError

from . import asked_settings, joint_live, joint_properties, pose_writing
from .joint_settings import MATERIALS, JointSettings, resolve
from .settings_file import SettingsFileError, read_settings, settings_text

_FILES = "*.toml"
_SUFFIX = ".doll.toml"


def armature_of(context: bpy.types.Context) -> bpy.types.Object | None:
    """The active armature, or that of the active mesh."""
    found = context.object
    if found is not None and found.type == "MESH":
        found = found.find_armature()
    return found if found is not None and found.type == "ARMATURE" and found.pose is not None else None


def selected_bones(armature: bpy.types.Object) -> list[bpy.types.PoseBone]:
    return [bone for bone in armature.pose.bones if pose_writing.is_selected(bone)]


def active_bone(armature: bpy.types.Object) -> bpy.types.PoseBone | None:
    active = armature.data.bones.active
    return armature.pose.bones.get(active.name) if active is not None else None


class _BonesOperator:
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return armature_of(context) is not None

    @staticmethod
    def bones(context: bpy.types.Context) -> tuple[bpy.types.Object, list[bpy.types.PoseBone]]:
        """The armature and its selected bones; if none is, the active one."""
        armature = armature_of(context)
        assert armature is not None
        active = active_bone(armature)
        return armature, selected_bones(armature) or ([active] if active is not None else [])


_KEY_ITEMS = [
    ("ALL", "All", "All of the joint and its body"),
    *((key, joint_properties.LABELS.get(key, key.title()), "This alone") for key in joint_properties.KEYS),
]


def _keys(choice: str) -> tuple[str, ...]:
    return joint_properties.KEYS if choice == "ALL" else (choice,)


class LAYFIGURE_OT_joints_copy(_BonesOperator, bpy.types.Operator):
    """Give the selected bones what is asked of the active one"""

    bl_idname = "layfigure.joints_copy"
    bl_label = "Copy Joint to Selected"

    keys: EnumProperty(name="What", items=_KEY_ITEMS, default="ALL")  # type: ignore[valid-type]

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature, bones = self.bones(context)
        active = active_bone(armature)
        others = [bone for bone in bones if active is not None and bone.name != active.name]
        if active is None or not others:
            self.report({"WARNING"}, "Nothing to copy to: select more bones, the one to copy from last")
            return {"CANCELLED"}
        settings = asked_settings.joint_settings(active)
        with joint_live.spreading(armature):
            for bone in others:
                asked_settings.write_joint(bone, settings, _keys(self.keys))
            joint_live.write_images(armature, [active, *others], _keys(self.keys))
        self.report({"INFO"}, f"Copied to {len(others)} bones")
        return {"FINISHED"}


class LAYFIGURE_OT_joints_clear(_BonesOperator, bpy.types.Operator):
    """Take back what is asked of the selected bones: they are as the doll has them"""

    bl_idname = "layfigure.joints_clear"
    bl_label = "Clear Joint Overrides"

    keys: EnumProperty(name="What", items=_KEY_ITEMS, default="ALL")  # type: ignore[valid-type]
    scope: EnumProperty(  # type: ignore[valid-type]
        name="Bones",
        items=[("SELECTED", "Selected", "The selected bones"), ("ALL", "All", "All bones of the armature")],
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature, bones = self.bones(context)
        if self.scope == "ALL":
            bones = list(armature.pose.bones)
        with joint_live.spreading(armature):
            for bone in bones:
                if bone.is_property_set("layfigure_joint"):
                    asked_settings.write_joint(bone, JointSettings(), _keys(self.keys))
            joint_live.write_images(armature, bones, _keys(self.keys))
        return {"FINISHED"}


class LAYFIGURE_OT_joints_mirror(_BonesOperator, bpy.types.Operator):
    """Give the bones on the other side what is asked of the selected ones, mirrored"""

    bl_idname = "layfigure.joints_mirror"
    bl_label = "Mirror Joint to Other Side"

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature, bones = self.bones(context)
        with joint_live.spreading(armature):
            count = joint_live.mirror_bones(armature, bones)
        if count == 0:
            self.report({"WARNING"}, "No bone on the other side: its name must differ by left and right alone")
            return {"CANCELLED"}
        self.report({"INFO"}, f"Mirrored to {count} bones")
        return {"FINISHED"}


class LAYFIGURE_OT_joints_material(_BonesOperator, bpy.types.Operator):
    """Make the joints of the selected bones as if the doll were of this material"""

    bl_idname = "layfigure.joints_material"
    bl_label = "Material of Selected Joints"

    material: EnumProperty(  # type: ignore[valid-type]
        name="Material", items=[(material, material.title(), "") for material in MATERIALS]
    )

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature, bones = self.bones(context)
        context.window_manager.progress_begin(0, 1)
        try:
            values = joint_live.values_of_material(armature, self.material)
        except LayfigureError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        finally:
            context.window_manager.progress_end()
        made = [bone for bone in bones if bone.name in values.joints]
        if not made:
            why = f"{bones[0].name}: {values.why_no_joint(bones[0].name)}" if bones else "Select bones first"
            self.report({"WARNING"}, why)
            return {"CANCELLED"}
        with joint_live.spreading(armature):
            for bone in made:
                joint_live.write_material(bone, values)
            joint_live.write_images(armature, made)
        self.report({"INFO"}, f"Made {len(made)} joints of {self.material}")
        return {"FINISHED"}


class LAYFIGURE_OT_joints_write(bpy.types.Operator, ExportHelper):
    """Write what is asked of the doll and its joints to a settings file of layfigure-server"""

    bl_idname = "layfigure.joints_write"
    bl_label = "Write Doll Settings"
    filename_ext = _SUFFIX
    filter_glob: StringProperty(default=_FILES, options={"HIDDEN"})  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return armature_of(context) is not None

    def check(self, _context: bpy.types.Context) -> bool:
        """ExportHelper's own would make CHARACTER.doll.toml.doll.toml of what ends in .toml already."""
        if self.filepath.endswith(".toml"):
            return False
        self.filepath = str(Path(self.filepath).with_suffix("")) + _SUFFIX
        return True

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature = armature_of(context)
        assert armature is not None
        text = settings_text(asked_settings.doll_settings(armature), f"Of the armature {armature.name} in Blender.")
        try:
            Path(self.filepath).write_text(text, "utf-8")
        except OSError as error:
            self.report({"ERROR"}, f"{self.filepath}: cannot be written: {error.strerror}")
            return {"CANCELLED"}
        return {"FINISHED"}


class LAYFIGURE_OT_joints_read(bpy.types.Operator, ImportHelper):
    """Ask of the doll and its joints what a settings file of layfigure-server says, and nothing else"""

    bl_idname = "layfigure.joints_read"
    bl_label = "Read Doll Settings"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012
    filename_ext = ".toml"
    filter_glob: StringProperty(default=_FILES, options={"HIDDEN"})  # type: ignore[valid-type]

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return armature_of(context) is not None

    def execute(self, context: bpy.types.Context) -> set[str]:
        armature = armature_of(context)
        assert armature is not None
        try:
            settings = read_settings(Path(self.filepath))
        except SettingsFileError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        joints, idle = resolve(settings.joints, [bone.name for bone in armature.pose.bones])
        with joint_live.spreading(armature):
            asked_settings.write_doll(armature, settings)
            for bone in armature.pose.bones:
                if bone.name in joints or bone.is_property_set("layfigure_joint"):
                    asked_settings.write_joint(bone, joints.get(bone.name, JointSettings()))
        if idle:
            self.report({"WARNING"}, f"No bone for {', '.join(idle)}: left out")
        self.report({"INFO"}, f"Read {Path(self.filepath).name}: settings of {len(joints)} bones")
        return {"FINISHED"}


classes = (
    LAYFIGURE_OT_joints_copy,
    LAYFIGURE_OT_joints_clear,
    LAYFIGURE_OT_joints_mirror,
    LAYFIGURE_OT_joints_material,
    LAYFIGURE_OT_joints_write,
    LAYFIGURE_OT_joints_read,
)
