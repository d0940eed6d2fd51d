"""Light on meshes: one soft key light, a sky with one diffuse bounce, a floor that fades into the backdrop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from layfigure.protocol import Floats, Ints
from layfigure.render.camera import Camera
from layfigure.usd.character_layer import vertex_normals

_KEY_DIRECTION = np.array([0.75, -0.62, 1.05]) / np.linalg.norm([0.75, -0.62, 1.05])
_KEY_COLOR = np.array([2.05, 1.92, 1.74])
_KEY_SOFTNESS = 0.12  # radius of the light at distance 1
_SKY_ZENITH = np.array([0.80, 0.86, 0.95])
_SKY_HORIZON = np.array([0.62, 0.62, 0.64])
_FLOOR_LIGHT = np.array([0.42, 0.42, 0.42])  # that the floor throws back from below
_SKIN_LIGHT = 0.45  # part of its own colour that a surface gets from others close by
_BACKDROP = np.array([0.80, 0.82, 0.84])
_FLOOR_ALBEDO = np.array([0.56, 0.57, 0.58])
_SPECULAR = 0.045
_SHININESS = 28.0
_EXPOSURE = 0.95
# steps of a sequence that fills the unit cube of six dimensions evenly: powers of the root of g^7 = g + 1
_SEQUENCE = 1.0 / 1.1127756842787055 ** np.arange(1, 7)  # pixel (2), sky (2), key light (2)
_FADE_BEGIN, _FADE_END = 0.8, 2.2  # of the floor, in radii of the scene


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh of one colour (linear RGB), or of one for each triangle."""

    points: Floats  # (V, 3)
    triangles: Ints  # (T, 3)
    color: Floats  # (3) or (T, 3)


@dataclass(frozen=True, eq=False)
class _Hits:
    """What the rays that hit something have hit."""

    rays: Ints
    points: Floats
    normals: Floats  # smooth, towards the viewer
    albedo: Floats
    directions: Floats  # of the rays
    backdrop: Floats  # how far the floor has faded, 0 to 1


