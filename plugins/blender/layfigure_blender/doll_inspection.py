# SPDX-License-Identifier: GPL-3.0-or-later
"""Asks layfigure-server what doll it would build of a character, and makes it a settings file that it takes.

Without Blender. What is here waits for a process of some tenths of a second, of the largest characters for up to a
minute: it is to be called from a thread of its own.
"""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from layfigure import LayfigureError

from .joint_settings import DollSettings, JointSettings
from .joint_values import DollValues, applicable, inspected
from .settings_file import settings_path_beside, settings_text

Result = TypeVar("Result")

TIMEOUT_S = 300.0  # the largest characters that the server reads take about a minute
COMMENT = "Written by Blender's extension Layfigure of the settings of bones and armature."

_AT_LINE = re.compile(r"\.toml:(\d+): (.*)")
_OF_FILE = re.compile(r"^.*\.inspected\.toml(:\d+)?: ")
_TABLE = re.compile(r"\[joints\.")


@dataclass(frozen=True)
class Prepared:
    """A settings file beside a character, for the server that is to be started with it."""

    asked: DollSettings
    own: DollValues  # what is chosen for the doll, whatever is asked of its joints
    file: Path
    refusals: dict[str, str] = field(
        default_factory=dict
    )  # by bones that the file leaves out, with the server's reason


class BoneRefusedError(LayfigureError):
    """The server's reason, which is about the settings of one bone."""

    def __init__(self, message: str, bone: str, reason: str) -> None:
        super().__init__(message)
        self.bone = bone
        self.reason = reason  # without the file and the line


def inspect(server: str, character: Path, settings: DollSettings) -> DollValues:
    """The doll that these settings make. Raises LayfigureError with the server's reason, BoneRefusedError if that is
    about one bone.
    """
    file = character.with_suffix(".inspected.toml")
    file.write_text(settings_text(settings), "utf-8")
    command = [server, "--inspect", str(character), "--json", "--doll", str(file)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired as error:
        raise LayfigureError(f"'{server}' needed more than {TIMEOUT_S:g} s for '{character}'") from error
    except OSError as error:
        raise LayfigureError(f"'{server}' cannot be run: {error.strerror}") from error
    finally:
        file.unlink(missing_ok=True)
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"'{server}' ended with exit code {done.returncode}"]
        message = lines[-1].removeprefix("layfigure-server: ")
        bone, reason = culprit(message, settings)
        message = _OF_FILE.sub("the doll's settings: ", message)
        raise LayfigureError(message) if bone is None else BoneRefusedError(message, bone, reason)
    return inspected(json.loads(done.stdout))


def own_values(server: str, character: Path, settings: DollSettings) -> DollValues:
    """What is chosen for the doll before anything is asked of its joints. What is asked of a bone and refused is left
    out. Raises LayfigureError: what is asked of the whole doll, or the character, is refused.
    """
    return _leaving_out(settings, lambda rest: _own_values(server, character, rest))[0]


def _own_values(server: str, character: Path, settings: DollSettings) -> DollValues:
    own = inspect(server, character, replace(settings, joints={}))
    bodies = applicable_bodies(settings, own)
    return inspect(server, character, bodies) if bodies.joints else own


def _leaving_out(settings: DollSettings, work: Callable[[DollSettings], Result]) -> tuple[Result, dict[str, str]]:
    """What `work` makes of the settings without those of the bones that it is refused for, and why these are."""
    refusals: dict[str, str] = {}
    while True:
        try:
            return work(settings), refusals
        except BoneRefusedError as error:
            refusals[error.bone] = error.reason
            kept = {bone: joint for bone, joint in settings.joints.items() if bone != error.bone}
            settings = replace(settings, joints=kept)


def applicable_bodies(settings: DollSettings, own: DollValues) -> DollSettings:
    """What is asked of bodies, without bones that the doll does not know. A bone that is to be a body may be more."""

    def of_bone(bone: str, joint: JointSettings) -> JointSettings:
        if bone in own.joints or bone in own.roots or (bone in own.riders and joint.merge is False):
            return joint
        return joint.merge_alone() if bone in own.riders else JointSettings()

    joints = {bone: of_bone(bone, joint) for bone, joint in settings.without_joints().joints.items()}
    return replace(settings, joints={bone: joint for bone, joint in joints.items() if joint})


def prepare(settings: DollSettings, program: Path, character: Path) -> Prepared:
    """Writes CHARACTER.doll.toml with all that the server takes; it then starts, whatever one bone is asked for.

    Raises LayfigureError: what is asked of the whole doll, or the character, is refused.
    """

    server = str(program)

    def tried(given: DollSettings) -> tuple[DollValues, DollSettings]:
        own = _own_values(server, character, given)
        taken = applicable(given, own)
        inspect(server, character, taken)
        return own, taken

    (own, taken), refusals = _leaving_out(settings, tried)
    file = settings_path_beside(character)
    file.write_text(settings_text(taken, COMMENT), "utf-8")
    return Prepared(settings, own, file, refusals)


def culprit(message: str, settings: DollSettings) -> tuple[str | None, str]:
    """The bone whose table of the settings file a message is about, and what it says; None if it is about none."""
    found = _AT_LINE.search(message)
    if found is None:
        return None, message
    above = settings_text(settings).splitlines()[: int(found[1])]
    tables = sum(1 for line in above if _TABLE.match(line))
    names = [name for name, joint in settings.joints.items() if joint]
    return (names[tables - 1], found[2]) if tables > 0 else (None, message)
