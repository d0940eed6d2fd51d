"""Pictures side by side on a sheet, each with a caption, and a legend below."""

from __future__ import annotations

import math
from dataclasses import dataclass

from PIL import Image, ImageDraw

from layfigure.render.picture_file import INK, PAPER, font

_SHEET_ASPECT = 1.4  # width over height that a sheet comes close to
_GAP = 8  # pixels
_CAPTION_HEIGHT = 38
_FONT_SIZE = 21
_LEGEND_FONT_SIZE = 18
_SWATCH = 16


@dataclass(frozen=True)
class LegendEntry:
    color: tuple[int, int, int]
    text: str


def assemble(panels: list[Image.Image], captions: list[str], legend: list[LegendEntry]) -> Image.Image:
    """Panels of one size, in rows."""
    width, height = panels[0].size
    cell_width, cell_height = width + _GAP, height + _CAPTION_HEIGHT + _GAP
    columns = _column_count(len(panels), cell_width / cell_height)
    rows = math.ceil(len(panels) / columns)
    sheet_width = max(columns * cell_width, _legend_width(legend)) + _GAP
    sheet = Image.new("RGB", (sheet_width, rows * cell_height + _GAP + _CAPTION_HEIGHT * bool(legend)), PAPER)
    for index, (panel, caption) in enumerate(zip(panels, captions, strict=True)):
        x, y = _GAP + index % columns * cell_width, _GAP + index // columns * cell_height
        sheet.paste(panel, (x, y))
        _caption(sheet, caption, x + width / 2, y + height)
    _draw_legend(sheet, legend, rows * cell_height + _GAP)
    return sheet


def with_caption(picture: Image.Image, caption: str) -> Image.Image:
    taller = Image.new("RGB", (picture.width, picture.height + _CAPTION_HEIGHT), PAPER)
    taller.paste(picture, (0, 0))
    _caption(taller, caption, picture.width / 2, picture.height)
    return taller


def _caption(sheet: Image.Image, text: str, x: float, top: float) -> None:
    draw = ImageDraw.Draw(sheet)
    draw.text((x, top + _CAPTION_HEIGHT / 2), text, fill=INK, font=font(_FONT_SIZE), anchor="mm")


def _legend_width(legend: list[LegendEntry]) -> int:
    letters = font(_LEGEND_FONT_SIZE)
    return round(sum(_SWATCH + 4 * _GAP + letters.getlength(entry.text) for entry in legend))


def _draw_legend(sheet: Image.Image, legend: list[LegendEntry], top: int) -> None:
    draw = ImageDraw.Draw(sheet)
    letters = font(_LEGEND_FONT_SIZE)
    x, middle = float(2 * _GAP), top + _CAPTION_HEIGHT // 2
    for entry in legend:
        draw.rectangle((x, middle - _SWATCH / 2, x + _SWATCH, middle + _SWATCH / 2), fill=entry.color)
        draw.text((x + _SWATCH + _GAP, middle), entry.text, fill=INK, font=letters, anchor="lm")
        x += _SWATCH + 4 * _GAP + letters.getlength(entry.text)


def _column_count(panels: int, panel_aspect: float) -> int:
    """For a sheet of a pleasant shape without many empty places."""

    def badness(columns: int) -> float:
        rows = math.ceil(panels / columns)
        empty = columns * rows - panels
        return abs(math.log(columns * panel_aspect / rows / _SHEET_ASPECT)) + 0.5 * empty

    return min(range(1, panels + 1), key=badness)
