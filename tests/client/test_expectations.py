"""What sessions expect: read from TOML, and judged on poses that a scripted server publishes."""

import math
from pathlib import Path

import pytest
from client_support import synthetic
from client_support.scripted_server import ScriptedServer

from layfigure.bus import Bus
from layfigure.errors import LayfigureError
from layfigure.expectation import Bounds, Contact, Expectation, Moved, Position, Rotation, Speed, Window, Yielded
from layfigure.judge import Judge, Verdict
from layfigure.play_report import Played, failure_line, write_junit
from layfigure.player import Player
from layfigure.protocol import Argument
from layfigure.session import Command, Expect, Mark, Session
from layfigure.session_file import load_session

HANDS = """
[[hand]]
pointer = 0
do = [
  { wait = 0.5 },
  { mark = "up" },
  { wait = 0.5 },
STEPS]
"""


def load(tmp_path: Path, text: str, *steps: str) -> Session:
    path = tmp_path / "s.toml"
    path.write_text(HANDS.replace("STEPS", "".join(f"  {step},\n" for step in steps)) + text)
    return load_session(path)


def expect(body: str, when: str = "at = 1") -> str:
    return f"[[expect]]\n{when}\n{body}\n"


def verdicts_of(bus: Bus, server: ScriptedServer, session: Session) -> list[Verdict]:
    server.clock = "lockstep"
    server.publish_poses(1)
    judge = Judge(bus, session)
    Player(bus, session, judge).play(lambda: False, lambda done, whole: None)
    return judge.verdicts()


