"""Scenes of the comparison: the file format that layfigure-bench reads, and chains made to measure.

Units are SI. Quaternions are w x y z, world orientations at the start; the rest rotation of every joint is the
identity, so a chain that starts bent starts strained.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Body:
    """A body and the ball joint to its parent. The torque on it is -K rotvec(R_parent^T R) - D w_rel."""

    parent: int  # -1: the world
    anchor: Vector  # of the joint, in the parent's frame
    com: Vector
    mass: float
    inertia: Vector  # diagonal, about the com
    quat0: Quaternion
    K: float
    D: float
    yield_torque: float | None = None  # None: the joint never flows
    flow_damping: float = 0.0


@dataclass(frozen=True)
class Load:
    """A force on a body at its com, in world axes, between two instants: swelling and fading as sin^2, or constant."""

    index: int
    force: Vector
    start: float
    end: float
    shape: str = "sin2"


@dataclass(frozen=True)
class Limb:
    """A capsule on a body, in its frame; a ball where its ends are one."""

    body: int
    start: Vector
    end: Vector
    radius: float


@dataclass(frozen=True)
class Scene:
    name: str
    gravity: Vector
    duration: float
    bodies: tuple[Body, ...]
    law: str = "paper"
    loads: tuple[Load, ...] = ()
    root: str = "ball"  # how the first body is held: by a "ball" joint, or "free"
    limbs: tuple[Limb, ...] = ()  # which meet the floor alone, not each other
    floor: float | None = None  # Coulomb's coefficient on the plane z = 0, if that is a floor

    @property
    def flows(self) -> bool:
        """Whether its joints can yield, which the peers' cannot."""
        return any(body.yield_torque is not None for body in self.bodies)


@dataclass(frozen=True)
class Chain:
    """A chain of 0.1 m, 0.1 kg links along x, fixed at its beginning by a joint like the others."""

    links: int
    bend: float = 0.0  # rotation of each joint at the start, about an axis that turns along the chain [rad]
    stiffness: float = 2.0
    damping: float = 0.02
    yield_torque: float | None = None
    flow_damping: float = 0.0

    def bodies(self) -> tuple[Body, ...]:
        bodies = []
        world = IDENTITY
        for i in range(self.links):
            turn = 0.7 * i
            world = product(world, exponential(self.bend * np.array([0.3, np.cos(turn), np.sin(turn)])))
            bodies.append(self._link(i, world))
        return tuple(bodies)

    def _link(self, i: int, world: Quaternion) -> Body:
        return Body(
            parent=i - 1,
            anchor=(0.1 if i else 0.0, 0.0, 0.0),
            com=(0.05, 0.0, 0.0),
            mass=0.1,
            inertia=(2e-5, 28e-5 / 3, 28e-5 / 3),
            quat0=world,
            K=self.stiffness,
            D=self.damping,
            yield_torque=self.yield_torque,
            flow_damping=self.flow_damping,
        )


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    w, x, y, z = a
    s, i, j, k = b
    return (
        w * s - x * i - y * j - z * k,
        w * i + x * s + y * k - z * j,
        w * j - x * k + y * s + z * i,
        w * k + x * j - y * i + z * s,
    )


def conjugate(q: Quaternion) -> Quaternion:
    return (q[0], -q[1], -q[2], -q[3])


def exponential(rotation_vector: Array) -> Quaternion:
    """The rotation about the vector by its length [rad]."""
    angle = float(np.linalg.norm(rotation_vector))
    x, y, z = (float(v) for v in rotation_vector * (0.5 * np.sinc(angle / (2.0 * np.pi))))
    return (float(np.cos(0.5 * angle)), x, y, z)


def matrix(q: Quaternion) -> Array:
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def joint_rotations(scene: Scene) -> list[Quaternion]:
    """Each body's rotation relative to its parent at the start."""
    return [
        body.quat0 if body.parent < 0 else product(conjugate(scene.bodies[body.parent].quat0), body.quat0)
        for body in scene.bodies
    ]


