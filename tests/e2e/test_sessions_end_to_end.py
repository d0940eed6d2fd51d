"""The sessions of tests/sessions, each played on a real server of its own: all that they expect is seen, and each
expectation fails when it is changed, or when the hands do nothing.
"""

from __future__ import annotations

import math
import os
import re
import signal
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from e2e_support import REPOSITORY, TIMEOUT_S, RunClient, StartClient
from server_support.process import StartServer

from layfigure.bus import Bus
from layfigure.expectation import Answer, Bounds, Expectation, Position
from layfigure.judge import Judge, Verdict
from layfigure.play_report import failure_line
from layfigure.player import Player
from layfigure.session import Action, Command, Expect, Mark, Session, Wait, duration_of
from layfigure.session_file import load_session

SESSIONS = sorted((REPOSITORY / "tests/sessions").glob("*.toml"))
SHIFT = 1.01  # of an interval by more than its width: nothing is in both
IMPOSSIBLE = "no server gives this reason"

each_session = pytest.mark.parametrize("path", SESSIONS, ids=lambda path: path.stem)


def judged(start_server: StartServer, session: Session) -> list[Verdict]:
    """The session's verdicts on a fresh server such as it is for."""
    wanted = {
        "--clock": session.server.clock,
        "--physics-hz": session.server.physics_hz,
        "--pose-hz": session.server.pose_hz,
    }
    options = [text for option, value in wanted.items() if value is not None for text in (option, value)]
    with Bus(start_server(*options).url) as bus:
        judge = Judge(bus, session)
        Player(bus, session, judge).play(lambda: False, lambda done, whole: None)
    return judge.verdicts()


def lines(path: Path, verdicts: list[Verdict]) -> list[str]:
    return [failure_line(path, verdict) for verdict in verdicts if not verdict.fulfilled]


def changed(expectation: Expectation) -> Expectation:
    """What cannot be true where the expectation is: a place or an interval that has nothing in common with it. What is
    to be seen once is then never to be: that is the contrary.
    """
    quantity, bounds = expectation.quantity, expectation.bounds
    if expectation.window is not None:
        expectation = replace(expectation, window=replace(expectation.window, every=True))
    if isinstance(quantity, Position):
        x, y, z = quantity.target
        return replace(expectation, quantity=replace(quantity, target=(x + 2.0 * SHIFT * bounds.most, y, z)))
    if isinstance(quantity, Answer) and quantity.result is None:
        other = Answer(quantity.command) if quantity.refused else Answer(quantity.command, refused=IMPOSSIBLE)
        return replace(expectation, quantity=other)
    if math.isinf(bounds.least) or bounds.least == 0.0 < bounds.most:
        return replace(expectation, bounds=Bounds(least=math.nextafter(bounds.most, math.inf)))
    if math.isinf(bounds.most):
        return replace(expectation, bounds=Bounds(most=math.nextafter(bounds.least, -math.inf)))
    shift = SHIFT * (bounds.most - bounds.least) or 1.0
    return replace(expectation, bounds=Bounds(bounds.least + shift, bounds.most + shift))


def changed_action(action: Action) -> Action:
    if isinstance(action, Expect):
        return Expect(changed(action.expectation))
    if isinstance(action, Command) and action.answer is not None:
        return replace(action, answer=changed(action.answer))
    return action


def idle(action: Action) -> Action:
    """As long, and the doll is left alone."""
    return action if isinstance(action, Expect | Mark) else Wait(duration_of(action))


def with_actions(session: Session, change: Callable[[Action], Action]) -> Session:
    return replace(
        session, hands=tuple(replace(hand, actions=tuple(map(change, hand.actions))) for hand in session.hands)
    )


def test_there_are_sessions_for_each_kind_of_work() -> None:
    assert len(SESSIONS) >= 20


@each_session
def test_session_sees_all_that_it_expects(path: Path, start_server: StartServer) -> None:
    verdicts = judged(start_server, load_session(path))
    assert verdicts
    assert lines(path, verdicts) == []


