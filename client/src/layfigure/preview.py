"""Pictures of any UsdSkel file: contact sheets and animated GIFs, with the forces and the flow that a take tells of."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

from layfigure.errors import LayfigureError, UsageError
from layfigure.protocol import Floats
from layfigure.render.camera import Camera, View, frame_points, picture_aspect
from layfigure.render.picture_file import write_gif, write_png
from layfigure.render.scene import Ground, Renderer, Surface, ground_under, to_srgb
from layfigure.render.shapes import arrow, ball
from layfigure.render.sheet import LegendEntry, assemble, with_caption
from layfigure.skin_painter import FLOW_COLOR, SkinPainter
from layfigure.usd.felt import Pull
from layfigure.usd.reader import SkinnedStage

DEFAULT_FRAMES = 6
MAX_FRAMES = 60  # of a sheet
MAX_GIF_FRAMES = 1500  # their pictures are in memory: about 0.5 MB each
DEFAULT_GIF_FPS = 12.5
MAX_GIF_FPS = 50.0  # GIF counts hundredths of a second, and viewers slow down what lasts for less than two
_PANEL_PIXELS = 220_000
_GIF_PIXELS = 120_000
# linear RGB
_POINTER_COLORS = np.array([[0.0, 0.165, 0.45], [0.0, 0.34, 0.17], [0.35, 0.05, 0.30], [0.02, 0.02, 0.02]])
_LONGEST_ARROW = 0.45  # of the scene's radius, as the next two
_ARROW_RADIUS = 0.012
_POINTER_RADIUS = 0.025
# to a cube's corners and the middles of its edges and faces: the farthest points stand for all when they are framed
_DIRECTIONS = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])

Progress = Callable[[int, int], None]  # pictures done, pictures in all
Size = tuple[int, int]  # width and height of one picture [pixels]


def write_contact_sheet(
    take: Path,
    out: Path,
    frames: list[float] | None = None,
    size: Size | None = None,
    progress: Progress = lambda done, whole: None,
) -> list[float]:
    """Draws `frames` (time codes), or six evenly spread ones, into a PNG; returns the frames drawn."""
    stage = SkinnedStage(take)
    chosen = frames if frames is not None else _spread(stage)
    _check_frames(chosen, stage, MAX_FRAMES)
    layout = _lay_out(stage, chosen, size, _PANEL_PIXELS)
    panels = list(_render(stage, chosen, layout, progress))
    captions = [f"{_seconds(stage, frame):.2f} s   (frame {frame:g})" for frame in chosen]
    write_png(assemble(panels, captions, _legend(layout)), out)
    return chosen


def write_animated_gif(
    take: Path,
    out: Path,
    frames: list[float] | None = None,
    size: Size | None = None,
    fps: float = DEFAULT_GIF_FPS,
    progress: Progress = lambda done, whole: None,
) -> list[float]:
    """A GIF of `fps` pictures a second: of `frames` one after the other, or of the whole take as fast as it was."""
    if fps > MAX_GIF_FPS:
        raise UsageError(f"--fps {fps:g} is too fast for a GIF: at most {MAX_GIF_FPS:g}")
    stage = SkinnedStage(take)
    chosen = frames if frames is not None else _in_real_time(stage, fps)
    _check_frames(chosen, stage, MAX_GIF_FRAMES)
    layout = _lay_out(stage, chosen, size, _GIF_PIXELS)
    pictures = [
        with_caption(picture, f"{_seconds(stage, frame):.2f} s")
        for picture, frame in zip(_render(stage, chosen, layout, progress), chosen, strict=True)
    ]
    ends = [round(100.0 * number / fps) for number in range(len(chosen) + 1)]  # hundredths: no error adds up
    write_gif(pictures, [10 * (end - start) for start, end in itertools.pairwise(ends)], out)
    return chosen


def _seconds(stage: SkinnedStage, frame: float) -> float:
    return (frame - stage.first_frame) / stage.fps


def _spread(stage: SkinnedStage) -> list[float]:
    count = min(DEFAULT_FRAMES, max(int(stage.last_frame - stage.first_frame), 0) + 1)
    return [float(round(frame)) for frame in np.linspace(stage.first_frame, stage.last_frame, count)]


def _in_real_time(stage: SkinnedStage, fps: float) -> list[float]:
    step = stage.fps / fps
    count = max(math.floor((stage.last_frame - stage.first_frame) / step + 1e-9), 0) + 1
    return [stage.first_frame + number * step for number in range(min(count, MAX_GIF_FRAMES + 1))]


def _check_frames(frames: list[float], stage: SkinnedStage, most: int) -> None:
    if len(frames) > most:
        raise UsageError(
            f"the frames are {len(frames)}, at most {most} fit in one picture: choose fewer with --frames or --fps"
        )
    for frame in frames:
        if not stage.first_frame <= frame <= stage.last_frame:
            raise UsageError(f"frame {frame:g} is outside the take: {stage.first_frame:g} to {stage.last_frame:g}")


@dataclass(frozen=True, eq=False)
class _Layout:
    """One camera, one ground and one scale of forces for all frames, so that they can be compared."""

    size: Size
    camera: Camera
    ground: Ground
    largest_force: float  # [N] 0: none
    pointers: tuple[int, ...]
    flows: bool


def _lay_out(stage: SkinnedStage, frames: list[float], size: Size | None, pixels: int) -> _Layout:
    outermost, pulls, flows = [], [], False
    for frame in frames:
        meshes = stage.posed(frame)
        points = np.concatenate([mesh.points for mesh in meshes])
        if not np.isfinite(points).all():
            raise LayfigureError("the skinned mesh has points that are not finite: run 'layfigure check'")
        outermost.append(points[np.unique(np.argmax(points @ _DIRECTIONS.T, axis=0))])
        pulls.append(stage.pulls(frame))
        flows = flows or any(mesh.flowing.any() for mesh in meshes)
    ground = ground_under(np.concatenate(outermost))
    all_pulls = [pull for of_frame in pulls for pull in of_frame]
    largest = max((float(np.linalg.norm(pull.force)) for pull in all_pulls), default=0.0)
    tips = [pull.point + _arrow_vector(pull, largest, ground.radius) for pull in all_pulls]
    framed = np.concatenate([*outermost, np.array(tips).reshape(-1, 3)])
    view = View()
    if size is None:
        aspect = picture_aspect(framed, view, least=0.55, most=1.8)
        size = (round(math.sqrt(pixels * aspect)), round(math.sqrt(pixels / aspect)))
    camera = frame_points(framed, size[0] / size[1], view)
    pointers = tuple(sorted({pull.pointer for pull in all_pulls}))
    return _Layout(size, camera, ground, largest, pointers, flows)


def _render(stage: SkinnedStage, frames: list[float], layout: _Layout, progress: Progress) -> Iterator[Image.Image]:
    skin = SkinPainter()
    with Renderer(*layout.size) as renderer:
        for done, frame in enumerate(frames):
            progress(done, len(frames))
            surfaces = [surface for mesh in stage.posed(frame) for surface in skin.surfaces(mesh)]
            for pull in stage.pulls(frame):
                surfaces += _hand(pull, layout)
            yield renderer.render(surfaces, layout.camera, layout.ground)


def _hand(pull: Pull, layout: _Layout) -> list[Surface]:
    color, radius = _pointer_color(pull.pointer), layout.ground.radius
    vector = _arrow_vector(pull, layout.largest_force, radius)
    shapes = [ball(pull.point, _POINTER_RADIUS * radius, color)]
    if np.any(vector != 0.0):
        shapes.append(arrow(pull.point, vector, _ARROW_RADIUS * radius, color))
    return shapes


def _arrow_vector(pull: Pull, largest_force: float, radius: float) -> Floats:
    return pull.force * (_LONGEST_ARROW * radius / largest_force) if largest_force > 0.0 else np.zeros(3)


def _pointer_color(pointer: int) -> Floats:
    return np.asarray(_POINTER_COLORS[pointer % len(_POINTER_COLORS)])


def _legend(layout: _Layout) -> list[LegendEntry]:
    entries = []
    for pointer in layout.pointers:
        text = f"hand {pointer} and its force"
        if pointer == layout.pointers[-1] and layout.largest_force > 0.0:
            text += f" (longest arrow: {layout.largest_force:.3g} N)"
        entries.append(LegendEntry(_byte_color(_pointer_color(pointer)), text))
    if layout.flows:
        entries.append(LegendEntry(_byte_color(FLOW_COLOR), "what the joint that yields moves"))
    return entries


def _byte_color(linear: Floats) -> tuple[int, int, int]:
    red, green, blue = (int(part) for part in to_srgb(linear))
    return red, green, blue
