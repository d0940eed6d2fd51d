"""The default bus, LCM's multicast, inside a network namespace with nothing but a loopback device."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from e2e_support import REPOSITORY

from layfigure.take_collector import read_take
from layfigure.usd.checks import check

TIMEOUT_S = 120.0
SETUP = 'ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo && exec "$@"'
SCRIPT = """
import os, sys
from pathlib import Path
sys.path[:0] = sys.argv[1:3]
os.environ["LCM_DEFAULT_URL"] = ""
from e2e_support import REPOSITORY, ClientProcess
from server_support.process import ServerProcess
folder, session, server = Path(sys.argv[3]), sys.argv[4], sys.argv[5:]
with ServerProcess([*server, "--clock", "lockstep"]) as server:
    with ClientProcess(folder, ["record", "take.usda"], {}) as recorder:
        print(recorder.error_line(), end="")
        for command in (["play", session], ["shutdown"]):
            with ClientProcess(folder, command, {}) as client:
                print(*client.finish())
        print(*recorder.finish())
"""


def test_record_and_play_over_multicast(
    binary: Path, character: Path, session: Path, tmp_path: Path, own_network: tuple[str, ...]
) -> None:
    paths = [Path(__file__).parent, REPOSITORY / "tests/server", tmp_path, session, binary, character]
    done = subprocess.run(
        [*own_network, "sh", "-c", SETUP, "sh", sys.executable, "-c", SCRIPT, *map(str, paths)],
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    take = read_take(tmp_path / "take.lcmlog")
    assert len(take.times_us) + take.lost_poses == 301, done.stdout
    assert check(tmp_path / "take.usda").findings == ()
