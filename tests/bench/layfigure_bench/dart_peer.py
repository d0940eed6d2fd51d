"""The scenes in DART: ball joints with its own spring and damping, which it takes implicitly, without contacts.

DART has no call that makes many steps, so the loop is Python's: what a call costs beside the step is measured on a
call that does nothing, and taken off. Its sleeping is off: a scene that sleeps is another problem.
"""

from __future__ import annotations

import time

import dartpy as dart  # type: ignore[import-untyped,import-not-found,unused-ignore]
import numpy as np

from layfigure_bench.engine import LocalEngine
from layfigure_bench.scenes import Array, Quaternion, Scene, joint_rotations

FAMILY = "DART"
CALLS = 20_000


class DartSimulation:
    def __init__(self, scene: Scene, h: float) -> None:
        self._skeleton = skeleton_of(scene)
        self._world = dart.simulation.World(scene.name)
        self._world.setGravity(scene.gravity)
        self._world.setTimeStep(h)
        sleeping = self._world.getDeactivationOptions()
        sleeping.mEnabled = False
        self._world.setDeactivationOptions(sleeping)
        self._world.addSkeleton(self._skeleton)
        self._start = np.array(self._skeleton.getPositions())

    def restart(self) -> None:
        self._skeleton.setPositions(self._start)
        self._skeleton.setVelocities(np.zeros_like(self._start))
        self._skeleton.setAccelerations(np.zeros_like(self._start))

    def advance(self, steps: int) -> None:
        step = self._world.step
        for _ in range(steps):
            step()

    def com(self) -> Array:
        return np.array([node.getCOM() for node in self._skeleton.getBodyNodes()], dtype=float)

    def energy(self) -> float:
        return float(self._skeleton.computeKineticEnergy() + self._skeleton.computePotentialEnergy())

    def call_cost_s(self) -> float:
        call = self._world.getTimeStep
        start = time.thread_time()
        for _ in range(CALLS):
            call()
        return (time.thread_time() - start) / CALLS


def skeleton_of(scene: Scene) -> dart.dynamics.Skeleton:
    skeleton = dart.dynamics.Skeleton(scene.name)
    nodes: list[dart.dynamics.BodyNode] = []
    for body, rotation in zip(scene.bodies, joint_rotations(scene), strict=True):
        parent = () if body.parent < 0 else (nodes[body.parent],)
        joint, node = skeleton.createBallJointAndBodyNodePair(*parent)
        anchor = np.eye(4)
        anchor[:3, 3] = body.anchor
        joint.setTransformFromParentBodyNode(dart.math.Isometry3(anchor))
        for axis in range(3):
            joint.setSpringStiffness(axis, body.K)
            joint.setDampingCoefficient(axis, body.D)
        joint.setPositions(dart.dynamics.BallJoint.convertToPositions(matrix(rotation)))
        node.setInertia(dart.dynamics.Inertia(body.mass, body.com, np.diag(body.inertia)))
        nodes.append(node)
    return skeleton


def matrix(q: Quaternion) -> Array:
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def engines() -> list[LocalEngine]:
    return [LocalEngine(FAMILY, FAMILY, DartSimulation)]
