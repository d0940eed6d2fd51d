"""Writes a take's layers in other units, or with another axis up.

A point p of the file becomes s C p, where s is the ratio of the units and C the rotation between the axes. What is in
the world is turned and scaled: points, normals, boxes, bind transforms, the root joints' rest transforms, rotations and
translations. What is relative to a parent joint is scaled alone. Forces are turned, not scaled: they stay in N.
"""

from __future__ import annotations

import logging
import math
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from pxr import Ar, Gf, Sdf, Tf, UsdGeom, UsdUtils, Vt

from layfigure import rotation
from layfigure.errors import LayfigureError
from layfigure.protocol import Bools, Floats
from layfigure.take_form import UpAxis
from layfigure.usd.failures import reason
from layfigure.usd.stage import open_stage, quiet
from layfigure.usd.textures import TextureFolder, asset_path_from, hand_over

_logger = logging.getLogger(__name__)


class _Change:
    """s and C."""

    def __init__(self, scale: float, quarter_turns: int) -> None:
        """`quarter_turns` about X: 1 from Y up to Z up, -1 back, 0 none."""
        self.scale = scale
        angle = quarter_turns * math.pi / 2.0
        self.quaternion = np.array([math.cos(angle / 2.0), math.sin(angle / 2.0), 0.0, 0.0])
        self.matrix = np.round(rotation.to_matrix(self.quaternion))  # of zeros and ones

    def points(self, values: Floats, _: Bools) -> Floats:
        return self.scale * self.vectors(values, _)

    def vectors(self, values: Floats, _: Bools) -> Floats:
        return values @ self.matrix.T

    def boxes(self, values: Floats, _: Bools) -> Floats:
        return np.sort(self.points(values, _).reshape(-1, 2, 3), axis=1).reshape(-1, 3)

    def offsets(self, values: Floats, roots: Bools) -> Floats:
        """Translations of joints."""
        return self.scale * np.where(roots[:, None], values @ self.matrix.T, values)

    def rotations(self, values: Floats, roots: Bools) -> Floats:
        """x y z w, as USD has quaternions in memory."""
        turned = rotation.multiply(np.broadcast_to(self.quaternion, values.shape), values[:, [3, 0, 1, 2]])
        return np.where(roots[:, None], turned[:, [1, 2, 3, 0]], values)

    def world_frames(self, values: Floats, _: Bools) -> Floats:
        """Matrices that act on rows, of frames without scale: X' = X C^T, its origin scaled."""
        return self.joint_frames(values, np.ones(len(values), np.bool_))

    def joint_frames(self, values: Floats, roots: Bools) -> Floats:
        turn = np.eye(4)
        turn[:3, :3] = self.matrix.T
        result = np.where(roots[:, None, None], values @ turn, values)
        result[:, 3, :3] *= self.scale
        return result

    def skin_frame(self, value: Floats, _: Bools) -> Floats:
        """geomBindTransform takes a mesh's points, which are turned and scaled too: S^-1 G S."""
        change = np.eye(4)
        change[:3, :3] = self.scale * self.matrix.T
        return np.linalg.inv(change) @ value @ change


Rule = Callable[[_Change, Floats, Bools], Floats]
_RULES: dict[str, tuple[Rule, Any]] = {
    "points": (_Change.points, Vt.Vec3fArray),
    "normals": (_Change.vectors, Vt.Vec3fArray),
    "primvars:normals": (_Change.vectors, Vt.Vec3fArray),
    "velocities": (_Change.points, Vt.Vec3fArray),
    "offsets": (_Change.points, Vt.Vec3fArray),  # of blend shapes, as the next
    "normalOffsets": (_Change.vectors, Vt.Vec3fArray),
    "extent": (_Change.boxes, Vt.Vec3fArray),
    "extentsHint": (_Change.boxes, Vt.Vec3fArray),
    "bindTransforms": (_Change.world_frames, Vt.Matrix4dArray),
    "restTransforms": (_Change.joint_frames, Vt.Matrix4dArray),
    "translations": (_Change.offsets, Vt.Vec3fArray),
    "rotations": (_Change.rotations, Vt.QuatfArray),
    "primvars:skel:geomBindTransform": (_Change.skin_frame, Gf.Matrix4d),
    "layfigure:restRotations": (_Change.rotations, Vt.QuatfArray),
    "layfigure:heldPoints": (_Change.points, Vt.Vec3fArray),
    "layfigure:forces": (_Change.vectors, Vt.Vec3fArray),
}


