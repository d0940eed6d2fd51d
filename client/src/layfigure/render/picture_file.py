"""What pictures have in common: their font and how they come into a file."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from PIL import Image, ImageFont

from layfigure.errors import LayfigureError

INK = (45, 48, 52)
PAPER = (255, 255, 255)
_PALETTE_SAMPLES = 8  # pictures of an animation that its palette is made of


def font(size: int) -> ImageFont.FreeTypeFont:
    """The one that comes with matplotlib, so that pictures do not depend on the machine."""
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), size)


def write_png(picture: Image.Image, out: Path) -> None:
    _write_whole(picture, out, format="PNG")


def write_gif(pictures: list[Image.Image], durations_ms: Iterable[int], out: Path) -> None:
    """Repeats for ever. One palette for all pictures: nothing flickers, and what stands still costs no bytes."""
    palette = _common_palette(pictures)
    first, *others = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures)
    _write_whole(
        first, out, format="GIF", save_all=True, append_images=others, duration=list(durations_ms), loop=0, disposal=1
    )


def _common_palette(pictures: list[Image.Image]) -> Image.Image:
    """Most colours for what covers the pictures, whose shades are then even, some for what is small and bright."""
    chosen = np.linspace(0, len(pictures) - 1, min(_PALETTE_SAMPLES, len(pictures))).astype(int)
    stack = Image.fromarray(np.concatenate([np.asarray(pictures[index]) for index in chosen]))
    colors: list[int] = []
    for count, method in ((192, Image.Quantize.MEDIANCUT), (64, Image.Quantize.MAXCOVERAGE)):
        colors += (stack.quantize(count, method).getpalette() or [])[: 3 * count]
    palette = Image.new("P", (1, 1))
    palette.putpalette(colors)
    return palette


def _write_whole(picture: Image.Image, out: Path, **options: Any) -> None:
    """Under another name first: a picture is whole or not there."""
    partial = out.with_name(f".{out.name}.partial")
    try:
        picture.save(partial, **options)
        partial.replace(out)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise LayfigureError(f"cannot write '{out}': {error.strerror}") from error
