"""A session file tells scripted hands what to do, in TOML:

    title = "Raise the left arm"

    [[hand]]                      # hands act at the same time, each through its list
    pointer = 0                   # 0 left hand, 1 right hand, ... 15
    do = [
      { wait = 0.5 },                                  # s of simulation time
      { grab = "LeftHand" },                           # a bone; "LeftHand" also finds "mixamorig:LeftHand"
      { move = [0.0, 0.1, 0.4], over = 2.0 },          # m, from where the bone was grabbed; minimum jerk
      { move = [0.3, 0.0, 1.6], over = 1.0, space = "world", interpolation = "linear" },
      { key = true },                                  # marks this moment
      { release = true },
    ]

grab also takes: point = [x, y, z] in the bone's frame [m], mode = "3dof" | "6dof", stiffness [N/m], damping [N s/m];
left out, the server's defaults hold. A hand has one tool at a time; beside grab these:

      { touch = "LeftHand", from = [0.0, 0.1, 0.0] },  # a fingertip comes out so far from the bone [m, world]
      { pinch = "LeftForeArm", with = 2, along = [0, 1, 0], width = 0.14, close = 0.06, over = 0.5 },
                                                       # two fingertips: this pointer's and pointer 2's, on either side
                                                       # of the bone along that line; their pointers close from width to
                                                       # less than the limb is thick [m]; the rest presses
      { magnet = true },                               # fingertips stick to what they touch, until { magnet = false }

touch and pinch also take: point in the bone's frame [m], radius of the fingertips [m], friction, stiffness, damping,
magnet = true. move moves a fingertip, or a pinch as a whole, and release puts it away. At any time:

      { pin = "LeftFoot" },                            # fastens a bone where it is; also point, mode = "3dof" | "6dof",
                                                       # hold = "stiff" | "rigid"; it stays after the session
      { unpin = "LeftFoot" }, { unpin = true },        # that bone's pins of this session; all pins there are
      { softness = 0.3 },                              # yield torques times this while any hand has a tool; also bone:
      { softness = 0.3, bone = "LeftArm" },            # of its joint alone
      { scale = 2.0 },                                 # the hand's moves are twice as large in the world
      { clutch = true }, { clutch = false },           # between them the hand moves and the doll does not: grips anew

      { mark = "up" },                                 # names this moment for the expectations below
      { command = "set", arguments = { softness = 0.5 } },
                                                       # any command of the server as it is: texts, numbers, lists of
                                                       # numbers, true and false. The session ends if it is refused,
                                                       # unless it says accepted = true, refused = "some words of the
                                                       # reason", or the bounds of a number of its reply: result =
                                                       # "steps", is = 7; all three are judged as expectations

A session may say what server it is for, and is then refused on another one:

    [server]                      # all may be left out
    character = "doll"            # its name; * and ? stand for anything
    clock = "lockstep"
    physics_hz = 1000
    pose_hz = 60

What it expects is checked when the file is read, and judged by `layfigure play --expect`:

    [[expect]]
    by = 2.5                      # s of the session
    torque = "LeftArm"
    at_least = 0.5                # N m

Anything that is not listed here is refused.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from layfigure.errors import LayfigureError
from layfigure.expectation import Expectation
from layfigure.expectation_file import BOUNDS, WINDOWS, ExpectationReader
from layfigure.protocol import Argument
from layfigure.session import (
    CLOCKS,
    HOLDS,
    INTERPOLATIONS,
    MAX_DURATION_S,
    MAX_FRICTION,
    MAX_SOFTNESS,
    MODES,
    RADII_M,
    SCALES,
    SPACES,
    Action,
    Clutch,
    Command,
    Expect,
    Fingertip,
    Grab,
    Hand,
    Key,
    Magnet,
    Mark,
    Move,
    Pin,
    Pinch,
    Release,
    Scale,
    Server,
    Session,
    Softness,
    Tool,
    Touch,
    Unpin,
    Wait,
)
from layfigure.session_moments import check_moments
from layfigure.session_tables import TableReader

FINGERTIP_OPTIONS = ("radius", "friction", "stiffness", "damping", "magnet")


def load_session(path: Path) -> Session:
    """Raises LayfigureError that names the file, the place and what is expected there."""
    try:
        text = path.read_text(encoding="utf-8")
        return _Reader(path, text).session(tomllib.loads(text))
    except OSError as error:
        raise LayfigureError(f"cannot read the session '{path}': {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise LayfigureError(f"'{path}' is not a text in UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise LayfigureError(f"'{path}' is not TOML: {error}") from error


class _Reader(TableReader):
    def __init__(self, path: Path, text: str) -> None:
        super().__init__(path, text)
        self._expectations = ExpectationReader(self)
        self._readers: dict[str, Callable[[dict[str, Any], str], Action]] = {
            "wait": self._wait,
            "grab": self._grab,
            "touch": self._touch,
            "pinch": self._pinch,
            "move": self._move,
            "release": self._release,
            "pin": self._pin,
            "unpin": self._unpin,
            "softness": self._softness,
            "scale": self._scale,
            "clutch": lambda table, where: Clutch(self._flag(table, "clutch", where)),
            "magnet": lambda table, where: Magnet(self._flag(table, "magnet", where)),
            "key": self._key,
            "mark": self._mark,
            "command": self._command,
            "expect": self._expect,
        }

    def session(self, table: dict[str, Any]) -> Session:
        self.refuse_unknown(table, {"title", "server", "hand", "expect"}, "the session")
        title = self.text(table.get("title", ""), "title")
        hands = table.get("hand")
        if not isinstance(hands, list) or not hands or not all(isinstance(hand, dict) for hand in hands):
            raise self.error("the session", "needs at least one [[hand]]")
        read = tuple(self._hand(hand, f"hand {number}") for number, hand in enumerate(hands, 1))
        taken: set[int] = set()
        for number, hand in enumerate(read, 1):
            for pointer in hand.pointers:
                if pointer in taken:
                    raise self.error(f"hand {number}", f"pointer {pointer} is an earlier hand's; give each its own")
            taken.update(hand.pointers)
        self._check_pins(read)
        session = Session(title, read, self._server(table.get("server", {})), self._expected(table.get("expect", [])))
        check_moments(session, self)
        return session

    def _server(self, table: Any) -> Server:
        if not isinstance(table, dict):
            raise self.error("server", f"is {table!r}, expected a table [server]", "server")
        self.refuse_unknown(table, {"character", "clock", "physics_hz", "pose_hz"}, "server")
        rates = {
            name: self.number(table[name], f"server, {name}", math.ulp(0.0), math.inf)
            for name in ("physics_hz", "pose_hz")
            if name in table
        }
        character = self.text(table["character"], "server, character") if "character" in table else None
        clock = self.choice(table, "clock", CLOCKS, "server") if "clock" in table else None
        return Server(character, clock, **rates)

    def _expected(self, tables: Any) -> tuple[Expectation, ...]:
        if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
            raise self.error("expect", f"is {tables!r}, expected tables [[expect]]", "expect")
        starts: list[int | None] = [
            match.start(1) for match in re.finditer(r"^[ \t]*(\[\[expect\]\])", self._text, re.MULTILINE)
        ]
        if len(starts) != len(tables):  # written another way: their lines are not known
            starts = [None] * len(tables)
        return tuple(
            ExpectationReader(TableReader(self._path, self._text, start)).table(table, f"expect {number}")
            for number, (start, table) in enumerate(zip(starts, tables, strict=True), 1)
        )

    def _check_pins(self, hands: tuple[Hand, ...]) -> None:
        pinned = {action.bone for hand in hands for action in hand.actions if isinstance(action, Pin)}
        for number, hand in enumerate(hands, 1):
            for action in hand.actions:
                if isinstance(action, Unpin) and action.bone is not None and action.bone not in pinned:
                    raise self.error(f"hand {number}", f"unpins '{action.bone}', which no hand of the session pins")

    def _hand(self, table: dict[str, Any], where: str) -> Hand:
        self.refuse_unknown(table, {"pointer", "do"}, where)
        pointer = self.pointer(table.get("pointer"), f"{where}, pointer")
        do = table.get("do")
        if not isinstance(do, list) or not do or not all(isinstance(action, dict) for action in do):
            raise self.error(where, "needs a list `do` of actions, such as { wait = 0.5 }")
        actions = tuple(self._action(action, f"{where}, action {number}") for number, action in enumerate(do, 1))
        for number, action in enumerate(actions, 1):
            if isinstance(action, Pinch) and action.second == pointer:
                raise self.error(f"{where}, action {number} (pinch), with", f"is {pointer}, the hand's own pointer")
        self._check_order(actions, where)
        return Hand(pointer, actions)

    def _action(self, table: dict[str, Any], where: str) -> Action:
        names = [name for name in self._readers if name in table and not self._is_option(name, table)]
        if len(names) != 1:
            found = " and ".join(names) or ", ".join(map(repr, table)) or "nothing"
            raise self.error(where, f"is {found}, expected one of {', '.join(self._readers)}", next(iter(table), ""))
        return self._readers[names[0]](table, f"{where} ({names[0]})")

    def _is_option(self, name: str, table: dict[str, Any]) -> bool:
        """A magnet is an action, and an option of touch and pinch."""
        return name == "magnet" and ("touch" in table or "pinch" in table)

    def _wait(self, table: dict[str, Any], where: str) -> Wait:
        self.refuse_unknown(table, {"wait"}, where)
        return Wait(self.number(table["wait"], where, 0.0, MAX_DURATION_S))

    def _grab(self, table: dict[str, Any], where: str) -> Grab:
        self.refuse_unknown(table, {"grab", "point", "mode", "stiffness", "damping"}, where)
        bone = self.bone(table["grab"], where)
        optional: dict[str, Any] = {}
        if "point" in table:
            optional["point"] = self.vector(table["point"], f"{where}, point")
        for name, least in (("stiffness", math.ulp(0.0)), ("damping", 0.0)):
            if name in table:
                optional[name] = self.number(table[name], f"{where}, {name}", least, math.inf)
        return Grab(bone, mode=self.choice(table, "mode", MODES, where), **optional)

    def _touch(self, table: dict[str, Any], where: str) -> Touch:
        self.refuse_unknown(table, {"touch", "from", "point", *FINGERTIP_OPTIONS}, where)
        if "from" not in table:
            raise self.error(where, "needs `from`, how far from the bone the fingertip comes out [x, y, z]")
        return Touch(
            bone=self.bone(table["touch"], where),
            offset=self.vector(table["from"], f"{where}, from"),
            point=self.point(table, where),
            fingertip=self._fingertip(table, where),
        )

    def _pinch(self, table: dict[str, Any], where: str) -> Pinch:
        needed = ("with", "along", "width", "close", "over")
        self.refuse_unknown(table, {"pinch", "point", *needed, *FINGERTIP_OPTIONS}, where)
        for name in needed:
            if name not in table:
                raise self.error(where, f"needs `{name}`")
        along = self.vector(table["along"], f"{where}, along")
        if along == (0.0, 0.0, 0.0):
            raise self.error(f"{where}, along", "is no direction")
        width = self.number(table["width"], f"{where}, width", math.ulp(0.0), math.inf)
        return Pinch(
            bone=self.bone(table["pinch"], where),
            second=self.pointer(table["with"], f"{where}, with"),
            along=along,
            width=width,
            close=self.number(table["close"], f"{where}, close", 0.0, width),
            duration_s=self.number(table["over"], f"{where}, over", math.ulp(0.0), MAX_DURATION_S),
            point=self.point(table, where),
            fingertip=self._fingertip(table, where),
        )

    def _fingertip(self, table: dict[str, Any], where: str) -> Fingertip:
        ranges = {
            "radius": RADII_M,
            "friction": (0.0, MAX_FRICTION),
            "stiffness": (math.ulp(0.0), math.inf),
            "damping": (0.0, math.inf),
        }
        optional: dict[str, Any] = {
            name: self.number(table[name], f"{where}, {name}", *ranges[name]) for name in ranges if name in table
        }
        if "magnet" in table:
            optional["magnet"] = self.boolean(table["magnet"], f"{where}, magnet")
        return Fingertip(**optional)

    def _pin(self, table: dict[str, Any], where: str) -> Pin:
        self.refuse_unknown(table, {"pin", "point", "mode", "hold"}, where)
        return Pin(
            bone=self.bone(table["pin"], where),
            point=self.point(table, where) if "point" in table else None,
            mode=self.choice(table, "mode", MODES, where),
            hold=self.choice(table, "hold", HOLDS, where),
        )

    def _unpin(self, table: dict[str, Any], where: str) -> Unpin:
        self.refuse_unknown(table, {"unpin"}, where)
        if table["unpin"] is True:
            return Unpin(None)
        return Unpin(self.bone(table["unpin"], where, "the name of a bone, or true for all"))

    def _softness(self, table: dict[str, Any], where: str) -> Softness:
        self.refuse_unknown(table, {"softness", "bone"}, where)
        factor = self.number(table["softness"], where, 0.0, MAX_SOFTNESS)
        return Softness(factor, self.bone(table["bone"], f"{where}, bone") if "bone" in table else None)

    def _scale(self, table: dict[str, Any], where: str) -> Scale:
        self.refuse_unknown(table, {"scale"}, where)
        return Scale(self.number(table["scale"], where, *SCALES))

    def _flag(self, table: dict[str, Any], name: str, where: str) -> bool:
        self.refuse_unknown(table, {name}, where)
        return self.boolean(table[name], where)

    def _move(self, table: dict[str, Any], where: str) -> Move:
        self.refuse_unknown(table, {"move", "over", "space", "interpolation"}, where)
        if "over" not in table:
            raise self.error(where, "needs `over`, the seconds it takes")
        return Move(
            to=self.vector(table["move"], where),
            duration_s=self.number(table["over"], f"{where}, over", math.ulp(0.0), MAX_DURATION_S),
            space=self.choice(table, "space", SPACES, where),
            interpolation=self.choice(table, "interpolation", INTERPOLATIONS, where),
        )

    def _release(self, table: dict[str, Any], where: str) -> Release:
        self.refuse_unknown(table, {"release"}, where)
        self.true(table["release"], where)
        return Release()

    def _key(self, table: dict[str, Any], where: str) -> Key:
        self.refuse_unknown(table, {"key"}, where)
        self.true(table["key"], where)
        return Key()

    def _mark(self, table: dict[str, Any], where: str) -> Mark:
        self.refuse_unknown(table, {"mark"}, where)
        name = self.text(table["mark"], where)
        if not name:
            raise self.error(where, "is empty, expected a name")
        return Mark(name)

    def _command(self, table: dict[str, Any], where: str) -> Command:
        answers = {"accepted", "refused", "result", "tolerance", *BOUNDS}
        self.refuse_unknown(table, {"command", "arguments", *answers}, where)
        name = self.text(table["command"], where)
        if not name:
            raise self.error(where, "is empty, expected the name of a command")
        given = table.get("arguments", {})
        if not isinstance(given, dict):
            raise self.error(f"{where}, arguments", f"is {given!r}, expected a table {{ name = value }}")
        arguments = tuple(self._argument(key, value, f"{where}, {key}") for key, value in given.items())
        return Command(name, arguments, self._expectations.answer(table, where))

    def _argument(self, name: str, value: Any, where: str) -> Argument:
        """Any number goes: a session may try what the server says to NaN."""
        if isinstance(value, str):
            return Argument(name, text=value)
        values = value if isinstance(value, list) else [value]
        if not all(isinstance(each, bool | int | float) for each in values):
            raise self.error(where, f"is {value!r}, expected a text, a number, numbers, true or false")
        return Argument(name, values=tuple(map(float, values)))

    def _expect(self, table: dict[str, Any], where: str) -> Expect:
        self.refuse_unknown(table, {"expect"}, where)
        expected = table["expect"]
        if not isinstance(expected, dict):
            raise self.error(where, f'is {expected!r}, expected a table such as {{ yielded = "LeftArm", is = true }}')
        for name in WINDOWS:
            if name in expected:
                raise self.error(where, f"has `{name}`, but is judged at its own moment; use [[expect]]", name)
        if "rate" in expected:
            raise self.error(where, "counts messages over a time; use [[expect]] with `during`", "rate")
        return Expect(self._expectations.step(expected, where))

    def _check_order(self, actions: tuple[Action, ...], where: str) -> None:
        held: Tool | None = None
        clutched = False
        for number, action in enumerate(actions, 1):
            place = f"{where}, action {number}"
            match action:
                case Grab() | Touch() | Pinch():
                    if held is not None:
                        verb = {Grab: "grabs", Touch: "touches", Pinch: "pinches"}[type(action)]
                        reason = f"{verb} '{action.bone}' while the hand holds '{held.bone}'; release it first"
                        raise self.error(place, reason)
                    if clutched:
                        raise self.error(place, "needs the clutch off: its pointer would not get there")
                    held = action
                case Move() | Release() if held is None:
                    raise self.error(place, "needs the hand to hold something; grab a bone first")
                case Move() if clutched and action.space == "world":
                    raise self.error(place, "cannot go to a place in the world while the clutch is held")
                case Release():
                    held = None
                case Magnet() if not isinstance(held, Touch | Pinch):
                    raise self.error(place, "needs a fingertip that is out; touch or pinch first")
                case Clutch():
                    clutched = action.held
        if held is not None:
            raise self.error(where, f"still holds '{held.bone}' at its end; add {{ release = true }}")
        if clutched:
            raise self.error(where, "still holds the clutch at its end; add { clutch = false }")
