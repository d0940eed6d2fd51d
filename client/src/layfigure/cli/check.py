"""layfigure check: is the USD right?"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from layfigure.errors import LayfigureError

EPILOG = """\
example:
  layfigure check take.usda
"""
_MAX_LINES = 50


def add_parsers(subparsers: Any) -> None:
    parser = subparsers.add_parser(
        "check",
        help="validate a USD file",
        description="Checks a USD file with USD's own validators and for what they miss of skeletons. "
        "Prints what it finds, one line each; exit code 1 if there is anything.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", metavar="IN.usd", type=Path)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from layfigure.usd.checks import check

    report = check(options.file)
    for finding in report.findings[:_MAX_LINES]:
        print(finding)
    count = len(report.findings)
    if count > _MAX_LINES:
        print(f"... and {count - _MAX_LINES} more")
    if count:
        raise LayfigureError(f"'{options.file}' has {count} finding{'s' if count > 1 else ''}")
    print(
        f"{options.file}: good ({report.validators} USD validators, own checks of {report.skeletons} skeleton"
        f"{'s' if report.skeletons > 1 else ''}, {report.frames} frames)"
    )
