"""Runs inside Blender's Python: hands at haptic devices, which the server simulates, as the overlay shows them.

python device_scenes.py SCENE
"""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import bpy
import numpy as np
import world
from grab_scenes import NAMES, InView
from layfigure_blender import overlay, preferences, seen_dolls, server, sessions
from layfigure_blender.grab import free_pointer
from layfigure_blender.overlay_picture import FORCE, HAND, LEAST_FORCE, YIELDING, Picture

GREETING = "listening on "
STRONG = (40.0, 0.0, 0.0)  # [m/s^2] aside, under which joints of the chain yield
ON_SPOT = 2.0  # [pixels]: between two looks at a doll that a device holds


@contextlib.contextmanager
def session_with_a_device() -> Iterator[sessions.Session]:
    """A chain of bones at a server that runs already, as the preferences name it, and has one device."""
    world.empty_file()
    armature = world.chain(NAMES)
    first = world.start(armature)
    folder = Path(tempfile.mkdtemp())
    character = Path(shutil.copy(first.character, folder / "chain.glb"))
    first.stop()
    command = [server.find(), character, "--device", "spidar-g6", "--broker", "0", "--end-with-input"]
    process = subprocess.Popen(list(map(str, command)), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        url = next(line for line in process.stdout if line.startswith(GREETING)).removeprefix(GREETING).strip()
        preferences.of = lambda _: SimpleNamespace(url=url)
        session = world.start(armature)
        world.wait(lambda: session.link.status is not None and session.link.status.devices, "the device")
        yield session
        session.stop()
    finally:
        process.stdin.close()
        process.wait(10.0)
        shutil.rmtree(folder)


def paints(picture: Picture, color: tuple[float, ...]) -> np.ndarray:
    """Where something of a colour is drawn, (N, 2) pixels."""
    return picture.triangles.points[np.all(np.isclose(picture.triangles.colors, color), axis=1)]


def shown(session: sessions.Session) -> Picture:
    sessions.tick()
    bpy.context.view_layer.update()
    return overlay.picture_of(InView(), session)


def hands(session: sessions.Session) -> list:
    return overlay._watch_of(session).hands()


def scene_hand_at_a_device_is_seen_before_it_holds_anything() -> None:
    with session_with_a_device() as session:
        world.wait(lambda: len(hands(session)) == 1, "the force of the device's pointer")
        [hand] = hands(session)
        assert hand.target is None
        picture = shown(session)
        at = seen_dolls.view_of(InView(), session).pixels(hand.place)
        assert np.abs(paints(picture, HAND).mean(axis=0) - at).max() < ON_SPOT
        assert len(paints(picture, FORCE)) == 0
        assert picture.labels == ()


def scene_what_a_device_holds_is_drawn_with_its_force_and_the_joints_that_yield() -> None:
    with session_with_a_device() as session:
        [device] = session.link.status.devices
        session.link.send("grab", pointer=device.pointer, bone="upper", point=[0.0, 0.0, 0.0]).result(world.TIMEOUT_S)
        session.link.send("set", gravity=STRONG).result(world.TIMEOUT_S)
        pictures: list[Picture] = []

        def yields_under_a_force() -> bool:
            pictures.append(shown(session))
            return (
                min(len(paints(pictures[-1], color)) for color in (YIELDING, FORCE)) > 0 and pictures[-1].labels != ()
            )

        world.wait(yields_under_a_force, "a joint's yielding under a force")
        assert [label.text.endswith(" N") for label in pictures[-1].labels] == [True]
        [hand] = hands(session)
        assert hand.target is not None
        assert np.linalg.norm(hand.force) > LEAST_FORCE
        assert set(overlay._yielding_bones(session)) <= set(NAMES)


def scene_pointer_of_a_device_is_not_taken_by_the_mouse() -> None:
    with session_with_a_device() as session:
        [device] = session.link.status.devices
        taken = {free_pointer(session.link.status, {}) for _ in range(3)}
        assert device.pointer not in taken
        assert None not in taken


if __name__ == "__main__":
    with world.registered():
        globals()[sys.argv[1]]()