def constant_forces(scene: Scene) -> Array:
    """What the loads exert on each body. Raises ValueError if they are not constant over the whole scene."""
    forces = np.zeros((len(scene.bodies), 3))
    for load in scene.loads:
        if load.shape != "constant" or load.start > 0.0 or load.end < scene.duration:
            raise ValueError(f"{scene.name}: not a constant load: {load}")
        forces[load.index] += load.force
    return forces


def hanging(name: str, chain: Chain, duration: float = 1.0) -> Scene:
    """A chain that gravity swings."""
    return Scene(name=name, gravity=(0.0, 0.0, -9.81), duration=duration, bodies=chain.bodies())


def pulled(name: str, chain: Chain, law: str, duration: float = 1.0) -> Scene:
    """A chain whose last link is pulled past yield for half a second and let go, without gravity."""
    load = Load(index=chain.links - 1, force=(0.3, 1.0, 0.6), start=0.0, end=0.5)
    return Scene(name, gravity=(0.0, 0.0, 0.0), duration=duration, bodies=chain.bodies(), law=law, loads=(load,))


def made_scenes() -> list[Scene]:
    """The scenes that are made rather than stored: with those, every length soft and stiff, planar and bent."""
    stiff = {"stiffness": 200.0, "damping": 2.0}
    doll = {"damping": 0.05, "yield_torque": 0.1, "flow_damping": 0.2}
    return [
        hanging("chain-20-stiff", Chain(20, **stiff)),
        hanging("chain-60-bent", Chain(60, bend=0.3)),
        hanging("chain-60-stiff", Chain(60, **stiff)),
        hanging("chain-60-stiff-bent", Chain(60, bend=0.1, **stiff)),
        hanging("chain-200-bent", Chain(200, bend=0.3)),
        hanging("chain-200-stiff-bent", Chain(200, bend=0.1, **stiff)),
        hanging("chain-1000", Chain(1000), duration=0.5),
        hanging("chain-1000-stiff-bent", Chain(1000, bend=0.1, **stiff), duration=0.5),
        pulled("chain-20-pulled-paper", Chain(20, **doll), "paper"),
        pulled("chain-20-pulled-overstress", Chain(20, **doll), "overstress"),
    ]


def load(path: Path) -> Scene:
    """Reads a scene file. Raises ValueError that names the file where something is missing or of the wrong kind."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        return Scene(
            name=str(data["name"]),
            gravity=_vector(data["gravity"]),
            duration=float(data["duration"]),
            bodies=tuple(_body(item) for item in data["bodies"]),
            law=str(data.get("law", "paper")),
            loads=tuple(_load(item) for item in data.get("loads", [])),
            root=str(data.get("root", "ball")),
            limbs=tuple(_limb(item) for item in data.get("limbs", [])),
            floor=None if data.get("floor") is None else float(data["floor"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path}: not a scene: {error!r}") from error


def save(scene: Scene, path: Path) -> None:
    data = asdict(scene)
    data["limbs"] = [
        {"body": limb.body, "from": limb.start, "to": limb.end, "radius": limb.radius} for limb in scene.limbs
    ]
    for body in data["bodies"]:
        if body["yield_torque"] is None:
            del body["yield_torque"]
    path.write_text(json.dumps(data), encoding="utf-8")


def _vector(values: Any) -> Vector:
    x, y, z = (float(v) for v in values)
    return (x, y, z)


def _body(item: dict[str, Any]) -> Body:
    w, x, y, z = (float(v) for v in item["quat0"])
    limit = item.get("yield_torque")
    return Body(
        parent=int(item["parent"]),
        anchor=_vector(item["anchor"]),
        com=_vector(item["com"]),
        mass=float(item["mass"]),
        inertia=_vector(item["inertia"]),
        quat0=(w, x, y, z),
        K=float(item["K"]),
        D=float(item["D"]),
        yield_torque=None if limit is None else float(limit),
        flow_damping=float(item.get("flow_damping", 0.0)),
    )


def _load(item: dict[str, Any]) -> Load:
    return Load(
        index=int(item["index"]),
        force=_vector(item["force"]),
        start=float(item["start"]),
        end=float(item["end"]),
        shape=str(item.get("shape", "sin2")),
    )


def _limb(item: dict[str, Any]) -> Limb:
    return Limb(int(item["body"]), _vector(item["from"]), _vector(item["to"]), float(item["radius"]))
