"""The writer's lease: one who sets, five seconds, and everybody sees who."""

import pytest

from drumstick.scenes.table import Refusal
from haptic_server.gateway.lease import MAX_S, NOBODY, Lease


def test_nobody_needs_it() -> None:
    lease = Lease()
    lease.require("", 0.0)
    lease.require("anybody", 0.0)
    assert lease.holder(0.0) == NOBODY == ("", 0.0)


def test_whoever_holds_it_is_the_only_one_for_five_seconds() -> None:
    lease = Lease()
    assert lease.take("secret", "Ada", MAX_S, 100.0) == ("Ada", 5.0)
    lease.require("secret", 104.9)
    for other in ("", "Ada", "another"):
        with pytest.raises(Refusal, match="Ada is tuning and holds the lock: ask them to unlock it"):
            lease.require(other, 104.9)
        with pytest.raises(Refusal, match="Ada is tuning"):
            lease.take(other or "x", "Eve", 5.0, 104.9)
    lease.require("", 105.0)
    assert lease.holder(105.0) == NOBODY
    assert lease.take("another", "Eve", 1.0, 105.0) == ("Eve", 1.0)


def test_it_is_renewed_and_given_back() -> None:
    lease = Lease()
    lease.take("secret", "Ada", 5.0, 0.0)
    assert lease.take("secret", "Ada", 5.0, 4.0) == ("Ada", 5.0)
    lease.require("secret", 8.9)
    assert lease.take("secret", "Ada", 0.0, 8.9) == NOBODY
    lease.require("", 8.9)


@pytest.mark.parametrize(
    ("who", "name", "seconds", "why"),
    [
        ("", "Ada", 5.0, "name yourself"),
        ("secret", "", 5.0, "name yourself"),
        ("secret", "  ", 5.0, "name yourself"),
        ("secret", "a\nb", 5.0, "name yourself"),
        ("secret", "a" * 61, 5.0, "name yourself"),
        ("secret", "Ada", 5.1, r"5\.1 s is outside 0 .. 5 s"),
        ("secret", "Ada", -1.0, "outside"),
        ("secret", "Ada", float("nan"), "outside"),
    ],
)
def test_what_is_no_lease(who: str, name: str, seconds: float, why: str) -> None:
    lease = Lease()
    with pytest.raises(Refusal, match=why):
        lease.take(who, name, seconds, 0.0)
    assert lease.holder(0.0) == NOBODY
