# SPDX-License-Identifier: GPL-3.0-or-later
"""The dolls that a 3D view shows, and what of them is under the mouse."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import bpy
import numpy as np

import layfigure
from layfigure import rotation
from layfigure.protocol import Floats

from . import sessions
from .grab import Way
from .picking import BONE_RADIUS, Hit, nearest_bone
from .sessions import Session
from .view import View


def is_posable(session: Session) -> bool:
    """Its poses are applied, and the server hears."""
    return session.live and session.link is not None and session.link.state == "live"


def posable_sessions() -> list[Session]:
    return [session for session in sessions.all() if is_posable(session)]


def view_of(context: bpy.types.Context, session: Session) -> View:
    """The context's region, as one that looks into the server's world of a session."""
    region, seen = context.region, context.region_data
    from_server = np.linalg.inv(np.array(session.world_to_server(), np.float64))
    return View(
        np.array(seen.view_matrix, np.float64) @ from_server,
        np.array(seen.window_matrix, np.float64),
        region.width,
        region.height,
        context.preferences.system.ui_scale,
    )


def seen_sessions(context: bpy.types.Context) -> list[Session]:
    """Those that can be posed, and of which the view shows something; the active one first."""
    active = sessions.active(context)
    shown = [session for session in posable_sessions() if _is_shown(context, session)]
    return sorted(shown, key=lambda session: session is not active)


@dataclass(frozen=True, eq=False)
class Target:
    """What a press of the button may take hold of."""

    session: Session
    view: View
    ways: Sequence[Way]
    bone: Hit | None  # that is hit


def target_under(context: bpy.types.Context, mouse: tuple[float, float]) -> Target | None:
    """Of several dolls, that of which a bone is drawn nearest to the mouse."""
    found = [(session, view_of(context, session)) for session in seen_sessions(context)]
    if not found:
        return None
    nearest = [(session, view, _nearest_bone(session, view, mouse)) for session, view in found]
    session, view, hit = min(nearest, key=lambda entry: np.inf if entry[2] is None else entry[2][1].distance)
    ways = list(_ways(context, session, view, mouse, hit))
    if not ways:
        return None
    is_hit = hit is not None and hit[1].distance <= BONE_RADIUS
    return Target(session, view, ways, hit[1] if hit is not None and is_hit else None)


def joint_under(context: bpy.types.Context, session: Session, view: View, mouse: tuple[float, float]) -> int | None:
    """The joint of the bone under the mouse."""
    hit = _nearest_bone(session, view, mouse)
    if hit is None or hit[1].distance > BONE_RADIUS or not _draws_bones(context, session):
        return None
    return session.bones.joint_of_bone(hit[0])


def segments(session: Session, names: Sequence[str]) -> tuple[Floats, Floats]:
    """Heads and tails (N, 3) of these bones as they are posed, in the server's world."""
    armature = session.armature()
    if armature is None or not names:
        return np.zeros((0, 3)), np.zeros((0, 3))
    to_server = np.array(session.world_to_server(), np.float64) @ np.array(armature.matrix_world, np.float64)
    bones = armature.pose.bones
    ends = np.array([(*bones[name].head, *bones[name].tail) for name in names if name in bones]).reshape(-1, 2, 3)
    ends = ends @ to_server[:3, :3].T + to_server[:3, 3]
    return ends[:, 0], ends[:, 1]


def _ways(
    context: bpy.types.Context, session: Session, view: View, mouse: tuple[float, float], hit: tuple[str, Hit] | None
) -> Iterator[Way]:
    """The bone first where bones are drawn over the skin, else the skin."""
    by_bone: list[Way] = []
    if hit is not None and hit[1].distance <= BONE_RADIUS and _draws_bones(context, session):
        by_bone = [_bone_way(session, *hit)]
    by_skin: list[Way] = []
    if any(mesh.visible_get(viewport=context.space_data) for mesh in _meshes(session)):
        origin, direction = view.ray(mouse)
        by_skin = [{"origin": origin, "direction": direction}]
    yield from by_bone + by_skin if _draws_bones_in_front(context, session) else by_skin + by_bone


def _bone_way(session: Session, name: str, hit: Hit) -> Way:
    """The point of the bone under the mouse, in the joint's frame as the doll is now."""
    joint = session.bones.joint_of_bone(name)
    assert joint is not None
    assert session.link is not None
    assert session.link.newest is not None
    character = session.bones.character
    rotations, positions = layfigure.world_poses(character, session.link.newest.pose)
    point = rotation.rotate(rotation.conjugate(rotations[joint]), hit.point - positions[joint])
    return {"bone": character.joints[joint].name, "point": point}


def _nearest_bone(session: Session, view: View, mouse: tuple[float, float]) -> tuple[str, Hit] | None:
    """Of those that belong to joints and are not hidden; its name too."""
    armature = session.armature()
    if armature is None:
        return None
    posed = armature.pose.bones
    names = [
        bone.name
        for bone in session.bones.bones
        if bone.name in posed
        and session.bones.joint_of_bone(bone.name) is not None
        and _is_drawn(armature, posed[bone.name])
    ]
    hit = nearest_bone(view, mouse, *segments(session, names))
    return (names[hit.index], hit) if hit is not None else None


def _is_shown(context: bpy.types.Context, session: Session) -> bool:
    armature = session.armature()
    if armature is None:
        return False
    things = itertools.chain([armature], _meshes(session))
    return any(thing.visible_get(viewport=context.space_data) for thing in things)


def _meshes(session: Session) -> Iterator[bpy.types.Object]:
    """Of the scene, that the armature deforms."""
    armature = session.armature()
    for mesh in bpy.context.scene.objects:
        if mesh.type == "MESH" and any(m.type == "ARMATURE" and m.object == armature for m in mesh.modifiers):
            yield mesh


def _draws_bones(context: bpy.types.Context, session: Session) -> bool:
    armature, space = session.armature(), context.space_data
    overlay = space.overlay
    is_shown = armature is not None and armature.visible_get(viewport=space)
    return bool(is_shown and overlay.show_overlays and overlay.show_bones)


def _draws_bones_in_front(context: bpy.types.Context, session: Session) -> bool:
    """Of the skin, so that who clicks where both are means the bone."""
    armature, shading = session.armature(), context.space_data.shading
    sees_through = shading.type == "WIREFRAME" or (shading.type == "SOLID" and shading.show_xray)
    return bool(armature is not None and (armature.show_in_front or sees_through))


def _is_drawn(armature: bpy.types.Object, bone: bpy.types.PoseBone) -> bool:
    hidden = bone.hide if hasattr(bone, "hide") else bone.bone.hide  # of the pose since 5.0
    if hidden:
        return False
    if hasattr(bone.bone, "layers"):  # before 4.0
        return any(of_bone and shown for of_bone, shown in zip(bone.bone.layers, armature.data.layers, strict=True))
    collections = bone.bone.collections
    return not collections or any(_is_visible(collection) for collection in collections)


def _is_visible(collection: bpy.types.BoneCollection) -> bool:
    """With those around it, which there are since 4.1."""
    return getattr(collection, "is_visible_effectively", collection.is_visible)
