"""layfigure play: scripted hands."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from layfigure import session_file
from layfigure.cli.options import add_bus_options, open_bus
from layfigure.cli.progress import ProgressLine
from layfigure.cli.stopping import StopFlag
from layfigure.errors import LayfigureError
from layfigure.player import Player

EPILOG = """\
examples:
  layfigure play assets/sessions/demo.toml
  layfigure play assets/sessions/touch.toml
  layfigure play session.toml --lcm-url tcpq://127.0.0.1:7700
"""


def add_parsers(subparsers: Any) -> None:
    parser = subparsers.add_parser(
        "play",
        help="play a session of scripted hands",
        description=session_file.__doc__,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("session", metavar="SESSION.toml", type=Path)
    add_bus_options(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    session = session_file.load_session(options.session)
    with open_bus(options) as bus, StopFlag() as stop, ProgressLine() as progress:
        played_s = Player(bus, session).play(stop, progress.show_part)
    if stop.raised:
        raise LayfigureError(f"interrupted after {played_s:.2f} s of '{options.session}'; the hands have let go")
    print(f"{options.session}: played {played_s:.2f} s")
