"""How a mesh of any USD file looks: base colours, of its materials, their textures or its display colour; normals."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError
from pxr import Ar, Usd, UsdGeom, UsdShade

from layfigure.protocol import Floats, Ints

_DEFAULT = np.array([0.6, 0.6, 0.6])
_MAX_TEXTURE_PIXELS = 256  # across: a triangle gets one colour, so finer textures are wasted
_EARLIEST = Usd.TimeCode.EarliestTime()
_WRAPS = ("repeat", "clamp", "mirror")


@dataclass(frozen=True, eq=False)
class Texture:
    name: str  # of its file
    data: bytes  # of its file, which Pillow can read
    factor: Floats  # (4) linear RGB and alpha, times the picture's
    wrap: tuple[str, str]  # along u and v: "repeat", "clamp" or "mirror"


@dataclass(frozen=True, eq=False)
class Look:
    """Of the triangles that have one material."""

    name: str  # of the material; "" without one
    opacity: float  # 0 to 1, without that of the texture
    texture: Texture | None  # None, too, where it cannot be read or has no coordinates
    texture_alpha: bool  # the texture's alpha counts
    alpha_cutoff: float  # > 0: what has less alpha is not there


@dataclass(frozen=True, eq=False)
class Looks:
    """Of a mesh's T triangles."""

    looks: tuple[Look, ...]
    of_triangles: Ints  # (T) which of them
    colors: Floats  # (T, 3) linear RGB, of textures those in the triangles' middles
    uvs: Floats  # (T, 3, 2) of the corners, v upwards; 0 where the look has no texture


@dataclass(frozen=True, eq=False)
class Triangles:
    """A mesh's faces as T triangles."""

    points: Ints  # (T, 3)
    corners: Ints  # (T, 3) of faces
    faces: Ints  # (T)

    def __getitem__(self, where: Any) -> Triangles:
        return Triangles(self.points[where], self.corners[where], self.faces[where])


def read_looks(mesh: Any, triangles: Triangles) -> Looks:
    count = len(triangles.faces)
    looks, of_triangles = [Look("", 1.0, None, False, 0.0)], np.zeros(count, np.int32)
    colors, uvs = np.tile(_display_color(mesh), (count, 1)), np.zeros((count, 3, 2))
    parts = [(np.arange(count), mesh.GetPrim())]
    for subset in UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets():
        faces = np.array(subset.GetIndicesAttr().Get() or [], np.int64)
        parts.append((np.flatnonzero(np.isin(triangles.faces, faces)), subset.GetPrim()))
    for where, prim in parts:
        found = _read_look(mesh, prim, triangles[where])
        if found is None:
            continue
        look, painted, coordinates = found
        of_triangles[where], colors[where] = len(looks), painted
        uvs[where] = coordinates if coordinates is not None else 0.0
        looks.append(look)
    return Looks(tuple(looks), of_triangles, colors, uvs)


def read_normals(mesh: Any, triangles: Triangles) -> Floats | None:
    """(T, 3, 3) of the triangles' corners, as they are in the file; None if there are none that fit."""
    primvar = UsdGeom.PrimvarsAPI(mesh.GetPrim()).GetPrimvar("normals")
    if primvar and primvar.HasAuthoredValue():
        values, interpolation = primvar.ComputeFlattened(_EARLIEST), primvar.GetInterpolation()
    else:
        values, interpolation = mesh.GetNormalsAttr().Get(_EARLIEST), mesh.GetNormalsInterpolation()
    normals = _of_corners(values, 3, interpolation, triangles)
    return normals if normals is not None and np.isfinite(normals).all() else None


def _display_color(mesh: Any) -> Floats:
    colors = mesh.GetDisplayColorAttr().Get(_EARLIEST)
    return np.array(colors, np.float64).mean(axis=0) if colors else _DEFAULT


def _read_look(mesh: Any, prim: Any, triangles: Triangles) -> tuple[Look, Floats, Floats | None] | None:
    """The look of a material, and its colours and texture coordinates for triangles of the mesh."""
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    shader = material.ComputeSurfaceSource("")[0] if material else None
    if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
        return None
    color, node = _input(shader, "diffuseColor"), _texture_node(shader, "diffuseColor")
    if node is None and color is None:
        return None
    texture = picture = uvs = None
    flat = np.array(color, np.float64) if node is None else np.array(_input(node, "fallback") or _DEFAULT)[:3]
    if node is not None and (read := _read_texture(node)) is not None:
        texture, picture = read
        flat = picture.reshape(-1, 3).mean(axis=0)
        uvs = _texture_coordinates(node, mesh, triangles)
    painted = flat
    if texture is not None and picture is not None and uvs is not None:
        painted = _sample(picture, uvs.mean(axis=1), texture.wrap)
    opacity, alpha = _input(shader, "opacity"), _texture_node(shader, "opacity")
    look = Look(
        name=str(material.GetPrim().GetName()),
        opacity=float(opacity) if alpha is None and opacity is not None else 1.0,
        texture=texture if uvs is not None else None,
        texture_alpha=alpha is not None and node is not None and alpha.GetPrim() == node.GetPrim(),
        alpha_cutoff=float(_input(shader, "opacityThreshold") or 0.0),
    )
    return look, painted, uvs


