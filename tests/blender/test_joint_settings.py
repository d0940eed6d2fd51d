"""Joint settings of the Blender extension, without Blender: what they say is what the real server reads."""

from __future__ import annotations

import json
import math
import subprocess
from pathlib import Path
from typing import Any

import pytest
from blender_support.glb_names import rename_nodes
from layfigure_blender.doll_inspection import culprit, inspect, own_values, prepare
from layfigure_blender.joint_settings import (
    AMOUNTS,
    AXES,
    BODY_NUMBERS,
    DOLL_NUMBERS,
    LAWS,
    LIMIT_AXES,
    MATERIALS,
    Amount,
    DollSettings,
    JointSettings,
    laid_over,
    matches,
    mirrored,
    resolve,
)
from layfigure_blender.joint_values import (
    DollValues,
    JointValues,
    applicable,
    as_settings,
    asked,
    changes,
)
from layfigure_blender.settings_file import (
    SettingsFileError,
    of_single,
    parse_settings,
    quoted,
    read_settings,
    settings_path_beside,
    settings_text,
)

from layfigure import LayfigureError

SAME = 1e-12  # relative: both sides compute in double precision with one or two roundings
ODD_NAMES = (
    "arm.L.001",
    'the "left" hand',
    "back\\slash",
    "手.左",
    "tab\there",
    "new\nline",
    "*",
    "?",
    "hand*",
    "[joints.x]",
    "é́ 🦴",
    "#'=",
    "'single'",
)

MANY = JointSettings(
    laws={
        "stiffness": (Amount(9.5), Amount(0.5, is_factor=True), None),
        "damping": Amount(0.25),
        "yield_torque": Amount(math.inf),
        "flow_damping": Amount(3.0, is_factor=True),
        "hardening": Amount(0.1),
    },
    limits={"twist": (-30.0, 45.5), "swing_z": (-180.0, 180.0)},
    locked=frozenset({"bend_z", "twist"}),
    merge=False,
    shape="capsule",
    numbers={"friction": 0.7, "mass": 0.01},
)


@pytest.fixture(scope="module")
def own(binary: Path, character: Path) -> DollValues:
    return inspect(str(binary), character, DollSettings())


def read_by_server(binary: Path, character: Path, text: str, folder: Path) -> subprocess.CompletedProcess[str]:
    file = folder / "settings.toml"
    file.write_text(text, "utf-8")
    command = [binary, "--inspect", character, "--json", "--doll", file]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)


def bodies(done: subprocess.CompletedProcess[str]) -> dict[str, dict[str, Any]]:
    assert done.returncode == 0, done.stderr
    return {body["name"]: body for body in json.loads(done.stdout)["bodies"]}


def is_near(a: JointValues, b: JointValues) -> bool:
    laws = all(
        math.isclose(x, y, rel_tol=SAME)
        for name in LAWS
        for x, y in zip(a.laws[name].axes, b.laws[name].axes, strict=True)
    )
    limits = all(
        math.isclose(x, y, rel_tol=SAME, abs_tol=SAME)
        for axis in LIMIT_AXES
        for x, y in zip(a.limits[axis], b.limits[axis], strict=True)
    )
    return laws and limits and a.locked == b.locked


# --- the file --------------------------------------------------------------------------------------------------------


def test_text_reads_back_as_the_same_settings() -> None:
    settings = DollSettings(
        "wire armature",
        {"total_mass": 0.1 + 0.2, "poisson_ratio": -0.5, "elastic_modulus": 1e18, "hold_margin": 1.0},
        dict.fromkeys(ODD_NAMES, MANY) | {"free": JointSettings(locked=frozenset())},
    )
    text = settings_text(settings, "of a\ndoll\x07")
    assert parse_settings(text, "f") == settings
    assert text.startswith("# of a\n# doll?\n")


def test_settings_that_ask_for_nothing_leave_no_table() -> None:
    assert settings_text(DollSettings(joints={"a": JointSettings()})) == "\n"
    assert not JointSettings()
    assert JointSettings(locked=frozenset())


