"""The socket between OSC server and OSCQuery hears the front alone, waits for nobody, and counts what it lost."""

import sys

import pytest

from haptic_server.gateway.oscquery.osc_bridge import OscBridge
from osc_bench import client


def test_only_the_front_is_heard() -> None:
    inlet = OscBridge("127.0.0.1")
    try:
        with client() as front, client() as stranger:
            inlet.join(front.endpoint[1])
            stranger.udp.sendto(b"/no", inlet.endpoint)
            front.udp.sendto(b"/yes", inlet.endpoint)
            assert inlet.take() == [b"/yes"]
            assert inlet.send(b"/back")
            assert front.udp.recv(100) == b"/back"
    finally:
        inlet.close()


def test_a_front_that_hears_everywhere_is_reached_on_loopback() -> None:
    inlet = OscBridge("0.0.0.0")
    try:
        assert inlet.endpoint[0] == "127.0.0.1"
    finally:
        inlet.close()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux counts what a full socket buffer drops")
def test_what_a_full_buffer_drops_is_counted() -> None:
    inlet = OscBridge("127.0.0.1")
    try:
        with client() as front:
            inlet.join(front.endpoint[1])
            for _ in range(20_000):
                front.udp.sendto(b"x" * 400, inlet.endpoint)
            taken = 0
            while batch := inlet.take():
                taken += len(batch)
            front.udp.sendto(b"the last", inlet.endpoint)  # brings the count along
            taken += len(inlet.take())
            assert inlet.dropped > 0
            assert taken + inlet.dropped == 20_001
    finally:
        inlet.close()


def test_nobody_there_is_no_error() -> None:
    inlet = OscBridge("127.0.0.1")
    try:
        with client() as gone:
            port = gone.endpoint[1]
        inlet.join(port)
        assert inlet.send(b"/x")
        assert not inlet.send(b"/x")  # the refusal of the first
        assert inlet.take() == []
    finally:
        inlet.close()