def _input(shader: Any, name: str) -> Any:
    value = shader.GetInput(name)
    return value.Get() if value else None


def _texture_node(shader: Any, name: str) -> Any:
    """The UsdUVTexture that an input is connected to."""
    value = shader.GetInput(name)
    sources = value.GetConnectedSources()[0] if value else []
    node = UsdShade.Shader(sources[0].source.GetPrim()) if sources else None
    return node if node and node.GetIdAttr().Get() == "UsdUVTexture" else None


def _read_texture(node: Any) -> tuple[Texture, Floats] | None:
    """With its picture (H, W, 3), linear RGB; None if it cannot be read."""
    file = _read_file(node)
    if file is None:
        return None
    name, data = file
    picture = _read_picture(data)
    if picture is None:
        return None
    factor = np.array(_input(node, "scale") or (1.0, 1.0, 1.0, 1.0), np.float64)
    wraps = [_input(node, name) for name in ("wrapS", "wrapT")]
    wrap_u, wrap_v = (wrap if wrap in _WRAPS else "repeat" for wrap in wraps)
    return Texture(name, data, factor, (wrap_u, wrap_v)), picture * factor[:3]


def _read_file(node: Any) -> tuple[str, bytes] | None:
    """Its name and bytes; of a file beside the USD or inside of a package."""
    asset = _input(node, "file")
    if asset is None:
        return None
    path = asset.resolvedPath or asset.path
    opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path))
    if not opened:
        return None
    inner = Ar.SplitPackageRelativePathInner(path)[1] if Ar.IsPackageRelativePath(path) else path
    return PurePosixPath(inner).name, bytes(opened.GetBuffer())


def _read_picture(data: bytes) -> Floats | None:
    from layfigure.render.scene import from_srgb

    try:
        image = Image.open(io.BytesIO(data)).convert("RGB")
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return None
    image.thumbnail((_MAX_TEXTURE_PIXELS, _MAX_TEXTURE_PIXELS))
    return from_srgb(np.asarray(image, np.float64) / 255.0)


def _sample(picture: Floats, uv: Floats, wrap: tuple[str, str]) -> Floats:
    """(T, 3) at texture coordinates (T, 2)."""
    height, width, _ = picture.shape
    u, v = (_wrapped(uv[:, axis], wrap[axis]) for axis in (0, 1))
    column = np.minimum((u * width).astype(int), width - 1)
    row = np.minimum(((1.0 - v) * height).astype(int), height - 1)
    return np.asarray(picture[row, column])


def _wrapped(coordinate: Floats, wrap: str) -> Floats:
    """In 0..1."""
    if wrap == "clamp":
        return np.clip(coordinate, 0.0, 1.0)
    if wrap == "mirror":
        return np.asarray(1.0 - np.abs(coordinate % 2.0 - 1.0))
    return np.asarray(coordinate % 1.0)


def _texture_coordinates(texture: Any, mesh: Any, triangles: Triangles) -> Floats | None:
    """(T, 3, 2), of the triangles' corners."""
    primvar = UsdGeom.PrimvarsAPI(mesh.GetPrim()).FindPrimvarWithInheritance(_coordinates_name(texture))
    values = primvar.ComputeFlattened(_EARLIEST) if primvar else None
    uvs = _of_corners(values, 2, primvar.GetInterpolation(), triangles) if values is not None else None
    return uvs if uvs is not None and np.isfinite(uvs).all() else None


def _of_corners(values: Any, width: int, interpolation: str, triangles: Triangles) -> Floats | None:
    """(T, 3, width) of an attribute's values; None if they do not fit the mesh."""
    array = np.array(values if values is not None else [], np.float64)
    of = {
        UsdGeom.Tokens.faceVarying: triangles.corners,
        UsdGeom.Tokens.vertex: triangles.points,
        UsdGeom.Tokens.varying: triangles.points,
        UsdGeom.Tokens.uniform: np.repeat(triangles.faces[:, None], 3, axis=1),
        UsdGeom.Tokens.constant: np.zeros_like(triangles.points),
    }
    indices = of.get(interpolation)
    if indices is None or array.ndim != 2 or array.shape[1] != width:
        return None
    if indices.size and indices.max() >= len(array):
        return None
    return np.asarray(array[indices])


def _coordinates_name(texture: Any) -> str:
    """Of the primvar that the texture's `st` is read from."""
    st = texture.GetInput("st")
    sources = st.GetConnectedSources()[0] if st else []
    for source in sources:
        reader = UsdShade.Shader(source.source.GetPrim())
        name = reader.GetInput("varname") if reader else None
        if name and name.Get():
            return str(name.Get())
    return "st"
