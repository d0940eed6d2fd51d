"""layfigure status, key, undo, set, step, shutdown, ..: one message each."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from layfigure.cli.options import add_bus_options, open_bus, positive
from layfigure.connection import Connection
from layfigure.errors import LayfigureError, UsageError
from layfigure.protocol import Argument, Reply

STEP_TIMEOUT_S = 60.0

SIMPLE_COMMANDS = {
    "key": "mark this moment of the take",
    "undo": "take back the newest work of a hand, or other change of the doll",
    "shutdown": "end the server",
}

SET_EPILOG = """\
NAME is called as in a settings file: stiffness, damping, flow_damping, yield_torque, hardening; of single axes
stiffness.twist, damping.bend_y, yield_torque.bend_z; as a multiple of what the doll was made with stiffness.factor,
stiffness.twist.factor; limits.twist, limits.swing_y, limits.swing_z [degrees]; and softness, gravity [m/s^2], or of a
pointer: pointer, scale, power_scale, clutch, magnet, base.

examples:
  layfigure set --bone '*Arm' stiffness.factor=0.5 yield_torque=2
  layfigure set --bone neck limits.twist=-30,30
  layfigure set gravity=0,0,-9.81"""

LOAD_EPILOG = """\
FILE.json holds rotations w x y z of joints beside their parents, of some or of all: {"arm.L": [1, 0, 0, 0], ..}.

