"""The scenes in MuJoCo: ball joints with its own stiffness and damping; contacts where there is a floor.

Its ball joint's spring torque is -K times the rotation vector from the reference to the joint's quaternion, in the
child's axes, which is the scenes' law. Its contacts are soft, at its default settings. Steps go through
mj_step(model, data, nstep), a loop in C.
"""

from __future__ import annotations

import mujoco  # type: ignore[import-untyped,import-not-found,unused-ignore]
import numpy as np

from layfigure_bench.engine import LocalEngine, Simulation
from layfigure_bench.scenes import Array, Scene, constant_forces, joint_rotations

FAMILY = "MuJoCo"
INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
    "discrete": mujoco.mjtIntegrator.mjINT_DISCRETE,
}
# Which geoms meet: limbs the floor alone.
FLOOR_BIT, LIMB_BIT = 1, 2
SLIDING = 3  # contact dimension: normal and two tangents


class MujocoSimulation:
    def __init__(self, scene: Scene, h: float, integrator: mujoco.mjtIntegrator) -> None:
        # Its warnings of instability would go to a file in the current folder; the end state tells the same.
        mujoco.set_mju_user_warning(lambda _: None)
        self._model = model_of(scene, h, integrator)
        self._data = mujoco.MjData(self._model)
        self._start = np.ravel(joint_rotations(scene))
        if scene.root == "free":
            self._start = np.concatenate([scene.bodies[0].anchor, self._start])
        self._loads = constant_forces(scene)

    def restart(self) -> None:
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:] = self._start
        self._data.xfrc_applied[1:, :3] = self._loads

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

    def frames(self) -> tuple[Array, Array]:
        mujoco.mj_kinematics(self._model, self._data)
        return np.array(self._data.xpos[1:]), np.array(self._data.xmat[1:]).reshape(-1, 3, 3)

    def kinetic(self) -> float:
        self.energy()
        return float(self._data.energy[1])

    def support(self) -> float:
        # The constraint force along the free root's vertical is the sum over all contacts.
        return float(self._data.qfrc_constraint[2])

    def call_cost_s(self) -> float:
        return 0.0


def model_of(scene: Scene, h: float, integrator: mujoco.mjtIntegrator) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.option.timestep = h
    spec.option.gravity = scene.gravity
    spec.option.integrator = integrator
    # Without this a scene that blew up would start again, and look as if it had survived.
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if scene.floor is None:
        spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    nodes: list[mujoco.MjsBody] = []
    for body in scene.bodies:
        parent = spec.worldbody if body.parent < 0 else nodes[body.parent]
        node = parent.add_body(
            pos=body.anchor, mass=body.mass, ipos=body.com, inertia=body.inertia, explicitinertial=True
        )
        if body.parent < 0 and scene.root == "free":
            node.add_freejoint()
        else:
            node.add_joint(type=mujoco.mjtJoint.mjJNT_BALL, stiffness=[body.K, 0, 0], damping=[body.D, 0, 0])
        nodes.append(node)
    if scene.floor is not None:
        add_shapes(scene, spec, nodes)
    return spec.compile()


def add_shapes(scene: Scene, spec: mujoco.MjSpec, nodes: list[mujoco.MjsBody]) -> None:
    common = {"friction": [scene.floor, 0.0, 0.0], "condim": SLIDING}
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=FLOOR_BIT, conaffinity=LIMB_BIT, **common
    )
    for limb in scene.limbs:
        common |= {"contype": LIMB_BIT, "conaffinity": FLOOR_BIT}
        if limb.start == limb.end:
            shape = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "pos": limb.start}
        else:
            shape = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "fromto": [*limb.start, *limb.end]}
        nodes[limb.body].add_geom(size=[limb.radius, 0, 0], **shape, **common)


def engines() -> list[LocalEngine]:
    def engine(name: str, integrator: mujoco.mjtIntegrator) -> LocalEngine:
        def build(scene: Scene, h: float) -> Simulation:
            return MujocoSimulation(scene, h, integrator)

        return LocalEngine(f"{FAMILY} {name}", FAMILY, build)

    return [engine(name, integrator) for name, integrator in INTEGRATORS.items()]
