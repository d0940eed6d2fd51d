"""The decoders against spoilt messages: a ProtocolError or a message that can be computed with, nothing else."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from layfigure import codec
from layfigure.errors import ProtocolError

GOLDEN = Path(__file__).parents[1] / "data/golden"
ROUNDS = 3000
LONGEST_S = 5.0  # for one message, on a machine under load: they are a few hundred bytes
EXTREMES = (0, 1, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FF00000, 0x7FF80000)

DECODERS: dict[str, Callable[[bytes], object]] = {
    "character_t": codec.decode_character,
    "force_t": codec.decode_force,
    "mesh_chunk_t": codec.decode_mesh_chunk,
    "meshes_t": lambda data: codec.decode_meshes(data, 2),
    "pose_t": codec.decode_pose,
    "reply_t": codec.decode_reply,
    "spidar_command_t": codec.decode_spidar_command,
    "status_t": codec.decode_status,
}


def spoil(data: bytes, choose: random.Random) -> bytes:
    spoilt = bytearray(data)
    for _ in range(choose.randrange(1, 4)):
        at = choose.randrange(8, len(spoilt)) if choose.random() < 0.9 else choose.randrange(len(spoilt))
        what = choose.randrange(4)
        if what == 0:
            spoilt[at] ^= 1 << choose.randrange(8)
        elif what == 1:
            spoilt[at : at + 4] = choose.choice(EXTREMES).to_bytes(4, "big")
        elif what == 2:
            spoilt[at : at + 8] = choose.randbytes(8)
        else:
            spoilt = spoilt[: max(9, at)]
    return bytes(spoilt)


@pytest.mark.parametrize("name", DECODERS)
def test_decode_spoilt_message_is_refused_or_whole(name: str) -> None:
    whole = (GOLDEN / f"{name}.bin").read_bytes()
    choose = random.Random(20261128)
    refused = 0
    for number in range(ROUNDS):
        data = spoil(whole, choose) if number % 10 else choose.randbytes(choose.randrange(400))
        start = time.monotonic()
        try:
            DECODERS[name](data)
        except ProtocolError:
            refused += 1
        assert time.monotonic() - start < LONGEST_S, f"message {number} took too long"
    assert refused > ROUNDS // 10