@pytest.mark.parametrize("name", ODD_NAMES)
def test_any_name_of_a_bone_reaches_that_bone_alone(name: str, binary: Path, character: Path, tmp_path: Path) -> None:
    renamed = tmp_path / "renamed.glb"
    rename_nodes(character, {"hand.L": name}, renamed)
    plain = bodies(read_by_server(binary, renamed, "", tmp_path))
    # What the importer cannot keep of a name is not the settings' to mend.
    if name not in plain:
        pytest.skip(f"the server reads the name {name!r} otherwise")
    text = settings_text(DollSettings(joints={name: JointSettings(laws={"hardening": Amount(0.125)})}))
    changed = bodies(read_by_server(binary, renamed, text, tmp_path))
    assert {body for body in plain if changed[body]["hardening"] != plain[body]["hardening"]} == {name}
    assert changed[name]["hardening"] == 0.125


def test_half_a_character_of_a_name_becomes_a_pattern_for_it() -> None:
    assert quoted("a\udc80b") == '"a?b"'


def test_materials_are_the_servers(binary: Path, character: Path, tmp_path: Path) -> None:
    refusal = read_by_server(binary, character, 'material = "cheese"\n', tmp_path).stderr
    assert tuple(refusal.strip().partition("expected one of ")[2].strip('"').split('", "')) == MATERIALS
    for material in MATERIALS:
        assert inspect(str(binary), character, DollSettings(material)).material == material


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("x = [", "not TOML"),
        ("colour = 1", "unknown key 'colour', expected one of material, total_mass"),
        ('material = "cheese"', "material = 'cheese', expected one of soft vinyl"),
        ("total_mass = 0", "total_mass = 0, expected a number in (0, 1e+06]"),
        ("total_mass = nan", "total_mass = nan"),
        ("total_mass = true", "total_mass: expected a number"),
        ("joints = 3", "joints: expected tables"),
        ("[joints]\na = 1", '[joints."a"] expected a table'),
        ("[joints.a]\ncolour = 1", "[joints.\"a\"] unknown key 'colour'"),
        ("[joints.a]\nstiffness = -1", "stiffness = -1, expected"),
        ('[joints.a]\nstiffness = "9"', "stiffness: expected a number"),
        ("[joints.a]\nstiffness = {factor = 0}", "stiffness.factor = 0, expected a number in (0, 1e+06]"),
        ("[joints.a]\nstiffness = {roll = 1}", "stiffness: expected a number or {factor = NUMBER}"),
        ("[joints.a]\nstiffness = {twist = 1, roll = 2}", "stiffness: unknown axis 'roll'"),
        ("[joints.a]\nhardening = {twist = 1}", "hardening: expected a number or"),
        ("[joints.a]\ndamping = inf", "damping = inf, expected"),
        ("[joints.a]\nlimits = {}", "limits: expected a table"),
        ("[joints.a]\nlimits = {bend_y = [-1, 1]}", "limits: unknown axis 'bend_y'"),
        ("[joints.a]\nlimits = {twist = [1, 2]}", "limits.twist lower = 1, expected a number in [-180, 0]"),
        ("[joints.a]\nlimits = {twist = [-1, 181]}", "limits.twist upper = 181, expected a number in [0, 180]"),
        ("[joints.a]\nlimits = {twist = -1}", "limits.twist: expected [lower, upper]"),
        ('[joints.a]\nlocked = ["swing_y"]', "locked: expected a list of twist"),
        ('[joints.a]\nlocked = "twist"', "locked: expected a list"),
        ("[joints.a]\nmerge = 1", "merge: expected true or false"),
        ('[joints.a]\nshape = "ball"', "shape = 'ball', expected one of hull"),
        ("[joints.a]\nmass = 1\ndensity = 2", "density and mass: expected only one"),
    ],
)
def test_bad_files_are_refused_by_us_and_the_server(
    text: str, why: str, binary: Path, character: Path, tmp_path: Path
) -> None:
    with pytest.raises(SettingsFileError) as refusal:
        parse_settings(text, "a.doll.toml")
    assert str(refusal.value).startswith("a.doll.toml: ")
    assert why in str(refusal.value)
    assert "\n" not in str(refusal.value) or "not TOML" in why
    assert read_by_server(binary, character, text, tmp_path).returncode == 1


def test_files_that_cannot_be_read_are_told(tmp_path: Path) -> None:
    with pytest.raises(SettingsFileError, match=r"none\.toml: cannot be read: .*; check the path"):
        read_settings(tmp_path / "none.toml")
    bad = tmp_path / "bad.toml"
    bad.write_bytes(b"material = \xff")
    with pytest.raises(SettingsFileError, match="not a text in UTF-8"):
        read_settings(bad)


