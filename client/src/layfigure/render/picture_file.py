"""What pictures have in common: their font and how they come into a file."""

from __future__ import annotations

from pathlib import Path

import matplotlib
from PIL import Image, ImageFont

from layfigure.errors import LayfigureError

INK = (45, 48, 52)
PAPER = (255, 255, 255)


def font(size: int) -> ImageFont.FreeTypeFont:
    """The one that comes with matplotlib, so that pictures do not depend on the machine."""
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"), size)


def write_png(picture: Image.Image, out: Path) -> None:
    """Under another name first: a picture is whole or not there."""
    partial = out.with_name(f".{out.name}.partial")
    try:
        picture.save(partial, format="PNG")
        partial.replace(out)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise LayfigureError(f"cannot write '{out}': {error.strerror}") from error
