"""What the command line tells of itself: help of each command, and shells' completion."""

from __future__ import annotations

import argparse
import shutil
import subprocess
from pathlib import Path

import pytest
from client_support.cli import Cli, assert_one_line_error

from layfigure.cli.main import build_parser


def command_parsers() -> dict[str, argparse.ArgumentParser]:
    [commands] = [action for action in build_parser()._actions if isinstance(action, argparse._SubParsersAction)]
    return dict(commands.choices)


COMMANDS = command_parsers()


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_each_command_has_an_example_of_it(name: str) -> None:
    _, _, examples = COMMANDS[name].format_help().partition("\nexample")
    assert f"layfigure {name} " in examples
    assert len(COMMANDS[name].description or "") > 0


def test_help_lists_all_commands(cli: Cli) -> None:
    output = cli("--help").stdout
    for name in COMMANDS:
        assert f"\n    {name} " in output


def completions(script: Path, *words: str) -> list[str]:
    """What bash offers for the last of the words."""
    line = "source {}; COMP_WORDS=({}); COMP_CWORD={}; _shtab_layfigure; printf '%s\\n' \"${{COMPREPLY[@]}}\"".format(
        script, " ".join(f"'{word}'" for word in ("layfigure", *words)), len(words)
    )
    result = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=True, cwd=script.parent)
    assert result.stderr == ""
    return result.stdout.split()


@pytest.fixture
def bash_script(cli: Cli, tmp_path: Path) -> Path:
    result = cli("--print-completion", "bash")
    assert (result.returncode, result.stderr) == (0, "")
    script = tmp_path / "completion.bash"
    script.write_text(result.stdout)
    return script


def test_bash_completes_commands_options_and_choices(bash_script: Path) -> None:
    assert completions(bash_script, "re") == ["record", "reset", "redo"]
    assert completions(bash_script, "record", "--fp") == ["--fps"]
    assert completions(bash_script, "record", "--keys", "r") == ["reduced"]


def test_bash_completes_files(bash_script: Path) -> None:
    (bash_script.parent / "take.usda").touch()
    assert completions(bash_script, "check", "tak") == ["take.usda"]


def test_zsh_script_is_for_the_command_and_parses(cli: Cli, tmp_path: Path) -> None:
    result = cli("--print-completion", "zsh")
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("#compdef layfigure\n")
    assert all(f"\n    {name}:'" in result.stdout for name in COMMANDS)
    if zsh := shutil.which("zsh"):
        script = tmp_path / "_layfigure"
        script.write_text(result.stdout)
        subprocess.run([zsh, "-n", script], check=True)


def test_completion_of_an_unknown_shell_is_refused(cli: Cli) -> None:
    assert_one_line_error(cli("--print-completion", "cmd.exe"), 2, "bash", "zsh")