example:
  layfigure load-pose wave.json --duration 1"""


def add_parsers(subparsers: Any) -> None:
    _add_parser(subparsers, "status", "print the server's newest heartbeat").set_defaults(run=run_status)
    for name, help_text in SIMPLE_COMMANDS.items():
        _add_parser(subparsers, name, help_text).set_defaults(run=run_command, command=name)
    _add_editing_parsers(subparsers)
    step = _add_parser(subparsers, "step", "advance a server in lockstep")
    step.add_argument("count", metavar="COUNT", type=step_count, nargs="?", default=1, help="physics steps (default 1)")
    step.set_defaults(run=run_step)


def _add_editing_parsers(subparsers: Any) -> None:
    reset = _add_parser(subparsers, "reset", "put the doll back to its initial pose")
    reset.add_argument("--all", action="store_true", help="what was set of the doll too")
    reset.set_defaults(run=run_reset)
    redo = _add_parser(subparsers, "redo", "do again what was taken back")
    redo.add_argument("--branch", metavar="K", type=whole_number, help="another than what was taken back last, from 0")
    redo.set_defaults(run=run_redo)
    history = _add_parser(subparsers, "history", "print where the doll is in its history, or go to a place of it")
    history.add_argument("--go", metavar="N", type=whole_number, help="to the place of this number, on any branch")
    history.set_defaults(run=run_history)
    mirror = _add_parser(subparsers, "mirror", "exchange the poses of left and right")
    mirror.add_argument(
        "--side", choices=("both", "left", "right"), default="both", help="whose pose goes onto the other side"
    )
    mirror.set_defaults(run=run_mirror)
    snapshot = _add_parser(subparsers, "snapshot", "keep the doll as it is under a name, beyond the server's end")
    snapshot.add_argument("name", metavar="NAME", nargs="?", help="of the snapshot")
    action = snapshot.add_mutually_exclusive_group()
    for name, text in {"restore": "put the doll back", "remove": "forget it", "list": "print the names"}.items():
        action.add_argument(f"--{name}", dest="action", action="store_const", const=name, help=text)
    snapshot.set_defaults(run=run_snapshot, action="save")
    for name, text in {"lock": "let joints turn no more", "unlock": "let joints turn again"}.items():
        lock = _add_parser(subparsers, name, text)
        lock.add_argument(
            "bone", metavar="BONE", nargs="?" if name == "unlock" else None, help="a name, or a pattern with * and ?"
        )
        lock.add_argument("--axes", metavar="AXES", nargs="+", choices=("twist", "bend_y", "bend_z"), help="(all)")
        lock.set_defaults(run=run_lock, command=name)
    loader = _add_parser(subparsers, "load-pose", "turn joints to the rotations of a file", LOAD_EPILOG)
    loader.add_argument("file", metavar="FILE.json", type=Path, nargs="?", help="joints' names and rotations")
    loader.add_argument("--duration", metavar="S", type=positive, default=0.5, help="of the way there (default 0.5)")
    loader.add_argument("--max-torque", metavar="NM", type=positive, help="of each joint's drive")
    loader.add_argument("--hold", action="store_true", help="drive the joints on when they have arrived")
    loader.add_argument("--cancel", action="store_true", help="let go of all joints, instead")
    loader.set_defaults(run=run_load_pose)
    setter = _add_parser(subparsers, "set", "set what joints, or the doll, are like", SET_EPILOG)
    setter.add_argument("--bone", metavar="BONE", help="a name, or a pattern with * and ? (all joints)")
    setter.add_argument("settings", metavar="NAME=VALUE", nargs="+", type=setting, help="see below")
    setter.set_defaults(run=run_set)


def _add_parser(subparsers: Any, name: str, help_text: str, epilog: str = "") -> Any:
    parser = subparsers.add_parser(
        name,
        help=help_text,
        description=f"{help_text[0].upper()}{help_text[1:]}.",
        epilog=epilog or f"example:\n  layfigure {name} --lcm-url tcpq://127.0.0.1:7700",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_bus_options(parser)
    return parser


def run_status(options: argparse.Namespace) -> None:
    with open_bus(options) as bus:
        connection = Connection(bus)
        connection.wait_for_status()
        connection.listen_for_rivals()
        status = connection.newest_status()
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


def _send(options: argparse.Namespace, name: str, *arguments: Argument) -> None:
    with open_bus(options) as bus:
        _print_reply(name, Connection(bus).command(name, *arguments))


def run_reset(options: argparse.Namespace) -> None:
    _send(options, "reset", *([Argument("all", values=(1.0,))] if options.all else []))


def run_redo(options: argparse.Namespace) -> None:
    branch = () if options.branch is None else (Argument("branch", values=(float(options.branch),)),)
    _send(options, "redo", *branch)


def run_history(options: argparse.Namespace) -> None:
    if options.go is None:
        _send(options, "history")
    else:
        _send(options, "history", Argument("action", "go"), Argument("place", values=(float(options.go),)))


def run_mirror(options: argparse.Namespace) -> None:
    _send(options, "mirror", Argument("side", options.side))


def run_snapshot(options: argparse.Namespace) -> None:
    if (options.name is None) != (options.action == "list"):
        raise UsageError("snapshot: give a NAME, or --list alone")
    name = () if options.name is None else (Argument("name", options.name),)
    _send(options, "snapshot", Argument("action", options.action), *name)


def run_lock(options: argparse.Namespace) -> None:
    bone = () if options.bone is None else (Argument("bone", options.bone),)
    axes = () if options.axes is None else (Argument("axes", " ".join(options.axes)),)
    _send(options, options.command, *bone, *axes)


def run_load_pose(options: argparse.Namespace) -> None:
    if (options.file is None) != options.cancel:
        raise UsageError("load-pose: give a FILE.json, or --cancel alone")
    if options.cancel:
        _send(options, "load_pose", Argument("action", "cancel"))
        return
    rotations = read_pose(options.file)
    with open_bus(options) as bus:
        connection = Connection(bus)
        names = [joint.name for joint in connection.fetch_character().joints]
        unknown = [name for name in rotations if name not in names]
        if unknown:
            raise LayfigureError(f"'{options.file}': the character has no joint '{unknown[0]}'")
        arguments = [
            Argument("joints", values=tuple(float(names.index(name)) for name in rotations)),
            Argument("rotations", values=tuple(number for rotation in rotations.values() for number in rotation)),
            Argument("duration", values=(options.duration,)),
            Argument("hold", values=(float(options.hold),)),
        ]
        if options.max_torque is not None:
            arguments.append(Argument("max_torque", values=(options.max_torque,)))
        _print_reply("load-pose", connection.command("load_pose", *arguments))


def read_pose(path: Path) -> dict[str, list[float]]:
    """The rotations [w x y z] of a file by the joints' names. Raises LayfigureError that names what is wrong."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise LayfigureError(f"cannot read '{path}': {error}") from error
    if not isinstance(content, dict) or not content:
        raise LayfigureError(f"'{path}': expected joints' names and their rotations, {{\"arm\": [w, x, y, z], ..}}")
    for name, rotation in content.items():
        fits = isinstance(rotation, list) and len(rotation) == 4
        if not fits or not all(type(number) in (int, float) for number in rotation):
            raise LayfigureError(f"'{path}': the rotation of '{name}' is not four numbers w x y z")
    return {name: [float(number) for number in rotation] for name, rotation in content.items()}


def run_set(options: argparse.Namespace) -> None:
    bone = () if options.bone is None else (Argument("bone", options.bone),)
    _send(options, "set", *bone, *options.settings)


def setting(text: str) -> Argument:
    """NAME=NUMBER or NAME=NUMBER,NUMBER,..; limits in degrees."""
    name, equals, value = text.partition("=")
    try:
        numbers = [float(number) for number in value.split(",")]
    except ValueError:
        numbers = []
    if not (name and equals and numbers):
        raise argparse.ArgumentTypeError(f"'{text}' is not NAME=NUMBER or NAME=NUMBER,NUMBER,..")
    unit = math.radians(1.0) if name.startswith("limits.") else 1.0
    return Argument(name, values=tuple(unit * number for number in numbers))


def whole_number(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 0")
    return int(text)


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
