"""Options and their values that several commands share."""

from __future__ import annotations

import argparse
import math
import re
from pathlib import Path

from layfigure.bus import Bus
from layfigure.errors import UsageError
from layfigure.servers import is_server_id

_MAX_PREFIX_LENGTH = 40  # LCM allows 63 characters for a whole channel name


def add_bus_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--lcm-url", metavar="URL", help="LCM URL of the bus, such as tcpq://127.0.0.1:7700")
    parser.add_argument(
        "--channel-prefix",
        metavar="P",
        type=channel_prefix,
        default="",
        help="what the server's channel names start with",
    )
    add_server_option(parser)


def add_server_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--server", metavar="ID", type=server_id, help="of several servers, that one: the server_id of 'status'"
    )


def open_bus(options: argparse.Namespace) -> Bus:
    return Bus(options.lcm_url, options.channel_prefix, options.server)


def server_id(text: str) -> int:
    if not (text.isdecimal() and text.isascii() and is_server_id(int(text))):
        raise argparse.ArgumentTypeError(f"'{text}' is not a server's id: expected the server_id of 'layfigure status'")
    return int(text)


def channel_prefix(text: str) -> str:
    if not re.fullmatch(rf"\w{{0,{_MAX_PREFIX_LENGTH}}}", text, re.ASCII):
        raise argparse.ArgumentTypeError(
            f"'{text}' is no channel prefix: letters, digits and _, at most {_MAX_PREFIX_LENGTH} of them"
        )
    return text


def check_picture_name(out: Path, *suffixes: str) -> None:
    if out.suffix not in suffixes:
        raise UsageError(f"'{out}': the name of a picture ends in {' or '.join(suffixes)}")
    if not out.parent.is_dir():
        raise UsageError(f"'{out}': there is no folder '{out.parent}'; make it first")


def positive(text: str) -> float:
    """A finite number greater than 0."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0.0):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number greater than 0")
    return value
