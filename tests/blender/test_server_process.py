"""layfigure-server as the extension runs it: found or not, loading, failing, and never left behind."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from layfigure_blender import server
from layfigure_blender.server import ServerError, ServerProcess

TIMEOUT_S = 60.0  # for a machine under load; never waited for in a test that passes
PLUGIN = Path(__file__).resolve().parents[2] / "plugins/blender"


def wait(condition: Callable[[], object]) -> None:
    deadline = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def is_alive(pid: int) -> bool:
    """Zombies of a parent that has gone are reaped by the system sooner or later."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def program(folder: Path, script: str, name: str = "layfigure-server") -> Path:
    path = folder / name
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


def test_find_on_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = program(tmp_path, "")
    monkeypatch.setenv("PATH", str(tmp_path))
    assert server.find() == there
    assert server.find(str(there)) == there
    assert server.find(str(tmp_path)) == there


def test_find_says_what_to_do_about_a_missing_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ServerError, match="not on PATH: name its file in the add-on's preferences"):
        server.find()
    with pytest.raises(ServerError, match=r"there is no file /nowhere: correct"):
        server.find("/nowhere")
    plain = tmp_path / "plain"
    plain.write_text("text")
    with pytest.raises(ServerError, match="cannot be executed"):
        server.find(str(plain))


def test_server_listens_on_a_port_of_its_own_and_stops(binary: Path, character: Path) -> None:
    one, other = (ServerProcess(binary, character) for _ in range(2))
    wait(lambda: one.url and other.url)
    assert one.url.startswith("tcpq://127.0.0.1:")
    assert one.url != other.url
    for process in (one, other):
        process.stop()
        process.stop()
        assert not process.running
        assert process.error is None


def test_server_that_is_stopped_while_it_loads_is_gone(tmp_path: Path) -> None:
    process = ServerProcess(program(tmp_path, "exec sleep 600"), tmp_path / "character.glb")
    process.stop()
    assert not process.running
    assert process.error is None


def test_server_says_its_last_line_when_it_fails(binary: Path, tmp_path: Path) -> None:
    broken = tmp_path / "broken.glb"
    broken.write_text("no model")
    process = ServerProcess(binary, broken)
    wait(lambda: process.error)
    assert str(broken) in process.error
    assert "\n" not in process.error
    assert process.url is None


def test_server_that_is_killed_says_so(binary: Path, character: Path) -> None:
    process = ServerProcess(binary, character)
    wait(lambda: process.url)
    os.kill(process.pid, signal.SIGKILL)
    wait(lambda: process.error)
    assert process.error == "layfigure-server was killed by signal 9"
    process.stop()


def test_server_that_cannot_be_run_is_an_error(tmp_path: Path) -> None:
    path = program(tmp_path, "")
    path.write_text("#!/no/such/interpreter\n")
    with pytest.raises(ServerError, match="cannot be run"):
        ServerProcess(path, tmp_path / "character.glb")


def test_server_tells_of_its_progress(tmp_path: Path) -> None:
    """As the server draws it on a terminal: over and over on one line, and wiped in the end."""
    draw = r"""printf '\r\033[Kreading doll.glb, 1 s' >&2; sleep 0.2
printf '\r\033[Kmaking the doll, 2 s' >&2; sleep 0.2
printf '\r\033[K' >&2; echo 'layfigure-server: remarks on the character: 3' >&2
test -t 2 && echo 'listening on tcpq://127.0.0.1:1'; read wait"""
    process = ServerProcess(program(tmp_path, draw), tmp_path / "character.glb")
    wait(lambda: process.progress == "reading doll.glb, 1 s")
    wait(lambda: process.progress == "making the doll, 2 s")
    wait(lambda: process.url)
    assert process.progress == "making the doll, 2 s"
    process.stop()


def test_server_that_writes_a_lot_is_not_held_up(tmp_path: Path) -> None:
    flood = (
        "i=0; while [ $i -lt 20000 ]; do echo 'layfigure-server: a line of some length' >&2; i=$((i+1)); done; exit 3"
    )
    process = ServerProcess(program(tmp_path, flood), tmp_path / "character.glb")
    wait(lambda: process.error)
    assert process.error == "a line of some length"


@pytest.mark.parametrize("end", ["os.kill(os.getpid(), signal.SIGKILL)", "os._exit(1)", "sys.exit()", "os.abort()"])
def test_server_ends_with_the_program_that_started_it(binary: Path, character: Path, end: str) -> None:
    script = f"""
import os, pathlib, signal, sys, time
sys.path.insert(0, {str(PLUGIN)!r})
from layfigure_blender.server import ServerProcess
server = ServerProcess(pathlib.Path({str(binary)!r}), pathlib.Path({str(character)!r}))
while server.url is None:
    time.sleep(0.01)
print(server.pid, flush=True)
{end}
"""
    started = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    pid = int(started.stdout)
    wait(lambda: not is_alive(pid))
