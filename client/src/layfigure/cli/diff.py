"""layfigure diff: how two takes differ."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from layfigure.cli.options import positive
from layfigure.errors import LayfigureError

if TYPE_CHECKING:
    from layfigure.differences import Differences

EPILOG = """\
examples:
  layfigure diff before.usda after.usda
  layfigure diff take.usda few_keys.usda --tolerance-mm 0.5 --tolerance-deg 0.2

Both are looked at in metres, Z up, at the same times since their starts: other units, axes, rates of frames and orders
of joints are no difference. Exit code 0: the same within the tolerances; 1: different, or they cannot be compared; 2:
usage.
"""
_WORST_JOINTS = 8  # that are listed


def add_parsers(subparsers: Any) -> None:
    parser = subparsers.add_parser(
        "diff",
        help="tell how two takes differ",
        description="Tells how the joints' rotations and the skinned vertices of two USD files differ.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("first", metavar="A.usd", type=Path)
    parser.add_argument("second", metavar="B.usd", type=Path)
    parser.add_argument("--tolerance-mm", metavar="MM", type=positive, default=0.1, help="of vertices (default 0.1)")
    parser.add_argument("--tolerance-deg", metavar="DEG", type=positive, default=0.1, help="of joints (default 0.1)")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from layfigure.differences import compare

    differences = compare(options.first, options.second)
    _print(differences, options)
    reasons = _reasons(differences, options)
    if reasons:
        raise LayfigureError(f"'{options.first}' and '{options.second}' differ: {', '.join(reasons)}")
    print("the same within the tolerances")


def _print(differences: Differences, options: argparse.Namespace) -> None:
    print(f"{differences.frames} frames compared, {differences.duration_s:.3f} s")
    for path, joints in zip((options.first, options.second), differences.only_in, strict=True):
        if joints:
            print(f"only in {path}: {', '.join(joints)}")
    angle = differences.worst_angle
    print(
        f"joints:   max {math.degrees(angle.size):.4g} deg at '{angle.name}', {angle.time_s:.3f} s; "
        f"rms {math.degrees(differences.angle_rms):.4g} deg"
    )
    if (distance := differences.worst_distance) is not None:
        print(
            f"vertices: max {1e3 * distance.size:.4g} mm of '{distance.name}', {distance.time_s:.3f} s; "
            f"rms {1e3 * differences.distance_rms:.4g} mm"
        )
    beyond = [worst for worst in differences.angles.values() if math.degrees(worst.size) > options.tolerance_deg]
    for worst in sorted(beyond, key=lambda worst: -worst.size)[:_WORST_JOINTS]:
        print(f"  {math.degrees(worst.size):9.3f} deg  {worst.name}, {worst.time_s:.3f} s")
    if len(beyond) > _WORST_JOINTS:
        print(f"  and {len(beyond) - _WORST_JOINTS} more joints")


def _reasons(differences: Differences, options: argparse.Namespace) -> list[str]:
    reasons = []
    if math.degrees(differences.worst_angle.size) > options.tolerance_deg:
        reasons.append(f"joints by up to {math.degrees(differences.worst_angle.size):.4g} deg")
    distance = differences.worst_distance
    if distance is not None and 1e3 * distance.size > options.tolerance_mm:
        reasons.append(f"vertices by up to {1e3 * distance.size:.4g} mm")
    if any(differences.only_in):
        reasons.append("joints that only one has")
    a, b = differences.durations_s
    if not math.isclose(a, b, abs_tol=1e-6):
        reasons.append(f"they last {a:.3f} s and {b:.3f} s")
    return reasons