@each_session
def test_session_with_changed_expectations_fails_in_each(path: Path, start_server: StartServer) -> None:
    session = with_actions(load_session(path), changed_action)
    session = replace(session, expectations=tuple(map(changed, session.expectations)))
    verdicts = judged(start_server, session)
    held = [verdict.expectation.place for verdict in verdicts if verdict.fulfilled]
    assert held == []
    for line in lines(path, verdicts):
        assert line.startswith(str(path))
        assert "expected" in line


@each_session
def test_session_whose_hands_do_nothing_fails(path: Path, start_server: StartServer) -> None:
    """What it expects is not true of a doll that is left alone; nor are there replies to commands that are not sent."""
    session = load_session(path)
    verdicts = judged(start_server, with_actions(session, idle))
    assert lines(path, verdicts) != [] or len(verdicts) < len(session.all_expectations)


# ---------------------------------------------------------------- the command line, as continuous integration uses it

GOOD = REPOSITORY / "tests/sessions/release_without_grab.toml"
HOLD = """
title = "Hold <on>"
[[hand]]
pointer = 0
do = [
  { wait = 0.25 },
  { grab = "hand.L" },
  { wait = DURATION },
  { expect = { name = "not reached", force = 0, at_most = 1 } },
  { release = true },
]

[[expect]]
name = "too far"
at = 0.25
position = "hand.L"
is = [0, 0, 0]
tolerance = 0.1
"""


def hold(folder: Path, duration_s: float) -> Path:
    path = folder / "hold.toml"
    path.write_text(HOLD.replace("DURATION", str(duration_s)))
    return path


def test_play_expect_tells_each_failure_and_writes_junit(
    start_server: StartServer, client: RunClient, tmp_path: Path
) -> None:
    hold(tmp_path, 0.25)
    url = ("--lcm-url", start_server("--clock", "lockstep").url)
    result = client("play", "hold.toml", GOOD, "--expect", "--junit", "report.xml", *url)
    assert result.returncode == 1
    failure, summary = result.stderr.splitlines()
    assert re.fullmatch(
        r"hold\.toml:13: expect 1 'too far' at 0\.250 s: expected distance of 'hand\.L' from \[0, 0, 0\] "
        r"at most 0\.1 m, saw 0\.\d+ m \(it is at \[.*\]\): 0\.\d+ m too much",
        failure,
    )
    assert summary == "layfigure: 7 expectations, 1 failed"
    assert result.stdout.splitlines()[0] == "hold.toml: played 0.50 s, 2 expectations, 1 failed"
    first, second = ET.parse(tmp_path / "report.xml").getroot()
    assert [first.get(key) for key in ("name", "tests", "failures", "errors")] == ["Hold <on>", "3", "1", "0"]
    assert [case.find("failure") is not None for case in first] == [False, False, True]
    assert failure == first[2].find("failure").text
    assert (second.get("failures"), second.get("errors")) == ("0", "0")


def test_play_expect_all_seen_exits_0(start_server: StartServer, client: RunClient) -> None:
    result = client("play", GOOD, "--expect", "--lcm-url", start_server("--clock", "lockstep").url)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.splitlines()[-1] == "5 expectations, 0 failed"


def test_play_without_expect_judges_nothing(start_server: StartServer, client: RunClient, tmp_path: Path) -> None:
    hold(tmp_path, 0.25)
    result = client("play", "hold.toml", "--lcm-url", start_server("--clock", "lockstep").url)
    assert (result.returncode, result.stdout, result.stderr) == (0, "hold.toml: played 0.50 s\n", "")


def test_play_session_for_another_server_is_refused_and_the_next_is_played(
    start_server: StartServer, client: RunClient
) -> None:
    other = REPOSITORY / "tests/sessions/pose_rate_240.toml"
    result = client("play", other, GOOD, "--expect", "--lcm-url", start_server("--clock", "lockstep").url)
    assert result.returncode == 1
    told, summary = result.stderr.splitlines()
    assert told == f"{other}: the session needs a server with --pose-hz 240, this one has 60"
    assert summary == "layfigure: 7 expectations, 2 failed; 1 of 2 sessions not played to the end"


def test_play_expect_unknown_bone_is_told_before_anything_moves(
    start_server: StartServer, client: RunClient, tmp_path: Path
) -> None:
    hold(tmp_path, 0.25).write_text(
        HOLD.replace("DURATION", "0.25").replace('position = "hand.L"', 'position = "hadn.L"')
    )
    for judging in ([], ["--expect"]):
        result = client("play", "hold.toml", *judging, "--lcm-url", start_server("--clock", "lockstep").url)
        assert result.returncode == 1
        assert "'doll' has no bone 'hadn.L'; similar: hand.L" in result.stderr.splitlines()[0]


