"""layfigure status, key, reset, step, shutdown: one message each."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from layfigure.cli.options import add_bus_options, open_bus
from layfigure.connection import Connection
from layfigure.protocol import Argument, Reply

STEP_TIMEOUT_S = 60.0

SIMPLE_COMMANDS = {
    "key": "mark this moment of the take",
    "reset": "put the doll back to its initial pose",
    "shutdown": "end the server",
}


def add_parsers(subparsers: Any) -> None:
    _add_parser(subparsers, "status", "print the server's newest heartbeat").set_defaults(run=run_status)
    for name, help_text in SIMPLE_COMMANDS.items():
        _add_parser(subparsers, name, help_text).set_defaults(run=run_command, command=name)
    step = _add_parser(subparsers, "step", "advance a server in lockstep")
    step.add_argument("count", metavar="COUNT", type=step_count, nargs="?", default=1, help="physics steps (default 1)")
    step.set_defaults(run=run_step)


def _add_parser(subparsers: Any, name: str, help_text: str) -> Any:
    parser = subparsers.add_parser(
        name,
        help=help_text,
        description=f"{help_text[0].upper()}{help_text[1:]}.",
        epilog=f"example:\n  layfigure {name} --lcm-url tcpq://127.0.0.1:7700",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_bus_options(parser)
    return parser


def run_status(options: argparse.Namespace) -> None:
    with open_bus(options) as bus:
        status = Connection(bus).wait_for_status()
    fields = asdict(status)
    del fields["devices"]
    _print_fields(fields)
    for device in status.devices:
        _print_fields({f"pointer {device.pointer}, {name}": value for name, value in asdict(device).items()})


def _print_fields(fields: dict[str, Any]) -> None:
    for name, value in fields.items():
        print(f"{name}: {value:g}" if isinstance(value, float) else f"{name}: {value}")


def run_command(options: argparse.Namespace) -> None:
    with open_bus(options) as bus:
        _print_reply(options.command, Connection(bus).command(options.command))


def run_step(options: argparse.Namespace) -> None:
    with open_bus(options) as bus:
        count = Argument("count", values=(float(options.count),))
        _print_reply("step", Connection(bus).command("step", count, timeout_s=STEP_TIMEOUT_S))


def step_count(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number of steps: expected a whole number from 1")
    return int(text)


def _print_reply(name: str, reply: Reply) -> None:
    results = [
        f"{result.name} {result.text or ' '.join(f'{value:g}' for value in result.values)}" for result in reply.results
    ]
    print(", ".join([f"{name}: done at {reply.time_us * 1e-6:.3f} s", *results]))
