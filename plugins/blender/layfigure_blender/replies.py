# SPDX-License-Identifier: GPL-3.0-or-later
"""What a server's replies say. Ring 1: no bpy."""

from __future__ import annotations

import layfigure


def numbers(reply: layfigure.Reply, name: str) -> tuple[float, ...]:
    """The numbers of a result, none if it has none."""
    return next((result.values for result in reply.results if result.name == name), ())
