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
from layfigure.session import (
    HOLDS,
    INTERPOLATIONS,
    MAX_DURATION_S,
    MAX_FRICTION,
    MAX_POINTERS,
    MAX_SOFTNESS,
    MODES,
    RADII_M,
    SCALES,
    SPACES,
    Action,
    Clutch,
    Fingertip,
    Grab,
    Hand,
    Key,
    Magnet,
    Move,
    Pin,
    Pinch,
    Release,
    Scale,
    Session,
    Softness,
    Tool,
    Touch,
    Unpin,
    Vector,
    Wait,
)

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


class _Reader:
    def __init__(self, path: Path, text: str) -> None:
        self._path = path
        self._text = text
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
        }

    def session(self, table: dict[str, Any]) -> Session:
        self._refuse_unknown(table, {"title", "hand"}, "the session")
        title = table.get("title", "")
        if not isinstance(title, str):
            raise self._error("title", f"is {title!r}, expected a text")
        hands = table.get("hand")
        if not isinstance(hands, list) or not hands or not all(isinstance(hand, dict) for hand in hands):
            raise self._error("the session", "needs at least one [[hand]]")
        read = tuple(self._hand(hand, f"hand {number}") for number, hand in enumerate(hands, 1))
        taken: set[int] = set()
        for number, hand in enumerate(read, 1):
            for pointer in hand.pointers:
                if pointer in taken:
                    raise self._error(f"hand {number}", f"pointer {pointer} is an earlier hand's; give each its own")
            taken.update(hand.pointers)
        self._check_pins(read)
        return Session(title, read)

    def _check_pins(self, hands: tuple[Hand, ...]) -> None:
        pinned = {action.bone for hand in hands for action in hand.actions if isinstance(action, Pin)}
        for number, hand in enumerate(hands, 1):
            for action in hand.actions:
                if isinstance(action, Unpin) and action.bone is not None and action.bone not in pinned:
                    raise self._error(f"hand {number}", f"unpins '{action.bone}', which no hand of the session pins")

    def _hand(self, table: dict[str, Any], where: str) -> Hand:
        self._refuse_unknown(table, {"pointer", "do"}, where)
        pointer = self._pointer(table.get("pointer"), f"{where}, pointer")
        do = table.get("do")
        if not isinstance(do, list) or not do or not all(isinstance(action, dict) for action in do):
            raise self._error(where, "needs a list `do` of actions, such as { wait = 0.5 }")
        actions = tuple(self._action(action, f"{where}, action {number}") for number, action in enumerate(do, 1))
        for number, action in enumerate(actions, 1):
            if isinstance(action, Pinch) and action.second == pointer:
                raise self._error(f"{where}, action {number} (pinch), with", f"is {pointer}, the hand's own pointer")
        self._check_order(actions, where)
        return Hand(pointer, actions)

    def _action(self, table: dict[str, Any], where: str) -> Action:
        names = [name for name in self._readers if name in table and not self._is_option(name, table)]
        if len(names) != 1:
            found = " and ".join(names) or ", ".join(map(repr, table)) or "nothing"
            raise self._error(where, f"is {found}, expected one of {', '.join(self._readers)}", next(iter(table), ""))
        return self._readers[names[0]](table, f"{where} ({names[0]})")

    def _is_option(self, name: str, table: dict[str, Any]) -> bool:
        """A magnet is an action, and an option of touch and pinch."""
        return name == "magnet" and ("touch" in table or "pinch" in table)

    def _wait(self, table: dict[str, Any], where: str) -> Wait:
        self._refuse_unknown(table, {"wait"}, where)
        return Wait(self._number(table["wait"], where, 0.0, MAX_DURATION_S))

    def _grab(self, table: dict[str, Any], where: str) -> Grab:
        self._refuse_unknown(table, {"grab", "point", "mode", "stiffness", "damping"}, where)
        bone = self._bone(table["grab"], where)
        optional: dict[str, Any] = {}
        if "point" in table:
            optional["point"] = self._vector(table["point"], f"{where}, point")
        for name, least in (("stiffness", math.ulp(0.0)), ("damping", 0.0)):
            if name in table:
                optional[name] = self._number(table[name], f"{where}, {name}", least, math.inf)
        return Grab(bone, mode=self._choice(table, "mode", MODES, where), **optional)

    def _touch(self, table: dict[str, Any], where: str) -> Touch:
        self._refuse_unknown(table, {"touch", "from", "point", *FINGERTIP_OPTIONS}, where)
        if "from" not in table:
            raise self._error(where, "needs `from`, how far from the bone the fingertip comes out [x, y, z]")
        return Touch(
            bone=self._bone(table["touch"], where),
            offset=self._vector(table["from"], f"{where}, from"),
            point=self._point(table, where),
            fingertip=self._fingertip(table, where),
        )

    def _pinch(self, table: dict[str, Any], where: str) -> Pinch:
        needed = ("with", "along", "width", "close", "over")
        self._refuse_unknown(table, {"pinch", "point", *needed, *FINGERTIP_OPTIONS}, where)
        for name in needed:
            if name not in table:
                raise self._error(where, f"needs `{name}`")
        along = self._vector(table["along"], f"{where}, along")
        if along == (0.0, 0.0, 0.0):
            raise self._error(f"{where}, along", "is no direction")
        width = self._number(table["width"], f"{where}, width", math.ulp(0.0), math.inf)
        return Pinch(
            bone=self._bone(table["pinch"], where),
            second=self._pointer(table["with"], f"{where}, with"),
            along=along,
            width=width,
            close=self._number(table["close"], f"{where}, close", 0.0, width),
            duration_s=self._number(table["over"], f"{where}, over", math.ulp(0.0), MAX_DURATION_S),
            point=self._point(table, where),
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
            name: self._number(table[name], f"{where}, {name}", *ranges[name]) for name in ranges if name in table
        }
        if "magnet" in table:
            optional["magnet"] = self._boolean(table["magnet"], f"{where}, magnet")
        return Fingertip(**optional)

    def _pin(self, table: dict[str, Any], where: str) -> Pin:
        self._refuse_unknown(table, {"pin", "point", "mode", "hold"}, where)
        return Pin(
            bone=self._bone(table["pin"], where),
            point=self._point(table, where) if "point" in table else None,
            mode=self._choice(table, "mode", MODES, where),
            hold=self._choice(table, "hold", HOLDS, where),
        )

    def _unpin(self, table: dict[str, Any], where: str) -> Unpin:
        self._refuse_unknown(table, {"unpin"}, where)
        if table["unpin"] is True:
            return Unpin(None)
        return Unpin(self._bone(table["unpin"], where, "the name of a bone, or true for all"))

    def _softness(self, table: dict[str, Any], where: str) -> Softness:
        self._refuse_unknown(table, {"softness", "bone"}, where)
        factor = self._number(table["softness"], where, 0.0, MAX_SOFTNESS)
        return Softness(factor, self._bone(table["bone"], f"{where}, bone") if "bone" in table else None)

    def _scale(self, table: dict[str, Any], where: str) -> Scale:
        self._refuse_unknown(table, {"scale"}, where)
        return Scale(self._number(table["scale"], where, *SCALES))

    def _flag(self, table: dict[str, Any], name: str, where: str) -> bool:
        self._refuse_unknown(table, {name}, where)
        return self._boolean(table[name], where)

    def _move(self, table: dict[str, Any], where: str) -> Move:
        self._refuse_unknown(table, {"move", "over", "space", "interpolation"}, where)
        if "over" not in table:
            raise self._error(where, "needs `over`, the seconds it takes")
        return Move(
            to=self._vector(table["move"], where),
            duration_s=self._number(table["over"], f"{where}, over", math.ulp(0.0), MAX_DURATION_S),
            space=self._choice(table, "space", SPACES, where),
            interpolation=self._choice(table, "interpolation", INTERPOLATIONS, where),
        )

    def _release(self, table: dict[str, Any], where: str) -> Release:
        self._refuse_unknown(table, {"release"}, where)
        self._true(table["release"], where)
        return Release()

    def _key(self, table: dict[str, Any], where: str) -> Key:
        self._refuse_unknown(table, {"key"}, where)
        self._true(table["key"], where)
        return Key()

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
                        raise self._error(place, reason)
                    if clutched:
                        raise self._error(place, "needs the clutch off: its pointer would not get there")
                    held = action
                case Move() | Release() if held is None:
                    raise self._error(place, "needs the hand to hold something; grab a bone first")
                case Move() if clutched and action.space == "world":
                    raise self._error(place, "cannot go to a place in the world while the clutch is held")
                case Release():
                    held = None
                case Magnet() if not isinstance(held, Touch | Pinch):
                    raise self._error(place, "needs a fingertip that is out; touch or pinch first")
                case Clutch():
                    clutched = action.held
        if held is not None:
            raise self._error(where, f"still holds '{held.bone}' at its end; add {{ release = true }}")
        if clutched:
            raise self._error(where, "still holds the clutch at its end; add { clutch = false }")

    def _refuse_unknown(self, table: dict[str, Any], known: set[str], where: str) -> None:
        for name in table:
            if name not in known:
                raise self._error(where, f"has an unknown '{name}', expected {', '.join(sorted(known))}", name)

    def _number(self, value: Any, where: str, least: float, most: float) -> float:
        if type(value) not in (int, float) or not math.isfinite(value) or not least <= value <= most:
            bound = "more than 0" if 0.0 < least < 1e-300 else f"at least {least:g}"
            above = "" if math.isinf(most) else f", at most {most:g}"
            raise self._error(where, f"is {value!r}, expected a number of {bound}{above}")
        return float(value)

    def _pointer(self, value: Any, where: str) -> int:
        if type(value) is not int or not 0 <= value < MAX_POINTERS:
            raise self._error(where, f"is {value!r}, expected a whole number 0 to {MAX_POINTERS - 1}")
        return value

    def _bone(self, value: Any, where: str, expected: str = "the name of a bone") -> str:
        if not isinstance(value, str) or not value:
            raise self._error(where, f"is {value!r}, expected {expected}")
        return value

    def _point(self, table: dict[str, Any], where: str) -> Vector:
        return self._vector(table["point"], f"{where}, point") if "point" in table else (0.0, 0.0, 0.0)

    def _boolean(self, value: Any, where: str) -> bool:
        if not isinstance(value, bool):
            raise self._error(where, f"is {value!r}, expected true or false")
        return value

    def _vector(self, value: Any, where: str) -> Vector:
        if not isinstance(value, list) or len(value) != 3:
            raise self._error(where, f"is {value!r}, expected three numbers [x, y, z]")
        x, y, z = (self._number(component, where, -math.inf, math.inf) for component in value)
        return (x, y, z)

    def _choice(self, table: dict[str, Any], name: str, choices: tuple[str, ...], where: str) -> str:
        value = table.get(name, choices[0])
        if value not in choices:
            raise self._error(f"{where}, {name}", f"is {value!r}, expected {' or '.join(choices)}")
        return str(value)

    def _true(self, value: Any, where: str) -> None:
        if value is not True:
            raise self._error(where, f"is {value!r}, expected true")

    def _error(self, where: str, what: str, key: str = "") -> LayfigureError:
        """`key` finds the line: TOML's reader does not keep it."""
        pattern = rf"(?:^|[\s{{,\[\.]){re.escape(key)}[\"']?\s*(?:=|\])"
        match = re.search(pattern, self._text, re.MULTILINE) if key else None
        line = f":{self._text.count(chr(10), 0, match.end()) + 1}" if match else ""
        return LayfigureError(f"{self._path}{line}: {where} {what}")
