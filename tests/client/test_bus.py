"""The bus against a broker that goes away."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import threading
import time

import pytest
from client_support.broker import Broker

from layfigure.bus import Bus
from layfigure.errors import BusError, ProtocolError


def test_poll_message_with_the_loss_right_behind_it_is_handled_first() -> None:
    received: list[bytes] = []
    broker = Broker()
    with Bus(broker.url) as listener, Bus(broker.url) as speaker:
        listener.subscribe("NEWS", received.append)
        assert broker.wait_for_subscription("NEWS")
        speaker.publish("NEWS", b"the last word")
        time.sleep(0.2)  # until it lies in the listener's socket
        broker.close()
        time.sleep(0.2)  # and the end of the stream behind it
        assert listener.wait_until(lambda: bool(received), 2.0)
        assert received == [b"the last word"]
        with pytest.raises(BusError, match="lost the connection to"):
            listener.wait_until(lambda: False, 2.0)


def test_postponed_messages_newest_alone_is_handled_after_all_others(broker: Broker) -> None:
    handled: list[bytes] = []
    with Bus(broker.url) as listener, Bus(broker.url) as speaker:
        listener.subscribe("POSE", lambda data: listener.postpone(handled.append, data))
        listener.subscribe("NEWS", handled.append)
        assert broker.wait_for_subscription("POSE")
        assert broker.wait_for_subscription("NEWS")
        for channel, data in [("POSE", b"old"), ("POSE", b"newest"), ("NEWS", b"news")]:
            speaker.publish(channel, data)
        time.sleep(0.2)  # until all of them lie in the listener's socket
        listener.poll(2.0)
        assert handled == [b"news", b"newest"]
        speaker.publish("POSE", b"next")
        assert listener.wait_until(lambda: len(handled) == 3, 2.0)
        assert handled[2] == b"next"


def test_postponed_message_that_cannot_be_read_is_counted(broker: Broker) -> None:
    def refuse(_: bytes) -> None:
        raise ProtocolError("not a pose")

    with Bus(broker.url) as listener, Bus(broker.url) as speaker:
        listener.subscribe("POSE", lambda data: listener.postpone(refuse, data))
        assert broker.wait_for_subscription("POSE")
        speaker.publish("POSE", b"x")
        assert listener.wait_until(lambda: listener.bad_messages == 1, 2.0)
        assert listener.problem == "not a pose"
        listener.poll(0.0)
        assert listener.bad_messages == 1


def test_poll_after_close_says_that_it_is_not_connected(broker: Broker) -> None:
    bus = Bus(broker.url)
    bus.close()
    with pytest.raises(BusError, match="not connected to"):
        bus.poll(0.0)


def test_connect_tcpq_sends_at_once(broker: Broker) -> None:
    with Bus(broker.url) as bus:
        assert bus._lcm is not None
        with socket.socket(fileno=os.dup(bus._lcm.fileno())) as duplicate:
            assert duplicate.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) == 1


def packets_sent(connection: socket.socket) -> int:
    """With data in them: tcpi_data_segs_out of the kernel's struct tcp_info."""
    return int(struct.unpack_from("I", connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 256), 156)[0])


@pytest.mark.skipif(not hasattr(socket, "TCP_CORK"), reason="needs Linux")
def test_publish_message_is_one_packet(broker: Broker) -> None:
    with Bus(broker.url) as bus, socket.socket(fileno=os.dup(bus.fileno())) as connection:
        before = packets_sent(connection)
        for _ in range(10):
            bus.publish("NEWS", b"a message")
        assert packets_sent(connection) - before == 10


@pytest.mark.parametrize(
    ("url", "warned"),
    [
        ("udpm://nowhere.invalid:1?ttl=1", True),
        ("udpm://nowhere.invalid:1?recv_buf_size=9&ttl=32", True),
        ("udpm://nowhere.invalid:1?ttl=0", False),
        ("udpm://nowhere.invalid:1", False),
    ],
)
def test_connect_url_that_leaves_the_machine_is_warned_of(
    url: str, warned: bool, caplog: pytest.LogCaptureFixture
) -> None:
    with contextlib.suppress(BusError), Bus(url):
        pass
    assert ("messages leave this machine" in caplog.text) == warned


def test_buses_of_several_threads_give_stderr_back(capfd: pytest.CaptureFixture[str]) -> None:
    """Each leads it away while it is in lcm's code: the last one out must find what the first one put aside."""

    def publish() -> None:
        with Bus("memq://") as bus:
            for _ in range(200):
                bus.publish("CHANNEL", b"bytes")

    threads = [threading.Thread(target=publish) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    os.write(2, b"heard")
    assert capfd.readouterr().err == "heard"
