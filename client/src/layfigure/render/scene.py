"""Shaded pictures of meshes on a ground that passes into the backdrop, by VTK through EGL: Mesa renders in software.

VTK is loaded when the first picture is drawn: it is large, and an extra of the package.
"""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
from PIL import Image

from layfigure.errors import LayfigureError
from layfigure.protocol import Floats, Ints
from layfigure.render.camera import Camera

BACKDROP = np.array([0.80, 0.82, 0.84])  # sRGB
_EGL = "libEGL.so.1"
_OVERSAMPLING = 2  # pixels across one of the picture's: smooth edges
_KEY_DIRECTION = np.array([0.75, -0.62, 1.05])  # towards the light; it alone casts a shadow
_LIGHTS = (  # towards the light, intensity, colour
    (_KEY_DIRECTION, 0.70, (1.0, 0.97, 0.92)),
    (np.array([-1.0, -0.6, 0.7]), 0.25, (0.92, 0.96, 1.0)),
    (np.array([0.0, 0.8, 0.6]), 0.20, (1.0, 1.0, 1.0)),
    (np.array([0.4, -1.0, 0.1]), 0.20, (1.0, 1.0, 1.0)),
)
_AMBIENT = 0.25  # light from everywhere: what faces away is dark, and not black
_SPECULAR, _SPECULAR_POWER = 0.12, 25.0
_SHINING_THROUGH = 0.35  # of a surface's colour
_GROUND_RADIUS = 4.0  # in radii of the scene, as the next
_GROUND_FADE = 1.2  # from here on it passes into the backdrop
_GROUND_RINGS, _GROUND_SECTORS = 24, 96
_GROUND_SHADE = 0.93  # in the middle, of the backdrop's brightness
_SHADOW_SHADE = 0.72
_GRID_SHADE = 0.84
_GRID_CELLS = 8  # across the scene's diameter, about
_GRID_REACH = 1.5  # of its lines from the middle, in radii of the scene
_LIFT = 1e-3  # of what lies on the ground, in radii of the scene: in front of it for the depth buffer


