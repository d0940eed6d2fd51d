"""Writes BVH: a hierarchy of joints, and their angles in every frame. In metres, Y up, no skin.

In BVH's zero pose all joints have the world's axes. It is the rest pose here: with R_j a joint's rest rotation and W_j
its rotation in the world, what is written is B_j = W_j R_j^T, relative to the parent's, as Z, X and Y angles in
degrees: B_parent^T B_j = Rz Rx Ry.
"""

from __future__ import annotations

import math
import re
from io import StringIO
from pathlib import Path

import numpy as np

from layfigure.errors import LayfigureError
from layfigure.export.clip import Clip, SkeletonClip
from layfigure.export.whole_file import write_whole
from layfigure.protocol import Floats

_LENGTH_TOLERANCE = 1e-4  # [m] of a bone's: BVH has no room for more
_GIMBAL = 1.0 - 1e-12  # sine of the middle angle, above which the other two cannot be told apart
_END_PART = 0.5  # of a last joint's own offset: its end site


def write_bvh(clip: Clip, out: Path) -> None:
    """Raises LayfigureError if there is more than one root, or if a bone changes its length."""
    if len(clip.skeletons) > 1:
        raise LayfigureError(f"BVH holds one skeleton, the file has {len(clip.skeletons)}: convert it to glTF")
    skeleton = clip.skeletons[0]
    roots = [name for name, parent in zip(skeleton.names, skeleton.parents, strict=True) if parent < 0]
    if len(roots) > 1:
        raise LayfigureError(f"BVH holds one root joint, the skeleton has {len(roots)}: convert it to glTF")
    text = StringIO()
    order: list[int] = []
    offsets = _offsets(skeleton)
    text.write("HIERARCHY\n")
    _write_joint(text, skeleton, offsets, 0, 0, order)
    text.write(f"MOTION\nFrames: {clip.frames}\nFrame Time: {1.0 / clip.fps:.9g}\n")
    angles = _angles_deg(skeleton)[:, order].reshape(clip.frames, -1)
    rows = np.concatenate([skeleton.local[:, 0, :3, 3], angles], axis=1)
    np.savetxt(text, rows, fmt="%.7f")
    write_whole(out, text.getvalue().encode())


def _offsets(skeleton: SkeletonClip) -> Floats:
    """(J, 3) from the parent in the zero pose, in the world's axes; the root's is 0, as its channels tell all."""
    lengths = skeleton.local[:, :, :3, 3]
    offsets = np.zeros((len(skeleton.parents), 3))
    for joint, parent in enumerate(skeleton.parents):
        if parent < 0:
            continue
        if np.ptp(lengths[:, joint], axis=0).max() > _LENGTH_TOLERANCE:
            raise LayfigureError(f"bone '{skeleton.names[joint]}' changes its length, which BVH cannot tell")
        offsets[joint] = skeleton.rest[parent, :3, :3] @ lengths[0, joint]
    return offsets


def _angles_deg(skeleton: SkeletonClip) -> Floats:
    """(F, J, 3): of Z, X and Y, without jumps from frame to frame."""
    turned = np.empty((*skeleton.local.shape[:2], 3, 3))
    world = np.empty_like(turned)
    for joint, parent in enumerate(skeleton.parents):
        local, rest = skeleton.local[:, joint, :3, :3], skeleton.rest[joint, :3, :3]
        world[:, joint] = local if parent < 0 else world[:, parent] @ local
        turned[:, joint] = world[:, joint] @ rest.T
    relative = turned.copy()
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0:
            relative[:, joint] = turned[:, parent].swapaxes(1, 2) @ turned[:, joint]
    return np.degrees(np.unwrap(zxy_angles(relative), axis=0))


def zxy_angles(r: Floats) -> Floats:
    """(..., 3) angles [rad] a, b, c of rotations (..., 3, 3) = Rz(a) Rx(b) Ry(c)."""
    sine = np.clip(r[..., 2, 1], -1.0, 1.0)
    locked = np.abs(sine) > _GIMBAL
    z = np.where(locked, np.arctan2(r[..., 1, 0], r[..., 0, 0]), np.arctan2(-r[..., 0, 1], r[..., 1, 1]))
    y = np.where(locked, 0.0, np.arctan2(-r[..., 2, 0], r[..., 2, 2]))
    return np.stack([z, np.arcsin(sine), y], axis=-1)


def _write_joint(
    text: StringIO, skeleton: SkeletonClip, offsets: Floats, joint: int, depth: int, order: list[int]
) -> None:
    order.append(joint)
    indent = "  " * depth
    name = re.sub(r"\s+", "_", skeleton.names[joint])
    text.write(f"{indent}{'JOINT' if depth else 'ROOT'} {name}\n{indent}{{\n")
    text.write(f"{indent}  OFFSET {_numbers(offsets[joint])}\n")
    positions = "" if depth else "Xposition Yposition Zposition "
    count = 3 if depth else 6
    text.write(f"{indent}  CHANNELS {count} {positions}Zrotation Xrotation Yrotation\n")
    children = [child for child, parent in enumerate(skeleton.parents) if parent == joint]
    for child in children:
        _write_joint(text, skeleton, offsets, child, depth + 1, order)
    if not children:
        end = _numbers(_END_PART * offsets[joint])
        text.write(f"{indent}  End Site\n{indent}  {{\n{indent}    OFFSET {end}\n{indent}  }}\n")
    text.write(f"{indent}}}\n")


def _numbers(vector: Floats) -> str:
    return " ".join(f"{value if math.fabs(value) > 0.0 else 0.0:.7f}" for value in vector)
