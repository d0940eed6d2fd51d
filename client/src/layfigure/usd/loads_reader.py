"""Reads the torques, the flow and the forces that a take's USD keeps beside the motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from pxr import UsdSkel

from layfigure import rotation
from layfigure.errors import LayfigureError
from layfigure.loads import HandLoads, JointLoads, Loads
from layfigure.protocol import Floats
from layfigure.usd.felt import read_yields
from layfigure.usd.stage import open_stage, quiet


def loads_of_usd(path: Path) -> Loads:
    """Raises LayfigureError if the file has no torques."""
    stage = open_stage(path)
    with quiet():
        for prim in stage.Traverse():
            if prim.IsA(UsdSkel.Skeleton) and (found := _loads(stage, prim)):
                return found
    raise LayfigureError(f"'{path}' holds no torques of joints: plot the event log that was recorded with it")


def _loads(stage: Any, skeleton: Any) -> Loads | None:
    animation = UsdSkel.BindingAPI(skeleton).GetInheritedAnimationSource()
    if not animation or not animation.GetAttribute("layfigure:torques").HasAuthoredValue():
        return None
    tokens = list(UsdSkel.Animation(animation).GetJointsAttr().Get() or [])
    codes = np.arange(stage.GetStartTimeCode(), stage.GetEndTimeCode() + 1.0)
    torques = _samples(animation, "torques", codes, (len(tokens), 3))
    if torques is None:
        return None
    rests = _samples(animation, "restRotations", codes, (len(tokens), 4))
    names = _per_joint(skeleton, "jointNames", tokens, [token.rpartition("/")[2] for token in tokens])
    bodies = _per_joint(skeleton, "isBody", tokens, [True] * len(tokens))
    yield_torques = _per_joint(skeleton, "yieldTorque", tokens, [np.inf] * len(tokens))
    times_s = (codes - stage.GetStartTimeCode()) / stage.GetTimeCodesPerSecond()
    events = read_yields(animation, tokens)
    joints = []
    for index, token in enumerate(tokens):
        if not bodies[index] or "/" not in token:
            continue
        flows = np.zeros(len(codes), np.bool_)
        for event in (event for event in events if event.joint == token):
            flows |= (codes >= np.floor(event.start)) & (codes <= np.ceil(event.end))  # none falls between two frames
        joints.append(
            JointLoads(
                name=str(names[index]),
                torques=np.linalg.norm(torques[:, index], axis=1),
                yield_torque=float(yield_torques[index]),
                flows=flows,
                rest_moved_deg=_angle_deg(rests[0, index], rests[-1, index]) if rests is not None else None,
            )
        )
    title = animation.GetParent().GetName()
    return Loads(title, times_s, tuple(joints), tuple(_hands(animation, codes, times_s, names)))


def _per_joint(skeleton: Any, name: str, tokens: list[str], default: list[Any]) -> list[Any]:
    """Of the skeleton's custom data, which is in the order of a take's joints."""
    values = skeleton.GetCustomDataByKey(f"layfigure:{name}")
    return list(values) if values is not None and len(values) == len(tokens) else default


def _samples(prim: Any, name: str, codes: Floats, shape: tuple[int, ...]) -> Floats | None:
    """(N, *shape); None if a value is missing or of another shape."""
    attribute = prim.GetAttribute(f"layfigure:{name}")
    if not attribute or not attribute.HasAuthoredValue():
        return None
    values = [np.array(attribute.Get(code), np.float64) for code in codes]
    return np.array(values) if values and all(value.shape == shape for value in values) else None


def _angle_deg(first: Floats, last: Floats) -> float:
    """Of two quaternions as USD has them in memory, x y z w."""
    return float(np.degrees(rotation.angle_between(first[[3, 0, 1, 2]], last[[3, 0, 1, 2]])))


def _hands(animation: Any, codes: Floats, times_s: Floats, names: list[Any]) -> list[HandLoads]:
    attribute = animation.GetAttribute("layfigure:pointers")
    pointers = list(attribute.Get() or []) if attribute else []
    forces = _samples(animation, "forces", codes, (len(pointers), 3))
    joints = _samples(animation, "heldJoints", codes, (len(pointers),))
    if forces is None or joints is None:
        return []
    hands = []
    for number, pointer in enumerate(pointers):
        held = joints[:, number].astype(int)
        hands.append(
            HandLoads(
                pointer=int(pointer),
                times_s=times_s,
                forces=np.linalg.norm(forces[:, number], axis=1),
                holds=held >= 0,
                joint_names=[str(names[joint]) if 0 <= joint < len(names) else "" for joint in held],
            )
        )
    return hands