@dataclass(frozen=True, eq=False)
class Picture:
    """What is painted on a surface."""

    pixels: np.ndarray[tuple[int, ...], np.dtype[np.uint8]]  # (H, W, 3) sRGB, the uppermost row first
    wrap: str  # outside of 0..1: "repeat", "clamp" or "mirror"


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle mesh of one colour (linear RGB), or of one for each triangle or vertex."""

    points: Floats  # (V, 3)
    triangles: Ints  # (T, 3)
    color: Floats  # (3), (T, 3) or, if `of_vertices`, (V, 3)
    of_vertices: bool = False
    normals: Floats | None = None  # (V, 3) unit; None: smooth ones
    uvs: Floats | None = None  # (V, 2) of the picture, v upwards
    picture: Picture | None = None  # instead of the colour
    shines_through: bool = False  # faintly, what is in front of it


@dataclass(frozen=True, eq=False)
class Ground:
    """A level disc at `height` under what is within `radius` of `centre`."""

    height: float
    centre: Floats  # (3)
    radius: float  # > 0


def ground_under(points: Floats) -> Ground:
    low, high = points.min(axis=0), points.max(axis=0)
    return Ground(float(low[2]), (low + high) / 2.0, max(float(np.linalg.norm(high - low)) / 2.0, 1e-6))


class Renderer:
    """Draws pictures of one size; use it in a `with` block. Raises LayfigureError if this machine cannot.

    Equal scenes give equal pictures on one machine. About 0.5 s for a picture of 360 x 600 pixels and a mesh of 30 000
    triangles, and 2 s for the first one, while shaders are compiled. Of one thread.
    """

    def __init__(self, width: int, height: int) -> None:
        self._vtk = _load_vtk()
        self._window = self._vtk.vtkEGLRenderWindow()
        self._window.SetOffScreenRendering(True)
        self._window.SetMultiSamples(0)
        self._window.SetNumberOfLayers(2)
        self._window.SetSize(_OVERSAMPLING * width, _OVERSAMPLING * height)
        self._size = (width, height)

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._window.Finalize()

    def render(self, surfaces: list[Surface], camera: Camera, ground: Ground) -> Image.Image:
        vtk = self._vtk
        renderer = vtk.vtkRenderer()
        renderer.SetBackground(*BACKDROP)
        for surface in surfaces:
            renderer.AddActor(self._actor(surface))
        for actor in self._ground_actors(ground, surfaces):
            renderer.AddActor(actor)
        _place_camera(renderer, camera)
        self._add_lights(renderer, ground.centre)
        layers = [renderer, self._shining_through(surfaces, camera, ground)]
        for layer in layers:
            self._window.AddRenderer(layer)
        self._window.Render()
        picture = self._read_pixels()
        for layer in layers:
            layer.ReleaseGraphicsResources(self._window)
            self._window.RemoveRenderer(layer)
        return picture.resize(self._size, Image.Resampling.BOX)

    def _shining_through(self, surfaces: list[Surface], camera: Camera, ground: Ground) -> Any:
        """A second layer over the picture, of the surfaces that do."""
        layer = self._vtk.vtkRenderer()
        layer.SetLayer(1)
        for actor in (self._actor(surface) for surface in surfaces if surface.shines_through):
            actor.GetProperty().SetOpacity(_SHINING_THROUGH)
            layer.AddActor(actor)
        _place_camera(layer, camera)
        self._add_lights(layer, ground.centre)
        return layer

    def _actor(self, surface: Surface) -> Any:
        vtk = self._vtk
        data = self._poly_data(surface)
        if surface.normals is not None:
            data.GetPointData().SetNormals(vtk.numpy_to_vtk(np.ascontiguousarray(surface.normals), deep=True))
        else:
            data = self._with_smooth_normals(data)
        colors = to_srgb(surface.color)
        mapper = vtk.vtkPolyDataMapper()
        mapper.SetInputData(data)
        actor = vtk.vtkActor()
        actor.SetMapper(mapper)
        look = actor.GetProperty()
        if surface.picture is not None and surface.uvs is not None:
            data.GetPointData().SetTCoords(vtk.numpy_to_vtk(np.ascontiguousarray(surface.uvs), deep=True))
            actor.SetTexture(self._texture(surface.picture))
        elif colors.ndim == 2:
            attributes = data.GetPointData() if surface.of_vertices else data.GetCellData()
            attributes.SetScalars(vtk.numpy_to_vtk(np.ascontiguousarray(colors), deep=True))
        else:
            look.SetColor(*(colors / 255.0))
        look.SetAmbient(_AMBIENT)
        look.SetSpecular(_SPECULAR)
        look.SetSpecularPower(_SPECULAR_POWER)
        return actor

    def _poly_data(self, surface: Surface) -> Any:
        vtk = self._vtk
        points = vtk.vtkPoints()
        points.SetData(vtk.numpy_to_vtk(np.ascontiguousarray(surface.points, np.float32), deep=True))
        offsets = np.arange(0, 3 * len(surface.triangles) + 1, 3, dtype=np.int64)
        corners = np.ascontiguousarray(surface.triangles, np.int64).reshape(-1)
        cells = vtk.vtkCellArray()
        cells.SetData(vtk.numpy_to_vtkIdTypeArray(offsets, deep=True), vtk.numpy_to_vtkIdTypeArray(corners, deep=True))
        data = vtk.vtkPolyData()
        data.SetPoints(points)
        data.SetPolys(cells)
        return data

    def _texture(self, picture: Picture) -> Any:
        vtk = self._vtk
        height, width, _ = picture.pixels.shape
        image = vtk.vtkImageData()
        image.SetDimensions(width, height, 1)
        rows = np.ascontiguousarray(picture.pixels[::-1]).reshape(-1, 3)  # VTK begins with the lowest
        image.GetPointData().SetScalars(vtk.numpy_to_vtk(rows, deep=True))
        texture = vtk.vtkTexture()
        texture.SetInputData(image)
        texture.InterpolateOn()
        texture.MipmapOn()
        wraps = {"repeat": texture.Repeat, "clamp": texture.ClampToEdge, "mirror": texture.MirroredRepeat}
        texture.SetWrap(wraps[picture.wrap])
        return texture

    def _with_smooth_normals(self, data: Any) -> Any:
        normals = self._vtk.vtkPolyDataNormals()
        normals.SetInputData(data)
        normals.SplittingOff()
        normals.ConsistencyOff()
        normals.Update()
        return normals.GetOutput()

    def _add_lights(self, renderer: Any, centre: Floats) -> None:
        renderer.AutomaticLightCreationOff()
        for direction, intensity, color in _LIGHTS:
            light = self._vtk.vtkLight()
            light.SetLightTypeToSceneLight()
            light.SetPosition(*(centre + direction))
            light.SetFocalPoint(*centre)
            light.SetIntensity(intensity)
            light.SetColor(*color)
            renderer.AddLight(light)

    def _ground_actors(self, ground: Ground, surfaces: list[Surface]) -> list[Any]:
        """The disc, a grid and the shadows on it. They are not lit: their colours are the picture's."""
        grid = self._vtk.vtkActor()
        mapper = self._vtk.vtkPolyDataMapper()
        mapper.SetInputData(self._lines(_grid(ground)))
        grid.SetMapper(mapper)
        grid.GetProperty().SetColor(*(_GRID_SHADE * BACKDROP))
        grid.GetProperty().SetLineWidth(float(_OVERSAMPLING))
        shadow_color = from_srgb(_SHADOW_SHADE * BACKDROP)
        shadows = [
            self._actor(Surface(_shadow(surface.points, ground), surface.triangles, shadow_color))
            for surface in surfaces
        ]
        actors = [self._actor(_disc(ground)), grid, *shadows]
        for actor in actors:
            actor.GetProperty().LightingOff()
            actor.GetProperty().SetAmbient(0.0)
        return actors

    def _lines(self, ends: Floats) -> Any:
        """Segments (N, 2, 3)."""
        vtk = self._vtk
        points = vtk.vtkPoints()
        points.SetData(vtk.numpy_to_vtk(np.ascontiguousarray(ends.reshape(-1, 3), np.float32), deep=True))
        corners = np.arange(2 * len(ends), dtype=np.int64)
        cells = vtk.vtkCellArray()
        offsets = np.arange(0, 2 * len(ends) + 1, 2, dtype=np.int64)
        cells.SetData(vtk.numpy_to_vtkIdTypeArray(offsets, deep=True), vtk.numpy_to_vtkIdTypeArray(corners, deep=True))
        data = vtk.vtkPolyData()
        data.SetPoints(points)
        data.SetLines(cells)
        return data

    def _read_pixels(self) -> Image.Image:
        grab = self._vtk.vtkWindowToImageFilter()
        grab.SetInput(self._window)
        grab.ReadFrontBufferOff()
        grab.ShouldRerenderOff()
        grab.Update()
        image = grab.GetOutput()
        width, height, _ = image.GetDimensions()
        pixels = self._vtk.vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, 3)
        return Image.fromarray(np.ascontiguousarray(pixels[::-1]))


