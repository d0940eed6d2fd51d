"""A pose on its way to the doll: when it is there, and where the doll then stands."""

from __future__ import annotations

from concurrent.futures import Future
from types import SimpleNamespace

import numpy as np
import pytest
from layfigure_blender import pushing
from layfigure_blender.pushing import PosePush

from layfigure import NoReplyError

ANSWERED_US = 5000


class Link:
    """Has answered, and has the pose of a time as its newest one."""

    def __init__(self) -> None:
        self.show(0)

    def show(self, time_us: int) -> None:
        self.newest = SimpleNamespace(pose=SimpleNamespace(time_us=time_us))

    def send(self, *_: object, **__: object) -> Future[SimpleNamespace]:
        reply: Future[SimpleNamespace] = Future()
        reply.set_result(SimpleNamespace(time_us=ANSWERED_US))
        return reply


class Bones:
    """Remembers by the pose of which time it was placed."""

    def __init__(self) -> None:
        self.placed_us: int | None = None

    def place_root(self, _: np.ndarray, pose: SimpleNamespace | None = None) -> None:
        self.placed_us = pose.time_us if pose is not None else None

    @staticmethod
    def rotations(_: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.array([1]), np.array([[1.0, 0.0, 0.0, 0.0]])


@pytest.fixture
def link() -> Link:
    return Link()


@pytest.fixture
def bones() -> Bones:
    return Bones()


@pytest.mark.parametrize("stale_us", [ANSWERED_US - 1000, ANSWERED_US])
def test_doll_is_placed_by_a_pose_of_after_the_answer(link: Link, bones: Bones, stale_us: int) -> None:
    push = PosePush(link, bones, np.zeros((1, 4, 4)))
    link.show(stale_us)
    push.step()
    assert not push.done
    assert bones.placed_us is None
    link.show(ANSWERED_US + 1000)
    push.step()
    assert push.future.result(0) is None
    assert bones.placed_us == ANSWERED_US + 1000


def test_pose_of_the_answers_time_does_where_no_other_comes(
    link: Link, bones: Bones, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pushing, "ARRIVAL_TIMEOUT_S", 0.0)
    push = PosePush(link, bones, np.zeros((1, 4, 4)))
    link.show(ANSWERED_US)
    push.step()
    assert push.future.result(0) is None
    assert bones.placed_us == ANSWERED_US


def test_server_that_sends_no_pose_is_told_of(link: Link, bones: Bones, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pushing, "ARRIVAL_TIMEOUT_S", 0.0)
    push = PosePush(link, bones, np.zeros((1, 4, 4)))
    link.show(ANSWERED_US - 1000)
    push.step()
    with pytest.raises(NoReplyError, match="no pose came"):
        push.future.result(0)
