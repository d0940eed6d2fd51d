# SPDX-License-Identifier: GPL-3.0-or-later
"""What a server's replies say. Ring 1: no bpy."""

from __future__ import annotations

import layfigure


def numbers(reply: layfigure.Reply, name: str) -> tuple[float, ...]:
    """The numbers of a result, none if it has none."""
    return next((result.values for result in reply.results if result.name == name), ())


def exactly(reply: layfigure.Reply, name: str, count: int) -> tuple[float, ...]:
    """Likewise, for a result without which there is no going on. Raises ProtocolError."""
    values = numbers(reply, name)
    if len(values) != count:
        raise layfigure.ProtocolError(
            f"the server's answer holds {len(values)} numbers of '{name}', expected {count}: it is of another version "
            "than this extension; install both of one"
        )
    return values
