# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings files of the server, CHARACTER.doll.toml: written from settings, and read back. Without Blender."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from .joint_settings import (
    AMOUNTS,
    AXES,
    BODY_NUMBERS,
    DOLL_NUMBERS,
    FACTORS,
    HALF_TURN_DEG,
    LAWS,
    LAWS_OF_AXES,
    LIMIT_AXES,
    MATERIALS,
    SHAPES,
    Amount,
    AxisAmounts,
    DollSettings,
    JointSettings,
    Limits,
    Range,
)

_REPLACEMENT = "?"  # any one character, in a pattern: what cannot be said in UTF-8


class SettingsFileError(Exception):
    """A settings file that cannot be used; one line with the file, the key and what is expected."""


def settings_path_beside(character: Path) -> Path:
    """Where the server looks for the settings of a character."""
    return character.with_suffix(".doll.toml")


# --- writing ---------------------------------------------------------------------------------------------------------


def settings_text(settings: DollSettings, comment: str = "") -> str:
    """The file; reading it makes the same settings. `comment` is put on top of it."""
    lines = [f"# {_printable(line)}" for line in comment.splitlines()]
    if settings.material is not None:
        lines.append(f"material = {quoted(settings.material)}")
    lines += [f"{name} = {_number(settings.numbers[name])}" for name in DOLL_NUMBERS if name in settings.numbers]
    for pattern, joint in settings.joints.items():
        if joint:
            lines += ["", f"[joints.{quoted(pattern)}]", *_joint_lines(joint)]
    return "\n".join(lines) + "\n"


def quoted(text: str) -> str:
    """The text as a TOML string, which is also a key. Half a surrogate pair, as Blender makes it of bytes that are not
    UTF-8, is no character that a file can hold: it becomes a ?, which as a pattern matches whatever is there.
    """
    return '"' + "".join(_escaped(letter) for letter in text) + '"'


def _escaped(letter: str) -> str:
    if letter in '"\\':
        return "\\" + letter
    if "\ud800" <= letter <= "\udfff":
        return _REPLACEMENT
    return f"\\u{ord(letter):04X}" if _is_control(letter) else letter


def _is_control(letter: str) -> bool:
    return letter < " " or letter == "\x7f"


def _printable(text: str) -> str:
    return "".join(_REPLACEMENT if _is_control(c) or "\ud800" <= c <= "\udfff" else c for c in text)


def _number(value: float) -> str:
    """The shortest text that reads back as the same double: repr() says inf and 1e-05 as TOML does."""
    return repr(float(value))


def _joint_lines(joint: JointSettings) -> list[str]:
    lines = []
    if joint.merge is not None:
        lines.append(f"merge = {'true' if joint.merge else 'false'}")
    lines += [f"{name} = {_law_text(joint.laws[name])}" for name in LAWS if name in joint.laws]
    limits = [
        f"{axis} = [{', '.join(map(_number, joint.limits[axis]))}]" for axis in LIMIT_AXES if axis in joint.limits
    ]
    if limits:
        lines.append("limits = {" + ", ".join(limits) + "}")
    if joint.locked is not None:
        lines.append("locked = [" + ", ".join(quoted(axis) for axis in AXES if axis in joint.locked) + "]")
    if joint.shape is not None:
        lines.append(f"shape = {quoted(joint.shape)}")
    return lines + [f"{name} = {_number(joint.numbers[name])}" for name in BODY_NUMBERS if name in joint.numbers]


def _law_text(law: Amount | AxisAmounts) -> str:
    if isinstance(law, Amount):
        return _amount_text(law)
    given = zip(AXES, law, strict=True)
    return "{" + ", ".join(f"{axis} = {_amount_text(amount)}" for axis, amount in given if amount is not None) + "}"


def _amount_text(amount: Amount) -> str:
    return f"{{factor = {_number(amount.number)}}}" if amount.is_factor else _number(amount.number)


# --- reading ---------------------------------------------------------------------------------------------------------


def read_settings(path: Path) -> DollSettings:
    """Raises SettingsFileError."""
    try:
        text = path.read_text("utf-8")
    except UnicodeDecodeError as error:
        raise SettingsFileError(f"{path}: not a text in UTF-8: {error.reason} at byte {error.start}") from error
    except OSError as error:
        raise SettingsFileError(f"{path}: cannot be read: {error.strerror}; check the path") from error
    return parse_settings(text, str(path))


def parse_settings(text: str, source: str) -> DollSettings:
    """Raises SettingsFileError, which begins with `source`."""
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise SettingsFileError(f"{source}: not TOML: {error}") from error
    return _Reader(source).settings(table)


