"""Contact sheets: some frames of a take, side by side, each under its time."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from layfigure.errors import LayfigureError, UsageError
from layfigure.protocol import Floats
from layfigure.render.camera import Camera, View, frame_points, picture_aspect
from layfigure.render.picture_file import INK, PAPER, font, write_png
from layfigure.render.scene import Scene, Surface, to_srgb
from layfigure.usd.reader import SkinnedStage

DEFAULT_FRAMES = 6
MAX_FRAMES = 60
_PANEL_PIXELS = 220_000
_SHEET_ASPECT = 1.4  # width over height that a sheet comes close to
_SAMPLES = 12  # rays per pixel
_GAP = 8  # pixels
_CAPTION_HEIGHT = 38
_FONT_SIZE = 21


Progress = Callable[[int, int], None]  # pictures done, pictures in all


def write_contact_sheet(
    take: Path, out: Path, frames: list[float] | None = None, progress: Progress = lambda done, whole: None
) -> list[float]:
    """Draws `frames` (time codes), or six evenly spread ones, into a PNG; returns the frames drawn."""
    stage = SkinnedStage(take)
    chosen = frames if frames is not None else _spread(stage)
    _check_frames(chosen, stage)
    posed = [[Surface(mesh.points, mesh.triangles, mesh.color) for mesh in stage.posed(frame)] for frame in chosen]
    panels = list(_render(posed, progress))
    captions = [f"{(frame - stage.first_frame) / stage.fps:.2f} s   (frame {frame:g})" for frame in chosen]
    write_png(_assemble(panels, captions), out)
    return chosen


def _spread(stage: SkinnedStage) -> list[float]:
    count = min(DEFAULT_FRAMES, int(stage.last_frame - stage.first_frame) + 1)
    return [float(round(frame)) for frame in np.linspace(stage.first_frame, stage.last_frame, count)]


def _check_frames(frames: list[float], stage: SkinnedStage) -> None:
    if len(frames) > MAX_FRAMES:
        raise UsageError(f"--frames lists {len(frames)}, at most {MAX_FRAMES} fit on a sheet")
    for frame in frames:
        if not stage.first_frame <= frame <= stage.last_frame:
            raise UsageError(f"frame {frame:g} is outside the take: {stage.first_frame:g} to {stage.last_frame:g}")


def _render(posed: list[list[Surface]], progress: Progress) -> Iterator[Image.Image]:
    """One camera and one floor for all frames, so that they can be compared."""
    points = np.concatenate([surface.points for surfaces in posed for surface in surfaces])
    if not np.isfinite(points).all():
        raise LayfigureError("the skinned mesh has points that are not finite: run 'layfigure check'")
    view = View()
    aspect = picture_aspect(points, view, least=0.55, most=1.8)
    width, height = round(math.sqrt(_PANEL_PIXELS * aspect)), round(math.sqrt(_PANEL_PIXELS / aspect))
    camera = frame_points(points, width / height, view)
    for done, surfaces in enumerate(posed):
        progress(done, len(posed))
        yield Image.fromarray(to_srgb(_picture(surfaces, points, camera, width, height)))


def _picture(surfaces: list[Surface], points: Floats, camera: Camera, width: int, height: int) -> Floats:
    low, high = points.min(axis=0), points.max(axis=0)
    radius = max(float(np.linalg.norm(high - low)) / 2.0, 1e-6)
    scene = Scene(surfaces, floor=float(low[2]), centre=(low + high) / 2.0, radius=radius)
    return scene.render(camera, width, height, _SAMPLES)


def _assemble(panels: list[Image.Image], captions: list[str]) -> Image.Image:
    width, height = panels[0].size
    cell_width, cell_height = width + _GAP, height + _CAPTION_HEIGHT + _GAP
    columns = _column_count(len(panels), cell_width / cell_height)
    rows = math.ceil(len(panels) / columns)
    sheet = Image.new("RGB", (columns * cell_width + _GAP, rows * cell_height + _GAP), PAPER)
    draw = ImageDraw.Draw(sheet)
    caption_font = font(_FONT_SIZE)
    for index, (panel, caption) in enumerate(zip(panels, captions, strict=True)):
        x, y = _GAP + index % columns * cell_width, _GAP + index // columns * cell_height
        sheet.paste(panel, (x, y))
        middle = (x + width / 2, y + height + _CAPTION_HEIGHT / 2)
        draw.text(middle, caption, fill=INK, font=caption_font, anchor="mm")
    return sheet


def _column_count(panels: int, panel_aspect: float) -> int:
    """For a sheet of a pleasant shape without many empty places."""

    def badness(columns: int) -> float:
        rows = math.ceil(panels / columns)
        empty = columns * rows - panels
        return abs(math.log(columns * panel_aspect / rows / _SHEET_ASPECT)) + 0.5 * empty

    return min(range(1, panels + 1), key=badness)
