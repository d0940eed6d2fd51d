# SPDX-License-Identifier: GPL-3.0-or-later
"""Work that waits for other programs, beside Blender's main thread. No bpy: nothing of Blender may be touched there."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from typing import TypeVar

Result = TypeVar("Result")


def in_background(work: Callable[[], Result], name: str) -> Future[Result]:
    """Calls it on a thread of its own, which does not keep Blender from ending; the future has what it returns."""
    future: Future[Result] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=run, name=f"layfigure {name}", daemon=True).start()
    return future


def call_all(calls: Sequence[Callable[[], Result]]) -> list[Result]:
    """What each returns; the first that raises ends it."""
    return [call() for call in calls]
