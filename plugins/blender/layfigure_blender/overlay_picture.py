# SPDX-License-Identifier: GPL-3.0-or-later
"""What is drawn over a 3D view while a doll is posed: hands and their forces, pins, joints that yield. No bpy."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from layfigure import Character, Device, Force
from layfigure.protocol import Floats

from .strokes import Color, Triangles, arrow, disc, joined, lines, ring
from .view import View

GRAVITY = 9.81  # [m/s^2]
LONGEST_ARROW = 120.0  # points of the screen, that forces approach however large they are
LABEL_RIGHT, LABEL_ABOVE, LABEL_BELOW = 12.0, 10.0, -20.0  # points of the screen, from the held point
# Of a doll's size and weight: a quarter of a pixel where the doll is 500 pixels high, and of a force's arrow.
UNSEEN = 5e-4
LEAST_FORCE = 0.05  # [N]; smaller ones are not told: the tick of a hand at rest

HAND: Color = (0.35, 0.80, 1.00, 1.0)
FORCE: Color = (1.00, 0.85, 0.25, 1.0)
PIN: Color = (1.00, 0.30, 0.45, 1.0)
YIELDING: Color = (1.00, 0.45, 0.05, 0.9)
BACKGROUND: Color = (0.0, 0.0, 0.0, 0.45)  # a margin that sets off all of it from what is light


@dataclass(frozen=True, eq=False)
class Hand:
    """A pointer of the server, in the world."""

    place: Floats  # (3) of what it holds or touches with; of itself if it has no tool out
    target: Floats | None  # (3) where it wants that to be
    force: Floats  # (3) on the doll [N]


class Label(NamedTuple):
    place: Floats  # (2), pixels
    text: str
    color: Color


class Picture(NamedTuple):
    triangles: Triangles
    labels: tuple[Label, ...]


def hands_of(forces: Iterable[Force], devices: Iterable[Device]) -> list[Hand]:
    """The hands that are seen: those with a tool out, and those of devices, which an artist looks for."""
    of_devices = {device.pointer for device in devices}
    return [
        Hand(force.position, force.target if force.attached else None, force.force)
        for force in forces
        if force.attached or force.pointer in of_devices
    ]


class Measures(NamedTuple):
    """How large and heavy a doll is."""

    size: float  # [m], from one end of its joints to the other
    weight: float  # [N]

    @staticmethod
    def of(character: Character) -> Measures:
        places = np.array([joint.bind_translation for joint in character.joints])
        mass = sum(joint.mass for joint in character.joints)
        return Measures(float(np.linalg.norm(np.ptp(places, axis=0))), GRAVITY * mass)


def look_alike(before: Sequence[Hand], now: Sequence[Hand], doll: Measures) -> bool:
    """Whether drawing hands anew would show what is shown: a hand that rests trembles by less than can be seen."""
    return len(before) == len(now) and all(
        _is_near(a.place, b.place, UNSEEN * doll.size)
        and (a.target is None) == (b.target is None)
        and (a.target is None or b.target is None or _is_near(a.target, b.target, UNSEEN * doll.size))
        and _is_near(a.force, b.force, min(UNSEEN * doll.weight, LEAST_FORCE))
        for a, b in zip(before, now, strict=True)
    )


def _is_near(a: Floats, b: Floats, tolerance: float) -> bool:
    return float(np.abs(a - b).max()) <= tolerance


def picture(
    view: View, hands: Sequence[Hand], pins: Floats, yielding: tuple[Floats, Floats], usual_force: float
) -> Picture:
    """`pins` (N, 3) and the bones whose joints yield, heads and tails (N, 3), in the world; an arrow of the
    `usual_force` [N], > 0, is half as long as one can be."""
    parts = [_bones(view, yielding)]
    parts += [_pin(view, place) for place in pins]
    labels = []
    for hand in hands:
        parts.append(_hand(view, hand, usual_force))
        if (label := _label(view, hand, usual_force)) is not None:
            labels.append(label)
    return Picture(joined(parts), tuple(labels))


def force_arrow(view: View, place: Floats, force: Floats, usual_force: float) -> tuple[Floats, Floats]:
    """Both ends on the screen. It is seen in perspective: short where it points at who looks."""
    size = float(np.linalg.norm(force))
    start = view.pixels(place)
    if size == 0.0 or np.isnan(start).any():
        return start, start
    length = LONGEST_ARROW * view.scale * size / (size + usual_force)
    end = view.pixels(place + force / size * length * view.pixel_size(place))
    return start, np.where(np.isnan(end), start, end)


def force_text(size: float) -> str:
    """Of newtons: two or three digits."""
    return f"{size:.1f} N" if size < 99.95 else f"{size:.0f} N"


def _bones(view: View, yielding: tuple[Floats, Floats]) -> Triangles:
    heads, tails = view.in_front(*yielding)
    a, b = view.pixels(heads), view.pixels(tails)
    return joined([lines(a, b, 7.0 * view.scale, BACKGROUND), lines(a, b, 4.0 * view.scale, YIELDING)])


def _pin(view: View, place: Floats) -> Triangles:
    at, scale = view.pixels(place), view.scale
    return joined(
        [
            disc(at, 9.0 * scale, BACKGROUND, sides=4),
            disc(at, 7.0 * scale, PIN, sides=4),
            disc(at, 2.0 * scale, (1.0, 1.0, 1.0, 1.0)),
        ]
    )


def _hand(view: View, hand: Hand, usual_force: float) -> Triangles:
    at, scale = view.pixels(hand.place), view.scale
    if hand.target is None:
        return joined([ring(at, 9.0 * scale, 4.0 * scale, BACKGROUND), ring(at, 9.0 * scale, 2.0 * scale, HAND)])
    target = view.pixels(hand.target)
    start, end = force_arrow(view, hand.place, hand.force, usual_force)
    return joined(
        [
            lines(at, target, 4.0 * scale, BACKGROUND),
            arrow(start, end, 6.0 * scale, BACKGROUND),
            arrow(start, end, 4.0 * scale, FORCE),
            lines(at, target, 1.5 * scale, HAND),
            ring(target, 9.0 * scale, 4.0 * scale, BACKGROUND),
            ring(target, 9.0 * scale, 2.0 * scale, HAND),
            disc(at, 5.5 * scale, BACKGROUND),
            disc(at, 4.0 * scale, HAND),
        ]
    )


def _label(view: View, hand: Hand, usual_force: float) -> Label | None:
    """On the side of the held point that its arrow does not point to."""
    size = float(np.linalg.norm(hand.force))
    start, end = force_arrow(view, hand.place, hand.force, usual_force)
    if hand.target is None or size < LEAST_FORCE or np.isnan(start).any():
        return None
    offset = np.array([LABEL_RIGHT, LABEL_BELOW if end[1] > start[1] else LABEL_ABOVE])
    return Label(start + offset * view.scale, force_text(size), FORCE)
