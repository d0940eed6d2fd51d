# SPDX-License-Identifier: GPL-3.0-or-later
"""What else of the scene is in front of a doll: nobody takes hold of what he does not see."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Vector

from layfigure.protocol import Floats

MOST_HITS = 64  # of one line of sight; beyond, whatever there is is behind enough
# Of the way so far: how far behind a hit the next one is looked for. Single precision has 1e-7.
PAST = 1e-5


class Sight(NamedTuple):
    """Along one ray, in lengths of Blender's world; infinity for what it does not meet."""

    doll: float  # where it meets the doll's own objects
    obstacle: float  # where it meets what hides all that is behind
    name: str  # of that object, "" if there is none

    @property
    def skin_is_hidden(self) -> bool:
        return self.obstacle < self.doll < np.inf

    def hides(self, distance: float) -> bool:
        return self.obstacle < distance


CLEAR = Sight(np.inf, np.inf, "")


def line_of_sight(
    context: bpy.types.Context,
    armature: bpy.types.Object,
    meshes: Sequence[bpy.types.Object],
    origin: Floats,
    way: Floats,
) -> Sight:
    """What a ray of Blender's world meets, `way` of length 1, up to the doll's `meshes` and what hangs on its bones.

    Objects are met as they are evaluated. Costs the search trees of those whose boxes it crosses, which Blender keeps
    until they change.
    """
    depsgraph = bpy.context.evaluated_depsgraph_get()
    start, along = Vector(origin), Vector(way)
    obstacle, name = np.inf, ""
    for _ in range(MOST_HITS):
        is_hit, place, _normal, _face, item, _matrix = bpy.context.scene.ray_cast(depsgraph, start, along)
        if not is_hit:
            break
        item = item.original
        distance = (place - Vector(origin)).dot(along)
        if _is_shown(context, item):
            if item in meshes or _hangs_on(item, armature):
                return Sight(-np.inf if item.show_in_front else distance, obstacle, name)
            if obstacle == np.inf and _is_solid(item):
                obstacle, name = distance, item.name
        start = place + along * (PAST * max(abs(distance), place.length))
    return Sight(np.inf, obstacle, name)


def _is_shown(context: bpy.types.Context, item: bpy.types.Object) -> bool:
    """Instances of what is not in the scene itself are."""
    is_in_scene = bpy.context.view_layer.objects.get(item.name) == item
    return not is_in_scene or item.visible_get(viewport=context.space_data)


def _is_solid(item: bpy.types.Object) -> bool:
    return item.display_type in {"SOLID", "TEXTURED"}


def _hangs_on(item: bpy.types.Object, armature: bpy.types.Object) -> bool:
    """Such as a hat: the head is under it."""
    while item is not None:
        if item == armature:
            return True
        item = item.parent
    return False
