"""What is made of a take: which keys, of which joints, in which files."""

from __future__ import annotations

import fnmatch
from dataclasses import dataclass
from typing import Literal

import numpy as np

from layfigure.errors import UsageError
from layfigure.protocol import Bools, Character

Keys = Literal["every", "marked", "reduced"]
Layout = Literal["layered", "single"]
UpAxis = Literal["Y", "Z"]

DEFAULT_TOLERANCE_M = 0.5e-3
_NAMES_SHOWN = 5


@dataclass(frozen=True)
class TakeForm:
    keys: Keys = "every"
    tolerance_m: float = DEFAULT_TOLERANCE_M  # > 0, of reduced keys: how far a vertex may be from where it was
    layout: Layout = "layered"
    joints: tuple[str, ...] = ()  # patterns with * and ? of the joints that move; none: all do
    custom_data: bool = False  # whether torques, yielded joints and pointers' forces are written, in every frame
    up_axis: UpAxis = "Z"
    meters_per_unit: float = 1.0  # > 0


def selected_joints(character: Character, patterns: tuple[str, ...]) -> Bools:
    """(J) whether a joint's name matches any of the patterns; all do without one. Raises UsageError for one of none."""
    names = [joint.name for joint in character.joints]
    selected = np.full(len(names), not patterns)
    for pattern in patterns:
        matches = np.array([fnmatch.fnmatchcase(name, pattern) for name in names])
        if not matches.any():
            shown = ", ".join(f"'{name}'" for name in names[:_NAMES_SHOWN])
            more = f" and {len(names) - _NAMES_SHOWN} more" if len(names) > _NAMES_SHOWN else ""
            raise UsageError(f"no joint of '{character.name}' matches '{pattern}': it has {shown}{more}")
        selected |= matches
    return selected
