from pathlib import Path

import pytest

from layfigure.errors import LayfigureError
from layfigure.session import (
    Clutch,
    Fingertip,
    Grab,
    Hand,
    Key,
    Magnet,
    Move,
    Pin,
    Pinch,
    Release,
    Scale,
    Session,
    Softness,
    Touch,
    Unpin,
    Wait,
)
from layfigure.session_file import load_session

GOOD = """
title = "Both hands"
[[hand]]
pointer = 0
do = [
  { wait = 0.5 },
  { grab = "LeftHand", point = [0, 0.1, 0], mode = "6dof", stiffness = 500, damping = 20.5 },
  { move = [0.0, 0.1, 0.4], over = 2 },
  { move = [0.3, 0.0, 1.6], over = 1.0, space = "world", interpolation = "linear" },
  { key = true },
  { release = true },
]
[[hand]]
pointer = 1
do = [ { wait = 1 } ]
"""


def load(tmp_path: Path, text: str) -> Session:
    path = tmp_path / "s.toml"
    path.write_text(text)
    return load_session(path)


def test_load_session_every_action_becomes_plain_data(tmp_path: Path) -> None:
    left = Hand(
        0,
        (
            Wait(0.5),
            Grab("LeftHand", (0.0, 0.1, 0.0), "6dof", 500.0, 20.5),
            Move((0.0, 0.1, 0.4), 2.0),
            Move((0.3, 0.0, 1.6), 1.0, "world", "linear"),
            Key(),
            Release(),
        ),
    )
    assert load(tmp_path, GOOD) == Session("Both hands", (left, Hand(1, (Wait(1.0),))))


TOOLS = """
[[hand]]
pointer = 0
do = [
  { softness = 0.5 },
  { softness = 0, bone = "Arm" },
  { scale = 2 },
  { touch = "Hand", from = [0, 0.1, 0], point = [0, 0, 1], radius = 0.01, friction = 0, magnet = true },
  { magnet = false },
  { clutch = true },
  { move = [0, 0, 1], over = 1 },
  { clutch = false },
  { release = true },
  { pin = "Foot", mode = "6dof", hold = "rigid", point = [0, 1, 0] },
  { pinch = "Arm", with = 3, along = [0, 1, 0], width = 0.1, close = 0.05, over = 0.5 },
  { release = true },
  { unpin = "Foot" },
  { unpin = true },
]
"""


def test_load_session_tools_become_plain_data(tmp_path: Path) -> None:
    read = load(tmp_path, TOOLS).hands[0]
    assert read.pointers == (0, 3)
    assert read.uses_map
    assert read.actions == (
        Softness(0.5),
        Softness(0.0, "Arm"),
        Scale(2.0),
        Touch("Hand", (0.0, 0.1, 0.0), (0.0, 0.0, 1.0), Fingertip(0.01, 0.0, magnet=True)),
        Magnet(False),
        Clutch(True),
        Move((0.0, 0.0, 1.0), 1.0),
        Clutch(False),
        Release(),
        Pin("Foot", (0.0, 1.0, 0.0), "6dof", "rigid"),
        Pinch("Arm", 3, (0.0, 1.0, 0.0), 0.1, 0.05, 0.5),
        Release(),
        Unpin("Foot"),
        Unpin(None),
    )


def hand(*actions: str) -> str:
    return f"[[hand]]\npointer = 0\ndo = [\n{','.join(actions)}\n]\n"


GRAB, RELEASE = '{ grab = "A" }', "{ release = true }"
TOUCH = '{ touch = "A", from = [0, 0.1, 0] }'


