# SPDX-License-Identifier: GPL-3.0-or-later
"""A server of a session's own, from the export of the armature to the end of the process."""

from __future__ import annotations

import functools
import shutil
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

import bpy

from layfigure import LayfigureError

from . import export, server
from .background import call_all, in_background
from .rig import Floats

Preparation = Callable[[Path, Path], object]  # (the server's program, the exported character); without bpy


class OwnServer:
    """Call step() until it has a `url`, or an `error`. Belongs to Blender's main thread; waits for nothing but the
    server's end.
    """

    def __init__(self, program: Path, pose_hz: float) -> None:
        self.program = program
        self.prepared: list[object] = []  # what the preparations returned
        self.error: str | None = None  # why there is no server, or none any more; one line
        self._pose_hz = pose_hz
        self._folder = Path(tempfile.mkdtemp(prefix="layfigure-", dir=bpy.app.tempdir or None))
        self._preparation: Future[list[object]] | None = None
        self._process: server.ServerProcess | None = None

    @property
    def character(self) -> Path:
        """What was exported."""
        return self._folder / "character.glb"

    @property
    def pid(self) -> int | None:
        return self._process.pid if self._process is not None else None

    @property
    def url(self) -> str | None:
        """Once it listens."""
        return self._process.url if self._process is not None else None

    @property
    def progress(self) -> str:
        """What goes on until it listens, one line."""
        return self._process.progress if self._process is not None else "trying the settings of the doll"

    def export(self, context: bpy.types.Context, armature: bpy.types.Object) -> Floats:
        """Writes the character; returns X_WA, (4, 4). Raises ExportError."""
        return export.export_character(context, armature, self.character).to_world

    def start(self, preparations: Sequence[Preparation]) -> None:
        """Starts it, or starts it anew. Raises ServerError.

        Settings are tried on the server's program first, on a thread: that may take as long as its start.
        """
        self._end_process()
        self.error, self.prepared = None, []
        self.character.with_suffix(".doll.toml").unlink(missing_ok=True)  # of the start before
        if not preparations:
            try:
                self._start_process()
            except server.ServerError as error:
                self.error = str(error)
                raise
            return
        calls = [functools.partial(prepare, self.program, self.character) for prepare in preparations]
        self._preparation = in_background(functools.partial(call_all, calls), "settings")

    def step(self) -> None:
        """Goes on by what has come since the last call."""
        if self._preparation is not None and self._preparation.done():
            preparation, self._preparation = self._preparation, None
            try:
                self.prepared = preparation.result()
                self._start_process()
            except (LayfigureError, OSError, server.ServerError) as error:
                self.error = str(error)
        elif self._process is not None and self._process.error is not None:
            self.error = self._process.error

    def stop(self) -> None:
        """Ends it, and removes what was exported."""
        self._end_process()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _start_process(self) -> None:
        self._process = server.ServerProcess(self.program, self.character, pose_hz=self._pose_hz)

    def _end_process(self) -> None:
        self._preparation = None
        if self._process is not None:
            self._process.stop()
        self._process = None
