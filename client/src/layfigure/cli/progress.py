"""A line that is rewritten in place: on a terminal only."""

from __future__ import annotations

import sys
import time
from types import TracebackType

_INTERVAL_S = 0.1
_BAR_WIDTH = 30


class ProgressLine:
    """Gone when its `with` block ends, however it ends."""

    def __init__(self) -> None:
        self._visible = sys.stderr.isatty()
        self._written_at = float("-inf")

    def show(self, text: str) -> None:
        if self._visible and time.monotonic() - self._written_at >= _INTERVAL_S:
            self._written_at = time.monotonic()
            print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)

    def show_part(self, done: float, whole: float) -> None:
        filled = round(_BAR_WIDTH * done / whole) if whole > 0.0 else _BAR_WIDTH
        self.show(f"[{'#' * filled}{'.' * (_BAR_WIDTH - filled)}] {done:.1f} of {whole:.1f} s")

    def __enter__(self) -> ProgressLine:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._visible:
            print("\r\033[K", end="", file=sys.stderr, flush=True)
