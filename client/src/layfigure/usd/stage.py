"""A USD file that is read: opened with one clear line when it cannot be, and in the units of ours."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdUtils

from layfigure.errors import LayfigureError


@contextmanager
def quiet() -> Iterator[None]:
    """Keeps USD's own warnings off stderr: what they tell is told in our words."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        delegate.TakeUncoalescedDiagnostics()  # it would print what is left in it


def open_stage(path: Path) -> Any:
    """Raises LayfigureError, in one line, if there is no such file, USD cannot read it, or a layer of it is missing:
    what is left of a take without its layers is neither to be drawn nor to be converted."""
    stage = open_as_it_is(path)
    with quiet():
        missing = sorted(missing_layers(stage))
    if missing:
        raise LayfigureError(f"'{path}' needs the file '{missing[0]}', which is missing or cannot be read")
    return stage


def missing_layers(stage: Any) -> set[str]:
    """The paths of layers that the stage needs, and that are not there, or broken."""
    needed = {
        layer.ComputeAbsolutePath(name)
        for layer in stage.GetUsedLayers()
        for name in layer.GetCompositionAssetDependencies()
    }
    return {path for path in needed if not _is_layer(path)}


def _is_layer(path: str) -> bool:
    try:
        return bool(Sdf.Layer.FindOrOpen(path))
    except Tf.ErrorException:
        return False


def open_as_it_is(path: Path) -> Any:
    """The same, but for layers that are missing."""
    if not path.is_file():
        raise LayfigureError(f"no USD file '{path}': check the name")
    try:
        with quiet():
            return Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise LayfigureError(f"cannot read '{path}' as USD: it is broken or of another kind") from error


def metres(stage: Any, up_axis: str) -> Any:
    """From the stage's units and axes to metres with `up_axis`, "Y" or "Z", up."""
    scale = Gf.Matrix4d().SetScale(UsdGeom.GetStageMetersPerUnit(stage))
    if UsdGeom.GetStageUpAxis(stage) == up_axis:
        return scale
    angle_deg = 90.0 if up_axis == "Z" else -90.0
    return scale * Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d.XAxis(), angle_deg))