def pinch(**options: str) -> str:
    given = {"with": "1", "along": "[0, 1, 0]", "width": "0.1", "close": "0.05", "over": "1"} | options
    return '{ pinch = "A", ' + ", ".join(f"{name} = {value}" for name, value in given.items() if value) + " }"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "at least one [[hand]]"),
        ("hand = []", "at least one [[hand]]"),
        ("hand = 3", "at least one [[hand]]"),
        ("title = 3\n" + hand("{ wait = 1 }"), "title is 3, expected a text"),
        ("speed = 2\n" + hand("{ wait = 1 }"), "s.toml:1: the session has an unknown 'speed'"),
        ("\n\n[[hands]]\npointer = 0", "s.toml:3: the session has an unknown 'hands'"),
        ("[[hand]]\npointer = 0\ndo = []", "needs a list `do`"),
        ("[[hand]]\npointer = 0\ndo = [3]", "needs a list `do`"),
        ("[[hand]]\npointer = 0", "needs a list `do`"),
        ("[[hand]]\ndo = [{ wait = 1 }]", "hand 1, pointer is None"),
        ("[[hand]]\npointer = -1\ndo = [{ wait = 1 }]", "pointer is -1, expected a whole number 0 to 15"),
        ("[[hand]]\npointer = 16\ndo = [{ wait = 1 }]", "pointer is 16"),
        ("[[hand]]\npointer = true\ndo = [{ wait = 1 }]", "pointer is True"),
        ("[[hand]]\npointer = 1.0\ndo = [{ wait = 1 }]", "pointer is 1.0"),
        (hand("{ wait = 1 }") * 2, "hand 2 pointer 0 is an earlier hand's"),
        (hand("{ }"), "hand 1, action 1 is nothing"),
        (hand("{ fly = 1 }"), "s.toml:4: hand 1, action 1 is 'fly', expected one of wait, grab"),
        (hand("{ wait = 1, key = true }"), "is wait and key"),
        (hand("{ wait = 1, over = 2 }"), "s.toml:4: hand 1, action 1 (wait) has an unknown 'over'"),
        (hand("{ wait = -1 }"), "hand 1, action 1 (wait) is -1, expected a number of at least 0"),
        (hand('{ wait = "1" }'), "(wait) is '1'"),
        (hand("{ wait = nan }"), "(wait) is nan"),
        (hand("{ wait = inf }"), "(wait) is inf"),
        (hand("{ wait = 1e9 }"), "at most 3600"),
        (hand("{ wait = true }"), "(wait) is True"),
        (hand("{ grab = 3 }"), "(grab) is 3, expected the name of a bone"),
        (hand('{ grab = "" }'), "expected the name of a bone"),
        (hand('{ grab = "A", mode = "5dof" }', RELEASE), "mode is '5dof', expected 3dof or 6dof"),
        (hand('{ grab = "A", stiffness = 0 }', RELEASE), "stiffness is 0, expected a number of more than 0"),
        (hand('{ grab = "A", damping = -1 }', RELEASE), "damping is -1"),
        (hand('{ grab = "A", point = [1, 2] }', RELEASE), "point is [1, 2], expected three numbers"),
        (hand('{ grab = "A", point = [1, 2, nan] }', RELEASE), "point is nan"),
        (hand('{ grab = "A", force = 3 }', RELEASE), "(grab) has an unknown 'force'"),
        (hand(GRAB, "{ move = [0, 0, 1] }", RELEASE), "action 2 (move) needs `over`"),
        (hand(GRAB, "{ move = [0, 0, 1], over = 0 }", RELEASE), "over is 0, expected a number of more than 0"),
        (hand(GRAB, "{ move = 1, over = 1 }", RELEASE), "(move) is 1, expected three numbers"),
        (hand(GRAB, '{ move = [0, 0, 1], over = 1, space = "bone" }', RELEASE), "space is 'bone'"),
        (hand(GRAB, '{ move = [0, 0, 1], over = 1, interpolation = "cubic" }', RELEASE), "interpolation is 'cubic'"),
        (hand(GRAB, "{ release = false }"), "(release) is False, expected true"),
        (hand("{ key = 1 }"), "(key) is 1, expected true"),
        (hand("{ move = [0, 0, 1], over = 1 }"), "action 1 needs the hand to hold something"),
        (hand(RELEASE), "action 1 needs the hand to hold something"),
        (hand(GRAB, GRAB, RELEASE), "action 2 grabs 'A' while the hand holds 'A'"),
        (hand(GRAB), "still holds 'A' at its end"),
        (hand('{ touch = "A" }', RELEASE), "(touch) needs `from`"),
        (hand("{ touch = 3, from = [0, 0, 0] }", RELEASE), "(touch) is 3, expected the name of a bone"),
        (hand('{ touch = "A", from = [0, 0] }', RELEASE), "from is [0, 0], expected three numbers"),
        (hand('{ touch = "A", from = [0, 0, 0], radius = 1 }', RELEASE), "radius is 1, expected a number of at least"),
        (hand('{ touch = "A", from = [0, 0, 0], friction = -1 }', RELEASE), "friction is -1"),
        (hand('{ touch = "A", from = [0, 0, 0], magnet = 1 }', RELEASE), "magnet is 1, expected true or false"),
        (hand('{ touch = "A", from = [0, 0, 0], mode = "6dof" }', RELEASE), "(touch) has an unknown 'mode'"),
        (hand(TOUCH, GRAB, RELEASE), "action 2 grabs 'A' while the hand holds 'A'"),
        (hand(GRAB, TOUCH, RELEASE), "action 2 touches 'A' while the hand holds 'A'"),
        (hand(TOUCH), "still holds 'A' at its end"),
        (hand(pinch(over=""), RELEASE), "(pinch) needs `over`"),
        (hand(pinch(close="0.2"), RELEASE), "close is 0.2, expected a number of at least 0, at most 0.1"),
        (hand(pinch(along="[0, 0, 0]"), RELEASE), "along is no direction"),
        (hand(pinch(**{"with": "0"}), RELEASE), "with is 0, the hand's own pointer"),
        (hand(pinch(**{"with": "16"}), RELEASE), "with is 16, expected a whole number 0 to 15"),
        (hand(pinch(), RELEASE) + "[[hand]]\npointer = 1\ndo = [{ wait = 1 }]", "pointer 1 is an earlier hand's"),
        (hand("{ magnet = true }"), "needs a fingertip that is out"),
        (hand(GRAB, "{ magnet = true }", RELEASE), "needs a fingertip that is out"),
        (hand('{ pin = "A", hold = "glue" }'), "hold is 'glue', expected stiff or rigid"),
        (hand("{ pin = true }"), "(pin) is True, expected the name of a bone"),
        (hand("{ unpin = false }"), "(unpin) is False, expected the name of a bone, or true for all"),
        (hand('{ unpin = "A" }'), "unpins 'A', which no hand of the session pins"),
        (hand("{ softness = -1 }"), "(softness) is -1"),
        (hand("{ softness = 1, bone = 3 }"), "bone is 3, expected the name of a bone"),
        (hand("{ scale = 0 }"), "(scale) is 0, expected a number of at least 0.001, at most 1000"),
        (hand("{ clutch = 1 }"), "(clutch) is 1, expected true or false"),
        (hand("{ clutch = true }"), "still holds the clutch at its end"),
        (hand("{ clutch = true }", GRAB, RELEASE), "needs the clutch off"),
        (
            hand(GRAB, "{ clutch = true }", '{ move = [0, 0, 1], over = 1, space = "world" }', RELEASE),
            "cannot go to a place in the world while the clutch is held",
        ),
        ("[[hand]\n", "is not TOML"),
        ("a = 1\na = 2", "is not TOML"),
    ],
)
def test_load_session_bad_file_is_refused_with_place_and_reason(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(LayfigureError) as error:
        load(tmp_path, text)
    message = str(error.value)
    assert words in message
    assert "s.toml" in message
    assert "\n" not in message


def test_load_session_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LayfigureError, match=r"none\.toml': No such file"):
        load_session(tmp_path / "none.toml")


def test_load_session_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LayfigureError, match="Is a directory"):
        load_session(tmp_path)


def test_load_session_binary_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(LayfigureError, match="not a text"):
        load_session(tmp_path / "s.toml")
