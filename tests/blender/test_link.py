"""The extension's connection to a server: on its own thread, in order, and again after a loss."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import numpy as np
import pytest
from layfigure_blender.link import Link
from server_support.process import ServerProcess

import layfigure

OTHER_CHARACTER = Path(__file__).resolve().parents[1] / "data/characters/lay_figure_blender.fbx"
TIMEOUT_S = 30.0  # for a machine under load; never waited for in a test that passes


def wait(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


@contextmanager
def linked(url: str) -> Iterator[Link]:
    link = Link(url)
    link.start()
    with closing(link):
        yield link


@pytest.fixture
def port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def serve(binary: Path, character: Path) -> Callable[..., ServerProcess]:
    def start(*options: object, of: Path = character) -> ServerProcess:
        return ServerProcess([str(binary), str(of), *map(str, options or ("--broker", 0))])

    return start


@pytest.fixture
def server(serve: Callable[..., ServerProcess]) -> Iterator[ServerProcess]:
    with serve() as process:
        yield process


@pytest.fixture
def link(server: ServerProcess) -> Iterator[Link]:
    with linked(server.url) as connected:
        wait(lambda: connected.state == "live")
        yield connected


def test_link_that_is_live_has_character_pose_and_status(link: Link) -> None:
    wait(lambda: link.status is not None)
    assert link.character is not None
    assert link.newest is not None
    assert len(link.newest.pose.rotations) == len(link.character.joints)
    first = link.newest
    wait(lambda: link.newest is not first)
    assert link.newest.received_at >= first.received_at


def test_link_commands_are_answered_in_order(link: Link) -> None:
    futures = [link.send("snapshot", name=f"s{number}") for number in range(20)]
    names = link.send("snapshot", action="list").result(TIMEOUT_S)
    assert [future.result(TIMEOUT_S).accepted for future in futures] == [True] * 20
    assert {f"s{number}" for number in range(20)} <= {result.text for result in names.results}


def test_link_refusal_is_the_futures_exception(link: Link) -> None:
    with pytest.raises(layfigure.RefusedError, match="no bone is called 'tail'"):
        link.send("grab", pointer=0, bone="tail").result(TIMEOUT_S)
    with pytest.raises(layfigure.UsageError, match="'bone' of 'grab'"):
        link.send("grab", bone=object()).result(TIMEOUT_S)
    assert link.send("key").result(TIMEOUT_S).accepted


def test_link_pointer_is_where_it_was_moved_before_the_command(link: Link) -> None:
    assert link.character is not None
    places = layfigure.world_poses(link.character, link.newest.pose)[1]
    hand = [joint.name for joint in link.character.joints].index("hand.L")
    for step in range(50):
        link.move_pointer(0, places[hand] + [0.0, 0.0, 0.001 * step])
    link.move_pointer(0, places[hand])
    link.send("grab", pointer=0, bone="hand.L", point=[0.0, 0.0, 0.0]).result(TIMEOUT_S)
    wait(lambda: 0 in link.forces and link.forces[0].attached)
    held = link.forces[0].target  # what is held follows the pointer from where they met
    link.move_pointer(0, places[hand] + [0.0, 0.0, 0.02], [1.0, 0.0, 0.0, 0.0])
    wait(lambda: np.allclose(link.forces[0].target - held, [0.0, 0.0, 0.02], atol=1e-12))
    wait(lambda: bool(np.linalg.norm(link.forces[0].force) > 0.1))


def test_link_waits_for_the_pose_that_a_motion_brings_about(serve: Callable[..., ServerProcess]) -> None:
    """The hand has begun to follow in it, and not in one that was under way when the pointer was moved."""
    with serve("--broker", 0, "--pose-hz", 120) as server, linked(server.url) as link:
        wait(lambda: link.newest is not None and link.state == "live")
        assert link.character is not None
        hand = [joint.name for joint in link.character.joints].index("hand.L")
        place = layfigure.world_poses(link.character, link.newest.pose)[1][hand]
        link.move_pointer(0, place)
        link.send("grab", pointer=0, bone="hand.L", point=[0.0, 0.0, 0.0]).result(TIMEOUT_S)
        for step in range(1, 6):
            before = link.newest
            link.move_pointer(0, place + np.array([0.0, 0.0, 0.01 * step]))
            assert link.wait_for_effect(TIMEOUT_S)
            assert link.newest.pose.time_us > before.pose.time_us


def test_link_does_not_wait_longer_than_it_may(serve: Callable[..., ServerProcess]) -> None:
    """A server that steps by commands brings no pose by itself."""
    assert not Link("tcpq://127.0.0.1:1").wait_for_effect(TIMEOUT_S)  # never connected: there is nothing to wait for
    with serve("--broker", 0, "--clock", "lockstep") as server, linked(server.url) as link:
        wait(lambda: link.newest is not None and link.state == "live")
        begun = time.monotonic()
        assert not link.wait_for_effect(0.05)
        assert time.monotonic() - begun >= 0.05


def test_link_moves_do_not_overtake_commands(link: Link) -> None:
    assert link.character is not None
    link.move_pointer(0, [0.0, 0.0, 1.0])
    held = link.send("grab", pointer=0, bone="hand.L", point=[0.0, 0.0, 0.0])
    let_go = link.send("release", pointer=0)
    link.move_pointer(0, [5.0, 5.0, 5.0])
    held.result(TIMEOUT_S)
    let_go.result(TIMEOUT_S)
    assert link.send("key").result(TIMEOUT_S).accepted
    wait(lambda: 0 not in link.forces or not link.forces[0].attached)


@pytest.mark.parametrize("where", [[0.0, 1.0], [0.0, 0.0, float("nan")], [1.0, 2.0, 3.0, 4.0]])
def test_link_pointer_that_is_no_place_is_refused(link: Link, where: list[float]) -> None:
    with pytest.raises(ValueError, match="pointer 0 is sent to"):
        link.move_pointer(0, where)
    with pytest.raises(ValueError, match="pointer 0 is sent to"):
        link.move_pointer(0, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0])


def test_link_latency_is_that_of_a_pose_not_of_polling(link: Link) -> None:
    """An answer that waited for a heartbeat or an idle wait would take 100 ms; half of them may be late."""
    times = []
    for _ in range(21):
        begin = time.monotonic()
        link.send("key").result(TIMEOUT_S)
        times.append(time.monotonic() - begin)
    assert sorted(times)[10] < 0.08


def test_link_without_a_server_says_so_and_connects_when_it_comes(
    serve: Callable[..., ServerProcess], port: int
) -> None:
    with linked(f"tcpq://127.0.0.1:{port}") as link:
        wait(lambda: "no server at" in link.message)
        assert link.state == "connecting"
        assert link.failed_attempts > 0
        with pytest.raises(layfigure.BusError, match="'key' was not sent"):
            link.send("key").result(TIMEOUT_S)
        with serve("--broker", port):
            wait(lambda: link.state == "live")
            assert link.failed_attempts == 0


def test_link_restarted_server_is_taken_up_again(serve: Callable[..., ServerProcess], port: int) -> None:
    with linked(f"tcpq://127.0.0.1:{port}") as link:
        with serve("--broker", port):
            wait(lambda: link.state == "live")
            first = link.newest.pose.server_id
        wait(lambda: link.state == "lost")
        assert link.message
        with serve("--broker", port):
            wait(lambda: link.state == "live" and link.newest.pose.server_id != first)
            assert link.send("key").result(TIMEOUT_S).accepted


def test_link_other_character_is_refused(serve: Callable[..., ServerProcess], port: int) -> None:
    with linked(f"tcpq://127.0.0.1:{port}") as link:
        with serve("--broker", port):
            wait(lambda: link.state == "live")
        with serve("--broker", port, of=OTHER_CHARACTER):
            wait(lambda: link.state == "refused")
            assert "another character" in link.message
        with serve("--broker", port):
            wait(lambda: link.state == "live")


def test_link_killed_server_fails_what_was_asked(server: ServerProcess) -> None:
    with linked(server.url) as link:
        wait(lambda: link.state == "live")
        server.process.kill()
        futures = [link.send("key") for _ in range(100)]
        wait(lambda: link.state == "lost")
        for future in futures[-10:]:  # the first may have been answered yet
            assert isinstance(future.exception(TIMEOUT_S), layfigure.BusError)


def test_link_server_that_says_nothing_any_more_is_lost(server: ServerProcess) -> None:
    with linked(server.url) as link:
        wait(lambda: link.state == "live")
        server.process.send_signal(19)  # SIGSTOP
        try:
            wait(lambda: link.state == "lost")
        finally:
            server.process.send_signal(18)  # SIGCONT
        wait(lambda: link.state == "live")


def test_link_closed_ends_its_thread_and_answers_all(server: ServerProcess) -> None:
    before = threading.active_count()
    link = Link(server.url)
    link.start()
    wait(lambda: link.state == "live")
    futures = [link.send("key") for _ in range(100)]
    link.close()
    link.close()
    assert all(future.done() for future in futures)
    assert threading.active_count() == before
    assert link.state == "closed"
    with pytest.raises(layfigure.LayfigureError):
        link.send("key").result(0.0)


def open_files() -> set[str]:
    return {path.name for path in Path("/proc/self/fd").iterdir()}


def test_link_that_never_began_closes_what_it_opened() -> None:
    before = open_files()
    link = Link("tcpq://127.0.0.1:1")
    link.close()
    assert open_files() == before


def test_link_survives_a_killed_server_where_broken_pipes_are_deadly(server: ServerProcess) -> None:
    """As in Blender, whose Python leaves SIGPIPE to its default."""
    script = f"""
import signal, sys, time
signal.signal(signal.SIGPIPE, signal.SIG_DFL)
sys.path[:0] = {[str(path) for path in sys.path]!r}
from layfigure_blender.link import Link
link = Link({server.url!r})
link.start()
while link.state != "live":
    time.sleep(0.01)
print("live", flush=True)
while link.state == "live":
    link.move_pointer(0, [0.0, 0.0, 1.0])
    time.sleep(0.0005)
link.close()
print(link.state, flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        assert program.stdout.readline() == "live\n"
        server.process.kill()
        assert program.stdout.readline() == "closed\n"
        assert program.wait(TIMEOUT_S) == 0


def test_links_of_two_servers_in_one_process_do_not_disturb_each_other(serve: Callable[..., ServerProcess]) -> None:
    with serve() as one, serve() as other, linked(one.url) as first, linked(other.url) as second:
        wait(lambda: first.state == "live" and second.state == "live")
        for _ in range(50):
            a, b = first.send("key"), second.send("key")
            assert a.result(TIMEOUT_S).server_id != b.result(TIMEOUT_S).server_id
        assert first.newest.pose.server_id != second.newest.pose.server_id
