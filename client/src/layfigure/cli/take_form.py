"""The options that say what is made of a take."""

from __future__ import annotations

import argparse
import math
from fractions import Fraction
from typing import get_args

from layfigure.cli.options import positive
from layfigure.errors import UsageError
from layfigure.take_form import DEFAULT_TOLERANCE_M, Keys, Layout, TakeForm, UpAxis

_DEFAULT_FPS = 24.0
_DEFAULT_TOLERANCE_MM = DEFAULT_TOLERANCE_M * 1e3
_MAX_RATE = 10_000  # above every rate of poses: it is a slip, which would fill the memory
_NTSC_BASES = (24, 30, 48, 60, 120)  # of these, 1000/1001 are in use: 23.976, 29.97, ...
_NTSC_ROUNDING = 5e-3  # how far off their usual names are: 23.98


def add_take_form_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--fps",
        metavar="RATE",
        type=frame_rate,
        default=_DEFAULT_FPS,
        help="frames per second (default 24), whatever the server's rate of poses; 23.976, 29.97 and the like are the "
        "exact 24000/1001, 30000/1001",
    )
    parser.add_argument(
        "--keys",
        choices=get_args(Keys),
        default="every",
        help="every frame (default), those where 'layfigure key' was sent, or the fewest that hold the tolerance",
    )
    parser.add_argument(
        "--tolerance-mm",
        metavar="MM",
        type=positive,
        help="with --keys reduced: how far any vertex may be from where it was recorded, in any frame "
        f"(default {_DEFAULT_TOLERANCE_MM:g})",
    )
    parser.add_argument(
        "--layout",
        choices=get_args(Layout),
        default="layered",
        help="a small layer over two others (default), or all in a single file",
    )
    parser.add_argument(
        "--joints",
        metavar="PATTERN",
        action="append",
        default=[],
        help="only these joints move, the others stay at rest: a name, or a pattern with * and ?; may be repeated",
    )
    parser.add_argument(
        "--custom-data",
        action="store_true",
        help="also write torques, rest rotations, yielded joints and the pointers' forces, in every frame",
    )
    parser.add_argument("--up-axis", choices=get_args(UpAxis), default="Z", help="of the USD (default Z)")
    parser.add_argument(
        "--meters-per-unit",
        metavar="M",
        type=positive,
        default=1.0,
        help="the USD's unit of length, such as 0.01 for centimetres (default 1)",
    )
    parser.add_argument(
        "--duration",
        metavar="S",
        type=positive,
        default=math.inf,
        help="end after so much simulation time; time without a server counts by the wall clock",
    )


def take_form(options: argparse.Namespace) -> TakeForm:
    """Raises UsageError if options contradict each other."""
    if options.tolerance_mm is not None and options.keys != "reduced":
        raise UsageError("--tolerance-mm is for --keys reduced: add that, or leave it out")
    tolerance_mm = _DEFAULT_TOLERANCE_MM if options.tolerance_mm is None else options.tolerance_mm
    return TakeForm(
        keys=options.keys,
        tolerance_m=tolerance_mm * 1e-3,
        layout=options.layout,
        joints=tuple(options.joints),
        custom_data=options.custom_data,
        up_axis=options.up_axis,
        meters_per_unit=options.meters_per_unit,
    )


def frame_rate(text: str) -> float:
    """A number, or a fraction such as 24000/1001."""
    try:
        rate = Fraction(text)
    except (ValueError, ZeroDivisionError):
        rate = Fraction(0)
    if not 0 < rate <= _MAX_RATE:
        raise argparse.ArgumentTypeError(
            f"'{text}' is not a number greater than 0, up to {_MAX_RATE}, or a fraction like 24000/1001"
        )
    for base in _NTSC_BASES:
        exact = Fraction(base * 1000, 1001)
        if abs(rate - exact) <= _NTSC_ROUNDING:
            return float(exact)
    return float(rate)
