"""A picture of a doll from the front and from the side: its bodies, what they weigh, and the sections at its joints."""

from __future__ import annotations

import colorsys
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from layfigure.inspection import InspectedBody, InspectedDoll
from layfigure.protocol import Floats
from layfigure.render.camera import View, frame_points, picture_aspect
from layfigure.render.picture_file import INK, PAPER, font, write_png
from layfigure.render.polygon import triangulate
from layfigure.render.scene import Renderer, Surface, ground_under, to_srgb

_ELEVATION = math.radians(14.0)  # so that level sections are not seen edge-on
_VIEWS = {
    "front": View(azimuth=0.0, elevation=_ELEVATION),
    "left side": View(azimuth=math.radians(90.0), elevation=_ELEVATION),
}
_PANEL_HEIGHT = 760  # pixels
_SKIN_OPACITY = 0.42  # of the skin over what is inside
_ELLIPSOID_RINGS = 24
_SECTION_THICKNESS = 0.004  # of the doll's size: a section is a thin slab, so that it is seen from all sides
_SECTION_SCALE = 1.04  # that it stands out of the skin by
_SECTION_COLOR = np.array([0.012, 0.012, 0.015])
_NOBODY_COLOR = np.array([0.35, 0.35, 0.35])  # of skin that moves with no body
_HUE_STEP = (math.sqrt(5.0) - 1.0) / 2.0  # the golden ratio: neighbours in the list differ most
_MARGIN = 16  # pixels
_TITLE_SIZE, _TEXT_SIZE = 26, 18
_LINE_HEIGHT = 27
_SWATCH = 16

Progress = Callable[[int, int], None]  # pictures done, pictures in all


def write_doll_picture(doll: InspectedDoll, out: Path, progress: Progress = lambda done, whole: None) -> None:
    """A PNG: the skin coloured by the body that it counts to, translucent over each body's ellipsoid of inertia and the
    filled outlines of the sections."""
    colors = body_colors(len(doll.bodies))
    panels = list(_render(_inside(doll, colors), _skin(doll, colors), progress))
    write_png(_assemble(doll, colors, dict(zip(_VIEWS, panels, strict=True))), out)


def body_colors(count: int) -> Floats:
    """Linear RGB (count, 3), each unlike the one before."""
    hues = np.arange(count) * _HUE_STEP % 1.0
    colors = [colorsys.hls_to_rgb(hue, 0.34 + 0.16 * (index % 2), 0.75) for index, hue in enumerate(hues)]
    return np.array(colors, np.float64).reshape(-1, 3)


def _skin(doll: InspectedDoll, colors: Floats) -> list[Surface]:
    palette = np.vstack([colors, _NOBODY_COLOR])  # the last one is also that of -1
    return [Surface(doll.vertices, doll.triangles, palette[doll.body_of_triangle])]


def _inside(doll: InspectedDoll, colors: Floats) -> list[Surface]:
    size = float(np.linalg.norm(np.ptp(doll.vertices, axis=0)))
    ellipsoids = [ellipsoid(body, color) for body, color in zip(doll.bodies, colors, strict=True)]
    slabs = [slab(body.section, _SECTION_THICKNESS * size) for body in doll.bodies if len(body.section)]
    return [*ellipsoids, *slabs]


def ellipsoid(body: InspectedBody, color: Floats) -> Surface:
    """Of a homogeneous body with the same mass and inertia."""
    latitude = np.linspace(0.0, math.pi, _ELLIPSOID_RINGS + 1)
    longitude = np.linspace(0.0, 2.0 * math.pi, 2 * _ELLIPSOID_RINGS, endpoint=False)
    theta, phi = (grid.ravel() for grid in np.meshgrid(latitude, longitude, indexing="ij"))
    unit = np.column_stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    columns = len(longitude)
    row, column = (grid.ravel() for grid in np.meshgrid(np.arange(_ELLIPSOID_RINGS), np.arange(columns), indexing="ij"))
    a, b = row * columns + column, row * columns + (column + 1) % columns
    triangles = np.concatenate([np.stack([a, a + columns, b], 1), np.stack([b, a + columns, b + columns], 1)])
    return Surface(body.com + unit @ body.semi_axes, triangles.astype(np.int32), color)


