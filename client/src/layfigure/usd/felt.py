"""Reads what a take's SkelAnimation keeps of hands and joints beside the motion: custom attributes, custom data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import UsdSkel

from layfigure.protocol import Floats


@dataclass(frozen=True, eq=False)
class Pull:
    """What a pointer does to the doll."""

    pointer: int
    point: Floats  # (3) that it holds, world [m]
    force: Floats  # (3) world [N]


@dataclass(frozen=True)
class JointYield:
    joint: str  # of the skeleton's joint paths
    start: float  # time codes
    end: float


def read_yields(animation: Any, joint_order: list[str]) -> list[JointYield]:
    """Of a SkelAnimation's prim, or of None. What is not in the form of a take's is left out."""
    if not animation:
        return []
    columns = [animation.GetCustomDataByKey(f"layfigure:yield{name}") for name in ("Joints", "Starts", "Ends")]
    if any(column is None for column in columns):
        return []
    names = list(UsdSkel.Animation(animation).GetJointsAttr().Get() or joint_order)
    return [
        JointYield(names[joint], float(start), float(end))
        for joint, start, end in zip(*columns, strict=False)
        if 0 <= joint < len(names)
    ]


def read_pulls(animation: Any, frame: float, to_world: Any) -> list[Pull]:
    """The hands that hold something or pull; none if the file does not tell of them."""
    points, forces, joints, pointers = (
        np.array(_value(animation, name, frame), float) for name in ("heldPoints", "forces", "heldJoints", "pointers")
    )
    if points.ndim != 2 or points.shape != forces.shape or points.shape[1] != 3:
        return []
    matrix = np.array(to_world)
    axes = matrix[:3, :3] / np.linalg.norm(matrix[0, :3])
    numbers = pointers if len(pointers) == len(points) else np.arange(len(points))
    held = joints >= 0 if len(joints) == len(points) else np.any(forces != 0.0, axis=1)
    return [
        Pull(int(numbers[k]), points[k] @ matrix[:3, :3] + matrix[3, :3], forces[k] @ axes)
        for k in np.flatnonzero(held)
    ]


def _value(prim: Any, name: str, frame: float) -> Any:
    attribute = prim.GetAttribute(f"layfigure:{name}")
    value = attribute.Get(frame) if attribute else None
    return value if value is not None else []
