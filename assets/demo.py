#!/usr/bin/env python3
"""The demo: scripted hands pose a character on a real server, a recorder writes it as USD.

    demo.py [--server BINARY] [--character FILE] [--session FILE] [--two-hands FILE] [--out FOLDER]

Three processes over LCM on 127.0.0.1, as a user would start them: layfigure-server in lockstep, layfigure record,
layfigure play. Then the take is checked, drawn and plotted, and a table of its joints is printed; it is exported again
with as few keys as hold the skin's tolerance. A second take is made by two haptic devices, simulated with their hands,
that grasp an arm and bend it. Without options it uses what ./run demo has built. Exit code 1 if anything fails, if an
arm does not keep its new pose, if what should come back does not, or if too many frames are keys.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from layfigure.analysis import JointSummary, summarize
from layfigure.errors import LayfigureError
from layfigure.take import Take
from layfigure.take_collector import read_take
from layfigure.take_form import TakeForm
from layfigure.usd.checks import check
from layfigure.usd.writer import write_take

ROOT = Path(__file__).resolve().parent.parent
FPS = 60  # poses of the server: each is a frame
TOLERANCE_MM = 0.5  # of the skin, with reduced keys
TOLERANCE_DEG = 1.0  # of joints, which show in the skin
MOST_KEYS = 0.2  # of the frames
PICTURES = 8
TIMEOUT_S = 300.0
START_TIMEOUT_S = 60.0
ARM = ("LeftArm", "LeftForeArm")
TRUNK = ("Spine", "Spine1", "Spine2")
KEPT_DEG = 5.0  # an arm whose rest rotations moved by less has not been posed
DEVICE = "spidar-g6"
BENT = "LeftForeArm"  # by two hands ...
STEADIED = "LeftArm"  # ... of which one holds the elbow
BACK_DEG = 2.0  # a trunk that came back to within this hangs as it did: its sag under the raised arm is less


class DemoError(Exception):
    """One line: what failed."""


def main() -> int:
    options = parse_options()
    try:
        require_file(options.server, "build it with ./run demo, or name it with --server")
        require_file(options.character, "make it with ./run demo, or name it with --character")
        require_file(options.session, "name it with --session")
        require_file(options.two_hands, "name it with --two-hands")
        options.out.mkdir(parents=True, exist_ok=True)
        take_file = options.out / "take.usda"
        record_session(options, options.session, take_file)
        judge(report(take_file, "forces.png"))
        reduce_keys(take_file)
        take_file = options.out / "two_hands.usda"
        record_session(options, options.two_hands, take_file, "--device", DEVICE, "--device", DEVICE)
        judge_two_hands(report(take_file, "two_hands_forces.png"))
    except (DemoError, LayfigureError, OSError) as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    return 0


def parse_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--server", type=Path, default=ROOT / "build/release/server/app/layfigure-server")
    parser.add_argument("--character", type=Path, default=ROOT / "build/characters/human.glb")
    parser.add_argument("--session", type=Path, default=ROOT / "assets/sessions/demo.toml")
    parser.add_argument("--two-hands", type=Path, default=ROOT / "assets/sessions/two_hands.toml")
    parser.add_argument("--out", type=Path, default=ROOT / "out/demo")
    return parser.parse_args()


def require_file(path: Path, mend: str) -> None:
    if not path.is_file():
        raise DemoError(f"no file '{path}': {mend}")


# --- the three processes ---------------------------------------------------------------------------------------------


def layfigure(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "layfigure", *map(str, arguments)]


def record_session(options: argparse.Namespace, session: Path, take_file: Path, *server_options: str) -> None:
    """The server's leave, which the shutdown command asks for, ends the recorder too."""
    server_command = [options.server, options.character, "--clock", "lockstep", "--broker", "0", *server_options]
    with running("layfigure-server", server_command) as server:
        url = wait_for_line("layfigure-server", server, "listening on ").split()[-1]
        with running(
            "layfigure record", layfigure("record", take_file, "--fps", FPS, "--custom-data", "--lcm-url", url)
        ) as recorder:
            wait_for_line("layfigure record", recorder, "recording ")
            call(layfigure("play", session, "--lcm-url", url))
            call(layfigure("shutdown", "--lcm-url", url))
            finish("layfigure record", recorder)
        finish("layfigure-server", server)


