"""Writes materials as UsdPreviewSurface, with a base colour texture or without."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pxr import Gf, Sdf, UsdShade

from layfigure.protocol import Material, Mesh
from layfigure.usd.names import unique_names
from layfigure.usd.textures import Textures, materials_of

TEXTURE_COORDINATES = "st"  # the primvar's name that tools agree on
_ROUGHNESS = 0.6
_OPAQUE = 1.0


def define_materials(stage: Any, scope: str, meshes: Iterable[Mesh], textures: Textures) -> dict[Material, Any]:
    """A prim for each material, however many meshes have it."""
    materials = list(materials_of(meshes))
    names = unique_names((material.name for material in materials), "material")
    return {
        material: _define_material(stage, f"{scope}/{name}", material, textures.get(material))
        for material, name in zip(materials, names, strict=True)
    }


def _define_material(stage: Any, path: str, material: Material, texture: str | None) -> Any:
    prim = UsdShade.Material.Define(stage, path)
    shader = UsdShade.Shader.Define(stage, f"{path}/Surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    color = shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f)
    color.Set(Gf.Vec3f(*material.base_color.tolist()))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(_ROUGHNESS)
    if texture is not None:
        reader = _define_texture(stage, path, material, texture)
        color.ConnectToSource(reader.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))
    if material.opacity < _OPAQUE or (texture is not None and material.texture_alpha):
        opacity = shader.CreateInput("opacity", Sdf.ValueTypeNames.Float)
        opacity.Set(material.opacity)
        if texture is not None and material.texture_alpha:
            opacity.ConnectToSource(reader.CreateOutput("a", Sdf.ValueTypeNames.Float))
        if material.alpha_cutoff > 0.0:
            shader.CreateInput("opacityThreshold", Sdf.ValueTypeNames.Float).Set(material.alpha_cutoff)
    surface = shader.CreateOutput("surface", Sdf.ValueTypeNames.Token)
    prim.CreateSurfaceOutput().ConnectToSource(surface)
    return prim


def _define_texture(stage: Any, path: str, material: Material, texture: str) -> Any:
    coordinates = UsdShade.Shader.Define(stage, f"{path}/Coordinates")
    coordinates.CreateIdAttr("UsdPrimvarReader_float2")
    coordinates.CreateInput("varname", Sdf.ValueTypeNames.String).Set(TEXTURE_COORDINATES)
    shader = UsdShade.Shader.Define(stage, f"{path}/Texture")
    shader.CreateIdAttr("UsdUVTexture")
    shader.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(Sdf.AssetPath(texture))
    shader.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set("sRGB")
    for name, wrap in zip(("wrapS", "wrapT"), material.wrap, strict=True):
        shader.CreateInput(name, Sdf.ValueTypeNames.Token).Set(wrap)
    factor = Gf.Vec4f(*material.base_color.tolist(), material.opacity)
    if factor != Gf.Vec4f(1.0):
        shader.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(factor)
    fallback = Gf.Vec4f(*material.base_color.tolist(), 1.0)
    shader.CreateInput("fallback", Sdf.ValueTypeNames.Float4).Set(fallback)  # else a missing file is black
    output = coordinates.CreateOutput("result", Sdf.ValueTypeNames.Float2)
    shader.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(output)
    return shader
