"""The scenes in DART: ball joints with its own spring and damping, which it takes implicitly; contacts where there is a
floor, by its default solver.

DART has no call that makes many steps, so the loop is Python's: what a call costs beside the step is measured on a
call that does nothing, and taken off. Its sleeping is off: a scene that sleeps is another problem.
"""

from __future__ import annotations

import time

import dartpy as dart  # type: ignore[import-untyped,import-not-found,unused-ignore]
import numpy as np

from layfigure_bench.engine import LocalEngine
from layfigure_bench.scenes import Array, Limb, Scene, constant_forces, joint_rotations, matrix

FAMILY = "DART"
CALLS = 20_000
FLOOR = "floor"


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
        if scene.floor is not None:
            # Its default detector does not have planes and capsules both.
            self._world.setCollisionDetector(dart.collision.BulletCollisionDetector())
            self._world.addSkeleton(floor_of(scene.floor))
        self._loads = [
            (self._skeleton.getBodyNode(i), force, scene.bodies[i].com)
            for i, force in enumerate(constant_forces(scene))
            if force.any()
        ]
        self._start = np.array(self._skeleton.getPositions())

    def restart(self) -> None:
        self._skeleton.setPositions(self._start)
        self._skeleton.setVelocities(np.zeros_like(self._start))
        self._skeleton.setAccelerations(np.zeros_like(self._start))

    def advance(self, steps: int) -> None:
        step = self._world.step
        for _ in range(steps):
            for node, force, com in self._loads:
                node.setExtForce(force, com, False, True)
            step()

    def com(self) -> Array:
        return np.array([node.getCOM() for node in self._skeleton.getBodyNodes()], dtype=float)

    def energy(self) -> float:
        return float(self._skeleton.computeKineticEnergy() + self._skeleton.computePotentialEnergy())

    def frames(self) -> tuple[Array, Array]:
        poses = np.array([node.getWorldTransform().matrix() for node in self._skeleton.getBodyNodes()])
        return poses[:, :3, 3], poses[:, :3, :3]

    def kinetic(self) -> float:
        return float(self._skeleton.computeKineticEnergy())

    def support(self) -> float:
        # A contact's force is that on its first object.
        forces = [
            -contact.force[2] if is_floor(contact.collisionObject1) else contact.force[2]
            for contact in self._world.getLastCollisionResult().getContacts()
        ]
        return float(sum(forces))

    def call_cost_s(self) -> float:
        call = self._world.getTimeStep
        start = time.thread_time()
        for _ in range(CALLS):
            call()
        return (time.thread_time() - start) / CALLS * (1 + len(self._loads))


def skeleton_of(scene: Scene) -> dart.dynamics.Skeleton:
    skeleton = dart.dynamics.Skeleton(scene.name)
    nodes: list[dart.dynamics.BodyNode] = []
    for body, rotation in zip(scene.bodies, joint_rotations(scene), strict=True):
        anchor = np.eye(4)
        anchor[:3, 3] = body.anchor
        if body.parent < 0 and scene.root == "free":
            joint, node = skeleton.createFreeJointAndBodyNodePair()
            anchor[:3, :3] = matrix(rotation)
            joint.setPositions(dart.dynamics.FreeJoint.convertToPositions(dart.math.Isometry3(anchor)))
        else:
            parent = () if body.parent < 0 else (nodes[body.parent],)
            joint, node = skeleton.createBallJointAndBodyNodePair(*parent)
            joint.setTransformFromParentBodyNode(dart.math.Isometry3(anchor))
            for axis in range(3):
                joint.setSpringStiffness(axis, body.K)
                joint.setDampingCoefficient(axis, body.D)
            joint.setPositions(dart.dynamics.BallJoint.convertToPositions(matrix(rotation)))
        node.setInertia(dart.dynamics.Inertia(body.mass, body.com, np.diag(body.inertia)))
        nodes.append(node)
    if scene.floor is not None:
        for limb in scene.limbs:
            add_limb(nodes[limb.body], limb, scene.floor)
    return skeleton


def add_limb(node: dart.dynamics.BodyNode, limb: Limb, friction: float) -> None:
    axis = np.subtract(limb.end, limb.start)
    length = float(np.linalg.norm(axis))
    shape = dart.dynamics.CapsuleShape(limb.radius, length) if length else dart.dynamics.SphereShape(limb.radius)
    pose = np.eye(4)
    pose[:3, 3] = np.add(limb.start, limb.end) / 2.0
    if length:
        z = axis / length
        x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
        x /= np.linalg.norm(x)
        pose[:3, :3] = np.column_stack([x, np.cross(z, x), z])
    shape_node = node.createShapeNode(shape)
    shape_node.setRelativeTransform(dart.math.Isometry3(pose))
    shape_node.createCollisionAspect()
    shape_node.createDynamicsAspect().setFrictionCoeff(friction)


def floor_of(friction: float) -> dart.dynamics.Skeleton:
    floor = dart.dynamics.Skeleton(FLOOR)
    _, node = floor.createWeldJointAndBodyNodePair()
    shape_node = node.createShapeNode(dart.dynamics.PlaneShape([0.0, 0.0, 1.0], 0.0))
    shape_node.createCollisionAspect()
    shape_node.createDynamicsAspect().setFrictionCoeff(friction)
    floor.setMobile(False)
    return floor


def is_floor(collided: dart.collision.CollisionObject) -> bool:
    return bool(collided.getShapeFrame().asShapeNode().getSkeleton().getName() == FLOOR)


def engines() -> list[LocalEngine]:
    return [LocalEngine(FAMILY, FAMILY, DartSimulation)]
