"""An X display of its own, without a screen: what is drawn on it nobody sees but the tests."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

WIDTH, HEIGHT = 1280, 960  # [pixels]
START_TIMEOUT_S = 30.0
END_TIMEOUT_S = 10.0


class Display:
    """A running Xvfb, on a number that it finds free. Ends with the `with` block."""

    def __init__(self, folder: Path) -> None:
        self._log = (folder / "xvfb.log").open("w")
        read_end, write_end = os.pipe()
        screen = f"{WIDTH}x{HEIGHT}x24"
        command = ["Xvfb", "-displayfd", str(write_end), "-screen", "0", screen, "-nolisten", "tcp", "-noreset"]
        self.process = subprocess.Popen(command, stdout=self._log, stderr=self._log, pass_fds=[write_end])
        os.close(write_end)
        with os.fdopen(read_end) as pipe:
            number = pipe.readline().strip()  # empty if Xvfb ended
        if not number:
            self.process.wait(START_TIMEOUT_S)
            raise RuntimeError(f"Xvfb did not start: {(folder / 'xvfb.log').read_text()}")
        self.name = f":{number}"

    def __enter__(self) -> Display:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        try:
            self.process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self._log.close()
