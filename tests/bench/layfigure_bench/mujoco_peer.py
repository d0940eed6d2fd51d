"""The scenes in MuJoCo: ball joints with its own stiffness and damping, without contacts.

Its ball joint's spring torque is -K times the rotation vector from the reference to the joint's quaternion, in the
child's axes, which is the scenes' law. Steps go through mj_step(model, data, nstep), a loop in C.
"""

from __future__ import annotations

import mujoco  # type: ignore[import-untyped,import-not-found,unused-ignore]
import numpy as np

from layfigure_bench.engine import LocalEngine, Simulation
from layfigure_bench.scenes import Array, Scene, joint_rotations

FAMILY = "MuJoCo"
INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}
# Without the automatic reset a scene that blew up would start again, and look as if it had survived.
DISABLED = mujoco.mjtDisableBit.mjDSBL_AUTORESET | mujoco.mjtDisableBit.mjDSBL_CONTACT


class MujocoSimulation:
    def __init__(self, scene: Scene, h: float, integrator: mujoco.mjtIntegrator) -> None:
        # Its warnings of instability would go to a file in the current folder; the end state tells the same.
        mujoco.set_mju_user_warning(lambda _: None)
        self._model = model_of(scene, h, integrator)
        self._data = mujoco.MjData(self._model)
        self._start = np.ravel(joint_rotations(scene))

    def restart(self) -> None:
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:] = self._start

    def advance(self, steps: int) -> None:
        mujoco.mj_step(self._model, self._data, nstep=steps)

    def com(self) -> Array:
        mujoco.mj_kinematics(self._model, self._data)
        return np.array(self._data.xipos[1:], dtype=float)

    def energy(self) -> float:
        mujoco.mj_fwdPosition(self._model, self._data)
        mujoco.mj_fwdVelocity(self._model, self._data)
        mujoco.mj_energyPos(self._model, self._data)
        mujoco.mj_energyVel(self._model, self._data)
        return float(np.sum(self._data.energy))

    def call_cost_s(self) -> float:
        return 0.0


def model_of(scene: Scene, h: float, integrator: mujoco.mjtIntegrator) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.option.timestep = h
    spec.option.gravity = scene.gravity
    spec.option.integrator = integrator
    spec.option.disableflags |= DISABLED
    nodes: list[mujoco.MjsBody] = []
    for body in scene.bodies:
        parent = spec.worldbody if body.parent < 0 else nodes[body.parent]
        node = parent.add_body(
            pos=body.anchor, mass=body.mass, ipos=body.com, inertia=body.inertia, explicitinertial=True
        )
        node.add_joint(type=mujoco.mjtJoint.mjJNT_BALL, stiffness=[body.K, 0, 0], damping=[body.D, 0, 0])
        nodes.append(node)
    return spec.compile()


def engines() -> list[LocalEngine]:
    def engine(name: str, integrator: mujoco.mjtIntegrator) -> LocalEngine:
        def build(scene: Scene, h: float) -> Simulation:
            return MujocoSimulation(scene, h, integrator)

        return LocalEngine(f"{FAMILY} {name}", FAMILY, build)

    return [engine(name, integrator) for name, integrator in INTEGRATORS.items()]