def test_load_session_expectations_become_plain_data(tmp_path: Path) -> None:
    session = load(
        tmp_path,
        expect('name = "there"\nposition = "A"\nis = [1, 2, 3]\ntolerance = 0.1\nsince = "up"')
        + expect('moved = "A"\nsince = 0.25\nat_most = 0.5', 'during = ["up", 1]')
        + expect('rotation = "A"\nabout = [0, 1, 0]\nis = -30\ntolerance = 2', "by = 0.75")
        + expect("at_rest = true", "within = [0.5, 0.75]")
        + expect("contact = 3\nis = false"),
        '{ expect = { yielded = "A", is = true, since = "up" } }',
        '{ command = "set", arguments = { softness = 0.5, bone = "A", point = [1, 2, nan], flag = true } }',
    )
    first, second, third, fourth, fifth = session.expectations
    position = Position("A", (1.0, 2.0, 3.0), since="up")
    assert first == Expectation(position, Bounds(0.0, 0.1), "expect 1", 11, "there", Window(1.0, 1.0))
    assert (second.quantity, second.bounds) == (Moved("A", 0.25), Bounds(most=0.5))
    assert second.window == Window("up", 1.0)
    assert (third.quantity, third.bounds) == (Rotation("A", (0.0, 1.0, 0.0)), Bounds(-32.0, -28.0))
    assert third.window == Window(0.0, 0.75, every=False)
    assert (fourth.quantity, fourth.bounds, fourth.window) == (
        Speed(),
        Bounds(0.0, 1e-3),
        Window(0.5, 0.75, every=False),
    )
    assert (fifth.quantity, fifth.bounds) == (Contact(3), Bounds(0.0, 0.0))
    mark, step, command = (session.hands[0].actions[index] for index in (1, 3, 4))
    assert mark == Mark("up")
    assert isinstance(step, Expect)
    assert step.expectation.quantity == Yielded("A", "up")
    assert isinstance(command, Command)
    assert [argument.name for argument in command.arguments] == ["softness", "bone", "point", "flag"]
    assert command.arguments[1] == Argument("bone", text="A")
    assert math.isnan(command.arguments[2].values[2])
    assert command.arguments[3].values == (1.0,)
    assert session.all_expectations[0] is step.expectation


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (expect('torque = "A"\nat_least = 1', ""), "s.toml:9: expect 1 has no moment, expected one of at, by, during"),
        (expect('torque = "A"\nat_least = 1', "at = 1\nby = 1"), "expect 1 has at and by"),
        (
            expect('torque = "A"\nat_least = 1', "at = 1.5"),
            "s.toml:9: expect 1 names 1.5 s, but the session ends at 1 s",
        ),
        (expect('torque = "A"\nat_least = 1', "at = -1"), "at is -1, expected seconds from 0 or the name of a mark"),
        (expect('torque = "A"\nat_least = 1', "at = nan"), "at is nan"),
        (
            expect('torque = "A"\nat_least = 1', 'at = "down"'),
            "names the mark 'down', which no step makes: there are up",
        ),
        (expect('torque = "A"\nat_least = 1', "during = 1"), "during is 1, expected two moments [FROM, TO]"),
        (expect('torque = "A"\nat_least = 1', 'during = [0.75, "up"]'), "ends at 0.5 s, but begins at 0.75 s"),
        (expect(""), "expect 1 is nothing, expected one of position"),
        (expect("colour = 3"), "s.toml:11: expect 1 is 'colour'"),
        (expect('torque = "A"\nstrain = "A"\nat_most = 1'), "expect 1 is strain and torque"),
        (expect('torque = "A"'), "has no bounds, expected one of is, between, at_least, at_most"),
        (expect('torque = "A"\nat_least = 1\nat_most = 2'), "has at_least and at_most"),
        (expect('torque = "A"\nis = 1'), "needs `tolerance`"),
        (expect('torque = "A"\nis = 1\ntolerance = -1'), "tolerance is -1, expected a number of at least 0"),
        (expect('torque = "A"\nat_most = 1\ntolerance = 1'), "has a `tolerance`, which goes with `is`"),
        (expect('torque = "A"\nbetween = [2, 1]'), "is [2, 1], expected the smaller number first"),
        (expect('torque = "A"\nbetween = 2'), "between is 2, expected [LEAST, MOST]"),
        (expect('torque = "A"\nat_least = 0'), "always holds"),
        (expect('torque = "A"\nat_most = -1'), "at_most is -1, expected a number of at least 0"),
        (expect('torque = "A"\nat_least = inf'), "at_least is inf"),
        (expect('torque = "A"\nat_least = "1"'), "at_least is '1'"),
        (expect("torque = 3\nat_least = 1"), "(torque) is 3, expected the name of a bone"),
        (expect('torque = "A"\nat_least = 1\nname = 3'), "name is 3, expected a text"),
        (expect('torque = "A"\nabout = [0, 0, 0]\nat_least = 1'), "about is no direction"),
        (expect('rotation = "A"\nat_least = 181'), "at_least is 181, expected a number of at least 0, at most 180"),
        (expect('rotation = "A"\nat_most = 180'), "always holds"),
        (expect('strain = "A"\nabout = [0, 1, 0]\nat_least = 1'), "(strain) has an unknown 'about'"),
        (expect('position = "A"\nis = [1, 2]\ntolerance = 1'), "is is [1, 2], expected three numbers"),
        (expect('position = "A"\nis = [1, 2, 3]'), "(position) needs `tolerance`"),
        (expect('moved = "A"\nat_most = 1'), "(moved) needs `since`"),
        (expect('moved = "A"\nsince = 0.75\nat_most = 1', "by = 1"), "compares with 0.75 s, which is later"),
        (expect("force = 16\nat_least = 1"), "(force) is 16, expected a whole number 0 to 15"),
        (expect('rate = "LAYFIGURE_POSE"\nat_least = 1'), "needs `during`"),
        (expect('rate = "POSE"\nat_least = 1', "during = [0, 1]"), "rate is 'POSE', expected LAYFIGURE_POSE or"),
        (expect('rate = "LAYFIGURE_POSE"\nat_least = 1', "during = [1, 1]"), "ends at 1 s, but begins at 1 s"),
        (expect('yielded = "A"'), "needs `is`, true or false"),
        (expect('yielded = "A"\nis = 1'), "is is 1, expected true or false"),
        (expect('yielded = "A"\nis = false', "by = 1"), "always holds: nothing has yielded at first"),
        (expect("same_state_as = 0"), "needs `tolerance`, in degrees"),
        (expect("at_rest = 1"), "(at_rest) is 1, expected true or false"),
        ("[expect]\nat = 1\n", "expected tables [[expect]]"),
        ("[server]\nclock = 'sundial'\n", "clock is 'sundial', expected realtime or lockstep"),
        ("[server]\npose_hz = 0\n", "pose_hz is 0, expected a number of more than 0"),
        ("[server]\ncolour = 'red'\n", "server has an unknown 'colour'"),
    ],
)
def test_load_session_bad_expectation_is_refused_with_place_and_reason(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(LayfigureError) as error:
        load(tmp_path, text)
    assert words in str(error.value)
    assert "s.toml" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("step", "words"),
    [
        ('{ mark = "up" }', "makes the mark 'up' again"),
        ('{ mark = "" }', "is empty, expected a name"),
        ('{ expect = "yes" }', "expected a table such as"),
        ('{ expect = { at = 1, yielded = "A", is = true } }', "has `at`, but is judged at its own moment"),
        ('{ expect = { rate = "LAYFIGURE_POSE", at_least = 1 } }', "use [[expect]] with `during`"),
        ('{ expect = { yielded = "A", is = true }, over = 1 }', "(expect) has an unknown 'over'"),
        ('{ command = "" }', "is empty, expected the name of a command"),
        ('{ command = "set", arguments = 3 }', "arguments is 3, expected a table"),
        ('{ command = "set", arguments = { a = { b = 1 } } }', "a is {'b': 1}, expected a text, a number"),
        ('{ command = "set", arguments = { a = [1, "x"] } }', "expected a text, a number"),
        ('{ command = "set", refused = "" }', "is empty, expected some words of the reason"),
        ('{ command = "set", accepted = false }', "accepted is False, expected true"),
        ('{ command = "set", accepted = true, refused = "x" }', "has accepted and refused"),
        ('{ command = "set", accepted = true, is = 1 }', "has `is`, which needs `result`"),
        ('{ command = "set", at_most = 1 }', "has `at_most`, which needs `result`"),
        ('{ command = "set", result = "x" }', "has no bounds"),
        ('{ command = "set", speed = 1 }', "(command) has an unknown 'speed'"),
    ],
)
def test_load_session_bad_step_is_refused_with_place_and_reason(tmp_path: Path, step: str, words: str) -> None:
    with pytest.raises(LayfigureError) as error:
        load(tmp_path, "", step)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("value", "excess"), [(1.0, 0.0), (2.0, 0.0), (0.5, -0.5), (3.0, 1.0), (math.inf, math.inf), (math.nan, math.nan)]
)
def test_bounds_excess_is_how_far_outside(value: float, excess: float) -> None:
    assert Bounds(1.0, 2.0).excess(value) == pytest.approx(excess, nan_ok=True)


