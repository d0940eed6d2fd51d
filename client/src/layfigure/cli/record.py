"""layfigure record: from the bus to USD."""

from __future__ import annotations

import argparse
import contextlib
import functools
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from layfigure.cli.options import add_bus_options, add_server_option, open_bus
from layfigure.cli.progress import ProgressLine
from layfigure.cli.stopping import StopFlag
from layfigure.cli.take_form import add_take_form_options, take_form
from layfigure.cli.take_switch import TakeSwitch
from layfigure.errors import LayfigureError, SpillError
from layfigure.recorder import Recorder
from layfigure.take import Take, TakeBuilder
from layfigure.take_files import finish_log, numbered, open_log, working_path
from layfigure.take_form import TakeForm, selected_joints

if TYPE_CHECKING:
    from layfigure.usd.working_file import WorkingFile

DESCRIPTION = """\
Records the doll's poses until Ctrl-C, SIGTERM, --duration or the server's leave, then writes them as USD:
  OUT.usda             a small layer over the two others
  OUT.character.usdc   skeleton, skinned meshes, materials
  OUT.anim.usdc        keys, yield events
  OUT.textures/        pictures that the character's file holds, if any; other textures stay where they are
  OUT.lcmlog           every message as it was received (LCM event log)
or, with --layout single, all but the log and pictures in OUT; an OUT.usdz holds all textures, too. Files of these names
are replaced, each when its successor is whole.
While it records, the log is called OUT.recording.lcmlog, and OUT.recording.usdc is the take so far. They outlive a
crash; a later recording sets them aside as OUT.cut-off-1, and 'layfigure export' makes the take of such a log.
With --takes each line on the standard input, Enter on a terminal, ends a take or begins the next: OUT_001.usda,
OUT_002.usda, ...; earlier ones are never replaced.
"""
EPILOG = """\
examples:
  layfigure record take.usda
  layfigure record take.usda --keys reduced --tolerance-mm 0.5
  layfigure record take.usdz --fps 29.97 --duration 10 --lcm-url tcpq://127.0.0.1:7700
  layfigure record take.usdc --layout single --joints '*Arm*' --joints '*Hand*' --takes
"""
EXPORT_DESCRIPTION = """\
Makes the USD of an event log that 'layfigure record' wrote, also of one that was cut off: the same, byte for byte, as
the recorder with the same options and name. Other options make other USD of the same take.
"""
EXPORT_EPILOG = """\
examples:
  layfigure export take.recording.lcmlog take.usda
  layfigure export take.lcmlog fewer.usda --keys reduced --tolerance-mm 2
"""


