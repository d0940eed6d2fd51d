"""Ctrl-C and SIGTERM as a wish to end cleanly."""

from __future__ import annotations

import signal
from types import FrameType, TracebackType


class StopFlag:
    """While entered, the signals only raise this flag; afterwards they do what they did before."""

    def __init__(self) -> None:
        self.raised = False
        self._former: list[tuple[int, object]] = []

    def __enter__(self) -> StopFlag:
        for number in (signal.SIGINT, signal.SIGTERM):
            self._former.append((number, signal.signal(number, self._raise)))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for number, handler in self._former:
            signal.signal(number, handler)  # type: ignore[arg-type]

    def __call__(self) -> bool:
        return self.raised

    def _raise(self, _number: int, _frame: FrameType | None) -> None:
        self.raised = True