def test_what_the_server_writes_reads_back_as_the_same_doll(
    binary: Path, character: Path, own: DollValues, tmp_path: Path
) -> None:
    file = tmp_path / "all.toml"
    subprocess.run([binary, "--inspect", character, "--write-settings", file], check=True, capture_output=True)
    again = inspect(str(binary), character, read_settings(file))
    assert again.joints.keys() == own.joints.keys()
    assert all(is_near(again.joints[bone], own.joints[bone]) for bone in own.joints)
    assert again.mass == pytest.approx(own.mass, rel=SAME)


def test_numbers_of_single_precision_are_those_that_were_typed() -> None:
    import numpy as np

    for typed in (0.1, 0.7, 1e-5, 123.456, 0.0, 1e12):
        assert of_single(float(np.float32(typed))) == typed


# --- patterns --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pattern", "name", "is_match"),
    [
        ("", "", True),
        ("*", "", True),
        ("**", "a", True),
        ("?", "", False),
        ("?", "手", True),
        ("*.L", "arm.L", True),
        ("*.L", "armxL", False),
        ("a*b*c", "a--b--b--c", True),
        ("a*b*c", "a--b--b-", False),
        ("[ab]", "a", False),
        ("[ab]", "[ab]", True),
        ("a?", "a", False),
        ("*" * 40 + "b", "a" * 200, False),
    ],
)
def test_patterns_match_as_the_servers(pattern: str, name: str, is_match: bool) -> None:
    assert matches(pattern, name) is is_match


FILE = """
[joints."*.L"]
stiffness = 1.0
damping = 2.0
mass = 1.0
[joints."hand.L"]
stiffness = {bend_y = 5.0}
[joints."hand*"]
stiffness = 3.0
density = 100.0
[joints."*arm.L"]
damping = {factor = 4.0}
locked = []
"""


def test_tables_of_a_file_are_put_together_as_the_server_does(binary: Path, character: Path, tmp_path: Path) -> None:
    plain = bodies(read_by_server(binary, character, "", tmp_path))
    joints, idle = resolve(parse_settings(FILE, "f").joints, plain)
    assert idle == []
    ours = bodies(read_by_server(binary, character, settings_text(DollSettings(joints=joints)), tmp_path))
    servers = bodies(read_by_server(binary, character, FILE, tmp_path))
    for body in [*ours.values(), *servers.values()]:
        del body["reasons"]
    assert ours == servers
    assert ours != plain


def test_patterns_without_a_bone_are_told() -> None:
    joints, idle = resolve({"x*": MANY, "a": MANY}, ["a", "b"])
    assert (list(joints), idle) == (["a"], ["x*"])


def test_laid_over_replaces_one_way_to_say_a_thing_by_the_other() -> None:
    under = JointSettings(numbers={"mass": 1.0, "friction": 0.5})
    over = JointSettings(numbers={"density": 2.0})
    assert laid_over(under, over).numbers == {"density": 2.0, "friction": 0.5}


# --- what is asked is what the server makes --------------------------------------------------------------------------

ASKED = {
    "nothing": JointSettings(),
    "many": MANY,
    "value": JointSettings(laws={"stiffness": Amount(2.0), "yield_torque": Amount(0.0)}),
    "factors": JointSettings(laws={name: Amount(1.5, is_factor=True) for name in LAWS}),
    "axes": JointSettings(laws={name: (Amount(0.2), None, Amount(3.0, True)) for name in ("damping", "yield_torque")}),
    "rigid axis": JointSettings(laws={"stiffness": (Amount(math.inf), None, None)}),
    "rigid": JointSettings(laws={"stiffness": Amount(math.inf)}),
    "no axis damps": JointSettings(laws={"damping": (Amount(0.0), Amount(0.0), Amount(0.0))}),
    "some axis damps": JointSettings(laws={"damping": (Amount(0.0), Amount(0.3), None)}),
    "narrow": JointSettings(limits={"twist": (-20.0, 20.0), "swing_y": (-75.0, 100.0)}),
    "no limits": JointSettings(limits=dict.fromkeys(LIMIT_AXES, (-180.0, 180.0))),
    "least swing": JointSettings(limits={"swing_z": (-90.0, 0.0)}),
    "unlocked": JointSettings(locked=frozenset()),
    "locked": JointSettings(locked=frozenset(AXES)),
}


