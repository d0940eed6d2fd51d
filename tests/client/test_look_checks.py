"""What `layfigure check` finds in normals and texture coordinates."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from client_support.looks import FPS, MESH, findings
from pxr import Usd, UsdGeom, Vt

from layfigure.take import Take
from layfigure.take_form import TakeForm
from layfigure.usd.reader import SkinnedStage
from layfigure.usd.writer import write_take


def make_normals_short(mesh: UsdGeom.Mesh) -> None:
    mesh.GetNormalsAttr().Set(Vt.Vec3fArray(len(mesh.GetNormalsAttr().Get()), (0.0, 0.0, 0.9)))


def cut_normals(mesh: UsdGeom.Mesh) -> None:
    mesh.GetNormalsAttr().Set(mesh.GetNormalsAttr().Get()[:-1])


def break_normal(mesh: UsdGeom.Mesh) -> None:
    normals = np.array(mesh.GetNormalsAttr().Get())
    normals[2, 0] = np.nan
    mesh.GetNormalsAttr().Set(Vt.Vec3fArray.FromNumpy(normals))


def cut_indices(mesh: UsdGeom.Mesh) -> None:
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    st.SetIndices(st.GetIndices()[:-3])


def break_index(mesh: UsdGeom.Mesh) -> None:
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    indices = np.array(st.GetIndices())
    indices[5] = 117
    st.SetIndices(Vt.IntArray.FromNumpy(indices))


def break_coordinate(mesh: UsdGeom.Mesh) -> None:
    st = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    values = np.array(st.Get())
    values[1, 1] = np.inf
    st.Set(Vt.Vec2fArray.FromNumpy(values))


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (make_normals_short, "normal 0 is 0.9 long, not 1, and 575 more"),
        (cut_normals, "has 575 values, expected 576 (faceVarying)"),
        (break_normal, "holds a normal that is not finite"),
        (cut_indices, "has 573 values, expected 576 (faceVarying)"),
        (break_index, "has an index out of range, expected 0 to 116"),
        (break_coordinate, "holds a value that is not finite"),
    ],
)
def test_check_names_what_is_wrong_with_normals_and_coordinates(
    painted: Take, tmp_path: Path, damage: Callable[[UsdGeom.Mesh], None], expected: str
) -> None:
    write_take(painted, tmp_path / "take.usda", FPS, TakeForm(layout="single"))
    stage = Usd.Stage.Open(str(tmp_path / "take.usda"))
    damage(UsdGeom.Mesh(stage.GetPrimAtPath(MESH)))
    stage.GetRootLayer().Save()
    assert any(MESH in finding and expected in finding for finding in findings(tmp_path / "take.usda"))
    SkinnedStage(tmp_path / "take.usda").bound()  # is read all the same
