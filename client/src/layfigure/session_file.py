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
left out, the server's defaults hold. Anything that is not listed here is refused.
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
    INTERPOLATIONS,
    MAX_DURATION_S,
    MAX_POINTERS,
    MODES,
    SPACES,
    Action,
    Grab,
    Hand,
    Key,
    Move,
    Release,
    Session,
    Vector,
    Wait,
)


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
            "move": self._move,
            "release": self._release,
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
        pointers = [hand.pointer for hand in read]
        for number, pointer in enumerate(pointers, 1):
            if pointer in pointers[: number - 1]:
                raise self._error(f"hand {number}", f"pointer {pointer} is an earlier hand's; give each its own")
        return Session(title, read)

    def _hand(self, table: dict[str, Any], where: str) -> Hand:
        self._refuse_unknown(table, {"pointer", "do"}, where)
        pointer = table.get("pointer")
        if type(pointer) is not int or not 0 <= pointer < MAX_POINTERS:
            raise self._error(f"{where}, pointer", f"is {pointer!r}, expected a whole number 0 to {MAX_POINTERS - 1}")
        do = table.get("do")
        if not isinstance(do, list) or not do or not all(isinstance(action, dict) for action in do):
            raise self._error(where, "needs a list `do` of actions, such as { wait = 0.5 }")
        actions = tuple(self._action(action, f"{where}, action {number}") for number, action in enumerate(do, 1))
        self._check_order(actions, where)
        return Hand(pointer, actions)

    def _action(self, table: dict[str, Any], where: str) -> Action:
        names = [name for name in self._readers if name in table]
        if len(names) != 1:
            found = " and ".join(names) or ", ".join(map(repr, table)) or "nothing"
            raise self._error(where, f"is {found}, expected one of {', '.join(self._readers)}", next(iter(table), ""))
        return self._readers[names[0]](table, f"{where} ({names[0]})")

    def _wait(self, table: dict[str, Any], where: str) -> Wait:
        self._refuse_unknown(table, {"wait"}, where)
        return Wait(self._number(table["wait"], where, 0.0, MAX_DURATION_S))

    def _grab(self, table: dict[str, Any], where: str) -> Grab:
        self._refuse_unknown(table, {"grab", "point", "mode", "stiffness", "damping"}, where)
        bone = table["grab"]
        if not isinstance(bone, str) or not bone:
            raise self._error(where, f"is {bone!r}, expected the name of a bone")
        optional: dict[str, Any] = {}
        if "point" in table:
            optional["point"] = self._vector(table["point"], f"{where}, point")
        for name, least in (("stiffness", math.ulp(0.0)), ("damping", 0.0)):
            if name in table:
                optional[name] = self._number(table[name], f"{where}, {name}", least, math.inf)
        return Grab(bone, mode=self._choice(table, "mode", MODES, where), **optional)

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
        held: str | None = None
        for number, action in enumerate(actions, 1):
            place = f"{where}, action {number}"
            if isinstance(action, Grab):
                if held is not None:
                    raise self._error(place, f"grabs '{action.bone}' while the hand holds '{held}'; release it first")
                held = action.bone
            elif held is None and isinstance(action, Move | Release):
                raise self._error(place, "needs the hand to hold something; grab a bone first")
            elif isinstance(action, Release):
                held = None
        if held is not None:
            raise self._error(where, f"still holds '{held}' at its end; add {{ release = true }}")

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
