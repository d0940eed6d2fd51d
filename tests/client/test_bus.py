"""The bus against a broker that goes away."""

from __future__ import annotations

import time

import pytest
from client_support.broker import Broker

from layfigure.bus import Bus
from layfigure.errors import BusError


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


def test_poll_after_close_says_that_it_is_not_connected(broker: Broker) -> None:
    bus = Bus(broker.url)
    bus.close()
    with pytest.raises(BusError, match="not connected to"):
        bus.poll(0.0)
