"""Messages of a gateway before its subscribers are connected again, in virtual time and over a real router."""

import time
from typing import Any, cast

import pytest

from haptic_server.gateway.zenoh import backlog
from haptic_server.gateway.zenoh.backlog import Backlog
from ports import free_port
from protocol.session import open_client, open_router

STARTED_S = 1000.0


class Subscribed:
    """Zenoh's answer."""

    def __init__(self) -> None:
        self.matching = False


class Outlet:
    """A publisher that notes what was published."""

    def __init__(self) -> None:
        self.matching_status = Subscribed()
        self.got: list[bytes] = []

    def put(self, payload: bytes) -> None:
        self.got.append(payload)


@pytest.fixture
def strikes(monkeypatch: pytest.MonkeyPatch) -> Outlet:
    monkeypatch.setattr(backlog.time, "monotonic", lambda: STARTED_S)
    return Outlet()


def test_what_is_published_before_anybody_subscribes_waits_for_the_first_and_a_little_for_others(
    strikes: Outlet,
) -> None:
    held, releases = Backlog(cast(Any, strikes)), Outlet()
    held.put(cast(Any, strikes), b"1")
    held.put(cast(Any, releases), b"2")
    held.step(STARTED_S + 0.1)
    assert not strikes.got
    strikes.matching_status.matching = True
    held.step(STARTED_S + 0.2)
    held.put(cast(Any, strikes), b"3")
    held.step(STARTED_S + 0.4)
    assert not strikes.got, "others are on their way"
    held.step(STARTED_S + 0.46)
    assert (strikes.got, releases.got) == ([b"1", b"3"], [b"2"])
    held.put(cast(Any, strikes), b"4")
    assert strikes.got[-1] == b"4", "from now on at once"


def test_it_waits_for_nobody_for_longer_than_that(strikes: Outlet) -> None:
    held = Backlog(cast(Any, strikes))
    held.put(cast(Any, strikes), b"1")
    held.step(STARTED_S + 0.74)
    assert not strikes.got
    held.step(STARTED_S + 0.76)
    assert strikes.got == [b"1"]


def test_a_late_subscriber_does_not_make_it_longer(strikes: Outlet) -> None:
    held = Backlog(cast(Any, strikes))
    strikes.matching_status.matching = True
    held.step(STARTED_S + 0.7)
    held.put(cast(Any, strikes), b"1")
    held.step(STARTED_S + 0.76)
    assert strikes.got == [b"1"]


def test_a_subscriber_that_connects_to_a_new_router_gets_what_was_published_before() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    first = open_router(endpoint)
    session = open_client(endpoint, lambda: True)
    assert session is not None
    got: list[bytes] = []
    subscriber = session.declare_subscriber("x", lambda sample: got.append(sample.payload.to_bytes()))
    first.close()
    second = open_router(endpoint)
    publisher = second.declare_publisher("x")
    held = Backlog(publisher)
    held.put(publisher, b"1")
    end = time.monotonic() + 30.0
    while not got and time.monotonic() < end:
        # The clock stands until the subscriber is there, however busy the machine is.
        held.step(0.0 if not cast(Any, publisher.matching_status).matching else time.monotonic() + 1.0)
        time.sleep(0.01)
    subscriber.undeclare()
    session.close()
    second.close()
    assert got == [b"1"]
