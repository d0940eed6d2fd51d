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
from .obstacles import CLEAR, Sight, line_of_sight
from .picking import BONE_RADIUS, Hit, nearest_bone
from .rig import check_similarity
from .sessions import Session
from .view import View

MEND = "hide that, or switch X-ray on (Alt Z)"


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
    ways: Sequence[Way]  # none if something else hides it
    why_none: str  # one line, "" if there are ways


def target_under(context: bpy.types.Context, mouse: tuple[float, float]) -> Target | None:
    """Of several dolls that are not hidden there, that of which a bone is drawn nearest to the mouse."""
    found = [_look(context, session, mouse) for session in seen_sessions(context)]
    found.sort(key=lambda look: np.inf if look.hit is None else look.hit[1].distance)
    for look in found:
        if ways := list(_ways(context, look, look.sight)):
            return Target(look.session, look.view, ways, "")
    for look in found:
        if any(True for _ in _ways(context, look, CLEAR)):
            return Target(look.session, look.view, (), f"'{look.sight.name}' is in front of the doll: {MEND}")
    return None


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


@dataclass(frozen=True, eq=False)
class _Look:
    """At one doll, through a pixel."""

    session: Session
    view: View
    origin: Floats  # of the ray, and its direction of length 1, in the server's world
    direction: Floats
    hit: tuple[str, Hit] | None  # the nearest bone
    sight: Sight


def _look(context: bpy.types.Context, session: Session, mouse: tuple[float, float]) -> _Look:
    view = view_of(context, session)
    ray = view.ray(mouse)
    return _Look(session, view, *ray, _nearest_bone(session, view, mouse), _sight(context, session, *ray))


def _ways(context: bpy.types.Context, look: _Look, sight: Sight) -> Iterator[Way]:
    """The bone first where bones are drawn over the skin, else the skin; neither behind what hides it."""
    session, hit = look.session, look.hit
    are_bones_in_front = _draws_bones_in_front(context, session)
    by_bone: list[Way] = []
    if hit is not None and hit[1].distance <= BONE_RADIUS and _draws_bones(context, session):
        away = float((hit[1].point - look.origin) @ look.direction) / _scale(session)
        if are_bones_in_front or not sight.hides(away):
            by_bone = [_bone_way(session, *hit)]
    by_skin: list[Way] = []
    if not sight.skin_is_hidden and any(mesh.visible_get(viewport=context.space_data) for mesh in _meshes(session)):
        by_skin = [{"origin": look.origin, "direction": look.direction}]
    yield from by_bone + by_skin if are_bones_in_front else by_skin + by_bone


def _sight(context: bpy.types.Context, session: Session, origin: Floats, direction: Floats) -> Sight:
    armature = session.armature()
    if armature is None or _sees_through(context):
        return CLEAR
    to_blender = np.linalg.inv(session.world_to_server())
    start = to_blender[:3, :3] @ origin + to_blender[:3, 3]
    way = to_blender[:3, :3] @ direction
    return line_of_sight(context, armature, list(_meshes(session)), start, way / np.linalg.norm(way))


def _scale(session: Session) -> float:
    """Of Blender's world in the server's."""
    return check_similarity(session.world_to_server())


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
    armature = session.armature()
    return bool(armature is not None and (armature.show_in_front or _sees_through(context)))


def _sees_through(context: bpy.types.Context) -> bool:
    shading = context.space_data.shading
    return bool(shading.type == "WIREFRAME" or (shading.type == "SOLID" and shading.show_xray))


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