@pytest.mark.parametrize("case", ASKED)
def test_asked_is_what_a_settings_file_makes(case: str, binary: Path, character: Path, own: DollValues) -> None:
    settings = ASKED[case].without_joint() if case == "nothing" else ASKED[case]
    made = inspect(str(binary), character, DollSettings(joints={"upper_arm.R": settings}))
    base = own_values(str(binary), character, DollSettings(joints={"upper_arm.R": settings}))
    expected = asked(base.joints["upper_arm.R"], settings)
    assert is_near(made.joints["upper_arm.R"], expected)
    assert (case == "nothing") == is_near(made.joints["upper_arm.R"], own.joints["upper_arm.R"]) or case == "unlocked"


def test_values_of_a_material_are_settings_that_make_them(binary: Path, character: Path) -> None:
    wood = inspect(str(binary), character, DollSettings("wood"))
    joints = {bone: as_settings(values) for bone, values in wood.joints.items()}
    made = inspect(str(binary), character, DollSettings(joints=joints))
    for bone, values in wood.joints.items():
        assert is_near(made.joints[bone], values), bone


def test_ranges_are_those_of_the_server(binary: Path, character: Path, tmp_path: Path) -> None:
    """Each end is taken, and what is beyond is not."""

    def is_taken(text: str) -> bool:
        return read_by_server(binary, character, text, tmp_path).returncode == 0

    for name, allowed in BODY_NUMBERS.items() | DOLL_NUMBERS.items():
        table = '[joints."hand.L"]\n' if name in BODY_NUMBERS and name not in DOLL_NUMBERS else ""
        assert is_taken(f"{table}{name} = {allowed.least}") is not allowed.least_excluded, name
        assert not is_taken(f"{table}{name} = {allowed.least - 1.0}"), name
        assert not is_taken(f"{table}{name} = {2.0 * allowed.most}"), name
    for name, allowed in AMOUNTS.items():
        assert not is_taken(f'[joints."hand.L"]\n{name} = {allowed.least - 1.0}')
        assert is_taken(f'[joints."hand.L"]\n{name} = {allowed.most}')


# --- a file for the start --------------------------------------------------------------------------------------------


def test_prepare_leaves_out_what_the_server_refuses(binary: Path, character: Path, tmp_path: Path) -> None:
    here = tmp_path / "doll.glb"
    here.write_bytes(character.read_bytes())
    joints = {
        "pelvis": JointSettings(laws={"stiffness": Amount(1.0)}, numbers={"friction": 0.25}),  # the root has no joint
        "no such bone": MANY,
        "no such bone either": JointSettings(merge=True),
        "shin.L": JointSettings(merge=True),
        "foot.L": JointSettings(laws={"hardening": Amount(0.5)}),
        "hand.R": JointSettings(numbers={"mass": 1e5}),
        "thigh.L": JointSettings({"damping": Amount(1.0)}, {"swing_y": (0.0, 1.0), "swing_z": (0.0, 0.0)}),
    }
    ready = prepare(DollSettings("clay", {"total_mass": 2.0}, joints), binary, here)
    assert ready.file == settings_path_beside(here) == tmp_path / "doll.doll.toml"
    made = json.loads(subprocess.run([binary, "--inspect", here, "--json"], capture_output=True, check=True).stdout)
    by_name = {body["name"]: body for body in made["bodies"]}
    assert made["settings"]["material"] == "clay"
    assert made["mass"] == pytest.approx(2.0)
    assert by_name["pelvis"]["friction"] == 0.25
    assert by_name["foot.L"]["hardening"] == 0.5
    assert "shin.L" not in by_name
    assert by_name["foot.L"]["parent"] == "thigh.L"
    assert ready.refusals.keys() == {"hand.R", "thigh.L"}
    assert "density of that mass" in ready.refusals["hand.R"]
    assert "the rest pose is outside" in ready.refusals["thigh.L"]
    assert by_name["thigh.L"]["damping"] == pytest.approx(ready.own.joints["thigh.L"].laws["damping"].unit)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["doll.doll.toml", "doll.glb"]


