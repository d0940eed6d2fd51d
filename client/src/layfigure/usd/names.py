"""Names that USD accepts, made from names that a character's file has."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence


def legal_name(name: str, fallback: str) -> str:
    """An identifier: letters, digits and _ , not starting with a digit."""
    legal = re.sub(r"\W", "_", name, flags=re.ASCII)
    if not legal.strip("_"):
        return fallback
    return f"_{legal}" if legal[0].isdigit() else legal


def unique_names(names: Iterable[str], fallback: str) -> list[str]:
    """Legal names, in order; a repeated one gets the first free number: Hand, Hand_1, Hand_2."""
    taken: set[str] = set()
    unique = []
    for name in names:
        base = candidate = legal_name(name, fallback)
        number = 0
        while candidate in taken:
            number += 1
            candidate = f"{base}_{number}"
        taken.add(candidate)
        unique.append(candidate)
    return unique


def joint_paths(names: Sequence[str], parents: Sequence[int]) -> list[str]:
    """UsdSkel's joint tokens: Hips, Hips/Spine, Hips/Spine/Chest, ..."""
    paths: list[str] = []
    for name, parent in zip(unique_names(names, "joint"), parents, strict=True):
        paths.append(name if parent < 0 else f"{paths[parent]}/{name}")
    return paths
