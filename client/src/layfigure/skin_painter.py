"""The surfaces of a posed mesh: textured, of its colours, and those that a joint moves which yields."""

from __future__ import annotations

import io
from collections.abc import Iterator

import numpy as np
from PIL import Image

from layfigure.protocol import Floats
from layfigure.render.scene import Picture, Surface, from_srgb, to_srgb
from layfigure.usd.character_layer import vertex_normals
from layfigure.usd.looks import Texture
from layfigure.usd.reader import PosedMesh

FLOW_COLOR = np.array([0.95, 0.30, 0.0])  # linear RGB
_FLOW_STRENGTH = 0.8  # of its colour over the skin's
_MAX_PICTURE_PIXELS = 2048  # across: more than a preview shows


class SkinPainter:
    """Keeps the pictures from one frame to the next."""

    def __init__(self) -> None:
        self._pictures: dict[Texture, Picture] = {}

    def surfaces(self, mesh: PosedMesh) -> Iterator[Surface]:
        flow = _FLOW_STRENGTH * mesh.flowing[mesh.triangles].mean(axis=1)
        colors = (1.0 - flow[:, None]) * mesh.colors + flow[:, None] * FLOW_COLOR
        textures = [look.texture for look in mesh.looks.looks]
        if not any(textures):
            yield Surface(mesh.points, mesh.triangles, colors)
            return
        normals = vertex_normals(mesh.points, mesh.triangles)  # of all, or there were seams
        is_textured = np.array([texture is not None for texture in textures])[mesh.looks.of_triangles] & (flow == 0.0)
        if not is_textured.all():
            yield Surface(mesh.points, mesh.triangles[~is_textured], colors[~is_textured], normals=normals)
        for number, texture in enumerate(textures):
            where = is_textured & (mesh.looks.of_triangles == number)
            if texture is not None and where.any():
                yield self._textured(mesh, where, normals, texture)

    def _textured(self, mesh: PosedMesh, where: Floats, normals: Floats, texture: Texture) -> Surface:
        """With a point for each corner of its triangles."""
        corners = mesh.triangles[where].reshape(-1)
        return Surface(
            points=mesh.points[corners],
            triangles=np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
            color=np.ones(3),
            normals=normals[corners],
            uvs=mesh.looks.uvs[where].reshape(-1, 2),
            picture=self._picture(texture),
        )

    def _picture(self, texture: Texture) -> Picture:
        if texture not in self._pictures:
            image = Image.open(io.BytesIO(texture.data)).convert("RGB")
            image.thumbnail((_MAX_PICTURE_PIXELS, _MAX_PICTURE_PIXELS))
            linear = from_srgb(np.asarray(image, np.float64) / 255.0) * texture.factor[:3]
            self._pictures[texture] = Picture(to_srgb(linear), texture.wrap[0])
        return self._pictures[texture]
