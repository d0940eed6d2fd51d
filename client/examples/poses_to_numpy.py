"""Streams poses into arrays, and keeps them in a .npz file.

layfigure-server doll.glb --broker 7700 &
python poses_to_numpy.py tcpq://127.0.0.1:7700 poses.npz --count 120
"""

import argparse
import itertools

import numpy as np

import layfigure

TIMEOUT_S = 5.0  # between two poses


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("url", help="LCM URL of the server's bus")
    parser.add_argument("out", help="the .npz file")
    parser.add_argument("--count", type=int, default=120, help="of poses (default 120)")
    options = parser.parse_args()

    with layfigure.connect(options.url) as doll:
        stream = doll.poses(timeout_s=TIMEOUT_S)
        poses = list(itertools.islice(stream, options.count))
        names = [joint.name for joint in doll.character.joints]

    arrays = {
        "names": np.array(names),  # (J)
        "times_s": np.array([pose.time_us for pose in poses]) * 1e-6,  # (P) simulation time
        "root_translations": np.array([pose.root_translation for pose in poses]),  # (P, 3) world [m]
        "rotations": np.array([pose.rotations for pose in poses]),  # (P, J, 4) w x y z, joint -> parent
        "torques": np.array([pose.torques for pose in poses]),  # (P, J, 3) in the joint's frame [N m]
    }
    np.savez(options.out, allow_pickle=False, **arrays)
    print(f"{options.out}: {len(poses)} poses of {len(names)} joints, {stream.skipped} lost")


if __name__ == "__main__":
    try:
        main()
    except layfigure.LayfigureError as error:
        raise SystemExit(f"poses_to_numpy: {error}") from None
