# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that are a command to the doll, whose answer Blender waits for."""

from __future__ import annotations

import concurrent.futures
from typing import Any

import bpy

from layfigure import LayfigureError, Reply

from . import sessions
from .live import live_session, sentence

REPLY_TIMEOUT_S = 2.0  # of commands that take the server some ms; Blender stands still meanwhile


def ask(operator: bpy.types.Operator, session: sessions.Session, name: str, /, **arguments: Any) -> Reply | None:
    """The answer to a command; None if there is none, which the operator has reported then."""
    try:
        return session.link.send(name, **arguments).result(REPLY_TIMEOUT_S)
    except concurrent.futures.TimeoutError:
        operator.report({"ERROR"}, f"The doll's server did not answer '{name}' within {REPLY_TIMEOUT_S:g} s")
    except LayfigureError as error:
        operator.report({"ERROR"}, sentence(error))
    return None


class ChangesDoll:
    """An operator that is one command, and one step of Blender's undo."""

    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return live_session(cls, context) is not None

    def change(self, context: bpy.types.Context, name: str, /, **arguments: Any) -> Reply | None:
        session = sessions.active(context)
        reply = ask(self, session, name, **arguments)
        if reply is not None:
            session.note_place()
        return reply

    def only_change(self, context: bpy.types.Context, name: str, /, **arguments: Any) -> set[str]:
        """What execute() returns where there is nothing to tell."""
        return {"CANCELLED"} if self.change(context, name, **arguments) is None else {"FINISHED"}
