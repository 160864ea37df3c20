"""Announcement by multicast DNS: for which addresses, seen, and taken back."""

import errno
import logging
from uuid import uuid4

import pytest
from zeroconf import ServiceInfo, Zeroconf

from haptic_server.gateway.oscquery import mdns
from haptic_server.gateway.oscquery.mdns import OSC, OSCJSON, Announcement, services_of
from osc_bench import BOUND_S

HERE, LAN, EVERYWHERE = "127.0.0.1", "192.168.1.5", "0.0.0.0"
OWN = ["192.168.1.5", "10.0.0.7"]


def told(services: list[ServiceInfo]) -> dict[str, tuple[int | None, list[str]]]:
    return {service.type: (service.port, service.parsed_addresses()) for service in services}


@pytest.mark.parametrize(
    ("query", "osc", "expected"),
    [
        (HERE, HERE, {OSCJSON: (9102, [HERE]), OSC: (9100, [HERE])}),
        (LAN, HERE, {OSCJSON: (9102, [LAN])}),
        (LAN, LAN, {OSCJSON: (9102, [LAN]), OSC: (9100, [LAN])}),
        (LAN, EVERYWHERE, {OSCJSON: (9102, [LAN]), OSC: (9100, OWN)}),
        (EVERYWHERE, HERE, {OSCJSON: (9102, OWN)}),
        (EVERYWHERE, EVERYWHERE, {OSCJSON: (9102, OWN), OSC: (9100, OWN)}),
    ],
)
def test_what_others_can_reach_is_announced(query: str, osc: str, expected: dict[str, object]) -> None:
    services = services_of("main", (query, 9102), (osc, 9100), OWN)
    assert told(services) == expected
    assert {service.name for service in services} == {f"drumstick main.{kind}" for kind in expected}


@pytest.mark.long
def test_it_is_seen_and_taken_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mdns, "_JOIN_S", BOUND_S)
    rig = f"seen-{uuid4().hex[:8]}"  # another suite may be at it on this machine
    made = Announcement(rig, (HERE, 9102), (HERE, 9100))
    try:
        assert made.announced.wait(BOUND_S * 2)
        with Zeroconf(interfaces=[HERE]) as look:
            name = f"drumstick {rig}.{OSCJSON}"
            asked = (look.get_service_info(OSCJSON, name) for _ in range(10))  # a datagram may get lost
            info = next(info for info in asked if info is not None)
            assert info.port == 9102
    finally:
        made.close()
    with Zeroconf(interfaces=[HERE]) as look:
        assert look.get_service_info(OSCJSON, f"drumstick {rig}.{OSCJSON}", timeout=300) is None
    made.close()


def test_a_network_without_multicast_is_told(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(**_: object) -> None:
        raise OSError(errno.ENODEV, "No such device")

    monkeypatch.setattr("zeroconf.Zeroconf", refused)
    with caplog.at_level(logging.ERROR):
        made = Announcement("nowhere", (HERE, 9102), (HERE, 9100))
        made.close()
    assert [record.message for record in caplog.records] == [
        f"OSCQuery cannot be announced at {HERE}: No such device"
    ]
    assert not made.announced.is_set()
