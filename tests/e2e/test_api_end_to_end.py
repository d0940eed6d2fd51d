"""`import layfigure` on the real server, and the examples of client/examples."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from e2e_support import NO_DEFAULT_BUS, REPOSITORY, TIMEOUT_S, RunClient
from pxr import Usd
from server_support.process import ServerProcess, StartServer, keepable_port

import layfigure
from layfigure.usd.checks import check

EXAMPLES = REPOSITORY / "client/examples"
SESSION_S = 5.0
POSE_HZ, PHYSICS_HZ = 60, 1000


@pytest.fixture
def lockstep(start_server: StartServer) -> ServerProcess:
    return start_server("--clock", "lockstep")


def run_example(folder: Path, name: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, EXAMPLES / name, *map(str, arguments)],
        cwd=folder,
        env={**os.environ, **NO_DEFAULT_BUS},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )


def raise_hand(doll: layfigure.Doll) -> np.ndarray:
    """Returns all rotations on the way (P, J, 4)."""
    hand = doll.joint("hand.L")
    start = layfigure.world_poses(doll.character, doll.pose())[1][hand]
    doll.move_pointer(0, start)
    doll.command("grab", pointer=0, bone="hand.L", point=np.zeros(3))
    way = np.linspace(start, start + np.array([0.0, -0.09, 0.05]), 30)
    return np.array([doll.next_pose({0: place}).rotations for place in way])


def test_next_pose_in_lockstep_follows_the_hand_and_repeats(start_server: StartServer) -> None:
    runs = []
    for _ in range(2):
        with layfigure.connect(start_server("--clock", "lockstep").url) as doll:
            arm = doll.joint("upper_arm.L")
            runs.append(raise_hand(doll))
            force = doll.force(0)
            assert force is not None
            assert force.attached
            assert np.linalg.norm(force.force) > 0.0
    assert np.abs(runs[0][-1, arm] - runs[0][0, arm]).max() > 0.01
    np.testing.assert_array_equal(runs[0], runs[1])


def test_step_returns_the_pose_of_the_last_period(lockstep: ServerProcess) -> None:
    with layfigure.connect(lockstep.url) as doll:
        assert doll.step(16).step == 0  # the next pose comes after 17 steps of 1 ms
        assert doll.step().step == 17
        pose = doll.step(PHYSICS_HZ - 17)
        assert (pose.step, pose.sequence) == (PHYSICS_HZ, POSE_HZ)
        assert doll.next_pose().step == PHYSICS_HZ + 17
        assert doll.command("step", count=3).values("steps") == (PHYSICS_HZ + 20,)
        assert doll.next_pose().step == PHYSICS_HZ + 34
        with pytest.raises(layfigure.UsageError, match="count of steps is 0"):
            doll.step(0)


def test_command_takes_any_argument_by_its_name(lockstep: ServerProcess) -> None:
    with layfigure.connect(lockstep.url) as doll:
        doll.command("set", bone="neck", **{"limits.twist": np.array([-0.5, 0.5])}, yield_torque=2)
        doll.command("lock", bone="neck", axes=["twist", "bend_y"])
        doll.command("snapshot", name="as it came", action="save")
        with pytest.raises(layfigure.RefusedError, match="wing"):
            doll.command("grab", pointer=0, bone="wing")
        with pytest.raises(layfigure.RefusedError):
            doll.command("fly")


def test_realtime_poses_stream_in_order(start_server: StartServer) -> None:
    with layfigure.connect(start_server().url) as doll:
        assert doll.status().clock == "realtime"
        stream = doll.poses(timeout_s=TIMEOUT_S)
        poses = [next(stream) for _ in range(30)]
        assert np.all(np.diff([pose.sequence for pose in poses]) >= 1)
        assert poses[-1].sequence - poses[0].sequence == 29 + stream.skipped
        assert doll.next_pose().sequence > poses[-1].sequence
        with pytest.raises(layfigure.UsageError, match="--clock lockstep"):
            doll.step()


def test_realtime_newest_pose_leaves_out_what_a_slow_loop_missed(start_server: StartServer) -> None:
    with layfigure.connect(start_server().url) as doll:
        stream = doll.poses(timeout_s=TIMEOUT_S, newest=True)
        first = next(stream)
        doll.wait(0.5)
        second = next(stream)
        assert second.sequence > first.sequence + 1
        assert stream.skipped == second.sequence - first.sequence - 1


def test_poses_end_when_the_server_leaves(start_server: StartServer) -> None:
    server = start_server()
    with layfigure.connect(server.url) as doll:
        stream = doll.poses(timeout_s=TIMEOUT_S)
        next(stream)
        doll.command("shutdown")
        list(stream)
        with pytest.raises(layfigure.LayfigureError):
            doll.command("key")


def test_doll_goes_on_with_a_restarted_server(start_server: StartServer) -> None:
    port = keepable_port()
    first = start_server("--clock", "lockstep", "--broker", port)
    with layfigure.connect(first.url) as doll:
        assert doll.step(200).step > 100
        first.process.kill()
        first.process.wait()
        start_server("--clock", "lockstep", "--broker", port)
        doll.wait(0.1)
        assert doll.next_pose().step == 17


def test_poses_of_a_lockstep_server_that_nobody_steps_run_into_the_timeout(lockstep: ServerProcess) -> None:
    with (
        layfigure.connect(lockstep.url) as doll,
        pytest.raises(layfigure.NoReplyError, match=r"within 0.2 s: order steps"),
    ):
        next(doll.poses(timeout_s=0.2))


def test_doll_is_refused_to_other_threads_and_after_its_end(lockstep: ServerProcess) -> None:
    refusals: list[str] = []

    def use(doll: layfigure.Doll) -> None:
        try:
            doll.command("key")
        except layfigure.UsageError as error:
            refusals.append(str(error))

    with layfigure.connect(lockstep.url) as doll:
        thread = threading.Thread(target=use, args=(doll,))
        thread.start()
        thread.join()
    use(doll)
    assert len(refusals) == 2
    assert "thread" in refusals[0]
    assert "closed" in refusals[1]


def test_connect_without_a_server_says_so(lockstep: ServerProcess) -> None:
    with pytest.raises(layfigure.BusError, match="no server at"):
        layfigure.connect("tcpq://127.0.0.1:1")
    with pytest.raises(layfigure.NoReplyError, match=r"within 0.2 s"):
        layfigure.connect(lockstep.url, prefix="ELSEWHERE_", timeout_s=0.2)


def test_two_recordings_are_two_takes_that_their_logs_hold(lockstep: ServerProcess, tmp_path: Path) -> None:
    with layfigure.connect(lockstep.url) as doll:
        takes = []
        for name in ("a", "b"):
            with doll.record(tmp_path / f"{name}.lcmlog") as recording:
                rotations = raise_hand(doll)
                doll.command("key")
                assert recording.take.duration_s > 0.0
            doll.command("reset")
            doll.next_pose()
            takes.append(recording.take)
            np.testing.assert_array_equal(takes[-1].rotations[1:], rotations)
            assert len(takes[-1].marks_us) == 1
            read = layfigure.read_take(tmp_path / f"{name}.lcmlog")
            np.testing.assert_array_equal(read.times_us, takes[-1].times_us)
            np.testing.assert_array_equal(read.rotations, takes[-1].rotations)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.lcmlog", "b.lcmlog"]


def test_recording_that_cannot_be_made_is_refused_and_the_doll_goes_on(lockstep: ServerProcess, tmp_path: Path) -> None:
    with layfigure.connect(lockstep.url) as doll:
        for bad in (tmp_path / "take.usda", tmp_path / "nowhere/take.lcmlog"):
            with pytest.raises(layfigure.UsageError, match="expected the name of an event log"), doll.record(bad):
                pass
        with doll.record(tmp_path / "a.lcmlog"), pytest.raises(layfigure.UsageError, match="already"):  # noqa: SIM117
            with doll.record(tmp_path / "b.lcmlog"):
                pass
        assert doll.next_pose().step == 17


def test_example_pose_and_key(lockstep: ServerProcess, tmp_path: Path) -> None:
    result = run_example(tmp_path, "pose_and_key.py", lockstep.url, "hand.L")
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("key at 2.000 s: hand.L stays ")
    assert float(result.stdout.split("stays ")[1].split(" mm")[0]) > 5.0
    unknown = run_example(tmp_path, "pose_and_key.py", lockstep.url, "wing")
    assert (unknown.returncode, unknown.stderr) == (1, "pose_and_key: 'doll' has no joint 'wing'\n")


def test_example_poses_to_numpy(start_server: StartServer, tmp_path: Path) -> None:
    result = run_example(tmp_path, "poses_to_numpy.py", start_server().url, "poses.npz", "--count", 20)
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith("poses.npz: 20 poses of 17 joints, ")
    arrays = np.load(tmp_path / "poses.npz")
    assert arrays["rotations"].shape == (20, 17, 4)
    assert np.all(np.diff(arrays["times_s"]) > 0.0)


def test_example_record_take(lockstep: ServerProcess, session: Path, tmp_path: Path, client: RunClient) -> None:
    result = run_example(tmp_path, "record_take.py", lockstep.url, session, "take.usda")
    assert (result.returncode, result.stderr) == (0, "")
    poses = round(SESSION_S * POSE_HZ) + 1
    assert result.stdout == f"take.usda, take_few.usdc: {poses} poses, {SESSION_S:.2f} s, 0 lost\n"
    for name in ("take.usda", "take_few.usdc"):
        assert check(tmp_path / name).findings == ()
        assert Usd.Stage.Open(str(tmp_path / name)).GetEndTimeCode() == SESSION_S * 24
    assert client("export", "take.lcmlog", "again.usdc", "--layout", "single").returncode == 0
    layfigure.write_usd(layfigure.read_take(tmp_path / "take.lcmlog"), tmp_path / "same.usdc", layout="single")
    assert (tmp_path / "again.usdc").read_bytes() == (tmp_path / "same.usdc").read_bytes()