def _place_camera(renderer: Any, camera: Camera) -> None:
    placed = renderer.GetActiveCamera()
    placed.SetPosition(*camera.position)
    placed.SetFocalPoint(*(camera.position + camera.forward))
    placed.SetViewUp(*camera.up)
    placed.SetViewAngle(math.degrees(2.0 * math.atan(camera.tan_half_height)))
    renderer.ResetCameraClippingRange()


def _shadow(points: Floats, ground: Ground) -> Floats:
    """The points where the key light's rays through them meet the ground."""
    above = points[:, 2:] - ground.height
    fallen = np.array(points - above * (_KEY_DIRECTION / _KEY_DIRECTION[2]), np.float64)
    fallen[:, 2] = ground.height + _LIFT * ground.radius
    return fallen


def _grid(ground: Ground) -> Floats:
    """Segments (N, 2, 3), whose distance is 1, 2 or 5 times a power of ten, on multiples of it."""
    step = _round_step(2.0 * ground.radius / _GRID_CELLS)
    reach = _GRID_REACH * ground.radius
    segments = []
    for axis in (0, 1):
        first, last = (
            math.ceil((ground.centre[axis] - reach) / step),
            math.floor((ground.centre[axis] + reach) / step),
        )
        for number in range(first, last + 1):
            ends = np.tile([*ground.centre[:2], ground.height + 0.5 * _LIFT * ground.radius], (2, 1))
            ends[:, axis] = number * step
            ends[:, 1 - axis] += [-reach, reach]
            segments.append(ends)
    return np.array(segments)


def _round_step(size: float) -> float:
    power = 10.0 ** math.floor(math.log10(size))
    return power * max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= size)


def _disc(ground: Ground) -> Surface:
    fractions = np.linspace(0.0, 1.0, _GROUND_RINGS + 1)
    radii, angles = np.meshgrid(
        _GROUND_RADIUS * ground.radius * fractions**2,
        np.linspace(0.0, 2.0 * math.pi, _GROUND_SECTORS, endpoint=False),
        indexing="ij",
    )
    points = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros_like(radii)], axis=-1).reshape(-1, 3)
    points += [ground.centre[0], ground.centre[1], ground.height]
    ring, sector = (grid.ravel() for grid in np.indices((_GROUND_RINGS, _GROUND_SECTORS)))
    a, b = ring * _GROUND_SECTORS + sector, ring * _GROUND_SECTORS + (sector + 1) % _GROUND_SECTORS
    triangles = np.concatenate(
        [np.stack([a, a + _GROUND_SECTORS, b], 1), np.stack([b, a + _GROUND_SECTORS, b + _GROUND_SECTORS], 1)]
    )
    part = np.clip((radii.ravel() / ground.radius - _GROUND_FADE) / (_GROUND_RADIUS - _GROUND_FADE), 0.0, 1.0)
    shade = _GROUND_SHADE + (1.0 - _GROUND_SHADE) * part
    return Surface(points, triangles.astype(np.int32), from_srgb(shade[:, None] * BACKDROP), of_vertices=True)


def to_srgb(linear: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """Linear RGB, 0 to 1, to 8-bit sRGB."""
    clipped = np.clip(linear, 0.0, 1.0)
    curve = np.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    return np.round(255.0 * curve).astype(np.uint8)


def from_srgb(srgb: Floats) -> Floats:
    """sRGB, 0 to 1, to linear RGB."""
    return np.asarray(np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4), np.float64)


def _load_vtk() -> Any:
    """A namespace of what is needed of VTK. Raises LayfigureError that says what to install."""
    try:
        ctypes.CDLL(_EGL)
    except OSError as error:
        raise LayfigureError(
            f"no picture can be drawn without {_EGL}: apt-get install libegl1 libgl1-mesa-dri"
        ) from error
    try:
        from layfigure.render import vtk_parts
    except ImportError as error:
        raise LayfigureError(
            f"no picture can be drawn without VTK ({error}): pip install 'layfigure[preview]'"
        ) from error
    return vtk_parts
