"""What a user does with a doll in the window: starts it, takes it by a bone, drags, lets go."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .legacy_addon import MODULE
from .window import BlenderWindow, Place

STEPS = 30  # motions of the mouse on one way
SETTLED_US = 500_000  # of the doll's time without a motion
REST = 2e-5  # [m] between two looks: a doll that settles
MOVED = 1e-3  # [m] away from where it was: two pixels in these views
SETTLE_TIMEOUT_S = 120.0  # for a machine under load
POLL_S = 0.05
DRAWN_S = 1.0  # several pictures

DOLL = "sessions.all()[0]"
HELD = f"any(force.attached for force in {DOLL}.link.forces.values())"

Position = NDArray[np.float64]


def open_character(blender: BlenderWindow, character: Path) -> None:
    """Enables the add-on, loads a character and opens the add-on's tab."""
    blender.enable(MODULE)
    blender.do(f"from {MODULE} import sessions")
    blender.do(f"load_character({str(character)!r})")
    blender.open_tab("Layfigure")


def start(blender: BlenderWindow) -> None:
    """Presses Start and waits until the doll is live."""
    blender.press_button("layfigure.start")
    blender.wait_for("[session.live for session in sessions.all()] == [True]")


def take_tool(blender: BlenderWindow) -> None:
    """Presses the button of the tool that drags."""
    blender.press_button("wm.tool_set_by_id")


def head(blender: BlenderWindow, bone: str) -> Position:
    """Where a bone's head is in the world [m]."""
    return np.array(blender.ask(f"bone_head({bone!r})"))


def seen_at(blender: BlenderWindow, bone: str) -> Place:
    x, y = blender.ask(f"on_screen(bone_head({bone!r}))")
    return float(x), float(y)


def seen_in_new_view(blender: BlenderWindow, bone: str) -> Place:
    """As seen_at(), once the view is drawn as it was set, which takes Blender a picture or two."""
    before, now = None, seen_at(blender, bone)
    while now != before:
        time.sleep(DRAWN_S)
        before, now = now, seen_at(blender, bone)
    return now


def way(begin: Place, by: Place) -> list[Place]:
    """The places of a mouse that is moved by so many pixels, right and down."""
    return [(begin[0] + t * by[0], begin[1] + t * by[1]) for t in np.linspace(0.0, 1.0, STEPS)]


def take(blender: BlenderWindow, bone: str) -> Place:
    """Presses the mouse on a bone, and waits until the server holds it; where that was."""
    place = seen_at(blender, bone)
    blender.move([place])
    blender.press()
    blender.wait_for(HELD)
    return place


def pull(blender: BlenderWindow, bone: str, begin: Place, by: Place) -> Position:
    """Moves the mouse that holds a bone by so many pixels, right and down; where the bone comes to rest."""
    before = head(blender, bone)
    blender.move(way(begin, by))
    return settle(blender, bone, before)


def let_go(blender: BlenderWindow, bone: str) -> Position:
    """Where the bone comes to rest."""
    blender.release()
    blender.wait_for(f"not {HELD}")
    return settle(blender, bone)


def drag(blender: BlenderWindow, bone: str, by: Place) -> Position:
    """Takes a bone, moves the mouse by so many pixels and lets go; where the bone comes to rest."""
    pull(blender, bone, take(blender, bone), by)
    return let_go(blender, bone)


def settle(blender: BlenderWindow, bone: str, left: Position | None = None) -> Position:
    """Waits until a bone has been at rest for a while of the doll's own time, and not where it was before, `left`.

    Blender takes the mouse's motions and keys when it comes to them: what they bring about is to be waited for.
    """
    deadline = time.monotonic() + SETTLE_TIMEOUT_S
    last, since = None, 0.0
    while time.monotonic() < deadline:
        *place, now, live = blender.ask(f"[*bone_head({bone!r}), {DOLL}.link.newest.pose.time_us, {DOLL}.live]")
        is_left = left is None or np.linalg.norm(place - left) > MOVED
        if last is None or not live or np.linalg.norm(place - last) > REST:
            last, since = np.array(place), now
        elif is_left and now - since > SETTLED_US:
            return np.array(place)
        time.sleep(POLL_S)
    raise AssertionError(f"'{bone}' did not come to rest elsewhere\n{blender.log()}")
