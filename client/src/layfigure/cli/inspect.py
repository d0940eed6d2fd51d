"""layfigure inspect: a picture of the doll that would be built of a character."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from layfigure.cli.options import check_picture_name
from layfigure.cli.progress import ProgressLine

EPILOG = """\
examples:
  layfigure inspect doll.glb -o doll.png
  layfigure inspect doll.glb -o soft.png --doll soft.toml --server-program build/release/server/app/layfigure-server

'layfigure-server --inspect doll.glb' tells the same as a table.
"""


def add_parsers(subparsers: Any) -> None:
    parser = subparsers.add_parser(
        "inspect",
        help="draw the doll that a character becomes",
        description="Draws the doll that layfigure-server builds of a character, from the front and from the side: "
        "its bodies, their ellipsoids of inertia and the sections at its joints. No server needs to be running.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("character", metavar="CHARACTER", type=Path)
    parser.add_argument("-o", "--out", metavar="OUT.png", type=Path, required=True)
    parser.add_argument("--doll", metavar="SETTINGS.toml", type=Path, help="as of layfigure-server")
    parser.add_argument(
        "--server-program", metavar="PROGRAM", type=Path, help="layfigure-server (default: the one in PATH)"
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from layfigure.doll_picture import write_doll_picture
    from layfigure.inspection import find_server, inspect_character

    check_picture_name(options.out, ".png")
    doll, remarks = inspect_character(find_server(options.server_program), options.character, options.doll)
    print(remarks, end="", file=sys.stderr)
    with ProgressLine() as line:

        def show(done: int, whole: int) -> None:
            line.show(f"picture {done + 1} of {whole}")

        write_doll_picture(doll, options.out, show)
    print(f"{options.out}: {len(doll.bodies)} bodies, {doll.mass:.3g} kg")
