"""Writes skinned characters as FBX 7.4 text files, with what glTF has no words for: limits of joints, and the axes that
they are measured in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from glb import Array, Bone, Mesh

CENTIMETRES = 100.0  # in a metre: FBX's usual unit
AXES = "XYZ"

Angles = tuple[float, float, float]  # [deg], about x, y, z
Bound = tuple[float | None, float | None, float | None]  # [deg]; None: none

FREE: Bound = (None, None, None)
NONE: Angles = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Joint:
    """How a bone turns: its rotation in its parent is pre * Rz * Ry * Rx * post^-1, with the limited angles in it."""

    lower: Bound = FREE
    upper: Bound = FREE
    pre: Angles = NONE
    post: Angles = NONE
    active: bool = True


def euler(angles: Angles) -> Array:
    """Rz Ry Rx: FBX's default order, XYZ."""
    x, y, z = np.radians(angles)
    cx, sx, cy, sy, cz, sz = np.cos(x), np.sin(x), np.cos(y), np.sin(y), np.cos(z), np.sin(z)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return np.asarray(about_z @ about_y @ about_x)


def angles_of(rotation: Array) -> Angles:
    """The inverse of euler()."""
    r = rotation
    x, z = np.arctan2(r[2, 1], r[2, 2]), np.arctan2(r[1, 0], r[0, 0])
    y = np.arctan2(-r[2, 0], np.hypot(r[2, 1], r[2, 2]))
    return (float(np.degrees(x)), float(np.degrees(y)), float(np.degrees(z)))


def write_fbx(path: Path, bones: list[Bone], meshes: list[Mesh], joints: Mapping[str, Joint]) -> None:
    """Writes the character to `path`; `joints` are by the bones' names."""
    objects, links = [], []
    for index, bone in enumerate(bones):
        parent = bones[bone.parent].frame if bone.parent >= 0 else np.eye(4)
        local = np.linalg.inv(parent) @ bone.frame
        objects.append(_bone(1 + index, bone.name, local, joints.get(bone.name)))
        links.append((1 + index, 1 + bone.parent))
    serial = 1 + len(bones)
    for mesh in meshes:
        model, geometry, skin, first = serial, serial + 1, serial + 2, serial + 3
        objects += [_model(model, mesh.name, "Mesh", ""), _geometry(geometry, mesh), _skin(skin)]
        links += [(model, 0), (geometry, model), (skin, geometry)]
        for index, bone in enumerate(bones):
            objects.append(_cluster(first + index, mesh.weights[:, index], bone.frame))
            links += [(first + index, skin), (1 + index, first + index)]
        serial = first + len(bones)
    path.write_text(
        "; FBX 7.4.0 project file\n"
        "FBXHeaderExtension: {\nFBXHeaderVersion: 1003\nFBXVersion: 7400\n}\n"
        "GlobalSettings: {\nVersion: 1000\nProperties70: {\n"
        'P: "UpAxis", "int", "Integer", "",1\nP: "UpAxisSign", "int", "Integer", "",1\n'
        'P: "UnitScaleFactor", "double", "Number", "",1\n}\n}\n'
        "Objects: {\n" + "".join(objects) + "}\n"
        "Connections: {\n" + "".join(f'C: "OO",{child},{parent}\n' for child, parent in links) + "}\n",
        encoding="utf-8",
    )


def _vector(name: str, kind: str, values: Angles) -> str:
    return f'P: "{name}", "{kind}", "", "A",{values[0]!r},{values[1]!r},{values[2]!r}\n'


def _flag(name: str, value: bool) -> str:
    return f'P: "{name}", "bool", "", "",{int(value)}\n'


def _model(serial: int, name: str, kind: str, properties: str) -> str:
    return f'Model: {serial}, "Model::{name}", "{kind}" {{\nVersion: 232\nProperties70: {{\n{properties}}}\n}}\n'


def _bound(name: str, bound: Bound) -> str:
    flags = "".join(_flag(name + axis, value is not None) for axis, value in zip(AXES, bound, strict=True))
    x, y, z = (value or 0.0 for value in bound)
    return _vector(name, "Vector3D", (x, y, z)) + flags


def _bone(serial: int, name: str, local: Array, joint: Joint | None) -> str:
    place = CENTIMETRES * local[:3, 3]
    properties = _vector("Lcl Translation", "Lcl Translation", (float(place[0]), float(place[1]), float(place[2])))
    turned = local[:3, :3]
    if joint is not None:
        turned = euler(joint.pre).T @ turned @ euler(joint.post)
        properties += _vector("PreRotation", "Vector3D", joint.pre) + _vector("PostRotation", "Vector3D", joint.post)
        properties += _flag("RotationActive", joint.active)
        properties += _bound("RotationMin", joint.lower) + _bound("RotationMax", joint.upper)
    properties += _vector("Lcl Rotation", "Lcl Rotation", angles_of(turned))
    return _model(serial, name, "LimbNode", properties)


def _array(name: str, values: Array) -> str:
    numbers = ",".join(repr(value) for value in values.ravel().tolist())
    return f"{name}: *{values.size} {{\na: {numbers}\n}}\n"


def _geometry(serial: int, mesh: Mesh) -> str:
    corners = mesh.triangles.copy()
    corners[:, 2] = -1 - corners[:, 2]  # the last corner of a polygon
    arrays = _array("Vertices", CENTIMETRES * mesh.points) + _array("PolygonVertexIndex", corners)
    return f'Geometry: {serial}, "Geometry::{mesh.name}", "Mesh" {{\n{arrays}}}\n'


def _skin(serial: int) -> str:
    return f'Deformer: {serial}, "Deformer::", "Skin" {{\nVersion: 101\n}}\n'


def _cluster(serial: int, weights: Array, frame: Array) -> str:
    heavy = np.flatnonzero(weights > 0.0)
    bind = frame.copy()
    bind[:3, 3] *= CENTIMETRES
    arrays = "" if heavy.size == 0 else _array("Indexes", heavy) + _array("Weights", weights[heavy])
    # FBX writes matrices by columns.
    arrays += _array("Transform", np.linalg.inv(bind).T) + _array("TransformLink", bind.T)
    return f'Deformer: {serial}, "SubDeformer::", "Cluster" {{\nVersion: 100\n{arrays}}}\n'