def test_prepare_raises_what_no_bone_is_to_blame_for(binary: Path, character: Path, tmp_path: Path) -> None:
    here = tmp_path / "doll.glb"
    here.write_bytes(character.read_bytes())
    heavy = {"hand.L": JointSettings(numbers={"mass": 0.01})}
    with pytest.raises(LayfigureError, match=r"total_mass = 0\.005, expected more than the 0\.01 kg"):
        prepare(DollSettings(numbers={"total_mass": 0.005}, joints=heavy), binary, here)
    with pytest.raises(LayfigureError, match="cannot be run"):
        prepare(DollSettings(), tmp_path / "none", here)
    here.write_bytes(b"glTF")
    with pytest.raises(LayfigureError, match=r"doll\.glb"):
        prepare(DollSettings(), binary, here)


def test_culprit_is_the_bone_of_the_table() -> None:
    settings = DollSettings(joints={"a": MANY, "[joints.b]\n": MANY, "none": JointSettings(), "c": MANY})
    lines = settings_text(settings).splitlines()
    for name in ("a", "[joints.b]\n", "c"):
        line = lines.index(f"[joints.{quoted(name)}]") + 3
        assert culprit(f"/x/f.toml:{line}: why", settings) == (name, "why")
    assert culprit("f.toml:1: why", DollSettings("wood", joints={"a": MANY})) == (None, "f.toml:1: why")
    assert culprit("no line", settings) == (None, "no line")


def test_applicable_keeps_what_a_bone_can_have(own: DollValues) -> None:
    values = DollValues(own.joints, own.roots, riders={"rider": "no body of its own"})
    joints = {"pelvis": MANY, "hand.L": MANY, "rider": MANY, "stranger": MANY}
    kept = applicable(DollSettings(joints=joints), values).joints
    assert kept == {"pelvis": MANY.without_joint(), "hand.L": MANY, "rider": JointSettings(merge=False)}


# --- commands and the other side -------------------------------------------------------------------------------------


def test_changes_are_none_for_the_same_and_few_for_a_little(own: DollValues) -> None:
    now = own.joints["hand.L"]
    assert changes(now, now) == []
    twice = asked(now, JointSettings(laws={"stiffness": Amount(2.0, True)}))
    (change,) = changes(now, twice)
    assert change.command == "set"
    assert change.arguments == (("stiffness", twice.laws["stiffness"].unit),)
    (change,) = changes(now, asked(now, JointSettings(laws={"stiffness": (None, Amount(1.0), None)})))
    assert [name for name, _ in change.arguments] == ["stiffness.twist", "stiffness.bend_y", "stiffness.bend_z"]
    both = changes(
        asked(now, JointSettings(locked=frozenset({"twist"}))), asked(now, JointSettings(locked=frozenset({"bend_y"})))
    )
    assert [(c.command, c.arguments) for c in both] == [
        ("unlock", (("axes", "twist"),)),
        ("lock", (("axes", "bend_y"),)),
    ]


def test_changes_come_apart_into_what_belongs_together(own: DollValues) -> None:
    now = own.joints["hand.L"]
    (change,) = changes(
        now, asked(now, JointSettings({"stiffness": (None, Amount(1.0), None)}, {"twist": (-1.0, 1.0)}))
    )
    assert [[name for name, _ in part.arguments] for part in change.apart()] == [
        ["stiffness.twist", "stiffness.bend_y", "stiffness.bend_z"],
        ["limits.twist"],
    ]


def limits_in_degrees(values: JointValues) -> JointSettings:
    return JointSettings(limits={axis: tuple(map(math.degrees, values.limits[axis])) for axis in LIMIT_AXES})


@pytest.mark.parametrize("pair", ["upper_arm", "forearm", "hand", "thigh", "shin", "foot"])
def test_mirrored_limits_are_those_that_the_server_gives_the_other_side(pair: str, own: DollValues) -> None:
    left, right = own.joints[f"{pair}.L"], own.joints[f"{pair}.R"]
    assert is_near(asked(left, mirrored(limits_in_degrees(right))), left)
    assert is_near(asked(right, mirrored(limits_in_degrees(left))), right)


def test_mirrored_twice_is_the_same() -> None:
    assert mirrored(mirrored(MANY)) == MANY
    assert mirrored(MANY).limits["twist"] == (-45.5, 30.0)
