"""Disconnection: whoever was ended is turned back for a minute, by certificate and address."""

from haptic_server.access.disconnection import TURNED_BACK_S, Ended
from osc_bench import Time


def test_the_same_certificate_from_the_same_address_is_turned_back_for_a_minute() -> None:
    now = Time()
    ended = Ended(now)
    ended.note("listener", "10.0.0.1")
    begun = now.s
    for after_s, holds in ((0.0, True), (TURNED_BACK_S - 0.1, True), (TURNED_BACK_S + 0.1, False)):
        now.s = begun + after_s
        assert ended.holds("listener", "10.0.0.1") is holds
        assert not ended.holds("panel", "10.0.0.1")
        assert not ended.holds("listener", "10.0.0.2")


def test_the_minute_begins_anew_and_what_is_remembered_is_bounded() -> None:
    now = Time()
    ended = Ended(now)
    begun = now.s
    ended.note("listener", "10.0.0.1")
    now.s = begun + 50.0
    ended.note("listener", "10.0.0.1")
    now.s = begun + 100.0
    assert ended.holds("listener", "10.0.0.1")
    for number in range(10_000):
        ended.note("listener", f"host {number}")
    assert len(vars(ended)["_until_s"]) == 256
    assert ended.holds("listener", "host 9999")
