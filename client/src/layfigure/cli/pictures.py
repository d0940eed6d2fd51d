"""layfigure preview and layfigure plot: pictures, without a GPU or a display."""

from __future__ import annotations

import argparse
import math
import re
from pathlib import Path
from typing import Any

from layfigure.cli.options import check_picture_name, positive
from layfigure.cli.progress import ProgressLine
from layfigure.errors import UsageError
from layfigure.loads import Loads, loads_of_take

PREVIEW_EPILOG = """\
examples:
  layfigure preview take.usda -o take.png
  layfigure preview take.usda -o take.png --frames 0,48,96:144:12 --size 400x600
  layfigure preview take.usda -o take.gif
"""
PLOT_EPILOG = """\
examples:
  layfigure plot take.lcmlog -o forces.png
  layfigure plot take.usda -o arm.png --joints 'Left*Arm' --joints Spine2
"""
USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
MIN_SIZE, MAX_SIZE = 16, 4096  # pixels
_MOST_FRAMES = 100_000  # of a range: more would only fill the memory


def add_parsers(subparsers: Any) -> None:
    preview = subparsers.add_parser(
        "preview",
        help="draw frames of a take as a contact sheet or an animated GIF",
        description="Draws the skinned characters of any USD file, without a GPU or a display: some frames side by "
        "side as a PNG, or an animated GIF. A take's hands, their forces and the joints that yield are shown.",
        epilog=PREVIEW_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    preview.add_argument("file", metavar="IN.usd", type=Path)
    preview.add_argument("-o", "--out", metavar="OUT.png|.gif", type=Path, required=True)
    preview.add_argument(
        "--frames",
        metavar="A,B:C,D:E:STEP,..",
        type=frame_list,
        help="time codes and ranges of them, both ends included (default: six, evenly spread; a GIF: the whole take)",
    )
    preview.add_argument("--size", metavar="WxH", type=picture_size, help="of one picture in pixels")
    preview.add_argument("--fps", type=positive, help="pictures per second of a GIF (default 12.5)")
    preview.set_defaults(run=run_preview)
    plot = subparsers.add_parser(
        "plot",
        help="plot pointer forces and joint torques of a take",
        description="Plots the force of each hand, and the torque of joints against their yield torque, over time: "
        "from an event log, or from a take's USD if that keeps the torques.",
        epilog=PLOT_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    plot.add_argument("file", metavar="TAKE.lcmlog|TAKE.usd", type=Path)
    plot.add_argument("-o", "--out", metavar="OUT.png", type=Path, required=True)
    plot.add_argument(
        "--joints",
        metavar="PATTERN",
        action="append",
        default=[],
        help="a name, or a pattern with * and ?; may be repeated (default: the six that came closest to yielding)",
    )
    plot.set_defaults(run=run_plot)


def run_preview(options: argparse.Namespace) -> None:
    from layfigure import preview

    check_picture_name(options.out, ".png", ".gif")
    if options.fps is not None and options.out.suffix != ".gif":
        raise UsageError("--fps is for GIFs: name the picture OUT.gif")
    with ProgressLine() as line:

        def show(done: int, whole: int) -> None:
            line.show(f"picture {done + 1} of {whole}")

        if options.out.suffix == ".gif":
            fps = options.fps if options.fps is not None else preview.DEFAULT_GIF_FPS
            frames = preview.write_animated_gif(options.file, options.out, options.frames, options.size, fps, show)
        else:
            frames = preview.write_contact_sheet(options.file, options.out, options.frames, options.size, show)
    print(f"{options.out}: {len(frames)} frames")


def run_plot(options: argparse.Namespace) -> None:
    from layfigure.plots import write_force_plot

    check_picture_name(options.out, ".png")
    joints = write_force_plot(_read_loads(options.file), options.out, options.joints)
    print(f"{options.out}: {len(joints)} joints")


def _read_loads(file: Path) -> Loads:
    if file.suffix in USD_SUFFIXES:
        from layfigure.usd.loads_reader import loads_of_usd

        return loads_of_usd(file)
    from layfigure.take_collector import read_take

    return loads_of_take(read_take(file))


def frame_list(text: str) -> list[float]:
    """Time codes "A", ranges "A:B" and "A:B:STEP", separated by commas."""
    frames: list[float] = []
    for item in text.split(","):
        try:
            first, last, step = _frame_range([float(part) for part in item.split(":")])
        except ValueError:
            raise argparse.ArgumentTypeError(f"'{text}' is not a list of frames, such as 0,24,48 or 0:96:8") from None
        frames += [first + number * step for number in range(math.floor((last - first) / step + 1e-9) + 1)]
    return frames


def _frame_range(parts: list[float]) -> tuple[float, float, float]:
    """First, last and step. Raises ValueError if it is none."""
    if len(parts) > 3 or not all(math.isfinite(part) for part in parts):
        raise ValueError
    first, last, step = parts[0], parts[min(1, len(parts) - 1)], parts[2] if len(parts) == 3 else 1.0
    if last < first or step <= 0.0 or (last - first) / step > _MOST_FRAMES:
        raise ValueError
    return first, last, step


def picture_size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    size = (int(match[1]), int(match[2])) if match else (0, 0)
    if not all(MIN_SIZE <= side <= MAX_SIZE for side in size):
        raise argparse.ArgumentTypeError(f"'{text}' is not a size of {MIN_SIZE} to {MAX_SIZE} pixels, such as 480x640")
    return size
