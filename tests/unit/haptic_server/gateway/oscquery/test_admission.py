"""Admission to read and listen: sources, names of this machine, no page of a stranger."""

import socket
from http import HTTPStatus
from ipaddress import ip_network

import pytest
from websockets.datastructures import Headers

from haptic_server.gateway.osc.osc_server import LOOPBACK
from haptic_server.gateway.oscquery.admission import Admission

HERE = Admission("127.0.0.1", LOOPBACK)
LAN = Admission("0.0.0.0", (*LOOPBACK, ip_network("192.168.1.0/24")))


def judge(admission: Admission, host: str, *origins: str) -> HTTPStatus:
    headers = Headers({"Host": host})
    for origin in origins:
        headers["Origin"] = origin
    return admission.judge(headers).status


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.1:9102", "localhost:1", "LOCALHOST", "[::1]:9102"])
def test_this_machines_own_names(host: str) -> None:
    assert judge(HERE, host) is HTTPStatus.OK
    assert judge(LAN, host) is HTTPStatus.OK


@pytest.mark.parametrize(
    "host",
    ["evil.example", "127.0.0.1.evil.example", "localhost.evil.example:80", "", "a@127.0.0.1", "127.0.0.1 x"],
)
def test_other_names_are_misdirected(host: str) -> None:
    assert judge(HERE, host) is HTTPStatus.MISDIRECTED_REQUEST
    assert judge(LAN, host) is HTTPStatus.MISDIRECTED_REQUEST


def test_on_the_network_addresses_and_the_machines_own_name_will_do() -> None:
    for host in (
        "192.168.1.5:9102",
        socket.gethostname(),
        f"{socket.gethostname().partition('.')[0]}.local:1",
    ):
        assert judge(LAN, host) is HTTPStatus.OK
        assert judge(HERE, host) is HTTPStatus.MISDIRECTED_REQUEST


def test_no_host_or_two() -> None:
    twice = Headers({"Host": "127.0.0.1"})
    twice["Host"] = "127.0.0.1"
    for headers in (Headers(), twice):
        assert HERE.judge(headers).status is HTTPStatus.MISDIRECTED_REQUEST


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "https://127.0.0.1:9102", "null", "http://127.0.0.1", ""]
)
def test_a_strangers_page_is_forbidden(origin: str) -> None:
    assert judge(HERE, "127.0.0.1:9102", origin) is HTTPStatus.FORBIDDEN
    assert judge(HERE, "127.0.0.1:9102", "http://127.0.0.1:9102", origin) is HTTPStatus.FORBIDDEN


def test_its_own_origin_is_none_of_a_stranger() -> None:
    assert judge(HERE, "127.0.0.1:9102", "http://127.0.0.1:9102") is HTTPStatus.OK


@pytest.mark.parametrize(("source", "here", "lan"), [
    ("127.0.0.1", True, True), ("127.9.9.9", True, True), ("192.168.1.77", False, True), ("192.168.2.1", False, False),
])  # fmt: skip
def test_sources_are_those_of_osc(source: str, here: bool, lan: bool) -> None:
    assert HERE.admits(source) is here
    assert LAN.admits(source) is lan
