"""A small server of LCM's tcpq protocol on 127.0.0.1, so that the client's processes can be tested by themselves."""

from __future__ import annotations

import contextlib
import re
import socket
import struct
import threading
import time

_HELLO = struct.Struct(">II")
_CLIENT_MAGIC, _SERVER_MAGIC, _VERSION = 0x287617FB, 0x287617FA, 0x0100
_PUBLISH, _SUBSCRIBE, _UNSUBSCRIBE = 1, 2, 3


class Broker:
    """Every client has a thread; a message goes to all subscribers before the next one is read from its sender."""

    def __init__(self, port: int = 0) -> None:
        self._listener = socket.create_server(("127.0.0.1", port))
        self.port = self._listener.getsockname()[1]
        self.url = f"tcpq://127.0.0.1:{self.port}"
        self._lock = threading.Lock()
        self._clients: dict[socket.socket, list[re.Pattern[str]]] = {}
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self) -> Broker:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Drops every client, as a server that dies does."""
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        with self._lock:
            for client in self._clients:
                client.shutdown(socket.SHUT_RDWR)

    def wait_for_subscription(self, channel: str, timeout_s: float = 10.0) -> bool:
        """Whether somebody listens to `channel` within the time."""

        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            with self._lock:
                if any(p.fullmatch(channel) for patterns in self._clients.values() for p in patterns):
                    return True
            time.sleep(0.01)
        return False

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            threading.Thread(target=self._serve, args=(client,), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        try:
            if _HELLO.unpack(_receive(client, _HELLO.size))[0] != _CLIENT_MAGIC:
                return
            client.sendall(_HELLO.pack(_SERVER_MAGIC, _VERSION))
            with self._lock:
                self._clients[client] = []
            while True:
                self._handle(client)
        except (OSError, EOFError):
            pass
        finally:
            with self._lock:
                self._clients.pop(client, None)
            client.close()

    def _handle(self, client: socket.socket) -> None:
        kind, length = _HELLO.unpack(_receive(client, _HELLO.size))
        channel = _receive(client, length)
        if kind == _PUBLISH:
            (size,) = struct.unpack(">I", _receive(client, 4))
            self._forward(channel, _receive(client, size))
            return
        pattern = re.compile(channel.decode())
        with self._lock:
            if kind == _SUBSCRIBE:
                self._clients[client].append(pattern)
            elif kind == _UNSUBSCRIBE:
                self._clients[client].remove(pattern)

    def _forward(self, channel: bytes, data: bytes) -> None:
        message = _HELLO.pack(_PUBLISH, len(channel)) + channel + struct.pack(">I", len(data)) + data
        with self._lock:
            for client, patterns in self._clients.items():
                if any(pattern.fullmatch(channel.decode()) for pattern in patterns):
                    with contextlib.suppress(OSError):  # it has gone; its own thread takes note
                        client.sendall(message)


def _receive(client: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        part = client.recv(size - len(data))
        if not part:
            raise EOFError
        data += part
    return data
