"""layfigure record: from the bus to USD."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Any

from layfigure.bus import EventLogWriter
from layfigure.cli.options import add_bus_options, open_bus, positive
from layfigure.cli.progress import ProgressLine
from layfigure.cli.stopping import StopFlag
from layfigure.errors import LayfigureError
from layfigure.recorder import Recorder, finish_log, open_log
from layfigure.take import Take, TakeBuilder

DESCRIPTION = """\
Records the doll's poses until Ctrl-C, SIGTERM, --duration or the server's leave, then writes them as USD:
  OUT.usda             a small layer over the two others
  OUT.character.usdc   skeleton, skinned meshes, colours
  OUT.anim.usdc        every frame, torques, yield events
  OUT.lcmlog           every message as it was received (LCM event log)
Files of these names are replaced, each when its successor is whole. While it records, the log is called
OUT.recording.lcmlog: it outlives a crash, and a later recording sets it aside as OUT.cut-off-1.lcmlog.
"""
EPILOG = """\
examples:
  layfigure record take.usda
  layfigure record take.usdz --fps 30 --duration 10 --lcm-url tcpq://127.0.0.1:7700
"""


def add_parsers(subparsers: Any) -> None:
    parser = subparsers.add_parser(
        "record",
        help="record a take as USD",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("out", metavar="OUT.usd[a|c|z]", type=Path)
    parser.add_argument("--fps", type=positive, default=24.0, help="frames per second (default 24)")
    parser.add_argument(
        "--duration",
        metavar="S",
        type=positive,
        default=math.inf,
        help="end after so much simulation time; time without a server counts by the wall clock",
    )
    add_bus_options(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    from layfigure.usd.writer import check_output

    check_output(options.out)
    with open_bus(options) as bus:
        log = open_log(options.out)
        failure: LayfigureError | None = None
        recorder = Recorder(bus, log)
        try:
            _record(recorder, options)
        except LayfigureError as error:
            failure = error
        finally:
            if not recorder.has_poses:
                log.discard()
    if recorder.has_poses:
        _write(recorder.builder.build(options.duration), log, options)
    elif failure is None:
        failure = LayfigureError("nothing was recorded: no pose arrived")
    if failure is not None:
        raise failure


def _record(recorder: Recorder, options: argparse.Namespace) -> None:
    character = recorder.start()
    with StopFlag() as stop, ProgressLine() as progress:
        joints = len(character.joints)
        print(f"recording '{character.name}' ({joints} joints) to '{options.out}'; Ctrl-C ends it", file=sys.stderr)

        def show(take: TakeBuilder) -> None:
            progress.show(f"{take.duration_s:.1f} s, {take.pose_count} poses")

        recorder.run(stop, options.duration, show)


def _write(take: Take, log: EventLogWriter, options: argparse.Namespace) -> None:
    from layfigure.usd.writer import write_take

    try:
        frames = write_take(take, options.out, options.fps)
    except LayfigureError as error:
        raise LayfigureError(f"{error}; all that was received is kept as '{log.path}'") from error
    finish_log(log, options.out)
    if take.lost_poses:
        print(f"layfigure: warning: {take.lost_poses} poses were lost on the way", file=sys.stderr)
    print(f"{options.out}: {frames} frames at {options.fps:g} fps, {len(take.times_us)} poses, {take.duration_s:.2f} s")
