"""OSC with a whole rig, through python-osc, from the port that the rig sends to."""

import socket
import time

import pytest
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder
from rig_process import PATIENCE_S, Rig


def send(sock: socket.socket, rig: Rig, address: str, *args: object) -> None:
    message = OscMessageBuilder(address)
    for arg in args:
        message.add_arg(arg)
    sock.sendto(message.build().dgram, ("127.0.0.1", rig.osc_in))


def receive(sock: socket.socket, address: str, value: float | None = None) -> list[object]:
    """The next message at `address`, or the next one whose first argument is `value`."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        message = OscMessage(sock.recv(2048))
        if message.address == address and (value is None or message.params[0] == pytest.approx(value)):
            return list(message.params)
    raise AssertionError(f"no {address} {'' if value is None else value} came")
