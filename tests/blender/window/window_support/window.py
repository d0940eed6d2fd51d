"""A Blender with a window, and a user's hands on it: xdotool moves the mouse and presses keys."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Callable, Iterable
from functools import cached_property
from pathlib import Path
from typing import Any

from PIL import ImageGrab

from .display import HEIGHT, WIDTH, Display

CONTROL = Path(__file__).parent / "control.py"
ANSWER_KEY = "F8"  # KEY of control.py
TIMEOUT_S = 120.0  # for a machine under load; never waited for in a test that passes
END_TIMEOUT_S = 10.0
POLL_S = 0.05
LOG_LINES = 60  # that a failure shows
MOTION_S = 0.016  # between two motions of the mouse, as of a mouse that tells 60 places in a second
TAB_WIDTH = 20  # [pixels], of the strip of tabs at the right of the sidebar
TAB_STEP = 20  # [pixels]; tabs are higher
EDGE = 60  # [pixels] from the lower edge of a view: nothing but the view is there
BUTTON_STEP = 16  # [pixels]; buttons are higher, 20
BUTTON_COLUMNS = (0.25, 0.75)  # of the sidebar's width: buttons in one or two columns

Place = tuple[float, float]


class BlenderError(AssertionError):
    """Blender ended, or what it was asked failed there."""


class BlenderWindow:
    """A running Blender that fills a display, with settings of its own under `folder`. Ends with the `with` block.

    The package is installed but not enabled. What the user does is done by mouse and keys; `ask` and `do` look at the
    state and prepare it.
    """

    def __init__(self, display: Display, folder: Path, pictures: Path, environment: dict[str, str]) -> None:
        self._display, self._folder, self._pictures = display, folder, pictures
        self._environment = {
            **{name: value for name, value in os.environ.items() if name != "PYTHONPATH"},  # of another Python
            "DISPLAY": display.name,
            "HOME": str(folder),
            "XDG_CONFIG_HOME": str(folder / "config"),
            "BLENDER_USER_SCRIPTS": str(folder / "scripts"),
            "LIBGL_ALWAYS_SOFTWARE": "1",  # the same pictures whatever the machine has
            **environment,
        }
        path = folder / "control"
        self._log = folder / "blender.log"
        geometry = map(str, ("--window-geometry", 0, 0, WIDTH, HEIGHT))
        command = ["blender", "--factory-startup", *geometry, "--python-exit-code", "1", "--python", str(CONTROL)]
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                [*command, "--", str(path)], cwd=folder, env=self._environment, stdout=log, stderr=subprocess.STDOUT
            )
        try:
            self._control = self._connect(path)
            self._answers = self._control.makefile()
        except BaseException:
            self._end()
            raise

    def __enter__(self) -> BlenderWindow:
        return self

    def __exit__(self, *_: object) -> None:
        if "_mouse" in vars(self):
            self._mouse.communicate(timeout=END_TIMEOUT_S)
        self._answers.close()
        self._control.close()
        self._end()

    # --- state -------------------------------------------------------------------------------------------------------

    def ask(self, expression: str) -> Any:
        """The value of a Python expression in Blender, which must be expressible in JSON."""
        return self._evaluate("", expression)

    def do(self, statements: str) -> None:
        """Runs Python statements in Blender; names that they define stay."""
        self._evaluate(statements, "None")

    def ask_at_mouse(self, expression: str) -> Any:
        """As ask(), in the context of what is under the mouse."""
        return self._evaluate_at_mouse("", expression)

    def do_in_view(self, statements: str) -> None:
        """As do(), with the mouse in the view and in its context, for operators that need one."""
        self._hover(self._place_in_view())
        self._evaluate_at_mouse(statements, "None")

    def wait_for(self, expression: str, timeout_s: float = TIMEOUT_S) -> Any:
        """Waits until an expression is true and returns its value."""
        deadline = time.monotonic() + timeout_s
        while not (value := self.ask(expression)):
            if time.monotonic() > deadline:
                raise BlenderError(f"within {timeout_s:g} s it did not become true: {expression}\n{self.log()}")
            time.sleep(POLL_S)
        return value

    def log(self) -> str:
        """The end of what Blender printed."""
        return "\n".join(self._log.read_text(errors="replace").splitlines()[-LOG_LINES:])

    # --- mouse and keys ----------------------------------------------------------------------------------------------

    def move(self, places: Iterable[Place], *, held: str = "") -> None:
        """Leads the mouse along places at the pace of a hand, with a key held if one is named."""
        steps: list[str] = []
        for x, y in places:
            steps += ["mousemove", str(round(x)), str(round(y)), "sleep", str(MOTION_S)]
        if held:
            steps = ["keydown", held, *steps, "keyup", held]
        self._xdotool(*steps)

    def press(self, button: int = 1) -> None:
        self._xdotool("mousedown", str(button))

    def release(self, button: int = 1) -> None:
        self._xdotool("mouseup", str(button))

    def click(self, place: Place, button: int = 1) -> None:
        """Moves there and clicks; Blender sees the mouse come first, as a button must be hovered to be pressed."""
        self._hover(place)
        self._xdotool("mousedown", str(button), "sleep", "0.05", "mouseup", str(button), "sleep", "0.1")

    def key(self, *names: str) -> None:
        """Presses keys one after the other, such as "ctrl+z"; they go to what is under the mouse."""
        for name in names:
            self._xdotool("key", name, "sleep", "0.1")

    def undo(self) -> None:
        """Ctrl+Z with the mouse in the view."""
        self._key_in_view("ctrl+z")

    def redo(self) -> None:
        self._key_in_view("ctrl+shift+z")

    def jump(self, place: Place) -> float:
        """Moves the mouse at once, and returns the monotonic time [s] right before.

        The xdotool that does it runs already: its start, of some milliseconds, is none of the delay that is measured.
        """
        assert self._mouse.stdin is not None
        command = "mousemove {} {}\n".format(*map(round, place))
        before = time.monotonic()
        self._mouse.stdin.write(command)
        self._mouse.stdin.flush()
        return before

    def resize(self, width: int, height: int) -> None:
        """The window, whose upper left corner stays."""
        self._xdotool("search", "--onlyvisible", "--name", "Blender", "windowsize", str(width), str(height))
        self.wait_for(f"(window().width, window().height) == ({width}, {height})")

    # --- panels ------------------------------------------------------------------------------------------------------

    def enable(self, module: str) -> None:
        """Enables an add-on and opens the sidebar, which begins with another tab than the add-on's."""
        self.do(f"bpy.ops.preferences.addon_enable(module={module!r})")
        self.do("view_area().spaces.active.show_region_ui = True")

    def open_tab(self, name: str) -> None:
        """Clicks the tabs of the sidebar, from the top, until panels of that name are drawn."""
        self.do(f"watch_panels({name!r})")
        left, top, width, height = self.ask("rectangle('UI')")
        for y in range(top + TAB_STEP, top + height, TAB_STEP):
            self.click((left + width - TAB_WIDTH / 2, y))
            if self.ask("panel_draws > 0"):
                return
        raise BlenderError(f"the sidebar has no tab {name!r}\n{self.log()}")

    def find_button(self, operator: str) -> Place:
        """Where the button of an operator is in the sidebar, such as "layfigure.start": hovers until it is found."""
        left, top, width, height = self.ask("rectangle('UI')")
        for y in range(top + BUTTON_STEP, top + height, BUTTON_STEP):
            for column in BUTTON_COLUMNS:
                place = (left + column * (width - TAB_WIDTH), y)
                self._hover(place)
                if f"bpy.ops.{operator}(" in self.ask_at_mouse("operator_under_mouse()"):
                    return place
        raise BlenderError(f"the sidebar has no button of {operator} that can be pressed\n{self.log()}")

    def press_button(self, operator: str) -> None:
        self.click(self.find_button(operator))

    # --- pictures ----------------------------------------------------------------------------------------------------

    def screenshot(self, name: str) -> Path:
        """The whole display as it is seen, but for the mouse."""
        self._pictures.mkdir(parents=True, exist_ok=True)
        picture = self._pictures / f"{name}.png"
        ImageGrab.grab(xdisplay=self._display.name).save(picture)
        return picture

    # --- inside ------------------------------------------------------------------------------------------------------

    def _evaluate(self, run: str, value: str) -> Any:
        return self._answer_to({"run": run, "value": value})

    def _evaluate_at_mouse(self, run: str, value: str) -> Any:
        request = {"run": run, "value": value, "at_mouse": True}
        self._answer_to(request)  # it waits for the key now
        self._xdotool("key", ANSWER_KEY)
        return self._answer_to(request, is_sent=True)

    def _answer_to(self, request: dict[str, Any], *, is_sent: bool = False) -> Any:
        try:
            if not is_sent:
                self._control.sendall(json.dumps(request).encode() + b"\n")
            line = self._answers.readline()
        except OSError as error:
            raise BlenderError(f"Blender does not answer: {error}\n{self._end_of_it()}") from error
        if not line:
            raise BlenderError(f"Blender ended\n{self._end_of_it()}")
        answer = json.loads(line)
        if "error" in answer:
            raise BlenderError(f"{request['run']}{request['value']}: {answer['error']}")
        return answer["value"]

    def _end_of_it(self) -> str:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(END_TIMEOUT_S)
        return f"exit code {self.process.returncode}\n{self.log()}"

    def _connect(self, path: Path) -> socket.socket:
        deadline = time.monotonic() + TIMEOUT_S
        while time.monotonic() < deadline and self.process.poll() is None:
            if path.exists():
                control = socket.socket(socket.AF_UNIX)
                control.settimeout(TIMEOUT_S)
                control.connect(str(path))
                return control
            time.sleep(POLL_S)
        raise BlenderError(f"Blender did not start\n{self._end_of_it()}")

    def _end(self) -> None:
        self.process.terminate()
        try:
            self.process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def _key_in_view(self, name: str) -> None:
        self._hover(self._place_in_view())
        self.key(name)

    def _place_in_view(self) -> Place:
        left, top, width, height = self.ask("rectangle('WINDOW')")
        return left + width / 4, top + height - EDGE

    @cached_property
    def _mouse(self) -> subprocess.Popen[str]:
        """Carries out each line that is written to it when it comes."""
        return subprocess.Popen(["xdotool", "-"], env=self._environment, stdin=subprocess.PIPE, text=True)

    def _hover(self, place: Place) -> None:
        """In two motions: the first enters a region of Blender's window, the second is seen by what is in it."""
        x, y = map(round, place)
        self._xdotool("mousemove", str(x - 2), str(y), "sleep", "0.02", "mousemove", str(x), str(y), "sleep", "0.05")

    def _xdotool(self, *arguments: str) -> None:
        command = ("xdotool", *arguments)
        subprocess.run(command, env=self._environment, check=True, capture_output=True, timeout=TIMEOUT_S)


def missing_tools() -> list[str]:
    return [tool for tool in ("blender", "Xvfb", "xdotool") if shutil.which(tool) is None]


OpenBlender = Callable[[], BlenderWindow]
