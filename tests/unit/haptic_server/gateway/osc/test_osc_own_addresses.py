"""The front neither sends to itself nor hears itself, at whatever address of this machine it can be reached."""

import logging

import pytest

from haptic_server.gateway.osc import own_addresses
from haptic_server.gateway.osc.osc_server import OscServer
from haptic_server.gateway.osc.own_addresses import OwnAddress
from osc_bench import FakeParameters, built, client, no_preset, opened_front
from ports import free_port

P = "/drumstick"
CABLE, WIRELESS, ANOTHER = "192.168.7.2", "10.1.2.3", "192.168.7.9"


class TwoInterfaces:
    """Stands in for a UDP socket on a machine with these two addresses beside loopback."""

    def __init__(self, *_: object) -> None:
        pass

    def __enter__(self) -> "TwoInterfaces":
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def bind(self, address: tuple[str, int]) -> None:
        if address[0] not in (CABLE, WIRELESS):
            raise OSError("Cannot assign requested address")


@pytest.mark.parametrize(
    ("bound", "ours", "others"),
    [
        (
            "0.0.0.0",
            ["0.0.0.0", "127.0.0.1", "127.9.9.9", CABLE, WIRELESS],
            [ANOTHER, "224.0.0.9", "255.255.255.255"],
        ),
        ("127.0.0.1", ["127.0.0.1", "0.0.0.0"], ["127.0.0.2", CABLE]),
        (CABLE, [CABLE, "0.0.0.0"], ["127.0.0.1", WIRELESS, ANOTHER]),
    ],
)
def test_which_addresses_are_its_own(
    monkeypatch: pytest.MonkeyPatch, bound: str, ours: list[str], others: list[str]
) -> None:
    monkeypatch.setattr(own_addresses.socket, "socket", TwoInterfaces)
    address = OwnAddress((bound, 9100))
    assert [host for host in [*ours, *others] if address.holds((host, 9100))] == ours
    assert not any(address.holds((host, 9101)) for host in [*ours, *others])


def test_an_address_of_nobody_is_not_this_machines() -> None:
    assert not OwnAddress(("0.0.0.0", 9100)).holds(("192.0.2.1", 9100))


@pytest.mark.parametrize("bind", ["0.0.0.0", "127.0.0.1", "localhost"])
def test_a_subscription_to_the_rigs_own_port_is_refused(bind: str) -> None:
    front = OscServer((bind, 0), [], P, FakeParameters(), no_preset)
    try:
        with client() as a:
            a.udp.sendto(built(P + "/subscribe", front.endpoint[1]), ("127.0.0.1", front.endpoint[1]))
            assert a.next() == ("/drumstick/error", ["/drumstick/subscribe", "that is the rig's own port"])
    finally:
        front.close()


@pytest.mark.parametrize(
    ("bind", "target"),
    [
        ("0.0.0.0", "127.0.0.1"),
        ("0.0.0.0", "127.0.0.7"),
        ("0.0.0.0", "0.0.0.0"),
        ("127.0.0.1", "127.0.0.1"),
    ],
)
def test_a_front_takes_none_of_its_addresses_as_target(bind: str, target: str) -> None:
    port = free_port()
    with pytest.raises(ValueError, match="send to another port"):
        OscServer((bind, port), [(target, port)], P, FakeParameters(), no_preset)


def test_what_comes_from_its_own_socket_is_dropped_counted_and_told_once(
    caplog: pytest.LogCaptureFixture,
) -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters, a) as front, caplog.at_level(logging.WARNING):
        for _ in range(20):
            for datagram in (built(P + "/param/dv_pls", 0.5), built(P + "/sync"), b"junk"):
                front.receive(datagram, front.endpoint)
        assert front.counters == {"own": 60}
        assert parameters.asked == []
        assert a.waiting() == []
        assert caplog.text.count("comes back to its own port") == 1
