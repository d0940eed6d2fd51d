"""layfigure check: is the USD right?"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from layfigure.errors import LayfigureError

EPILOG = """\
examples:
  layfigure check take.usda
  layfigure check character.usdz               a file of another tool
  layfigure check take.usda && publish take.usda

Errors are broken rules: of USD, by its own validators, and of skeletons: array lengths, types, parents, unit
quaternions, invertible transforms, joint and vertex indices, weights, blend shapes, texture coordinates and normals,
files that are missing, the time range. Warnings are what USD allows but importers stumble over, such as bones that
change their lengths or normals that are not of unit length; in a take of Layfigure's own they are errors.
Exit code 0: no errors; 1: errors, or not readable; 2: usage.
"""
_MAX_LINES = 50


def add_parsers(subparsers: Any) -> None:
    parser = subparsers.add_parser(
        "check",
        help="validate a USD file",
        description="Checks a USD file of any tool with USD's own validators and for what they miss of skeletons. "
        "Prints what it finds, one line each, errors first.",
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
    errors = report.error_count
    warnings = f", {_plural(count - errors, 'warning')}" if count > errors else ""
    if errors:
        raise LayfigureError(f"'{options.file}' has {_plural(errors, 'error')}{warnings}")
    print(
        f"{options.file}: good ({report.validators} USD validators, own checks of "
        f"{_plural(report.skeletons, 'skeleton')}, {report.frames} frames{warnings})"
    )


def _plural(count: int, noun: str) -> str:
    return f"{count} {noun}{'' if count == 1 else 's'}"
