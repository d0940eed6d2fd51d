"""layfigure convert: takes for tools that read no USD."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from layfigure.cli.options import positive
from layfigure.errors import UsageError

DESCRIPTION = """\
Writes a USD file's skeletons, at every frame, for tools that read no USD, in metres and Y up:
  .glb, .gltf              glTF 2.0 with skins, weights, materials, textures and one animation
  .bvh                     BVH with the joints alone, of one skeleton; its zero pose is the rest pose
or a take as a single USD file in other units, or with another axis up:
  .usd, .usda, .usdc, .usdz
"""
EPILOG = """\
examples:
  layfigure convert take.usda take.glb
  layfigure convert take.usda take.bvh
  layfigure convert take.usda for_maya.usdc --up-axis Y --meters-per-unit 0.01
"""
USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
SUFFIXES = (".glb", ".gltf", ".bvh", *USD_SUFFIXES)


def add_parsers(subparsers: Any) -> None:
    parser = subparsers.add_parser(
        "convert",
        help="write a take as glTF, BVH, or USD in other units",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", metavar="TAKE.usd", type=Path)
    parser.add_argument("out", metavar="OUT.glb|.gltf|.bvh|.usd", type=Path)
    parser.add_argument("--up-axis", choices=("Y", "Z"), help="of a USD file (default: as it is)")
    parser.add_argument(
        "--meters-per-unit", metavar="M", type=positive, help="of a USD file, such as 0.01 (default: as it is)"
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    if options.out.suffix not in SUFFIXES:
        raise UsageError(f"'{options.out}': the name of the result ends in {', '.join(SUFFIXES)}")
    if not options.out.parent.is_dir():
        raise UsageError(f"'{options.out}': there is no folder '{options.out.parent}'; make it first")
    if options.out.suffix in USD_SUFFIXES:
        _write_usd(options)
    elif options.up_axis is not None or options.meters_per_unit is not None:
        raise UsageError(f"'{options.out}' is in metres and Y up: --up-axis and --meters-per-unit are for USD")
    else:
        _export(options)


def _write_usd(options: argparse.Namespace) -> None:
    from layfigure.usd.units import write_in_units
    from layfigure.usd.writer import check_output

    check_output(options.out)
    write_in_units(options.file, options.out, options.up_axis, options.meters_per_unit)
    print(options.out)


def _export(options: argparse.Namespace) -> None:
    from layfigure.export.bvh import write_bvh
    from layfigure.export.clip import read_clip
    from layfigure.export.gltf import write_gltf

    clip = read_clip(options.file)
    (write_bvh if options.out.suffix == ".bvh" else write_gltf)(clip, options.out)
    joints = sum(len(skeleton.names) for skeleton in clip.skeletons)
    print(f"{options.out}: {clip.frames} frames at {clip.fps:g} fps, {joints} joints")
