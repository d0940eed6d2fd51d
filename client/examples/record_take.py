"""Records what a session's hands do as a take, and writes it as USD: every frame, and again with as few keys as do.

layfigure-server doll.glb --broker 7700 &
python record_take.py tcpq://127.0.0.1:7700 session.toml take.usda
"""

import argparse
from pathlib import Path

import layfigure

TOLERANCE_M = 0.5e-3  # that the reduced keys may be off, anywhere on the skin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("url", help="LCM URL of the server's bus")
    parser.add_argument("session", help="of the hands, a TOML file")
    parser.add_argument("out", type=Path, help="the USD file")
    options = parser.parse_args()

    with layfigure.connect(options.url) as doll:
        with doll.record(options.out.with_suffix(".lcmlog")) as recording:
            doll.play(options.session)
        take = recording.take

    layfigure.write_usd(take, options.out, fps=24.0)
    few = options.out.with_name(f"{options.out.stem}_few.usdc")
    layfigure.write_usd(take, few, fps=24.0, keys="reduced", tolerance_m=TOLERANCE_M, layout="single")
    print(f"{options.out}, {few}: {len(take.times_us)} poses, {take.duration_s:.2f} s, {take.lost_poses} lost")


if __name__ == "__main__":
    try:
        main()
    except layfigure.LayfigureError as error:
        raise SystemExit(f"record_take: {error}") from None
