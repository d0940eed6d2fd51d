"""Takes as USD, for programs."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from layfigure.errors import UsageError
from layfigure.take import Take
from layfigure.take_form import DEFAULT_TOLERANCE_M, Keys, Layout, TakeForm, UpAxis


def write_usd(
    take: Take,
    out: str | os.PathLike[str],
    *,
    fps: float = 24.0,
    keys: Keys = "every",
    tolerance_m: float = DEFAULT_TOLERANCE_M,
    layout: Layout = "layered",
    joints: Sequence[str] = (),
    custom_data: bool = False,
    up_axis: UpAxis = "Z",
    meters_per_unit: float = 1.0,
) -> Path:
    """Writes a take as a UsdSkel animation of the skinned character; returns the file's path.

    `out` ends in .usd, .usda, .usdc or .usdz. With the layout "layered" it is a small layer over two others beside it,
    OUT.character.usdc and OUT.anim.usdc, with "single" all is in it; pictures that the character's file holds are in
    OUT.textures beside it. Files of these names are replaced, each when its successor is whole. Frame k is the doll at
    k / fps seconds after the take's first pose, by slerp of its joints.

    `keys`: "every" frame; those at the "marked" moments, of the command `key`; or "reduced", the fewest with which no
    vertex of the skin is in any frame more than `tolerance_m` [m, > 0] off. `joints`: patterns with * and ? of those
    that move, the others stay at rest. `custom_data`: torques, rest rotations, yielded joints and the pointers' forces
    as attributes `layfigure:..` too. `up_axis` and `meters_per_unit` (0.01: centimetres) are those of the file.

    Raises UsageError for an argument that makes no sense, LayfigureError if the take has no key or the files cannot be
    written. Takes of different files may be written in different threads.
    """
    from layfigure.usd.writer import check_output, write_take

    _check_positive("fps", fps)
    _check_positive("tolerance_m", tolerance_m)
    _check_positive("meters_per_unit", meters_per_unit)
    _check_choice("up_axis", up_axis, get_args(UpAxis))
    _check_choice("keys", keys, get_args(Keys))
    _check_choice("layout", layout, get_args(Layout))
    if isinstance(joints, str):
        raise UsageError(f"joints is '{joints}': expected a list of names or patterns, ['{joints}']")
    path = Path(out)
    check_output(path)
    form = TakeForm(keys, tolerance_m, layout, tuple(joints), custom_data, up_axis, meters_per_unit)
    write_take(take, path, fps, form)
    return path


def _check_positive(name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise UsageError(f"{name} is {value:g}: expected a number greater than 0")


def _check_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise UsageError(f"{name} is '{value}': expected {' or '.join(choices)}")
