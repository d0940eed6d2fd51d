"""layfigure convert: takes for tools that read no USD."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from layfigure.errors import UsageError

DESCRIPTION = """\
Writes a USD file's skeletons, at every frame, for tools that read no USD, in metres and Y up:
  .glb, .gltf    glTF 2.0 with skins, weights, colours and one animation
  .bvh           BVH with the joints alone, of one skeleton; its zero pose is the rest pose
"""
EPILOG = """\
examples:
  layfigure convert take.usda take.glb
  layfigure convert take.usda take.bvh
"""
SUFFIXES = (".glb", ".gltf", ".bvh")


def add_parsers(subparsers: Any) -> None:
    parser = subparsers.add_parser(
        "convert",
        help="write a take as glTF or BVH",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", metavar="TAKE.usd", type=Path)
    parser.add_argument("out", metavar="OUT.glb|.gltf|.bvh", type=Path)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    if options.out.suffix not in SUFFIXES:
        raise UsageError(f"'{options.out}': the name of the result ends in {', '.join(SUFFIXES)}")
    if not options.out.parent.is_dir():
        raise UsageError(f"'{options.out}': there is no folder '{options.out.parent}'; make it first")
    from layfigure.export.bvh import write_bvh
    from layfigure.export.clip import read_clip
    from layfigure.export.gltf import write_gltf

    clip = read_clip(options.file)
    (write_bvh if options.out.suffix == ".bvh" else write_gltf)(clip, options.out)
    joints = sum(len(skeleton.names) for skeleton in clip.skeletons)
    print(f"{options.out}: {clip.frames} frames at {clip.fps:g} fps, {joints} joints")
