"""The tables of a session file, read strictly: what is wrong is told in a line with file, place and mend."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

from layfigure.errors import LayfigureError
from layfigure.expectation import Vector
from layfigure.session import MAX_POINTERS


class TableReader:
    def __init__(self, path: Path, text: str, start: int | None = None) -> None:
        """`start`: where in the text the table begins whose errors are told; None: it is not known."""
        self._path = path
        self._text = text
        self._start = start

    def refuse_unknown(self, table: dict[str, Any], known: set[str], where: str) -> None:
        for name in table:
            if name not in known:
                raise self.error(where, f"has an unknown '{name}', expected {', '.join(sorted(known))}", name)

    def number(self, value: Any, where: str, least: float, most: float) -> float:
        if type(value) not in (int, float) or not math.isfinite(value) or not least <= value <= most:
            raise self.error(where, f"is {value!r}, expected a number{_range(least, most)}")
        return float(value)

    def pointer(self, value: Any, where: str) -> int:
        if type(value) is not int or not 0 <= value < MAX_POINTERS:
            raise self.error(where, f"is {value!r}, expected a whole number 0 to {MAX_POINTERS - 1}")
        return value

    def bone(self, value: Any, where: str, expected: str = "the name of a bone") -> str:
        if not isinstance(value, str) or not value:
            raise self.error(where, f"is {value!r}, expected {expected}")
        return value

    def point(self, table: dict[str, Any], where: str) -> Vector:
        return self.vector(table["point"], f"{where}, point") if "point" in table else (0.0, 0.0, 0.0)

    def boolean(self, value: Any, where: str) -> bool:
        if not isinstance(value, bool):
            raise self.error(where, f"is {value!r}, expected true or false")
        return value

    def vector(self, value: Any, where: str) -> Vector:
        if not isinstance(value, list) or len(value) != 3:
            raise self.error(where, f"is {value!r}, expected three numbers [x, y, z]")
        x, y, z = (self.number(component, where, -math.inf, math.inf) for component in value)
        return (x, y, z)

    def choice(self, table: dict[str, Any], name: str, choices: tuple[str, ...], where: str) -> str:
        value = table.get(name, choices[0])
        if value not in choices:
            raise self.error(f"{where}, {name}", f"is {value!r}, expected {' or '.join(choices)}")
        return str(value)

    def true(self, value: Any, where: str) -> None:
        if value is not True:
            raise self.error(where, f"is {value!r}, expected true")

    def text(self, value: Any, where: str) -> str:
        if not isinstance(value, str):
            raise self.error(where, f"is {value!r}, expected a text")
        return value

    @property
    def line(self) -> int | None:
        """On which the table begins, if that is known."""
        return None if self._start is None else self._line_of(self._start)

    def error(self, where: str, what: str, key: str = "", line: int | None = None) -> LayfigureError:
        """Where the line is not given, `key` finds it from where the table begins: TOML's reader does not keep it."""
        pattern = rf"(?:^|[\s{{,\[\.]){re.escape(key)}[\"']?\s*(?:=|\])"
        match = re.compile(pattern, re.MULTILINE).search(self._text, self._start or 0) if key else None
        if line is None:
            line = self._line_of(match.end()) if match else self.line
        return LayfigureError(f"{self._path}{'' if line is None else f':{line}'}: {where} {what}")

    def _line_of(self, position: int) -> int:
        return self._text.count("\n", 0, position) + 1


def _range(least: float, most: float) -> str:
    if math.isinf(least):
        return ""
    bound = "more than 0" if 0.0 < least < 1e-300 else f"at least {least:g}"
    return f" of {bound}" + ("" if math.isinf(most) else f", at most {most:g}")
