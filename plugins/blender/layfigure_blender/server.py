# SPDX-License-Identifier: GPL-3.0-or-later
"""layfigure-server as a process of Blender's. No bpy."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import threading
from pathlib import Path

PROGRAM = "layfigure-server"
# Twice what most screens show: a motion of the mouse waits for the next pose, 8 ms at most. One of 163 joints takes 0.5
# to 0.8 ms to be read, on a thread that shares Python with Blender's, and so they are not more.
USUAL_POSE_HZ = 120.0
_GREETING = "listening on "
_NAME_IN_FRONT = f"{PROGRAM}: "
_LINE_ENDS = re.compile(r"\r\n|\r|\n")
_ESCAPES = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
_MOST_OUTPUT = 65536  # bytes taken by one read


class ServerError(RuntimeError):
    """The server cannot be started; the message is one line for the user."""


def find(preferred: str = "") -> Path:
    """The program: at the path in the preferences, else on PATH. Raises ServerError with the mend."""
    if preferred:
        program = Path(preferred).expanduser()
        if program.is_dir():
            program /= PROGRAM
        if not program.is_file():
            raise ServerError(f"there is no file {program}: correct the server's path in the add-on's preferences")
        if not os.access(program, os.X_OK):
            raise ServerError(f"{program} cannot be executed: correct the server's path in the add-on's preferences")
        return program
    on_path = shutil.which(PROGRAM)
    if on_path is None:
        raise ServerError(
            f"{PROGRAM} is not on PATH: name its file in the add-on's preferences (Edit > Preferences > Add-ons > "
            "Layfigure)"
        )
    return Path(on_path)


class ServerProcess:
    """A running server of one character; ends with Blender, however that ends.

    Its broker has a port of its own, so that servers of several Blenders do not meet. What it says is read on a thread;
    attributes may be read from any thread. It writes to a pseudo terminal, as only there it tells of its progress.
    """

    def __init__(self, program: Path, character: Path, *, pose_hz: float = USUAL_POSE_HZ) -> None:
        """Starts it; it loads for a while. Raises ServerError if the program cannot be run."""
        self.url: str | None = None  # once it listens
        self.progress = "starting the server"  # what it is doing while it loads, one line
        self.error: str | None = None  # once it has ended by itself: why, one line
        self._stopping = False
        self._last_line = ""
        self._terminal, its_terminal = os.openpty()
        command = [str(program), str(character), "--broker", "0", "--end-with-input", "--pose-hz", f"{pose_hz:g}"]
        try:
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=its_terminal, start_new_session=True
            )
        except OSError as error:
            os.close(self._terminal)
            raise ServerError(f"{program} cannot be run: {error.strerror}") from error
        finally:
            os.close(its_terminal)
        self._errors = threading.Thread(target=self._read_errors, name="layfigure-server's errors", daemon=True)
        self._output = threading.Thread(target=self._read_output, name="layfigure-server's output", daemon=True)
        self._errors.start()
        self._output.start()

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    def stop(self, timeout_s: float = 2.0) -> None:
        """Ends it. May be called again."""
        self._stopping = True
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()  # upon which it leaves as soon as it listens; while it loads it need not
        if self.url is None and self.running:
            self._process.kill()
        try:
            self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._output.join(timeout_s)

    def _read_output(self) -> None:
        """Until it has ended; then tells why."""
        assert self._process.stdout is not None
        with self._process.stdout as output:
            for line in output:
                text = line.decode(errors="replace").strip()
                if text.startswith(_GREETING):
                    self.url = text.removeprefix(_GREETING)
        code = self._process.wait()
        self._errors.join()
        if not self._stopping:
            self.error = self._why_it_ended(code)

    def _why_it_ended(self, code: int) -> str:
        if code < 0:
            return f"{PROGRAM} was killed by signal {-code}"
        return self._last_line or f"{PROGRAM} ended with code {code}"

    def _read_errors(self) -> None:
        rest = ""
        with contextlib.suppress(OSError):  # EIO: the other end of the terminal is closed
            while data := os.read(self._terminal, _MOST_OUTPUT):
                *lines, rest = _LINE_ENDS.split(rest + data.decode(errors="replace"))
                for line in lines:
                    self._take_line(line)
                self._take_progress(rest)
        self._take_line(rest)
        os.close(self._terminal)

    def _take_line(self, line: str) -> None:
        text = _ESCAPES.sub("", line).strip()
        if text.startswith(_NAME_IN_FRONT):
            self._last_line = text.removeprefix(_NAME_IN_FRONT)

    def _take_progress(self, line: str) -> None:
        """A line that is drawn over and over, and not ended."""
        text = _ESCAPES.sub("", line).strip()
        if text and not text.startswith(_NAME_IN_FRONT[: len(text)]):
            self.progress = text