class Scene:
    """Surfaces within `radius` of `centre`, over a floor at height `floor` that fades out around them."""

    def __init__(self, surfaces: list[Surface], floor: float, centre: Floats, radius: float) -> None:
        self._centre = centre
        self._radius = radius
        self._offset = 1e-4 * radius  # keeps secondary rays off the surface they start from
        self._surfaces = [*surfaces, _floor(floor, centre, 8.0 * radius)]
        self._normals = [vertex_normals(surface.points, surface.triangles) for surface in self._surfaces]
        self._embree = EmbreeScene()
        self._geometry = [  # Embree reads these arrays as long as the scene lives
            TriangleMesh(self._embree, surface.points.astype(np.float32), surface.triangles.astype(np.int32))
            for surface in self._surfaces
        ]

    def render(self, camera: Camera, width: int, height: int, samples: int, seed: int = 0) -> Floats:
        """Linear RGB (height, width, 3), 0 to 1, of `samples` rays per pixel. Equal calls give equal pictures."""
        pixels = height * width
        shifts = np.random.default_rng(seed).random((pixels, len(_SEQUENCE)))
        rows, columns = np.divmod(np.arange(pixels), width)
        picture = np.zeros((pixels, 3))
        for index in range(samples):
            numbers = (shifts + (index + 1) * _SEQUENCE) % 1.0
            x = 2.0 * (columns + numbers[:, 0]) / width - 1.0
            y = 1.0 - 2.0 * (rows + numbers[:, 1]) / height
            picture += self._trace(camera, camera.directions(x, y), numbers[:, 2:])
        return (picture / samples).reshape(height, width, 3)

    def _trace(self, camera: Camera, directions: Floats, numbers: Floats) -> Floats:
        colors = np.tile(_BACKDROP, (len(directions), 1))
        origins = np.tile(camera.position, (len(directions), 1))
        hits = self._intersect(origins, directions)
        if len(hits.rays):
            backdrop = hits.backdrop[:, None]
            colors[hits.rays] = (1.0 - backdrop) * self._shade(hits, numbers[hits.rays]) + backdrop * _BACKDROP
        return 1.0 - np.exp(-_EXPOSURE * colors)

    def _intersect(self, origins: Floats, directions: Floats) -> _Hits:
        """Without the floor where it has faded wholly."""
        found = self._embree.run(origins.astype(np.float32), directions.astype(np.float32), output=1)
        points = origins + found["tfar"][:, None].astype(np.float64) * directions
        faded = np.where(found["geomID"] == len(self._surfaces) - 1, self._fading(points), 0.0)
        rays = np.flatnonzero((found["geomID"] >= 0) & (faded < 1.0))
        normals, albedo = self._surface_at({name: values[rays] for name, values in found.items()})
        normals *= np.where(np.sum(normals * directions[rays], axis=1) > 0.0, -1.0, 1.0)[:, None]
        return _Hits(rays.astype(np.int32), points[rays], normals, albedo, directions[rays], faded[rays])

    def _surface_at(self, found: dict[str, Any]) -> tuple[Floats, Floats]:
        """Smooth normals and colours where rays have met surfaces."""
        weights = np.stack([1.0 - found["u"] - found["v"], found["u"], found["v"]], axis=1)
        normals, albedo = np.empty((len(weights), 3)), np.empty((len(weights), 3))
        for index, surface in enumerate(self._surfaces):
            mine = found["geomID"] == index
            corners = self._normals[index][surface.triangles[found["primID"][mine]]]
            normals[mine] = np.einsum("nk,nkd->nd", weights[mine], corners)
            albedo[mine] = surface.color if surface.color.ndim == 1 else surface.color[found["primID"][mine]]
        return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9), albedo

    def _fading(self, points: Floats) -> Floats:
        """Of the floor into the backdrop, 0 to 1, smoothly with the distance from the centre."""
        distance = np.hypot(*(points[:, :2] - self._centre[:2]).T) / self._radius
        part = np.clip((distance - _FADE_BEGIN) / (_FADE_END - _FADE_BEGIN), 0.0, 1.0)
        return np.asarray(part * part * (3.0 - 2.0 * part))

    def _shade(self, hits: _Hits, numbers: Floats) -> Floats:
        origins = hits.points + self._offset * hits.normals
        return hits.albedo * self._sky_light(hits, origins, numbers[:, :2]) + self._key_light(
            hits, origins, numbers[:, 2:]
        )

    def _key_light(self, hits: _Hits, origins: Floats, numbers: Floats) -> Floats:
        to_light = _KEY_DIRECTION + _KEY_SOFTNESS * _on_sphere(numbers)
        to_light /= np.linalg.norm(to_light, axis=1, keepdims=True)
        cosine = np.maximum(np.sum(hits.normals * to_light, axis=1), 0.0)
        half = to_light - hits.directions
        half /= np.linalg.norm(half, axis=1, keepdims=True)
        shine = _SPECULAR * np.maximum(np.sum(hits.normals * half, axis=1), 0.0) ** _SHININESS * (cosine > 0.0)
        visible = ~self._occluded(origins, to_light)
        return np.asarray(
            visible[:, None] * _KEY_COLOR * (hits.albedo / math.pi * 2.0 * cosine[:, None] + shine[:, None])
        )

    def _sky_light(self, hits: _Hits, origins: Floats, numbers: Floats) -> Floats:
        """Cosine-weighted directions: sky where free, light bounced off the surroundings where not."""
        directions = hits.normals + 0.999 * _on_sphere(numbers)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        height = np.clip(directions[:, 2:], -1.0, 1.0)
        sky = (1.0 - height) * _SKY_HORIZON + height * _SKY_ZENITH
        bounced = np.where(height < 0.0, _FLOOR_LIGHT, _SKIN_LIGHT * hits.albedo)
        return np.where(self._occluded(origins, directions)[:, None], bounced, sky)

    def _occluded(self, origins: Floats, directions: Floats) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        answer = self._embree.run(origins.astype(np.float32), directions.astype(np.float32), query="OCCLUDED")
        return np.asarray(answer) >= 0


def _on_sphere(numbers: Floats) -> Floats:
    """Evenly spread unit vectors from evenly spread pairs of numbers in 0 to 1."""
    z, angle = 2.0 * numbers[:, 0] - 1.0, 2.0 * math.pi * numbers[:, 1]
    radius = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def _floor(height: float, centre: Floats, half_size: float) -> Surface:
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half_size + centre[:2]
    points = np.column_stack([corners, np.full(4, height)])
    return Surface(points, np.array([[0, 1, 2], [0, 2, 3]], np.int32), _FLOOR_ALBEDO)


def to_srgb(linear: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """Linear RGB, 0 to 1, to 8-bit sRGB."""
    clipped = np.clip(linear, 0.0, 1.0)
    curve = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    return np.round(255.0 * curve).astype(np.uint8)
