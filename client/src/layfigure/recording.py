"""A take that is recorded from inside a program."""

from __future__ import annotations

from pathlib import Path

from layfigure.errors import LayfigureError
from layfigure.recorder import Recorder
from layfigure.take import Take
from layfigure.take_files import finish_log


class Recording:
    """Made by Doll.record(); `take` can be read while it grows and afterwards."""

    def __init__(self, recorder: Recorder, out: Path) -> None:
        self._recorder = recorder
        self._out = out
        self._finished: Take | None = None

    @property
    def take(self) -> Take:
        """What has been recorded so far, as arrays. Raises LayfigureError if no pose has come.

        Costs a copy of all poses while it is recorded, nothing afterwards.
        """
        return self._recorder.builder.build() if self._finished is None else self._finished

    def finish(self) -> None:
        """The take ends, and its log gets its name; without any pose it leaves none."""
        self._recorder.pause()
        if not self._recorder.has_poses:
            self._recorder.log.discard()
            return
        try:
            finish_log(self._recorder.log, self._out)
        except OSError as error:
            raise LayfigureError(f"cannot write '{self._out}': {error.strerror}") from error
        self._finished = self._recorder.builder.build()