def test_play_expect_server_that_dies_is_reported_and_nothing_waits(
    start_server: StartServer, start_client: StartClient, tmp_path: Path
) -> None:
    hold(tmp_path, 600.0)
    server = start_server()  # in realtime
    arguments = ("play", "hold.toml", GOOD, "--expect", "--junit", "report.xml", "--lcm-url", server.url)
    player = start_client(*arguments)
    with Bus(server.url) as bus:
        forces: list[bytes] = []
        bus.subscribe("LAYFIGURE_FORCE", forces.append)
        assert bus.wait_until(lambda: len(forces) > 10, TIMEOUT_S)
    server.process.kill()
    code, output, errors = player.finish()
    assert (code, output) == (1, "")
    failure, lost, skipped, summary = errors.splitlines()
    assert failure.startswith("hold.toml:13: expect 1 'too far' at 0.250 s")
    assert lost.startswith("hold.toml: ")
    assert "lost the connection" in lost
    assert skipped == f"{GOOD}: not played: the server is gone"
    assert summary == "layfigure: 7 expectations, 7 failed; 2 of 2 sessions not played to the end"
    suites = ET.parse(tmp_path / "report.xml").getroot()
    assert [suite.get("errors") for suite in suites] == ["1", "1"]


def test_play_expect_interrupted_reports_what_was_judged(
    start_server: StartServer, start_client: StartClient, tmp_path: Path
) -> None:
    hold(tmp_path, 600.0)
    server = start_server()
    arguments = ("play", "hold.toml", GOOD, "--expect", "--junit", "report.xml", "--lcm-url", server.url)
    player = start_client(*arguments)
    with Bus(server.url) as bus:
        forces: list[bytes] = []
        bus.subscribe("LAYFIGURE_FORCE", forces.append)
        assert bus.wait_until(lambda: len(forces) > 10, TIMEOUT_S)
    code, output, errors = player.finish(signal.SIGINT)
    assert (code, output) == (1, "")
    failure, stopped, skipped, summary = errors.splitlines()
    assert failure.startswith("hold.toml:13: expect 1 'too far' at 0.250 s")
    assert re.fullmatch(r"hold\.toml: interrupted after \d+\.\d+ s; the hands have let go", stopped)
    assert skipped == f"{GOOD}: not played: interrupted"
    assert summary == "layfigure: 7 expectations, 7 failed; 2 of 2 sessions not played to the end"
    assert ET.parse(tmp_path / "report.xml").getroot()[0].get("errors") == "1"


def test_readme_recipe_for_continuous_integration_works(binary: Path, character: Path, tmp_path: Path) -> None:
    """The lines of client/README.md, as they stand there."""
    readme = (REPOSITORY / "client/README.md").read_text()
    (recipe,) = re.findall(r"```bash\n(.*?)```", readme, re.DOTALL)
    tools = tmp_path / "bin"
    tools.mkdir()
    (tools / "layfigure-server").symlink_to(binary)
    (tools / "layfigure").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m layfigure "$@"\n')
    (tools / "layfigure").chmod(0o755)
    (tmp_path / "doll.glb").symlink_to(character)
    sessions = tmp_path / "sessions"
    sessions.mkdir()
    environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}"}

    def run_recipe(session: str) -> subprocess.CompletedProcess[str]:
        (sessions / "hold.toml").write_text(session)
        return subprocess.run(
            ["bash", "-c", recipe],
            cwd=tmp_path,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        )

    session = HOLD.replace("DURATION", "0.25")
    failed = run_recipe(session)
    assert failed.returncode == 1, failed.stderr
    assert "layfigure: 2 expectations, 1 failed" in failed.stderr
    assert ET.parse(tmp_path / "report.xml").getroot()[0].get("failures") == "1"
    good = run_recipe(session.replace("tolerance = 0.1", "tolerance = 1.0"))
    assert good.returncode == 0, good.stderr
    assert "2 expectations, 0 failed" in good.stdout
