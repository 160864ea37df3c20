"""What Zenoh logs about those it turned away, counted; a flood of it makes few lines of ours."""

import logging

import pytest

from haptic_server.gateway.refusals import Refusals

# As Zenoh 1.10 writes them, colours included.
HANDSHAKE = (
    "\x1b[2m2026-11-21T22:05:20.847225Z\x1b[0m \x1b[33m WARN\x1b[0m acc-0 ThreadId(04)"
    " \x1b[2mzenoh_link_tls::unicast\x1b[0m\x1b[2m:\x1b[0m {}. Hint: increase the system open file limit."
)
NO_ROLE = (
    "\x1b[2m2026-11-21T22:05:28.360926Z\x1b[0m \x1b[32m INFO\x1b[0m acc-0 ThreadId(04)"
    " \x1b[2mzenoh::net::routing::interceptor::access_control\x1b[0m\x1b[2m:\x1b[0m 2a493df3ed27dfe8edae60b7ceb99959"
    " did not match any configured ACL subject. Default permission `Deny` will be applied on all messages"
)


def test_each_kind_is_counted_and_the_last_is_told() -> None:
    refusals = Refusals(lambda: 0.0)
    refusals.take(HANDSHAKE.format("peer sent no certificates"))
    refusals.take(HANDSHAKE.format("invalid peer certificate: UnknownIssuer"))
    assert refusals.counters() == {
        "handshakes_refused": 2,
        "without_role": 0,
        "last": "a handshake failed: invalid peer certificate: UnknownIssuer",
    }
    refusals.take(NO_ROLE)
    assert (refusals.handshakes, refusals.without_role) == (2, 1)


def test_a_flood_makes_one_line_in_ten_seconds(caplog: pytest.LogCaptureFixture) -> None:
    now = 0.0
    refusals = Refusals(lambda: now)
    with caplog.at_level(logging.WARNING):
        for number in range(600):
            now = number * 0.1
            refusals.take(HANDSHAKE.format("peer sent no certificates"))
    assert refusals.handshakes == 600
    assert len(caplog.messages) == 6
    assert caplog.messages[0] == (
        "public listener: refused 1, last: a handshake failed: peer sent no certificates"
    )
    assert caplog.messages[1].startswith("public listener: refused 100, ")


def test_what_is_no_refusal_is_handed_on(caplog: pytest.LogCaptureFixture) -> None:
    refusals = Refusals()
    refusals.take("2026 ERROR net-0 zenoh::net::runtime: something else\n")
    refusals.take("\n")
    assert caplog.messages == ["2026 ERROR net-0 zenoh::net::runtime: something else"]
    assert refusals.counters()["handshakes_refused"] == 0
