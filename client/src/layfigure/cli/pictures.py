"""layfigure preview and layfigure plot: pictures, without a GPU or a display."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

from layfigure.cli.options import check_picture_name
from layfigure.cli.progress import ProgressLine

PREVIEW_EPILOG = """\
examples:
  layfigure preview take.usda -o take.png
  layfigure preview take.usda -o take.png --frames 0,48,96,144
"""
PLOT_EPILOG = """\
example:
  layfigure plot take.lcmlog -o forces.png
"""


def add_parsers(subparsers: Any) -> None:
    preview = subparsers.add_parser(
        "preview",
        help="draw frames of a take as a contact sheet",
        description="Draws some frames of a USD file's skinned character, side by side.",
        epilog=PREVIEW_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    preview.add_argument("file", metavar="IN.usd", type=Path)
    preview.add_argument("-o", "--out", metavar="OUT.png", type=Path, required=True)
    preview.add_argument("--frames", metavar="A,B,..", type=frame_list, help="time codes (default: six, evenly spread)")
    preview.set_defaults(run=run_preview)
    plot = subparsers.add_parser(
        "plot",
        help="plot pointer forces and joint torques of a take",
        description="Plots the force of each pointer, and the torque of the joints that came closest to yielding "
        "against their yield torque, over time.",
        epilog=PLOT_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    plot.add_argument("file", metavar="TAKE.lcmlog", type=Path)
    plot.add_argument("-o", "--out", metavar="OUT.png", type=Path, required=True)
    plot.set_defaults(run=run_plot)


def run_preview(options: argparse.Namespace) -> None:
    from layfigure.preview import write_contact_sheet

    check_picture_name(options.out)
    with ProgressLine() as line:

        def show(done: int, whole: int) -> None:
            line.show(f"picture {done + 1} of {whole}")

        frames = write_contact_sheet(options.file, options.out, options.frames, show)
    print(f"{options.out}: {len(frames)} frames")


def run_plot(options: argparse.Namespace) -> None:
    from layfigure.plots import write_force_plot
    from layfigure.take_collector import read_take

    check_picture_name(options.out)
    write_force_plot(read_take(options.file), options.out)
    print(options.out)


def frame_list(text: str) -> list[float]:
    try:
        frames = [float(item) for item in text.split(",")]
    except ValueError:
        frames = [math.nan]
    if not all(math.isfinite(frame) for frame in frames):
        raise argparse.ArgumentTypeError(f"'{text}' is not a list of frames, such as 0,24,48")
    return frames
