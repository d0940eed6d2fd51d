"""Scenes whose limbs meet a floor: the doll dropped on it, and its hand pressed on a table.

Every engine has what they take: a free root, capsules, a plane, Coulomb's friction and a constant force. Limbs do not
meet each other.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from layfigure_bench.scenes import IDENTITY, Array, Body, Limb, Load, Quaternion, Scene, Vector, exponential, matrix

FRICTION = 0.5
DROP = 0.1  # of the lowest limb over the floor at the start [m]
RECLINE = np.array([0.0, -1.4, 0.0])  # on its back, the head a little higher [rad]
PRESS = 20.0  # [N]
BALL = 0.01  # A capsule that is less longer than a ball, relative to its reach, is one.
HAND = 9  # among the bodies of the stored doll: the left one


def floor_scenes(doll: Scene) -> list[Scene]:
    """Made of the stored doll of 52 bodies."""
    return [dropped(doll), pressed(doll)]


def dropped(doll: Scene) -> Scene:
    """The doll falls on its back."""
    return lifted(replace(doll, name="doll-52-dropped", duration=1.5), exponential(RECLINE), DROP)


def pressed(doll: Scene) -> Scene:
    """A hand that a force at its palm presses on the table."""
    hand = subtree(doll, HAND)
    scene = replace(doll, name="hand-pressed", duration=1.0, bodies=hand)
    press = Load(index=0, force=(0.0, 0.0, -PRESS), start=0.0, end=scene.duration, shape="constant")
    return replace(lifted(scene, IDENTITY, 0.01), loads=(press,))


def subtree(scene: Scene, top: int) -> tuple[Body, ...]:
    """The body and all that hangs on it, the body as the root."""
    kept = [top]
    for i, body in enumerate(scene.bodies):
        if body.parent in kept:
            kept.append(i)
    return tuple(replace(scene.bodies[i], parent=kept.index(scene.bodies[i].parent) if i != top else -1) for i in kept)


def lifted(scene: Scene, turn: Quaternion, height: float) -> Scene:
    """The scene, whose bodies all have the world's axes, turned, its root free and its lowest limb above a floor."""
    limbs = tuple(limb_of(i, body) for i, body in enumerate(scene.bodies))
    bodies = tuple(replace(body, quat0=turn) for body in scene.bodies)
    turned = matrix(turn)
    origins = _origins(bodies, turned)
    lowest = min(
        float((origins[limb.body] + turned @ np.array(end))[2]) - limb.radius
        for limb in limbs
        for end in (limb.start, limb.end)
    )
    x, y, z = bodies[0].anchor
    root = replace(bodies[0], anchor=(x, y, z - lowest + height))
    return replace(scene, bodies=(root, *bodies[1:]), root="free", limbs=limbs, floor=FRICTION)


def _origins(bodies: tuple[Body, ...], turned: Array) -> list[Array]:
    origins: list[Array] = []
    for body in bodies:
        anchor = np.array(body.anchor)
        origins.append(anchor if body.parent < 0 else origins[body.parent] + turned @ anchor)
    return origins


def limb_of(index: int, body: Body) -> Limb:
    """A capsule from the joint to as far beyond the com, as thin as the box of the body's inertia."""
    radius = thickness(body)
    com = np.array(body.com)
    beyond = 1.0 - radius / float(np.linalg.norm(com))
    half = (beyond if beyond > BALL else 0.0) * com
    return Limb(index, _vector(com - half), _vector(com + half), radius)


def thickness(body: Body) -> float:
    """The smallest half extent of the box that has the body's mass and inertia [m]."""
    moments = np.array(body.inertia)
    return float(np.sqrt(np.min(1.5 * (moments.sum() - 2.0 * moments) / body.mass)))


def penetration(scene: Scene, origins: Array, rotations: Array) -> float:
    """How deep the deepest limb is in the floor [m], 0 if none is."""
    deepest = 0.0
    for limb in scene.limbs:
        for end in (limb.start, limb.end):
            height = float(origins[limb.body, 2] + rotations[limb.body, 2] @ np.array(end))
            deepest = max(deepest, limb.radius - height)
    return deepest


def carried(scene: Scene) -> float:
    """What the floor has to carry at rest: the weight and the constant loads [N]."""
    weight = -scene.gravity[2] * sum(body.mass for body in scene.bodies)
    return weight - sum(load.force[2] for load in scene.loads)


def _vector(values: Array) -> Vector:
    x, y, z = (float(v) for v in values)
    return (x, y, z)
