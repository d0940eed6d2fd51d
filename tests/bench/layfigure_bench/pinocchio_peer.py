"""The cost of Pinocchio's forward dynamics (ABA) on the scenes' trees.

Its batch call, with one thread, evaluates many states in C++, so that Python is not charged to it.
"""

from __future__ import annotations

import statistics
import time

import numpy as np
import pinocchio  # type: ignore[import-untyped,import-not-found,unused-ignore]

from layfigure_bench.scenes import Scene

FAMILY = "Pinocchio ABA"
REPEATS = 7


def model_of(scene: Scene) -> pinocchio.Model:
    model = pinocchio.Model()
    model.gravity.linear = np.array(scene.gravity)
    joints: list[int] = []
    for i, body in enumerate(scene.bodies):
        parent = 0 if body.parent < 0 else joints[body.parent]
        anchor = pinocchio.SE3(np.eye(3), np.array(body.anchor))
        joint = model.addJoint(parent, pinocchio.JointModelSpherical(), anchor, f"joint{i}")
        inertia = pinocchio.Inertia(body.mass, np.array(body.com), np.diag(body.inertia))
        model.appendBodyToJoint(joint, inertia, pinocchio.SE3.Identity())
        joints.append(joint)
    return model


class Evaluations:
    """A batch of states of a scene's tree, evaluated on one thread."""

    def __init__(self, scene: Scene, count: int) -> None:
        model = model_of(scene)
        rng = np.random.default_rng(0)
        self._count = count
        self._pool = pinocchio.ModelPool(model, 1)
        self._q = np.column_stack([pinocchio.randomConfiguration(model) for _ in range(count)])
        self._v, self._torque = (rng.standard_normal((model.nv, count)) for _ in range(2))
        self._acceleration = np.zeros((model.nv, count), order="F")

    def us_per_evaluation(self) -> float:
        """Median over several batches [us]."""
        times = []
        for _ in range(REPEATS):
            start = time.process_time()
            pinocchio.abaInParallel(1, self._pool, self._q, self._v, self._torque, self._acceleration)
            times.append(time.process_time() - start)
        return statistics.median(times) / self._count * 1e6
