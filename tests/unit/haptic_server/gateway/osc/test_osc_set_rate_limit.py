"""Limit of the sets of one sender: one that sends more than any automation is held back, alone, until it is calm."""

import pytest

from haptic_server.gateway.osc.osc_server import OscServer
from haptic_server.set_rate_limit import SetRateLimit, Verdict
from osc_bench import Client, FakeParameters, Time, built, client, opened_front, tell

P = "/drumstick"
ONE, OTHER = ("127.0.0.1", 5000), ("127.0.0.1", 5001)


def verdicts(pace: SetRateLimit, rate: float, begin_s: float, lasts_s: float) -> list[Verdict]:
    return [pace.judge(ONE, begin_s + i / rate) for i in range(round(rate * lasts_s))]


@pytest.mark.parametrize("rate", [30, 200, 490])
def test_automation_is_never_held_back(rate: float) -> None:
    assert set(verdicts(SetRateLimit(), rate, 7.0, 60.0)) == {Verdict.FREE}


@pytest.mark.parametrize("rate", [600, 1000, 9000])
def test_after_two_seconds_a_flood_is_held_back_and_told_once(rate: int) -> None:
    found = verdicts(SetRateLimit(), rate, 7.0, 5.0)
    assert set(found[: 2 * rate - 1]) == {Verdict.FREE}
    assert found.count(Verdict.HELD_FIRST) == 1
    assert set(found[2 * rate + 1 :]) <= {Verdict.HELD, Verdict.HELD_FIRST}


def test_a_burst_is_no_flood() -> None:
    pace = SetRateLimit()
    for begin in range(10):
        assert {pace.judge(ONE, 2.0 * begin) for _ in range(2000)} == {Verdict.FREE}


def test_whoever_is_calm_is_heard_again_and_others_always() -> None:
    pace = SetRateLimit()
    verdicts(pace, 1000, 0.0, 3.0)
    assert pace.judge(ONE, 3.5) is Verdict.HELD
    assert pace.judge(OTHER, 3.5) is Verdict.FREE
    assert pace.judge(ONE, 5.0) is Verdict.FREE
    found = verdicts(pace, 1000, 5.0, 3.0)
    assert found.count(Verdict.HELD_FIRST) == 1  # and is told again when it begins again


def test_a_crowd_is_not_remembered() -> None:
    pace = SetRateLimit()
    for port in range(20_000):
        assert pace.judge(("10.0.0.1", port), 0.0) is Verdict.FREE
    verdicts(pace, 1000, 0.0, 2.5)
    assert pace.judge(ONE, 2.5) is Verdict.HELD


def flood(front: OscServer, sender: Client, time: Time, seconds: float) -> None:
    for i in range(round(1000 * seconds)):
        front.receive(built(P + "/param/dv_pls", 0.25 + 0.25 * (i % 2)), sender.endpoint)
        time.s += 1e-3


def test_sets_of_a_flood_are_dropped_and_counted_but_not_its_panic_and_questions() -> None:
    parameters, time = FakeParameters(), Time()
    with client() as a, client() as b, opened_front(parameters, now=time) as front:
        flood(front, a, time, 2.1)
        errors = [args for address, args in a.waiting() if address == "/drumstick/error"]
        assert len(errors) == 1
        assert "500 sets a second" in str(errors[0][1])
        taken, served = len(parameters.sets), front.counters["served"]
        flood(front, a, time, 0.5)
        assert a.waiting() == []
        assert (len(parameters.sets), front.counters["served"]) == (taken, served)
        assert front.counters["held_back"] >= 500
        assert len(tell(front, a, built(P + "/param/dv_pls"))) == 2
        assert tell(front, a, built(P + "/ping")) == [("/drumstick/pong", [])]
        front.receive(built(P + "/panic"), a.endpoint)
        assert len(parameters.panics) == 1
        front.receive(built(P + "/param/tau", 0.004), b.endpoint)
        assert len(parameters.sets) == taken + 1
        time.s += 1.1
        front.receive(built(P + "/param/tau", 0.005), a.endpoint)
        assert len(parameters.sets) == taken + 2
