"""Generates layfigure.messages from the repository's LCM types, then hands over to setuptools.

It runs for `pip install ./client` and for an editable install alike; the generated package is never committed.
"""

import shutil
import subprocess
import tempfile
from pathlib import Path

import lcm
from setuptools import setup

CLIENT = Path(__file__).resolve().parent
TYPES = CLIENT.parent / "server" / "messaging" / "types"
MESSAGES = CLIENT / "src" / "layfigure" / "messages"


def generate_messages() -> None:
    """Runs lcm-gen on copies whose package is layfigure.messages: `layfigure` itself is the hand-written package."""
    sources = sorted(TYPES.glob("*.lcm"))
    if not sources:
        raise SystemExit(f"{TYPES}: no .lcm files; install the client from a checkout of the whole repository")
    with tempfile.TemporaryDirectory() as scratch:
        copies = [Path(scratch) / source.name for source in sources]
        for source, copy in zip(sources, copies, strict=True):
            copy.write_text(source.read_text().replace("package layfigure;", "package layfigure.messages;"))
        lcm_gen = Path(lcm.LCM_BIN_DIR) / "lcm-gen"
        subprocess.run([lcm_gen, "--python", "--ppath", scratch, *copies], check=True)
        shutil.rmtree(MESSAGES, ignore_errors=True)
        shutil.copytree(Path(scratch) / "layfigure" / "messages", MESSAGES)


generate_messages()
setup()
