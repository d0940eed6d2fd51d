"""A network between two multicast groups that loses, doubles, delays and reorders datagrams, from a fixed seed."""

from __future__ import annotations

import heapq
import random
import select
import socket
import struct
import threading
import time
from dataclasses import dataclass

Group = tuple[str, int]


@dataclass(frozen=True)
class Faults:
    """Shares of the datagrams, and the longest delay [s]; delays at random reorder them."""

    lost: float = 0.03
    doubled: float = 0.02
    delayed: float = 0.25
    longest_delay_s: float = 0.004


class LossyRelay:
    """Relays between `here` and `there` on a thread of its own, for as long as the `with` block lasts."""

    def __init__(self, here: Group, there: Group, faults: Faults, seed: int = 1) -> None:
        self._faults = faults
        self._random = random.Random(seed)
        self._out = _sender()
        self._target = {_receiver(here): there, _receiver(there): here}
        self._waiting: list[tuple[float, int, bytes, Group]] = []
        self._stopping = False
        self.lost = 0
        self.relayed = 0
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> LossyRelay:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping = True
        self._thread.join()
        for end in (*self._target, self._out):
            end.close()

    def _run(self) -> None:
        while not self._stopping:
            readable, _, _ = select.select(list(self._target), [], [], 0.001)
            for end in readable:
                data, sender = end.recvfrom(65536)
                if sender[1] != self._out.getsockname()[1]:  # not what this relay has sent itself
                    self._take(data, self._target[end])
            while self._waiting and self._waiting[0][0] <= time.monotonic():
                _, _, data, target = heapq.heappop(self._waiting)
                self._out.sendto(data, target)

    def _take(self, data: bytes, target: Group) -> None:
        if self._random.random() < self._faults.lost:
            self.lost += 1
            return
        for _ in range(2 if self._random.random() < self._faults.doubled else 1):
            self.relayed += 1
            late = self._random.random() < self._faults.delayed
            delay = self._random.uniform(0.0, self._faults.longest_delay_s) if late else 0.0
            heapq.heappush(self._waiting, (time.monotonic() + delay, self.relayed, data, target))


def _sender() -> socket.socket:
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    sender.bind(("", 0))
    return sender


def _receiver(group: Group) -> socket.socket:
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
    receiver.bind(group)
    receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, struct.pack("4sL", socket.inet_aton(group[0]), 0))
    return receiver