class _Reader:
    def __init__(self, source: str) -> None:
        self._source = source
        self._where = ""

    def settings(self, table: Mapping[str, Any]) -> DollSettings:
        numbers = {}
        joints: dict[str, JointSettings] = {}
        for key, value in table.items():
            if key == "joints":
                joints = self._tables(value)
            elif key in DOLL_NUMBERS:
                numbers[key] = self._number(key, value, DOLL_NUMBERS[key])
            elif key != "material":
                self._refuse(f"unknown key '{key}', expected one of {_list(('material', *DOLL_NUMBERS, 'joints'))}")
        material = table.get("material")
        return DollSettings(
            None if material is None else self._choice("material", material, MATERIALS), numbers, joints
        )

    def _refuse(self, why: str) -> NoReturn:
        raise SettingsFileError(f"{self._source}: {self._where}{why}")

    def _tables(self, tables: Any) -> dict[str, JointSettings]:
        if not isinstance(tables, dict):
            self._refuse('joints: expected tables such as [joints."*Arm"]')
        joints = {}
        for pattern, table in tables.items():
            self._where = f"[joints.{quoted(pattern)}] "
            if not isinstance(table, dict):
                self._refuse("expected a table")
            joints[pattern] = self._joint(table)
        self._where = ""
        return joints

    def _joint(self, table: Mapping[str, Any]) -> JointSettings:
        readers: dict[str, Callable[[Any], object]] = {
            "limits": self._limits,
            "locked": self._locked,
            "merge": lambda value: self._flag("merge", value),
            "shape": lambda value: self._choice("shape", value, SHAPES),
        }
        known = (*LAWS, *readers, *BODY_NUMBERS)
        for key in table:
            if key not in known:
                self._refuse(f"unknown key '{key}', expected one of {_list(known)}")
        if "density" in table and "mass" in table:
            self._refuse("density and mass: expected only one of them")
        numbers = {k: self._number(k, table[k], allowed) for k, allowed in BODY_NUMBERS.items() if k in table}
        laws = {name: self._law(name, table[name]) for name in LAWS if name in table}
        rest: dict[str, Any] = {key: reader(table[key]) for key, reader in readers.items() if key in table}
        return JointSettings(laws=laws, numbers=numbers, **rest)

    def _number(self, name: str, value: Any, allowed: Range) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._refuse(f"{name}: expected a number")
        complaint = allowed.complaint(name, float(value))
        if complaint:
            self._refuse(complaint)
        return float(value)

    def _flag(self, name: str, value: Any) -> bool:
        if not isinstance(value, bool):
            self._refuse(f"{name}: expected true or false")
        return bool(value)

    def _choice(self, name: str, value: Any, choices: tuple[str, ...]) -> str:
        if value not in choices:
            self._refuse(f"{name} = {value!r}, expected one of {_list(choices)}, in quotes")
        return str(value)

    def _law(self, name: str, value: Any) -> Amount | AxisAmounts:
        if name in LAWS_OF_AXES and isinstance(value, dict) and any(axis in value for axis in AXES):
            for axis in value:
                if axis not in AXES:
                    self._refuse(f"{name}: unknown axis '{axis}', expected one of {_list(AXES)}")
            twist, bend_y, bend_z = (
                self._amount(f"{name}.{axis}", name, value[axis]) if axis in value else None for axis in AXES
            )
            return twist, bend_y, bend_z
        return self._amount(name, name, value)

    def _amount(self, name: str, law: str, value: Any) -> Amount:
        if not isinstance(value, dict):
            return Amount(self._number(name, value, AMOUNTS[law]))
        if set(value) != {"factor"}:
            self._refuse(f"{name}: expected a number or {{factor = NUMBER}}")
        return Amount(self._number(f"{name}.factor", value["factor"], FACTORS), is_factor=True)

    def _limits(self, value: Any) -> dict[str, Limits]:
        if not isinstance(value, dict) or not value:
            self._refuse(f"limits: expected a table such as {{twist = [-30, 30]}} of {_list(LIMIT_AXES)}, in degrees")
        for axis in value:
            if axis not in LIMIT_AXES:
                self._refuse(f"limits: unknown axis '{axis}', expected one of {_list(LIMIT_AXES)}")
        return {axis: self._pair(f"limits.{axis}", value[axis]) for axis in LIMIT_AXES if axis in value}

    def _pair(self, name: str, value: Any) -> Limits:
        if not isinstance(value, list) or len(value) != 2:
            self._refuse(f"{name}: expected [lower, upper] in degrees, such as [-30, 30]")
        lower = self._number(f"{name} lower", value[0], Range(-HALF_TURN_DEG, 0.0))
        upper = self._number(f"{name} upper", value[1], Range(0.0, HALF_TURN_DEG))
        return lower, upper

    def _locked(self, value: Any) -> frozenset[str]:
        if not isinstance(value, list) or any(axis not in AXES for axis in value):
            self._refuse(f"locked: expected a list of {_list(AXES)}, in quotes")
        return frozenset(value)


def _list(names: tuple[str, ...]) -> str:
    return ", ".join(names)


def of_single(value: float) -> float:
    """The double that the shortest text of a single-precision number reads as: 0.1 for what Blender keeps of 0.1."""
    if not math.isfinite(value):
        return math.nan if math.isnan(value) else value  # one and the same, so that settings with it equal themselves
    return float(np.format_float_positional(np.float32(value), unique=True))
