"""What a session expects of the doll, in TOML, in one table for each quantity:

    [[expect]]
    name = "the arm stays up"       # for the report, may be left out
    at = 2.5                        # s of the session
    position = "LeftHand"           # of the bone's head, or of point = [x, y, z] in its frame [m]
    is = [0.1, 0.0, 1.4]            # m, world; with since = MOMENT: from where it was then
    tolerance = 0.01                # m

When: at = MOMENT; by = MOMENT (at one pose at least up to then); during = [MOMENT, MOMENT] (at every pose); within =
[MOMENT, MOMENT] (at one at least). A MOMENT is a number of seconds from the session's start, or the name of a step
{ mark = "up" }. As a step of a hand, { expect = { torque = "LeftArm", at_least = 0.5 } } judges the newest pose there,
before the steps of the same moment have taken effect.

What:

    moved = BONE, since = MOMENT                    # m, its head's distance from where it was; also point
    rotation = BONE                                 # degrees from the character's rest pose; with about = [x, y, z] in
                                                    # the bone's frame: its twist about that axis, -180 to 180
    strain = BONE                                   # degrees from where its joint springs back to
    flow = BONE                                     # degrees that its joint's rest has flowed from the character's
    torque = BONE                                   # N m; with about = [x, y, z] in the bone's frame: about that axis
    speed = BONE                                    # m/s of its head
    force = POINTER                                 # N on the doll or the fingertip; with along = [x, y, z]: that way
    rate = "LAYFIGURE_POSE"                         # Hz of the session's time, with `during`; also LAYFIGURE_FORCE; on
                                                    # the realtime clock LAYFIGURE_STATUS and LAYFIGURE_CHARACTER

each with its bounds: is = NUMBER and tolerance = NUMBER, or between = [LEAST, MOST], or at_least =
NUMBER, or at_most = NUMBER.

    at_rest = true                                  # no bone's head is faster than tolerance = 0.001 m/s
    yielded = BONE, is = true                       # its joint flowed after since = MOMENT [the session's start]
    contact = POINTER, is = true                    # it holds or touches the doll; with bone = BONE: that bone
    same_state_as = MOMENT, tolerance = 0.1         # degrees: every joint's rotation and rest rotation, as then
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from layfigure.expectation import (
    RATED_CHANNELS,
    Answer,
    Bounds,
    Contact,
    Expectation,
    Flow,
    Force,
    Moment,
    Moved,
    Position,
    Quantity,
    Rate,
    Rotation,
    SameState,
    Speed,
    Strain,
    Torque,
    Vector,
    Window,
    Yielded,
)
from layfigure.session_tables import TableReader

BOUNDS = ("is", "between", "at_least", "at_most")
WINDOWS = ("at", "by", "during", "within")
REST_SPEED = 1e-3  # [m/s]: a millimetre in a second is not seen to move
HALF_TURN_DEG = 180.0

Read = tuple[Quantity, Bounds]


class ExpectationReader:
    """Reads one table; `tables` tells its errors."""

    def __init__(self, tables: TableReader) -> None:
        self._tables = tables
        self._readers: dict[str, Callable[[dict[str, Any], str], Read]] = {
            "position": self._position,
            "moved": self._moved,
            "rotation": self._rotation,
            "strain": lambda table, where: self._angle(table, where, "strain", Strain),
            "flow": lambda table, where: self._angle(table, where, "flow", Flow),
            "torque": self._torque,
            "speed": self._speed,
            "at_rest": self._at_rest,
            "force": self._force,
            "rate": self._rate,
            "same_state_as": self._same_state,
            "yielded": self._yielded,
            "contact": self._contact,
        }

    def table(self, table: dict[str, Any], where: str) -> Expectation:
        """One of [[expect]], which has a window."""
        found = [name for name in WINDOWS if name in table]
        if len(found) != 1:
            raise self._tables.error(where, f"has {' and '.join(found) or 'no moment'}, expected one of {_or(WINDOWS)}")
        rest = {name: value for name, value in table.items() if name != found[0]}
        expectation = self.step(rest, where)
        window = self._window(found[0], table[found[0]], where)
        if isinstance(expectation.quantity, Rate) and found[0] != "during":
            raise self._tables.error(where, "needs `during`, the time over which messages are counted", "rate")
        if isinstance(expectation.quantity, Yielded) and not window.every and expectation.bounds.most < 1.0:
            raise self._tables.error(where, f"always holds: nothing has yielded at first; use `at`, not `{found[0]}`")
        return replace(expectation, window=window)

    def step(self, table: dict[str, Any], where: str) -> Expectation:
        """One of a hand's list, without a window."""
        names = [name for name in self._readers if name in table]
        if len(names) != 1:
            found = " and ".join(names) or ", ".join(map(repr, table)) or "nothing"
            raise self._tables.error(
                where, f"is {found}, expected one of {', '.join(self._readers)}", next(iter(table), "")
            )
        name = self._tables.text(table.get("name", ""), f"{where}, name")
        quantity, bounds = self._readers[names[0]](table, f"{where} ({names[0]})")
        return Expectation(quantity, bounds, where, self._tables.line, name)

    def answer(self, table: dict[str, Any], where: str) -> Expectation | None:
        """Of a command's step: refused, accepted or result, if one of them is there."""
        found = [name for name in ("accepted", "refused", "result") if name in table]
        if not found:
            for name in (*BOUNDS, "tolerance"):
                if name in table:
                    raise self._tables.error(where, f"has `{name}`, which needs `result`", name)
            return None
        if len(found) > 1:
            raise self._tables.error(where, f"has {' and '.join(found)}, expected one of them")
        if found != ["result"] and (extra := [name for name in (*BOUNDS, "tolerance") if name in table]):
            raise self._tables.error(where, f"has `{extra[0]}`, which needs `result`", extra[0])
        command, bounds = str(table["command"]), Bounds(1.0, 1.0)
        if found == ["accepted"]:
            self._tables.true(table["accepted"], f"{where}, accepted")
            quantity = Answer(command)
        elif found == ["refused"]:
            words = self._tables.text(table["refused"], f"{where}, refused")
            if not words:
                raise self._tables.error(f"{where}, refused", "is empty, expected some words of the reason", "refused")
            quantity = Answer(command, refused=words)
        else:
            quantity = Answer(command, result=self._tables.text(table["result"], f"{where}, result"))
            bounds = self._bounds(table, where, -math.inf, math.inf, exact=True)
        return Expectation(quantity, bounds, where, self._tables.line)

    def _window(self, kind: str, value: Any, where: str) -> Window:
        place = f"{where}, {kind}"
        if kind in ("at", "by"):
            moment = self._moment(value, place)
            return Window(moment, moment) if kind == "at" else Window(0.0, moment, every=False)
        if not isinstance(value, list) or len(value) != 2:
            raise self._tables.error(place, f"is {value!r}, expected two moments [FROM, TO]", kind)
        first, last = (self._moment(moment, place) for moment in value)
        return Window(first, last, every=kind == "during")

    def _moment(self, value: Any, where: str) -> Moment:
        if isinstance(value, str) and value:
            return value
        if type(value) not in (int, float) or not (math.isfinite(value) and value >= 0.0):
            raise self._tables.error(where, f"is {value!r}, expected seconds from 0 or the name of a mark")
        return float(value)

    def _known(self, table: dict[str, Any], where: str, *names: str) -> None:
        self._tables.refuse_unknown(table, {"name", *names}, where)

    def _position(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "position", "is", "tolerance", "point", "since")
        for name in ("is", "tolerance"):
            if name not in table:
                raise self._tables.error(where, f"needs `{name}`", "position")
        quantity = Position(
            self._tables.bone(table["position"], where),
            self._tables.vector(table["is"], f"{where}, is"),
            self._tables.point(table, where),
            self._since(table, where),
        )
        return quantity, Bounds(0.0, self._tolerance(table, where))

    def _moved(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "moved", "point", "since", "tolerance", *BOUNDS)
        bone = self._tables.bone(table["moved"], where)
        since = self._since(table, where)
        if since is None:
            raise self._tables.error(where, "needs `since`, a moment", "moved")
        return Moved(bone, since, self._tables.point(table, where)), self._bounds(table, where, 0.0, math.inf)

    def _rotation(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "rotation", "about", "tolerance", *BOUNDS)
        about = self._direction(table, "about", where)
        least = 0.0 if about is None else -HALF_TURN_DEG
        quantity = Rotation(self._tables.bone(table["rotation"], where), about)
        return quantity, self._bounds(table, where, least, HALF_TURN_DEG)

    def _angle(self, table: dict[str, Any], where: str, name: str, make: Callable[[str], Quantity]) -> Read:
        self._known(table, where, name, "tolerance", *BOUNDS)
        return make(self._tables.bone(table[name], where)), self._bounds(table, where, 0.0, HALF_TURN_DEG)

    def _torque(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "torque", "about", "tolerance", *BOUNDS)
        about = self._direction(table, "about", where)
        quantity = Torque(self._tables.bone(table["torque"], where), about)
        return quantity, self._bounds(table, where, 0.0 if about is None else -math.inf, math.inf)

    def _speed(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "speed", "tolerance", *BOUNDS)
        return Speed(self._tables.bone(table["speed"], where)), self._bounds(table, where, 0.0, math.inf)

    def _at_rest(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "at_rest", "tolerance")
        tolerance = self._tolerance(table, where) if "tolerance" in table else REST_SPEED
        if self._tables.boolean(table["at_rest"], where):
            return Speed(), Bounds(0.0, tolerance)
        return Speed(), Bounds(math.nextafter(tolerance, math.inf))

    def _force(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "force", "along", "tolerance", *BOUNDS)
        along = self._direction(table, "along", where)
        quantity = Force(self._tables.pointer(table["force"], where), along)
        return quantity, self._bounds(table, where, 0.0 if along is None else -math.inf, math.inf)

    def _rate(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "rate", "tolerance", *BOUNDS)
        channel = self._tables.choice(table, "rate", RATED_CHANNELS, where)
        return Rate(channel), self._bounds(table, where, 0.0, math.inf)

    def _same_state(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "same_state_as", "tolerance")
        if "tolerance" not in table:
            raise self._tables.error(where, "needs `tolerance`, in degrees", "same_state_as")
        moment = self._moment(table["same_state_as"], where)
        return SameState(moment), Bounds(0.0, self._tolerance(table, where, most=HALF_TURN_DEG))

    def _yielded(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "yielded", "is", "since")
        since = self._since(table, where)
        quantity = Yielded(self._tables.bone(table["yielded"], where), 0.0 if since is None else since)
        return quantity, self._truth(table, where)

    def _contact(self, table: dict[str, Any], where: str) -> Read:
        self._known(table, where, "contact", "is", "bone")
        bone = self._tables.bone(table["bone"], f"{where}, bone") if "bone" in table else None
        return Contact(self._tables.pointer(table["contact"], where), bone), self._truth(table, where)

    def _truth(self, table: dict[str, Any], where: str) -> Bounds:
        if "is" not in table:
            raise self._tables.error(where, "needs `is`, true or false")
        value = float(self._tables.boolean(table["is"], f"{where}, is"))
        return Bounds(value, value)

    def _since(self, table: dict[str, Any], where: str) -> Moment | None:
        return self._moment(table["since"], f"{where}, since") if "since" in table else None

    def _direction(self, table: dict[str, Any], name: str, where: str) -> Vector | None:
        if name not in table:
            return None
        direction = self._tables.vector(table[name], f"{where}, {name}")
        if direction == (0.0, 0.0, 0.0):
            raise self._tables.error(f"{where}, {name}", "is no direction", name)
        return direction

    def _tolerance(self, table: dict[str, Any], where: str, most: float = math.inf) -> float:
        return self._tables.number(table["tolerance"], f"{where}, tolerance", 0.0, most)

    def _bounds(self, table: dict[str, Any], where: str, least: float, most: float, exact: bool = False) -> Bounds:
        """`least` and `most`: of what the quantity can be. Bounds that all of it fulfils are refused."""
        found = [name for name in BOUNDS if name in table]
        if len(found) != 1:
            raise self._tables.error(where, f"has {' and '.join(found) or 'no bounds'}, expected one of {_or(BOUNDS)}")
        (name,) = found
        place = f"{where}, {name}"
        if "tolerance" in table and name != "is":
            raise self._tables.error(where, f"has a `tolerance`, which goes with `is`, not with `{name}`", "tolerance")
        if name == "is":
            if "tolerance" not in table and not exact:
                raise self._tables.error(where, "needs `tolerance`", "is")
            middle = self._tables.number(table["is"], place, least, most)
            tolerance = self._tolerance(table, where) if "tolerance" in table else 0.0
            bounds = Bounds(middle - tolerance, middle + tolerance)
        elif name == "between":
            value = table["between"]
            if not isinstance(value, list) or len(value) != 2:
                raise self._tables.error(place, f"is {value!r}, expected [LEAST, MOST]", name)
            bounds = Bounds(*(self._tables.number(bound, place, least, most) for bound in value))
            if bounds.least > bounds.most:
                raise self._tables.error(place, f"is {value!r}, expected the smaller number first", name)
        elif name == "at_least":
            bounds = Bounds(least=self._tables.number(table[name], place, least, most))
        else:
            bounds = Bounds(most=self._tables.number(table[name], place, least, most))
        if bounds.least <= least and bounds.most >= most:
            raise self._tables.error(where, "always holds, whatever the doll does: give narrower bounds", name)
        return bounds


def references(quantity: Quantity) -> tuple[Moment, ...]:
    """The moments, besides its window, whose state the quantity needs."""
    since = getattr(quantity, "since", None)
    return () if since is None else (since,)


def _or(names: Iterable[str]) -> str:
    return ", ".join(names)