def test_judge_measures_what_the_poses_hold(tmp_path: Path, bus: Bus, server: ScriptedServer) -> None:
    """The synthetic arm's joints swing by known angles, its root goes at 0.1 m/s, and its hand spins by 4 rad/s."""
    hips_deg, arm_deg = math.degrees(0.2), math.degrees(math.sin(1.0))
    place = synthetic.world_matrices(synthetic.pose_rotations(1.0), synthetic.root_translation(1.0))[2][:3, 3]
    exact = "tolerance = 1e-6"
    session = load(
        tmp_path,
        expect(f'position = "LeftHand"\nis = {place.tolist()}\n{exact}')
        + expect(f'position = "Hips"\nsince = "up"\nis = [0.05, 0, 0]\n{exact}')
        + expect(f'moved = "Hips"\nsince = 0\nis = 0.1\n{exact}')
        + expect(f'speed = "Hips"\nis = 0.1\n{exact}', "during = [0.5, 1]")
        + expect(f'rotation = "Hips"\nis = {hips_deg}\n{exact}')
        + expect(f'rotation = "Hips"\nabout = [0, 0, -2]\nis = {-hips_deg}\n{exact}')
        + expect(f'rotation = "LeftArm"\nabout = [1, 0, 0]\nis = {arm_deg}\n{exact}')
        + expect(f'rotation = "LeftArm"\nabout = [0, 1, 0]\nis = 0\n{exact}')
        + expect('rate = "LAYFIGURE_POSE"\nis = 60\ntolerance = 0', "during = [0.5, 1]"),
    )
    verdicts = verdicts_of(bus, server, session)
    assert [failure_line(Path("s"), verdict) for verdict in verdicts if not verdict.fulfilled] == []
    assert len(verdicts) == 9


def test_judge_each_window_is_kept(tmp_path: Path, bus: Bus, server: ScriptedServer) -> None:
    """The hips have moved 0.1 m in a second: 5 cm are passed once, not always."""
    far = 'moved = "Hips"\nsince = 0\nat_least = 0.05'
    windows = ["at = 0.25", "at = 0.75", "by = 0.25", "by = 0.75", "during = [0.25, 1]", "during = [0.6, 1]"]
    windows += ["within = [0, 0.4]", "within = [0.25, 1]"]
    session = load(tmp_path, "".join(expect(far, window) for window in windows))
    verdicts = verdicts_of(bus, server, session)
    assert [verdict.fulfilled for verdict in verdicts] == [False, True, False, True, False, True, False, True]
    worst, closest = verdicts[4], verdicts[6]
    assert (worst.time_s, worst.excess) == (pytest.approx(0.25), pytest.approx(-0.025, abs=1e-3))
    assert (closest.time_s, closest.excess) == (pytest.approx(0.4), pytest.approx(-0.01, abs=1e-3))