@contextmanager
def running(name: str, command: Sequence[object]) -> Iterator[subprocess.Popen[str]]:
    """A process whose output, both streams in one, can be read; it does not outlive the block."""
    try:
        process = subprocess.Popen(
            list(map(str, command)),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
    except OSError as error:
        raise DemoError(f"cannot start {name}: {error.strerror}") from error
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def wait_for_line(name: str, process: subprocess.Popen[str], start: str) -> str:
    """The first line of the process that begins with `start`; the others are shown."""
    assert process.stdout is not None
    killer = threading.Timer(START_TIMEOUT_S, process.kill)
    killer.start()
    try:
        for line in process.stdout:
            print(line, end="", flush=True)
            if line.startswith(start):
                return line
    finally:
        killer.cancel()
    raise DemoError(f"{name} ended before it was ready")


def finish(name: str, process: subprocess.Popen[str]) -> None:
    try:
        output, _ = process.communicate(timeout=TIMEOUT_S)
    except subprocess.TimeoutExpired as error:
        raise DemoError(f"{name} did not end within {TIMEOUT_S:g} s") from error
    print(output, end="", flush=True)
    if process.returncode != 0:
        raise DemoError(f"{name} failed with exit code {process.returncode}")


def call(command: list[str]) -> None:
    result = subprocess.run(command, stdin=subprocess.DEVNULL, check=False, timeout=TIMEOUT_S)
    if result.returncode != 0:
        raise DemoError(f"'{' '.join(command[1:])}' failed with exit code {result.returncode}")


# --- what came of it -------------------------------------------------------------------------------------------------


def report(take_file: Path, plot: str) -> dict[str, JointSummary]:
    call(layfigure("check", take_file))
    frames = check(take_file).frames
    chosen = ",".join(str(round(index * (frames - 1) / (PICTURES - 1))) for index in range(PICTURES))
    call(layfigure("preview", take_file, "-o", take_file.with_suffix(".png"), "--frames", chosen))
    call(layfigure("plot", take_file.with_suffix(".lcmlog"), "-o", take_file.with_name(plot)))
    take = read_take(take_file.with_suffix(".lcmlog"))
    summaries = {summary.name.rpartition(":")[2]: summary for summary in summarize(take)}
    print_table(summaries)
    print_figures(take, frames)
    return summaries


def print_table(summaries: dict[str, JointSummary]) -> None:
    """The joints that the sessions are about, and whatever else flowed."""
    flowed = [name for name, joint in summaries.items() if joint.yielded]
    print()
    print("                 largest       yield            rest rotation        pose")
    print("joint             torque      torque           before     after     moved")
    for name in dict.fromkeys((*ARM, *TRUNK, *flowed)):
        if (joint := summaries.get(name)) is not None:
            outcome = "flowed" if joint.yielded else "held"
            print(
                f"{name:<14}{joint.largest_torque:>6.2f} N m{joint.yield_torque:>8.2f} N m   {outcome:<6}"
                f"{joint.rest_before_deg:>8.1f}°{joint.rest_after_deg:>9.1f}°{joint.moved_deg:>9.1f}°"
            )


def print_figures(take: Take, frames: int) -> None:
    print()
    print(
        f"{frames} frames at {FPS} fps; {len(take.times_us)} poses in {take.duration_s:.2f} s, {take.lost_poses} lost"
    )
    if take.last_status is not None:
        print(
            f"real-time factor of the simulation: {take.last_status.realtime_factor:.0f}; "
            f"a step takes {take.last_status.step_us_p50:.1f} us (median)"
        )


def judge(summaries: dict[str, JointSummary]) -> None:
    """Raises DemoError unless the arm stayed where it was put and the trunk came back."""
    require_kept(summaries, ARM)
    require_back(summaries, TRUNK)
    print("the arm has kept its new pose, the trunk has come back")


def judge_two_hands(summaries: dict[str, JointSummary]) -> None:
    """Raises DemoError unless the elbow stayed bent and the shoulder, which the other hand steadied, came back."""
    require_kept(summaries, [BENT])
    require_back(summaries, [STEADIED])
    print("two hands have bent the elbow, the shoulder has held")


def reduce_keys(take_file: Path) -> None:
    """Raises DemoError unless few keys hold the tolerance, which `layfigure diff` verifies: it skins every frame."""
    reduced = take_file.with_name("take_keys.usda")
    take = read_take(take_file.with_suffix(".lcmlog"))
    animation = write_take(take, reduced, FPS, TakeForm("reduced", TOLERANCE_MM * 1e-3))
    share = len(animation.keys) / len(animation.frames)
    print(f"{reduced}: {len(animation.keys)} of {len(animation.frames)} frames are keys, {share:.1%}", flush=True)
    call(layfigure("diff", take_file, reduced, "--tolerance-mm", TOLERANCE_MM, "--tolerance-deg", TOLERANCE_DEG))
    if share > MOST_KEYS:
        raise DemoError(f"{share:.1%} of the frames are keys, at most {MOST_KEYS:.0%} expected")


def require_kept(summaries: dict[str, JointSummary], names: Sequence[str]) -> None:
    for joint in (summary_of(summaries, name) for name in names):
        if not joint.yielded or joint.rest_after_deg - joint.rest_before_deg < KEPT_DEG:
            raise DemoError(f"'{joint.name}' has not kept a new pose")


def require_back(summaries: dict[str, JointSummary], names: Sequence[str]) -> None:
    for joint in (summary_of(summaries, name) for name in names):
        if joint.yielded or joint.moved_deg > BACK_DEG:
            raise DemoError(f"'{joint.name}' has not come back")


def summary_of(summaries: dict[str, JointSummary], name: str) -> JointSummary:
    if name not in summaries:
        raise DemoError(f"the character has no body '{name}': the sessions are for Mixamo's bone names")
    return summaries[name]


if __name__ == "__main__":
    sys.exit(main())
