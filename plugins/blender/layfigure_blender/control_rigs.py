# SPDX-License-Identifier: GPL-3.0-or-later
"""Rigs of controls, of which no doll can be made: bones that deform the skin follow controls and not each other."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection

import bpy

_NOTHING = ""


def why_it_falls_apart(armature: bpy.types.Object, deforming: Collection[str]) -> str | None:
    """Why most of the doll would hang together by constraints alone, and the mend, in one line; None if it does not.

    `deforming`: names of the bones that move the skin. In a rig that Rigify has generated, as in others of that kind,
    constraints of bones between them keep thighs at the spine and arms at the shoulders: a doll, which has none, is
    torn. Single parts that are kept so, such as eyes or a shield, are no matter.
    """
    carriers = _carriers(armature, deforming)
    if not carriers or 2 * max(Counter(carriers.values()).values()) >= len(carriers):
        return None
    bone, carrier = next((bone, carrier) for bone, carrier in carriers.items() if carrier != _NOTHING)
    return (
        f"'{armature.name}' is a rig of controls: bones that deform its mesh, such as '{bone}', hang on bones that "
        f"constraints move, such as '{carrier}', and not on each other. Start an armature without controls, such as "
        "Rigify's metarig, with the mesh bound to it: Object > Parent > Armature Deform > With Automatic Weights"
    )


def _carriers(armature: bpy.types.Object, deforming: Collection[str]) -> dict[str, str]:
    """By each deforming bone the one with constraints, muted or not, that the tree of deforming bones hangs on in which
    it is; nothing, if none is above it."""
    found: dict[str, str] = {}
    for bone in armature.data.bones:  # parents first
        if bone.name not in deforming:
            continue
        above = bone.parent_recursive
        deforming_above = next((each.name for each in above if each.name in found), None)
        if deforming_above is not None:
            found[bone.name] = found[deforming_above]
        else:
            constrained = (each.name for each in above if armature.pose.bones[each.name].constraints)
            found[bone.name] = next(constrained, _NOTHING)
    return found