def slab(outline: Floats, thickness: float) -> Surface:
    """The filled outline, a little larger and as thick as that."""
    middle = outline.mean(axis=0)
    spread = _SECTION_SCALE * (outline - middle)
    u, v, normal = np.linalg.svd(spread, full_matrices=False)[2]
    flat = triangulate(np.column_stack([spread @ u, spread @ v]))
    count = len(outline)
    ring = np.arange(count)
    following = (ring + 1) % count
    sides = np.concatenate(
        [np.stack([ring, following, ring + count], 1), np.stack([following, following + count, ring + count], 1)]
    )
    points = np.concatenate([middle + spread + side * 0.5 * thickness * normal for side in (1.0, -1.0)])
    # corners of their own for the sides: the edges stay sharp
    triangles = np.concatenate([flat, flat + count, sides + 2 * count])
    return Surface(np.concatenate([points, points]), triangles.astype(np.int32), _SECTION_COLOR)


def _render(inside: list[Surface], skin: list[Surface], progress: Progress) -> Iterator[Image.Image]:
    points = np.concatenate([surface.points for surface in [*inside, *skin]])
    for done, view in enumerate(_VIEWS.values()):
        progress(done, len(_VIEWS))
        width = round(_PANEL_HEIGHT * picture_aspect(points, view, least=0.4, most=1.4))
        camera = frame_points(points, width / _PANEL_HEIGHT, view)
        with Renderer(width, _PANEL_HEIGHT) as renderer:
            below, above = (renderer.render(surfaces, camera, ground_under(points)) for surfaces in (inside, skin))
        yield Image.blend(below, above, _SKIN_OPACITY)


def _assemble(doll: InspectedDoll, colors: Floats, panels: dict[str, Image.Image]) -> Image.Image:
    legend = _legend(doll, colors)
    width = sum(panel.width + _MARGIN for panel in panels.values()) + legend.width + 2 * _MARGIN
    top = 2 * _MARGIN + _TITLE_SIZE
    height = top + max(_PANEL_HEIGHT + _LINE_HEIGHT, legend.height) + _MARGIN
    picture = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(picture)
    draw.text((_MARGIN, _MARGIN), _title(doll), fill=INK, font=font(_TITLE_SIZE))
    x = _MARGIN
    for name, panel in panels.items():
        picture.paste(panel, (x, top))
        draw.text((x + panel.width / 2, top + _PANEL_HEIGHT + 4), name, fill=INK, font=font(_TEXT_SIZE), anchor="ma")
        x += panel.width + _MARGIN
    picture.paste(legend, (x, top))
    return picture


def _title(doll: InspectedDoll) -> str:
    settings = f"settings {Path(doll.settings).name}" if doll.settings else "default settings"
    return f"{doll.name} ({doll.source_file}): {len(doll.bodies)} bodies, {doll.mass:.3g} kg, {settings}"


def _mass_text(mass: float) -> str:
    return f"{mass:.3g} kg" if mass >= 0.1 else f"{1000.0 * mass:.3g} g"


def _legend(doll: InspectedDoll, colors: Floats) -> Image.Image:
    """The bodies with their masses in columns as high as the panels, below them what the shapes mean."""
    measured = sum(len(body.section) > 0 for body in doll.bodies)
    notes = [
        "translucent: the skin of each body",
        "solid: ellipsoids with the bodies' mass and inertia",
        f"dark: sections at the joints ({measured} of {len(doll.bodies)} measured)",
    ]
    entries = [f"{body.name}  {_mass_text(body.mass)}" for body in doll.bodies]
    text_font = font(_TEXT_SIZE)
    rows = max(_PANEL_HEIGHT // _LINE_HEIGHT - len(notes) - 1, 1)
    columns = math.ceil(len(entries) / rows)
    rows = math.ceil(len(entries) / columns)  # of equal heights
    column_width = _SWATCH + 3 * _MARGIN + round(max(text_font.getlength(entry) for entry in entries))
    width = max(columns * column_width, round(max(text_font.getlength(note) for note in notes)))
    legend = Image.new("RGB", (width, _PANEL_HEIGHT + _LINE_HEIGHT), PAPER)
    draw = ImageDraw.Draw(legend)
    for index, entry in enumerate(entries):
        x, y = index // rows * column_width, index % rows * _LINE_HEIGHT
        color = tuple(int(part) for part in to_srgb(colors[index]))
        draw.rectangle((x, y + 3, x + _SWATCH, y + 3 + _SWATCH), fill=color)
        draw.text((x + _SWATCH + _MARGIN // 2, y), entry, fill=INK, font=text_font)
    y = (min(len(entries), rows) + 1) * _LINE_HEIGHT
    for note in notes:
        draw.text((0, y), note, fill=INK, font=text_font)
        y += _LINE_HEIGHT
    return legend
