"""Raises the doll's left arm, marks the pose as a key, and says what stayed of it.

layfigure-server doll.glb --broker 7700 &
python pose_and_key.py tcpq://127.0.0.1:7700 hand.L
"""

import argparse

import numpy as np

import layfigure

RISE = np.array([0.0, -0.09, 0.05])  # of the hand, in the world [m]
DURATION_S = 1.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("url", help="LCM URL of the server's bus")
    parser.add_argument("bone", help="that the hand grabs")
    options = parser.parse_args()

    with layfigure.connect(options.url) as doll:
        bone = doll.joint(options.bone)
        _, positions = layfigure.world_poses(doll.character, doll.pose())
        start = positions[bone]
        doll.move_pointer(0, start)
        doll.command("grab", pointer=0, bone=options.bone, point=[0.0, 0.0, 0.0])

        frames = round(DURATION_S * doll.character.pose_hz)
        for frame in range(1, frames + 1):  # the same in realtime and in lockstep
            doll.next_pose({0: start + RISE * frame / frames})
        doll.command("release", pointer=0)
        for _ in range(frames):
            pose = doll.next_pose()

        key = doll.command("key")
        _, positions = layfigure.world_poses(doll.character, pose)
        moved_mm = 1e3 * np.linalg.norm(positions[bone] - start)
        print(f"key at {key.time_us * 1e-6:.3f} s: {options.bone} stays {moved_mm:.1f} mm from where it was")


if __name__ == "__main__":
    try:
        main()
    except layfigure.LayfigureError as error:
        raise SystemExit(f"pose_and_key: {error}") from None
