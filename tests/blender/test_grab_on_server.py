"""The mouse on the real server: what is held follows it, and how the doll is afterwards.

Time passes by the test's steps alone, so that a hand is as fast on any machine.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from blender_support.views import looking, perspective, shifted
from layfigure_blender.grab import Grab, Outcome, Phase, free_pointer
from layfigure_blender.link import Link
from layfigure_blender.pins import PinList
from layfigure_blender.view import View

import layfigure
from layfigure import rotation

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.append(str(REPOSITORY / "tests/server"))  # one way to start a server for all tests
from server_support.process import ServerProcess  # noqa: E402

TIMEOUT_S = 30.0  # for a machine under load; never waited for in a test that passes
POLL_S = 0.005
FRAME = 17  # steps of 1 ms between two motions of the mouse
POSE_HZ = str(1000.0 / FRAME)
SETTLED = 3000  # steps after which a doll swings no more
HAND, OTHER_HAND = "hand.L", "hand.R"
WIDTH, HEIGHT = 1000, 800


class Stage:
    """A doll 0.3 m tall on a real server, looked at from 1 m in front of it, and a mouse."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.pins = PinList(link)
        window = perspective(WIDTH, HEIGHT, focal=2.5)
        self.view = View(looking(np.array([0.0, -1.0, 0.15]), np.array([0.0, 0.0, 0.15])), window, WIDTH, HEIGHT)

    def place(self, joint: str) -> np.ndarray:
        return self._world(joint)[1]

    def turn(self, joint: str) -> np.ndarray:
        return self._world(joint)[0]

    def press(self, *ways: dict[str, object], at: np.ndarray) -> Grab:
        """Presses at a pixel and holds."""
        pointer = free_pointer(self.link.status, self.link.forces)
        assert pointer is not None
        grab = Grab(self.link, self.pins, pointer, ways, at, 0.0, click_radius=3.0)
        grab.poll(1.0)
        self.until(lambda: grab.phase is Phase.HOLDING, grab)
        return grab

    def press_bone(self, joint: str) -> tuple[Grab, np.ndarray]:
        pixel = self.view.pixels(self.place(joint))
        return self.press({"bone": joint, "point": np.zeros(3)}, at=pixel), pixel

    def lead(self, grab: Grab, start: np.ndarray, end: np.ndarray, *, turn: bool = False) -> None:
        """The mouse at the pace of a hand, 60 places in a second."""
        for share in np.linspace(0.0, 1.0, 30)[1:]:
            grab.mouse(self.view, (1.0 - share) * start + share * end, turn=turn)
            grab.poll(2.0)
            self.step(FRAME)

    def end(self, grab: Grab) -> None:
        self.until(lambda: grab.phase is Phase.ENDED, grab)

    def until(self, condition: Callable[[], bool], grab: Grab | None = None) -> None:
        deadline = time.monotonic() + TIMEOUT_S
        while not condition():
            assert time.monotonic() < deadline, f"{grab and (grab.phase, grab.outcome, grab.note)}"
            if grab is not None:
                grab.poll(2.0)
            time.sleep(POLL_S)

    def step(self, count: int) -> None:
        """Lets time pass, and waits for the pose of its end."""
        reply = self.link.send("step", count=count).result(TIMEOUT_S)
        last = reply.values("steps")[0] // FRAME * FRAME
        self.until(lambda: self.link.newest is not None and self.link.newest.pose.step >= last)

    def settle(self) -> None:
        self.step(SETTLED)

    def _world(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        assert self.link.character is not None
        assert self.link.newest is not None
        rotations, positions = layfigure.world_poses(self.link.character, self.link.newest.pose)
        index = [joint.name for joint in self.link.character.joints].index(name)
        return rotations[index], positions[index]


@pytest.fixture
def server(binary: Path, character: Path) -> Iterator[ServerProcess]:
    with ServerProcess(
        [str(binary), str(character), "--broker", "0", "--clock", "lockstep", "--pose-hz", POSE_HZ]
    ) as process:
        yield process


@pytest.fixture
def stage(server: ServerProcess) -> Iterator[Stage]:
    link = Link(server.url)
    link.start()
    try:
        stage = Stage(link)
        stage.until(lambda: link.state == "live" and link.newest is not None)
        stage.settle()
        yield stage
    finally:
        link.close()


def test_hand_follows_the_mouse_and_keeps_what_was_bent_too_far(stage: Stage) -> None:
    before = stage.place(HAND)
    grab, pixel = stage.press_bone(HAND)
    stage.lead(grab, pixel, shifted(pixel, -60.0, 60.0))
    assert grab.target is not None
    np.testing.assert_allclose(stage.view.pixels(grab.target), shifted(pixel, -60.0, 60.0), atol=1e-6)
    stage.settle()
    held = stage.place(HAND)
    way, wanted = held - before, grab.target - before
    assert way @ wanted > 0.5 * (wanted @ wanted)
    grab.release()
    stage.end(grab)
    assert grab.outcome is Outcome.RELEASED
    stage.settle()
    assert np.linalg.norm(stage.place(HAND) - before) > 0.3 * np.linalg.norm(way)


def test_cancel_puts_the_doll_back_where_it_was_before_the_grab(stage: Stage) -> None:
    assert stage.link.newest is not None
    before = stage.link.newest.pose
    grab, pixel = stage.press_bone(HAND)
    grab.soften()
    stage.lead(grab, pixel, shifted(pixel, -60.0, 60.0))
    grab.pin()
    assert np.abs(stage.link.newest.pose.rotations - before.rotations).max() > 0.1
    grab.cancel()
    stage.end(grab)
    assert grab.outcome is Outcome.CANCELLED
    stage.step(FRAME)
    after = stage.link.newest.pose
    np.testing.assert_allclose(after.rest_rotations, before.rest_rotations, atol=1e-9)
    np.testing.assert_allclose(after.rotations, before.rotations, atol=1e-4)  # at rest, but for the last creep
    stage.until(lambda: stage.pins.known == ())
    assert free_pointer(stage.link.status, stage.link.forces) == grab.pointer


def test_skin_is_held_where_the_ray_of_the_pixel_meets_it(stage: Stage) -> None:
    pixel = shifted(stage.view.pixels(stage.place("chest")), 4.0, 6.0)
    origin, direction = stage.view.ray(pixel)
    grab = stage.press({"origin": origin, "direction": direction}, at=pixel)
    assert grab.target is not None
    np.testing.assert_allclose(stage.view.pixels(grab.target), pixel, atol=1e-6)
    assert stage.view.depth(grab.target) < stage.view.depth(stage.place("chest"))
    grab.release()
    stage.end(grab)


def test_ray_past_the_doll_misses_and_a_bone_is_the_next_way(stage: Stage) -> None:
    origin, direction = stage.view.ray([1.0, 1.0])
    ray = {"origin": origin, "direction": direction}
    grab = Grab(stage.link, stage.pins, 15, [ray], [1.0, 1.0], 0.0, click_radius=3.0)
    grab.poll(1.0)
    stage.end(grab)
    assert (grab.outcome, grab.note) == (Outcome.MISSED, "the ray meets no skin")
    grab = stage.press(ray, {"bone": HAND, "point": np.zeros(3)}, at=np.array([1.0, 1.0]))
    grab.cancel()
    stage.end(grab)


def test_second_grab_of_the_same_pointer_begins_without_a_jump(stage: Stage) -> None:
    grab, pixel = stage.press_bone(HAND)
    stage.lead(grab, pixel, shifted(pixel, -60.0, 60.0))
    grab.mouse(stage.view, shifted(pixel, -50.0, 80.0), turn=True)
    grab.release()
    stage.end(grab)
    stage.settle()
    before = stage.place(OTHER_HAND)
    stage.until(lambda: free_pointer(stage.link.status, stage.link.forces) == grab.pointer)
    again, pixel = stage.press_bone(OTHER_HAND)
    assert again.pointer == grab.pointer
    again.mouse(stage.view, shifted(pixel, 1.0, 0.0), turn=True)  # holds the rotation, which it turns by half a degree
    stage.settle()
    assert np.linalg.norm(stage.place(OTHER_HAND) - before) < 2e-3
    assert np.linalg.norm(stage.link.forces[again.pointer].target - before) < 2e-3
    again.release()
    stage.end(again)


def test_turning_turns_what_is_held_about_the_axes_of_the_view(stage: Stage) -> None:
    grab, pixel = stage.press_bone(HAND)
    before = stage.turn(HAND)
    stage.lead(grab, pixel, shifted(pixel, 60.0, 0.0), turn=True)  # 0.6 rad
    stage.settle()
    turned = rotation.to_vector(rotation.multiply(stage.turn(HAND), rotation.conjugate(before)))
    assert turned @ stage.view.up > 0.3
    grab.cancel()
    stage.end(grab)


def test_what_is_pinned_stays_while_something_else_is_dragged(stage: Stage) -> None:
    grab, pixel = stage.press_bone(HAND)
    stage.lead(grab, pixel, shifted(pixel, -40.0, 40.0))
    grab.pin()
    stage.until(lambda: grab.pinned, grab)
    grab.release()
    stage.end(grab)
    stage.settle()
    pinned = stage.place(HAND)
    other, pixel = stage.press_bone("head")
    stage.lead(other, pixel, shifted(pixel, 60.0, -20.0))
    moved = stage.place("head")
    assert np.linalg.norm(stage.place(HAND) - pinned) < 2e-3
    other.unpin_all()
    stage.until(lambda: stage.pins.known == (), other)
    stage.settle()
    assert np.linalg.norm(stage.place(HAND) - pinned) > 2e-3
    assert np.linalg.norm(stage.place("head") - moved) < 0.05
    other.release()
    stage.end(other)


def test_softened_doll_gives_way_to_a_pull_that_it_would_spring_back_from(stage: Stage) -> None:
    stays = []
    for soft in (False, True):
        before = stage.place(HAND)
        grab, pixel = stage.press_bone(HAND)
        if soft:
            grab.soften()
        stage.lead(grab, pixel, shifted(pixel, 0.0, 20.0))
        stage.settle()
        grab.release()
        stage.end(grab)
        stage.settle()
        stays.append(np.linalg.norm(stage.place(HAND) - before))
    assert stays[1] > stays[0] + 1e-3
    reply = stage.link.send("history").result(TIMEOUT_S)
    assert reply.accepted


def test_server_that_is_killed_ends_the_hold_with_a_message(stage: Stage, server: ServerProcess) -> None:
    grab, pixel = stage.press_bone(HAND)
    server.process.kill()
    server.process.wait()
    stage.end(grab)
    assert grab.outcome is Outcome.LOST
    assert grab.note
    grab.mouse(stage.view, pixel)
    grab.release()


def test_undo_of_another_program_ends_the_hold(stage: Stage) -> None:
    grab, pixel = stage.press_bone(HAND)
    stage.lead(grab, pixel, shifted(pixel, -40.0, 40.0))
    stage.until(lambda: stage.link.forces[grab.pointer].attached, grab)
    stage.link.send("undo").result(TIMEOUT_S)
    stage.step(FRAME)
    stage.end(grab)
    assert grab.outcome is Outcome.RELEASED
    assert "let go" in grab.note
