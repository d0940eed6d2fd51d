"""layfigure play: scripted hands."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from layfigure import expectation_file, session_file
from layfigure.cli.options import add_bus_options, open_bus
from layfigure.cli.progress import ProgressLine
from layfigure.cli.stopping import StopFlag
from layfigure.errors import BusError, LayfigureError, NoReplyError, UsageError
from layfigure.judge import Judge, unjudged
from layfigure.play_report import Played, failure_line, summary, write_junit
from layfigure.player import Player
from layfigure.session import Session

EPILOG = """\
examples:
  layfigure play assets/sessions/demo.toml
  layfigure play assets/sessions/touch.toml
  layfigure play session.toml --lcm-url tcpq://127.0.0.1:7700
  layfigure play tests/*.toml --expect --junit report.xml

Several sessions are played one after the other on the same doll. With --expect the exit code is 0 if all that they
expect was seen, 1 if not or if a session could not be played; each failure is a line on stderr. Without it, what they
expect is checked as part of the file, and not judged.
"""


def add_parsers(subparsers: Any) -> None:
    parser = subparsers.add_parser(
        "play",
        help="play sessions of scripted hands",
        description=f"{session_file.__doc__}\n{expectation_file.__doc__}",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sessions", metavar="SESSION.toml", type=Path, nargs="+")
    parser.add_argument("--expect", action="store_true", help="judge what the sessions expect")
    parser.add_argument("--junit", metavar="FILE.xml", type=Path, help="with --expect: write a report in JUnit's form")
    add_bus_options(parser)
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    if options.junit is not None:
        _check_report(options)
    sessions = [(path, session_file.load_session(path)) for path in options.sessions]
    if options.expect:
        _judge_all(options, sessions)
        return
    with StopFlag() as stop:
        for path, session in sessions:
            with open_bus(options) as bus, ProgressLine() as progress:
                played_s = Player(bus, session).play(stop, progress.show_part)
            if stop.raised:
                raise LayfigureError(f"interrupted after {played_s:.2f} s of '{path}'; the hands have let go")
            print(f"{path}: played {played_s:.2f} s")


def _check_report(options: argparse.Namespace) -> None:
    if not options.expect:
        raise UsageError("--junit reports expectations: it needs --expect")
    if not options.junit.parent.is_dir():
        raise UsageError(f"'{options.junit}': there is no folder '{options.junit.parent}'; make it first")


def _judge_all(options: argparse.Namespace, sessions: list[tuple[Path, Session]]) -> None:
    """A session that fails does not keep the others from being played; a lost server or an interruption does."""
    played: list[Played] = []
    with StopFlag() as stop:
        for path, session in sessions:
            if played and (stop.raised or played[-1].lost):
                reason = "not played: interrupted" if stop.raised else "not played: the server is gone"
                one = Played(path, session.title, 0.0, tuple(unjudged(session)), reason)
            else:
                one = _judge_one(options, path, session, stop)
            played.append(one)
            _tell(one)
    if options.junit is not None:
        write_junit(options.junit, played)
    if any(one.error or one.failures for one in played):
        raise LayfigureError(summary(played))
    print(summary(played))


def _judge_one(options: argparse.Namespace, path: Path, session: Session, stop: StopFlag) -> Played:
    judge: Judge | None = None
    played_s, error, lost = 0.0, "", False

    def show(done_s: float, whole_s: float) -> None:
        nonlocal played_s
        played_s = done_s
        progress.show_part(done_s, whole_s)

    try:
        with open_bus(options) as bus, ProgressLine() as progress:
            judge = Judge(bus, session)
            Player(bus, session, judge).play(stop, show)
        if stop.raised:
            error = f"interrupted after {played_s:.2f} s; the hands have let go"
    except (BusError, NoReplyError) as problem:
        error, lost = str(problem), True
    except LayfigureError as problem:
        error = str(problem)
    verdicts = unjudged(session) if judge is None else judge.verdicts()
    return Played(path, session.title, played_s, tuple(verdicts), error, lost)


def _tell(played: Played) -> None:
    for verdict in played.failures:
        if verdict.time_s is not None or not played.error:
            print(failure_line(played.path, verdict), file=sys.stderr)
    if played.error:
        print(f"{played.path}: {played.error}", file=sys.stderr)
    else:
        print(f"{played.path}: played {played.played_s:.2f} s, {summary([played])}")