def change_units(layer: Any, up_axis: UpAxis, meters_per_unit: float) -> None:
    """In place, of one layer of a take, whose units it tells itself: what the layer's own prims hold.

    Raises LayfigureError if a prim is placed by transform operations, which other tools do and takes never have.
    """
    metadata = layer.pseudoRoot  # not of a stage, which would look for the layers that this one names
    scale = metadata.GetInfo(UsdGeom.Tokens.metersPerUnit) / meters_per_unit
    turns = (up_axis == "Z") - (metadata.GetInfo(UsdGeom.Tokens.upAxis) == UsdGeom.Tokens.z)
    change = _Change(scale, turns)
    with Sdf.ChangeBlock():
        for spec in list(_attributes(layer)):
            if spec.name.startswith("xformOp:"):
                raise LayfigureError(f"'{spec.path}' places a prim: only takes of 'layfigure record' can be converted")
            if spec.name in _RULES:
                _apply(layer, spec, change)
    metadata.SetInfo(UsdGeom.Tokens.upAxis, up_axis)
    metadata.SetInfo(UsdGeom.Tokens.metersPerUnit, meters_per_unit)


def _attributes(layer: Any) -> Iterator[Any]:
    paths: list[Any] = []
    layer.Traverse(Sdf.Path.absoluteRootPath, paths.append)
    for path in paths:
        if path.IsPropertyPath() and isinstance(spec := layer.GetPropertyAtPath(path), Sdf.AttributeSpec):
            yield spec


def _apply(layer: Any, spec: Any, change: _Change) -> None:
    rule, type_ = _RULES[spec.name]
    joints = layer.GetAttributeAtPath(spec.path.GetPrimPath().AppendProperty("joints"))
    roots = np.array(["/" not in joint for joint in (joints.default or [])] if joints else [], np.bool_)

    def changed(value: Any) -> Any:
        array = np.array(value, np.float64)
        if array.size == 0:
            return value
        return _as(type_, rule(change, array, roots))

    if spec.default is not None:
        spec.default = changed(spec.default)
    for code in layer.ListTimeSamplesForPath(spec.path):
        value = layer.QueryTimeSample(spec.path, code)
        if not isinstance(value, Sdf.ValueBlock):
            layer.SetTimeSample(spec.path, code, changed(value))


def _as(type_: Any, array: Floats) -> Any:
    if type_ is Gf.Matrix4d:
        return Gf.Matrix4d(array.tolist())
    if type_ is Vt.Matrix4dArray:
        return Vt.Matrix4dArray([Gf.Matrix4d(matrix.tolist()) for matrix in array])
    return type_.FromNumpy(np.ascontiguousarray(array, np.float32))


def rewrite_in_units(path: Path, up_axis: UpAxis, meters_per_unit: float) -> None:
    """One layer's file; written anew, as a change that is saved would leave the old values in a crate file."""
    layer = Sdf.Layer.OpenAsAnonymous(str(path))
    change_units(layer, up_axis, meters_per_unit)
    layer.Export(str(path))


def _place_files(layer: Any, out: Path, pictures: TextureFolder) -> None:
    """Names what a flattened layer names, textures, from where `out` is. What is in a package is written beside `out`,
    and into a package goes what is a picture."""
    placed: dict[str, str] = {}

    def place(path: str) -> str:
        if path not in placed:
            placed[path] = _place_file(path, out, pictures)
        return placed[path]

    with quiet():
        UsdUtils.ModifyAssetPaths(layer, place)


def _place_file(path: str, out: Path, pictures: TextureFolder) -> str:
    is_packed = Ar.IsPackageRelativePath(path)
    if not path or not (is_packed or out.suffix == ".usdz"):
        return asset_path_from(path, out)
    name = Ar.SplitPackageRelativePathInner(path)[1] if is_packed else path
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path))
    added = pictures.add(PurePosixPath(name).name, bytes(asset.GetBuffer())) if asset else None
    if added is None:
        _logger.warning("'%s' is left out: it is missing, or no picture", path)
    return added or ""


def write_in_units(source: Path, out: Path, up_axis: UpAxis | None, meters_per_unit: float | None) -> None:
    """One whole layer, or a package, of a take, and the pictures that were in a package; what is None stays.

    Raises LayfigureError if it cannot be done.
    """
    stage = open_stage(source)
    up_axis = up_axis or UsdGeom.GetStageUpAxis(stage)
    meters_per_unit = meters_per_unit or UsdGeom.GetStageMetersPerUnit(stage)
    layer = stage.Flatten(False)
    try:
        with quiet(), tempfile.TemporaryDirectory(prefix=f".{out.stem}.", dir=out.parent) as scratch:
            change_units(layer, up_axis, meters_per_unit)
            pictures = TextureFolder(Path(scratch), out)
            _place_files(layer, out, pictures)
            packed = out.suffix == ".usdz"
            flat = Path(scratch) / (f"{out.stem}.usdc" if packed else out.name)
            layer.Export(str(flat))
            if packed and not UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(flat)), str(Path(scratch) / out.name)):
                raise LayfigureError(f"cannot write '{out}': USD could not pack it")
            hand_over([*([] if packed else pictures.files), Path(scratch) / out.name], Path(scratch), out.parent)
    except OSError as error:
        raise LayfigureError(f"cannot write '{out}': {error.strerror}") from error
    except Tf.ErrorException as error:
        raise LayfigureError(f"cannot write '{out}': {reason(error)}") from error