def test_judge_replies_are_judged_and_end_nothing(tmp_path: Path, bus: Bus, server: ScriptedServer) -> None:
    server.refusals["mirror"] = "no side is called 'up'"
    session = load(
        tmp_path,
        "",
        '{ command = "mirror", arguments = { side = "up" }, refused = "no side" }',
        '{ command = "mirror", refused = "another reason" }',
        '{ command = "mirror", accepted = true }',
        '{ command = "snapshot", refused = "no" }',
        '{ command = "pin", result = "pin", is = 7 }',
        '{ command = "pin", result = "pin", is = 8 }',
        '{ command = "pin", result = "nonsense", is = 8 }',
        '{ command = "mirror", result = "pin", is = 7 }',
    )
    verdicts = verdicts_of(bus, server, session)
    assert [verdict.fulfilled for verdict in verdicts] == [True, False, False, False, True, False, False, False]
    lines = [failure_line(Path("s.toml"), verdict) for verdict in verdicts if not verdict.fulfilled]
    assert lines[0] == (
        "s.toml: hand 1, action 5 (command) at 1.000 s: expected the reply to 'mirror' refused with 'another reason', "
        "but it was refused: no side is called 'up'"
    )
    assert lines[3].endswith("expected 'pin' of the reply to 'pin' 8 to 8, saw 7: 1 too little")
    assert "the reply holds no 'nonsense'" in lines[4]


def test_play_command_refused_without_a_word_of_it_ends_the_session(
    tmp_path: Path, bus: Bus, server: ScriptedServer
) -> None:
    server.refusals["mirror"] = "no"
    session = load(tmp_path, expect("at_rest = true"), '{ command = "mirror" }', "{ key = true }")
    with pytest.raises(LayfigureError, match=r"pointer 0 at 1\.00 s: the server refuses 'mirror': no"):
        verdicts_of(bus, server, session)
    assert "key" not in server.command_names()


def test_judge_of_a_session_that_broke_off_fulfils_only_what_was_decided(
    tmp_path: Path, bus: Bus, server: ScriptedServer
) -> None:
    moving = 'speed = "Hips"\nat_least = 0.05'
    session = load(
        tmp_path, expect(moving, "during = [0.1, 1]") + expect(moving, "within = [0.1, 1]") + expect(moving, "at = 0.9")
    )
    server.clock = "lockstep"
    server.publish_poses(1)
    judge = Judge(bus, session)
    Player(bus, session, judge).play(lambda: server.steps > 500, lambda done, whole: None)
    verdicts = judge.verdicts()
    assert [verdict.fulfilled for verdict in verdicts] == [False, True, False]
    assert "did not get there" in failure_line(Path("s.toml"), verdicts[0])


@pytest.mark.parametrize("channel", ["LAYFIGURE_STATUS", "LAYFIGURE_CHARACTER"])
def test_judge_rate_of_the_wall_clock_is_refused_in_lockstep(
    channel: str, tmp_path: Path, bus: Bus, server: ScriptedServer
) -> None:
    session = load(tmp_path, expect(f'rate = "{channel}"\nat_least = 1', "during = [0, 1]"))
    with pytest.raises(LayfigureError, match=f"expect 1: {channel} comes by wall-clock time"):
        verdicts_of(bus, server, session)


@pytest.mark.parametrize(
    ("server_table", "words"),
    [
        ('character = "Real*"', "is for the character 'Real*', the server has 'Synthetic arm'"),
        ('clock = "realtime"', "needs a server with --clock realtime, this one has lockstep"),
        ("physics_hz = 500", "needs a server with --physics-hz 500, this one has 1000"),
        ("pose_hz = 240", "needs a server with --pose-hz 240, this one has 60"),
    ],
)
def test_play_session_for_another_server_is_refused_before_anything_moves(
    server_table: str, words: str, tmp_path: Path, bus: Bus, server: ScriptedServer
) -> None:
    session = load(tmp_path, f"[server]\n{server_table}\n")
    server.clock = "lockstep"
    server.publish_poses(1)
    with pytest.raises(LayfigureError) as error:
        Player(bus, session).play(lambda: False, lambda done, whole: None)
    assert words in str(error.value)
    assert "step" not in server.command_names()


def test_play_unknown_bone_of_an_expectation_is_refused_without_a_judge_too(
    tmp_path: Path, bus: Bus, server: ScriptedServer
) -> None:
    session = load(tmp_path, expect('flow = "LeftHnd"\nat_most = 1'))
    server.clock = "lockstep"
    server.publish_poses(1)
    with pytest.raises(LayfigureError, match="no bone 'LeftHnd'; similar: mixamorig:LeftHand"):
        Player(bus, session).play(lambda: False, lambda done, whole: None)


def test_write_junit_text_that_xml_cannot_hold_is_replaced(tmp_path: Path) -> None:
    write_junit(tmp_path / "r.xml", [Played(Path("s.toml"), "a <b> \x00 & c", 1.0, (), "lost\x1b")])
    text = (tmp_path / "r.xml").read_text()
    assert 'name="a &lt;b&gt; ? &amp; c"' in text
    assert 'message="lost?"' in text


def test_write_junit_into_no_folder_is_told(tmp_path: Path) -> None:
    with pytest.raises(LayfigureError, match=r"cannot write '.*r\.xml': No such file"):
        write_junit(tmp_path / "none" / "r.xml", [])
