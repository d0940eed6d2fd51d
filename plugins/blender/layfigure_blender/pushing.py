# SPDX-License-Identifier: GPL-3.0-or-later
"""A pose on its way from the armature to the doll. No bpy."""

from __future__ import annotations

import time
from concurrent.futures import Future

from layfigure import LayfigureError, NoReplyError, Reply

from .link import Link
from .rig import BoneMap, Floats

ARRIVAL_TIMEOUT_S = 2.0  # of the first pose after the answer; one comes at least ten times a second


class PosePush:
    """Puts the doll into `pose_matrices` (B, 4, 4), bone -> armature. Call step() until it is done."""

    def __init__(self, link: Link, bones: BoneMap, pose_matrices: Floats) -> None:
        """`bones`' placement is set anew, so that the doll as a whole stands where the root bone does."""
        self.future: Future[None] = Future()
        self._link = link
        self._bones = bones
        self._wanted = pose_matrices
        bones.place_root(pose_matrices)
        joints, rotations = bones.rotations(pose_matrices)
        self._reply: Future[Reply] | None = None
        self._deadline = float("inf")
        if len(joints):
            self._reply = link.send("load_pose", action="put", joints=joints, rotations=rotations)

    @property
    def done(self) -> bool:
        return self.future.done()

    def step(self) -> None:
        """Goes on as far as it can without waiting."""
        if self.done or (self._reply is not None and not self._reply.done()):
            return
        try:
            if self._has_arrived():
                self.future.set_result(None)
        except LayfigureError as error:
            self.future.set_exception(error)

    def _has_arrived(self) -> bool:
        """Whether the newest pose is of the time since the doll has it; the root is then where its pin holds it.

        That of the very time of the answer may be of before, and does only where no other comes: from a server that
        somebody steps.
        """
        sample = self._link.newest
        assert sample is not None
        if self._reply is not None:
            answered_us = self._reply.result().time_us
            self._deadline = min(self._deadline, time.monotonic() + ARRIVAL_TIMEOUT_S)
            if sample.pose.time_us <= answered_us and time.monotonic() < self._deadline:
                return False
            if sample.pose.time_us < answered_us:
                raise NoReplyError("no pose came from the server after its answer")
        self._bones.place_root(self._wanted, sample.pose)
        return True