def add_parsers(subparsers: Any) -> None:
    record = subparsers.add_parser(
        "record",
        help="record a take as USD",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    record.add_argument("out", metavar="OUT.usd[a|c|z]", type=Path)
    add_take_form_options(record)
    record.add_argument("--takes", action="store_true", help="several takes, begun and ended by lines on stdin")
    add_bus_options(record)
    record.set_defaults(run=run_record)
    export = subparsers.add_parser(
        "export",
        help="make USD of a take's event log",
        description=EXPORT_DESCRIPTION,
        epilog=EXPORT_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    export.add_argument("log", metavar="TAKE.lcmlog", type=Path)
    export.add_argument("out", metavar="OUT.usd[a|c|z]", type=Path)
    add_take_form_options(export)
    add_server_option(export)
    export.set_defaults(run=run_export)


def run_export(options: argparse.Namespace) -> None:
    from layfigure.take_collector import read_take
    from layfigure.usd.writer import check_output

    form = take_form(options)
    check_output(options.out)
    try:
        take = read_take(options.log, options.duration, options.out.parent, options.server)
    except SpillError as error:
        raise LayfigureError(f"cannot write '{options.out}': {error}") from error
    write(take, options.out, options.fps, form)


def write(take: Take, out: Path, fps: float, form: TakeForm) -> None:
    """Writes the files and says what is in them."""
    from layfigure.usd.writer import write_take

    with ProgressLine() as progress:
        animation = write_take(take, out, fps, form, progress.show)
    if take.lost_poses:
        print(f"layfigure: warning: {take.lost_poses} poses were lost on the way", file=sys.stderr)
    frames, keys = len(animation.frames), len(animation.keys)
    count = f"{frames} frames" if keys == frames else f"{keys} key{'s' if keys > 1 else ''} of {frames} frames"
    print(f"{out}: {count} at {fps:g} fps, {len(take.times_us)} poses, {take.duration_s:.2f} s", flush=True)


def run_record(options: argparse.Namespace) -> None:
    from layfigure.usd.writer import check_output

    form = take_form(options)
    check_output(options.out)
    with open_bus(options) as bus:
        outs = numbered(options.out) if options.takes else iter([options.out])
        out = next(outs)
        recorder = Recorder(bus, open_log(out))
        recording = Recording(recorder, options, form)
        recording.record(out, recorder.start)
        while options.takes and recording.wait_for_next():
            out = next(outs)
            log = open_log(out)
            recording.record(out, functools.partial(recorder.resume, log))
    if recording.written == 0:
        raise LayfigureError("nothing was recorded: no pose arrived")


class Recording:
    """One take or several of one character."""

    def __init__(self, recorder: Recorder, options: argparse.Namespace, form: TakeForm) -> None:
        self.written = 0  # takes
        self._recorder = recorder
        self._options = options
        self._form = form
        self._switch = TakeSwitch() if options.takes else None
        self._stopped = False

    def record(self, out: Path, begin: Callable[[], object]) -> None:
        """A take that begins with `begin()`, in the recorder's log. One without any pose leaves no file."""
        failure: LayfigureError | None = None
        working: WorkingFile | None = None
        stop = StopFlag()
        with contextlib.ExitStack() as stack:
            try:
                begin()
                working = self._prepare(out)
                stack.enter_context(stop)  # until all is written: whoever is impatient loses nothing
                self._run(out, working, stop)
            except LayfigureError as error:
                failure = error
            finally:
                if not self._recorder.has_poses:
                    self._recorder.log.discard()
                if working is not None and not self._recorder.has_poses:
                    working.remove()
            if self._recorder.has_poses:
                try:
                    self._finish(out)
                finally:
                    working_path(out).unlink(missing_ok=True)  # the log holds all of it
            self._stopped = stop()
        if failure is not None:
            raise failure

    def wait_for_next(self) -> bool:
        """Until the next take is wished for; False if there is to be none."""
        if self._stopped or self._recorder.server_left:
            return False
        self._recorder.pause()
        print("waiting; Enter begins the next take, Ctrl-C ends", file=sys.stderr)
        with StopFlag() as stop:
            self._recorder.wait(lambda: stop() or self._thrown())
            return not (stop() or self._recorder.server_left)

    def _prepare(self, out: Path) -> WorkingFile:
        from layfigure.usd.working_file import WorkingFile

        character = self._recorder.character
        selected_joints(character, self._form.joints)  # better refused before the take than after it
        return WorkingFile(working_path(out), character, self._recorder.meshes, self._options.fps)

    def _run(self, out: Path, working: WorkingFile, stop: StopFlag) -> None:
        character = self._recorder.character
        what = f"recording '{character.name}' ({len(character.joints)} joints) to '{out}'"
        ends = "Enter ends it, Ctrl-C all" if self._switch else "Ctrl-C ends it"
        with ProgressLine() as progress:
            print(f"{what}; {ends}", file=sys.stderr)

            def show(take: TakeBuilder) -> None:
                working.update(take)
                progress.show(f"{take.duration_s:.1f} s, {take.pose_count} poses")

            self._recorder.run(lambda: stop() or self._thrown(), self._options.duration, show)

    def _thrown(self) -> bool:
        return self._switch is not None and self._switch.thrown()

    def _finish(self, out: Path) -> None:
        log = self._recorder.log
        try:
            write(self._recorder.builder.build(self._options.duration), out, self._options.fps, self._form)
        except LayfigureError as error:
            raise LayfigureError(f"{error}; all that was received is kept as '{log.path}'") from error
        finish_log(log, out)
        self.written += 1
