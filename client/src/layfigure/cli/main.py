"""The command `layfigure`. Exit codes: 0 done, 1 failed, 2 usage."""

from __future__ import annotations

import argparse
import logging
import os
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

from layfigure import __version__
from layfigure.cli import check, commands, convert, diff, inspect, pictures, play, record
from layfigure.cli.completion import add_completion_option
from layfigure.errors import LayfigureError, UsageError

EPILOG = """\
examples:
  layfigure record take.usda                   record until Ctrl-C, or until the server leaves
  layfigure export take.lcmlog few.usda --keys reduced
  layfigure play demo.toml                     let scripted hands pose the doll
  layfigure check take.usda                    validate what was written
  layfigure preview take.usda -o take.png      draw it
  layfigure diff a.usda b.usda                 tell how two takes differ
  layfigure convert take.usda take.glb         for tools that read no USD
  layfigure inspect doll.glb -o doll.png       draw the doll that a character becomes
  layfigure status                             is a server there?
  layfigure undo                               take back what a hand has done
  layfigure snapshot standing                  keep the doll as it is
  layfigure --print-completion bash > ~/.local/share/bash-completion/completions/layfigure

Without --lcm-url the bus is $LCM_DEFAULT_URL, else LCM's multicast on this machine.
'layfigure COMMAND --help' tells more of each.
"""


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the whole usage."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message}; see '{self.prog} --help'\n")


def build_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="layfigure",
        description="Records, plays and checks the takes of a layfigure-server.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"layfigure {__version__}")
    add_completion_option(parser)
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for module in (record, play, check, pictures, diff, convert, inspect, commands):
        module.add_parsers(subparsers)
    return parser


def main(arguments: Sequence[str] | None = None) -> int:
    logging.basicConfig(format="layfigure: warning: %(message)s", level=logging.WARNING, stream=sys.stderr)
    options = build_parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        options.run(options)
        sys.stdout.flush()
    except UsageError as error:
        print(f"layfigure: {error}", file=sys.stderr)
        return 2
    except LayfigureError as error:
        print(f"layfigure: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("layfigure: interrupted", file=sys.stderr)
        return 1
    except BrokenPipeError:  # whoever read our output has gone; nothing more can be said to it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return 0
