"""The base colours of a mesh: of its materials, of their textures, or its display colour."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from PIL import Image, UnidentifiedImageError
from pxr import Ar, Usd, UsdGeom, UsdShade

from layfigure.protocol import Floats, Ints

_DEFAULT = np.array([0.6, 0.6, 0.6])
_MAX_TEXTURE_PIXELS = 256  # across: a triangle gets one colour, so finer textures are wasted


def triangle_colors(mesh: Any, triangles: Ints, corners: Ints, faces: Ints) -> Floats:
    """Linear RGB (T, 3). Of each triangle (T, 3): its points, its corners of faces, and the face (T) that it is of."""
    colors = np.empty((len(triangles), 3))
    colors[:] = _display_color(mesh)
    _paint(colors, slice(None), mesh, mesh.GetPrim(), triangles, corners)
    subsets = UsdShade.MaterialBindingAPI(mesh.GetPrim()).GetMaterialBindSubsets()
    for subset in subsets:
        wanted = np.flatnonzero(np.isin(faces, np.array(subset.GetIndicesAttr().Get() or [], np.int64)))
        _paint(colors, wanted, mesh, subset.GetPrim(), triangles, corners)
    return colors


def _display_color(mesh: Any) -> Floats:
    colors = mesh.GetDisplayColorAttr().Get(Usd.TimeCode.EarliestTime())
    return np.array(colors, np.float64).mean(axis=0) if colors else _DEFAULT


def _paint(colors: Floats, where: Any, mesh: Any, prim: Any, triangles: Ints, corners: Ints) -> None:
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    shader = material.ComputeSurfaceSource("")[0] if material else None
    if not shader or shader.GetIdAttr().Get() != "UsdPreviewSurface":
        return
    diffuse = shader.GetInput("diffuseColor")
    if not diffuse:
        return
    sources = diffuse.GetConnectedSources()[0]
    texture = UsdShade.Shader(sources[0].source.GetPrim()) if sources else None
    if texture and texture.GetIdAttr().Get() == "UsdUVTexture":
        painted = _texture_colors(texture, mesh, triangles[where], corners[where])
        colors[where] = painted if painted is not None else _DEFAULT
    elif (value := diffuse.Get()) is not None:
        colors[where] = np.array(value, np.float64)


def _texture_colors(texture: Any, mesh: Any, triangles: Ints, corners: Ints) -> Floats | None:
    """The texture's colours in the triangles' middles; without UVs its mean; None without a readable picture."""
    picture = _read_picture(texture)
    if picture is None:
        return None
    uv = _texture_coordinates(texture, mesh, triangles, corners)
    if uv is None:
        return np.asarray(picture.reshape(-1, 3).mean(axis=0))
    height, width, _ = picture.shape
    wrapped = uv - np.floor(uv)
    column = np.minimum((wrapped[:, 0] * width).astype(int), width - 1)
    row = np.minimum(((1.0 - wrapped[:, 1]) * height).astype(int), height - 1)
    return np.asarray(picture[row, column])


def _read_picture(texture: Any) -> Floats | None:
    """Linear RGB; of a file beside the USD or inside of a package."""
    from layfigure.render.scene import from_srgb

    file = texture.GetInput("file")
    asset = file.Get() if file else None
    if asset is None:
        return None
    with_path = asset.resolvedPath or asset.path
    opened = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(with_path))
    if not opened:
        return None
    try:
        image = Image.open(io.BytesIO(opened.GetBuffer())).convert("RGB")
    except (UnidentifiedImageError, OSError, Image.DecompressionBombError):
        return None
    image.thumbnail((_MAX_TEXTURE_PIXELS, _MAX_TEXTURE_PIXELS))
    return from_srgb(np.asarray(image, np.float64) / 255.0)


def _texture_coordinates(texture: Any, mesh: Any, triangles: Ints, corners: Ints) -> Floats | None:
    """(T, 2), of the triangles' middles."""
    primvar = UsdGeom.PrimvarsAPI(mesh.GetPrim()).FindPrimvarWithInheritance(_coordinates_name(texture))
    values = primvar.ComputeFlattened(Usd.TimeCode.EarliestTime()) if primvar else None
    if values is None:
        return None
    uv = np.array(values, np.float64)
    of = {UsdGeom.Tokens.faceVarying: corners, UsdGeom.Tokens.vertex: triangles, UsdGeom.Tokens.varying: triangles}
    indices = of.get(primvar.GetInterpolation())
    if indices is None or uv.ndim != 2 or uv.shape[1] != 2 or (indices.size and indices.max() >= len(uv)):
        return None
    return np.asarray(uv[indices].mean(axis=1))


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
