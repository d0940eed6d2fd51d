"""Characters with pictures on their skin, and what to look at in files of them."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from pxr import Usd, UsdShade

from client_support import synthetic
from layfigure.usd.checks import check

ROOT = "/Synthetic_arm"
MESH = f"{ROOT}/Geometry/arm_mesh"
FPS = 24.0
SKIN_TOLERANCE = 1e-4  # of directions between points 4 cm apart, in floats some metres from the origin
FLOAT_TOLERANCE = 1e-6  # of unit vectors and coordinates in floats
SAVED_COLOR_TOLERANCE = 0.01  # linear, of 8-bit sRGB
# Of the picture that is wrapped around the arm, by the quarters of v: red is the lowest, at the arm's root.
QUARTERS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0]], np.uint8)


def picture(format_name: str = "PNG", mode: str = "RGB") -> bytes:
    """32 x 32 pixels of four colours, one above the other."""
    pixels = np.repeat(np.repeat(QUARTERS[::-1], 8, axis=0)[:, None], 32, axis=1)  # the file begins with the top
    data = io.BytesIO()
    Image.fromarray(pixels).convert(mode).save(data, format_name)
    return data.getvalue()


def textured_meshes(texture: str = "", image: bytes | None = None, normals: bool = True) -> Any:
    """Two tubes of one material, whose texture is a file or a picture of the character's file."""
    message = synthetic.meshes_message()
    synthetic.wrap_texture(message.meshes[0], normals)
    second = synthetic.meshes_message().meshes[0]
    synthetic.wrap_texture(second, normals)
    second.name = "sleeve"
    message.meshes.append(second)
    message.mesh_count = 2
    message.materials = [synthetic.material_message("skin", (1.0, 1.0, 1.0))]
    if image is not None:
        message.images, message.image_count = [synthetic.image_message(image, "../../evil name")], 1
        message.materials[0].image = 0
    message.materials[0].texture = texture
    return message


def texture_node(stage: Usd.Stage, material: str = "skin") -> UsdShade.Shader:
    return UsdShade.Shader(stage.GetPrimAtPath(f"{ROOT}/Materials/{material}/Texture"))


def findings(path: Path) -> list[str]:
    return [str(finding) for finding in check(path).findings]
