import queue
import threading
from collections.abc import Iterator

import pytest

from web_panel.access.lease_access import LEASE_S, LeaseAccess
from web_panel.rig.answer import Answer


class Gateway:
    """Remembers what it was asked; refuses when told to."""

    def __init__(self) -> None:
        self.asked: queue.SimpleQueue[tuple[str, str, float]] = queue.SimpleQueue()
        self.answer = Answer()
        self.answered = threading.Semaphore(0)

    def __call__(self, secret: str, name: str, seconds: float) -> Answer:
        self.asked.put((secret, name, seconds))
        return self.answer

    def next(self) -> tuple[str, str, float]:
        return self.asked.get(timeout=60)


@pytest.fixture
def gateway() -> Gateway:
    return Gateway()


@pytest.fixture
def door(gateway: Gateway) -> Iterator[LeaseAccess]:
    made = LeaseAccess(gateway, renew_s=0.02)
    made.start()
    yield made
    made.close()


def test_it_is_renewed_while_held_and_given_back(gateway: Gateway, door: LeaseAccess) -> None:
    door.take(1, "Ada")
    secret, name, seconds = gateway.next()
    assert (name, seconds) == ("Ada", LEASE_S)
    assert [gateway.next() for _ in range(3)] == [(secret, "Ada", LEASE_S)] * 3
    assert door.secret_of(1) == secret
    assert (door.secret_of(2), door.secret_of(None)) == ("", "")
    door.give_back(2)  # another browser left
    assert door.name == "Ada"
    door.give_back(1)
    while (asked := gateway.next())[2] != 0.0:
        pass
    assert asked == (secret, "Ada", 0.0)
    assert (door.name, door.secret_of(1)) == ("", "")


def test_another_browser_of_the_same_panel_does_not_get_it(gateway: Gateway, door: LeaseAccess) -> None:
    door.take(1, "Ada")
    gateway.next()
    door.take(2, "Bob")
    assert door.name == "Ada"
    while door.outcomes.get(timeout=60) != ("Refused: locked by Ada: ask them to unlock it", True):
        pass  # among what is said of Ada's, each time it is renewed


def test_a_refusal_ends_it_and_silence_does_not(gateway: Gateway, door: LeaseAccess) -> None:
    gateway.answer = Answer(reason="nobody answers")
    door.take(1, "Ada")
    gateway.next()
    gateway.next()
    assert door.outcomes.get(timeout=60) == ("Not confirmed: nobody answers", True)
    assert door.name == "Ada"
    gateway.answer = Answer(reason="Eve is tuning", refused=True)
    while door.outcomes.get(timeout=60) != ("Refused: Eve is tuning", True):
        pass
    for _ in range(6000):
        if not door.name:
            break
        threading.Event().wait(0.01)
    assert door.secret_of(1) == ""


def test_it_is_given_back_at_the_end(gateway: Gateway) -> None:
    door = LeaseAccess(gateway, renew_s=60.0)
    door.start()
    door.take(1, "Ada")
    secret = gateway.next()[0]
    door.close()
    assert gateway.next() == (secret, "Ada", 0.0)
