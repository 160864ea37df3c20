"""Asking, setting and echoes of parameters."""

import math

import numpy as np
import pytest

from haptic_server.gateway.osc.echo_filter import ANSWERS, EchoFilter
from haptic_server.gateway.osc.reply_targets import MAX_WAITING, ReplyTargets
from osc_bench import FakeParameters, Time, built, client, opened_front, tell
from protocol import osc

P = "/drumstick"


def near(value: float) -> object:
    return pytest.approx(value, rel=1e-6)


def test_asking_tells_sender_and_targets_once_each() -> None:
    parameters = FakeParameters()
    with client() as a, client() as target, opened_front(parameters, target) as front:
        expected = [("/drumstick/param/dv_pls", [near(0.2)]), ("/drumstick/param/dv_pls/norm", [near(0.02)])]
        assert tell(front, a, built(P + "/param/dv_pls")) == expected
        assert target.waiting() == expected
        assert tell(front, target, built(P + "/param/dv_pls/norm")) == expected
    assert parameters.sets == []


@pytest.mark.parametrize("value", [0.5, 1])
def test_setting_reaches_the_desk(value: float) -> None:
    parameters = FakeParameters()
    with client() as a, client() as target, opened_front(parameters, target) as front:
        front.receive(built(P + "/param/dv_pls", value), a.endpoint)
        host, port = a.endpoint
        assert parameters.sets == [({"dv_pls": float(value)}, f"osc {host}:{port}")]
        # Nothing is sent before the servo has it.
        assert a.waiting() == []
        assert target.waiting() == []


def test_norm_sets_over_the_declared_range() -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters) as front:
        front.receive(built(P + "/param/k_coll/norm", 0.5), a.endpoint)
        assert parameters.sets[0][0] == {"k_coll": pytest.approx(1000.0)}  # 1 .. 1e6, by logarithm


@pytest.mark.parametrize(("name", "limit"), [("tau", 1e-6), ("m", 1e-4), ("k_coll", 1e6), ("z_h0", -1.0)])
def test_a_limit_can_be_set_in_32_bits(name: str, limit: float) -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters) as front:
        front.receive(built(f"{P}/param/{name}", limit), a.endpoint)
        assert parameters.asked == [{name: limit}]


_BAD = {
    "NaN": (built(P + "/param/dv_pls", math.nan), "not a finite number"),
    "infinite": (built(P + "/param/dv_pls", math.inf), "not a finite number"),
    "below": (built(P + "/param/dv_pls", -0.5), "outside 0 .. 10 m/s"),
    "above": (built(P + "/param/dv_pls", 10.5), "outside 0 .. 10 m/s"),
    "text": (built(P + "/param/dv_pls", "0.3"), "expects one number"),
    "two numbers": (
        built(P + "/param/dv_pls", 0.1, 0.2),
        "expects one number",
    ),
    "beyond the envelope": (built(P + "/param/dv_pls", 6.0), "the limit is 10 m/s"),
    "norm below": (built(P + "/param/dv_pls/norm", -0.01), "outside 0 .. 1"),
    "norm above": (built(P + "/param/dv_pls/norm", 1.01), "outside 0 .. 1"),
    "norm NaN": (built(P + "/param/dv_pls/norm", math.nan), "outside 0 .. 1"),
    "norm text": (built(P + "/param/dv_pls/norm", "1"), "expects one number"),
    "unknown parameter": (built(P + "/param/nonsense", 0.5), "no such address"),
    "unknown address": (built(P + "/preset/delete"), "no such address"),
    "without the prefix": (built("/param/dv_pls"), "no such address"),
    "another's prefix": (built("/drumstic/param/dv_pls"), "no such address"),
    "bundle": (b"#bundle\0" + bytes(8), "bundles are not read"),
    "ping with NaN": (built(P + "/ping", math.nan), "not a finite"),
    "subscribe without a port": (built(P + "/subscribe"), "one port"),
    "subscribe to a text": (built(P + "/subscribe", "9000"), "one port"),
    "subscribe to port 0": (built(P + "/subscribe", 0), "one port"),
    "subscribe to port 65536": (built(P + "/subscribe", 65536), "one port"),
    "subscribe to half a port": (built(P + "/subscribe", 9000.5), "one port"),
    "subscribe to NaN": (built(P + "/subscribe", math.nan), "one port"),
    "unsubscribe a text": (built(P + "/unsubscribe", "9000"), "one port"),
}


@pytest.mark.parametrize("name", _BAD)
def test_a_mistake_is_answered_and_changes_nothing(name: str) -> None:
    datagram, why = _BAD[name]
    parameters = FakeParameters()
    with client() as a, client() as target, opened_front(parameters, target) as front:
        answers = tell(front, a, datagram)
        assert [address for address, _ in answers] == ["/drumstick/error"]
        refused, reason = answers[0][1]
        assert why in str(reason)
        assert refused == "?" or str(refused).encode() in datagram
        assert target.waiting() == answers
        assert parameters.sets == []
        assert "served" not in front.counters
        assert tell(front, target, datagram) == answers  # once, to a sender that is a target


def test_z_h0_of_a_hand_without_stiffness_is_an_error_not_a_nan() -> None:
    parameters = FakeParameters()
    parameters.lose_z_h0()
    with client() as a, opened_front(parameters) as front:
        assert tell(front, a, built(P + "/param/z_h0")) == [
            ("/drumstick/error", ["/drumstick/param/z_h0", "z_h0 has no value at present"])
        ]
        synced = tell(front, a, built(P + "/sync"))
        assert ("/drumstick/error", ["/drumstick/param/z_h0", "z_h0 has no value at present"]) in synced
        assert len(synced) == 2 * len(parameters.table) - 1


def test_sync_sends_everything_in_both_forms() -> None:
    parameters = FakeParameters()
    with client() as a, client() as target, opened_front(parameters, target) as front:
        synced = tell(front, a, built(P + "/sync"))
        assert synced == target.waiting()
        expected = dict(parameters.values())
        assert {k: v[0] for k, v in synced} == {
            **{f"{P}/param/{n}": near(v) for n, v in expected.items()},
            **{f"{P}/param/{n}/norm": near(parameters.table[n].norm(v)) for n, v in expected.items()},
        }


def test_a_sync_cannot_multiply_a_flood() -> None:
    parameters, time = FakeParameters(), Time()
    with client() as a, opened_front(parameters, now=time) as front:
        answered = [tell(front, a, built(P + "/sync")) for _ in range(30)]
        assert sum(len(each) > 1 for each in answered) == 5
        assert answered[5] == [
            ("/drumstick/error", ["/drumstick/sync", "asked more than 5 times in a second"])
        ]
        time.s += 1.0
        assert len(tell(front, a, built(P + "/sync"))) > 1


def test_who_set_a_value_gets_its_readback_once() -> None:
    parameters, time = FakeParameters(), Time()
    with client() as a, client() as target, opened_front(parameters, target, now=time) as front:
        front.receive(built(P + "/param/dv_pls", 0.5), a.endpoint)
        time.s += 0.9
        front.readback("k_coll", 1000.0, 0.5)
        assert a.waiting() == []
        front.readback("dv_pls", 0.5, 0.05)
        assert [address for address, _ in a.waiting()] == [
            "/drumstick/param/dv_pls",
            "/drumstick/param/dv_pls/norm",
        ]
        front.readback("dv_pls", 0.75, 0.075)
        assert a.waiting() == []
        assert len(target.waiting()) == 6


def test_a_moving_fader_gets_the_last_value_too() -> None:
    with client() as a, opened_front(FakeParameters()) as front:
        for value in (0.25, 0.5):
            front.receive(built(P + "/param/dv_pls", value), a.endpoint)
        for value in (0.25, 0.5, 0.75):
            front.readback("dv_pls", value, value / 10)
        assert [v for address, (v,) in a.waiting() if address.endswith("dv_pls")] == [0.25, 0.5]


def test_an_echo_is_awaited_for_one_second() -> None:
    time = Time()
    with client() as a, opened_front(FakeParameters(), now=time) as front:
        front.receive(built(P + "/param/dv_pls", 0.5), a.endpoint)
        time.s += 1.0
        front.readback("dv_pls", 0.5, 0.05)
        assert a.waiting() == []


def test_a_sender_that_is_a_target_gets_the_readback_once() -> None:
    with client() as target, opened_front(FakeParameters(), target) as front:
        front.receive(built(P + "/param/dv_pls", 0.5), target.endpoint)
        front.readback("dv_pls", 0.5, 0.05)
        assert len(target.waiting()) == 2


def test_a_refused_set_awaits_nothing() -> None:
    with client() as a, opened_front(FakeParameters()) as front:
        assert tell(front, a, built(P + "/param/dv_pls", 6.0))[0][0] == "/drumstick/error"
        front.readback("dv_pls", 0.5, 0.05)
        assert a.waiting() == []


def test_a_refused_set_keeps_the_wait_for_the_one_before() -> None:
    with client() as a, opened_front(FakeParameters()) as front:
        front.receive(built(P + "/param/dv_pls", 0.5), a.endpoint)
        tell(front, a, built(P + "/param/dv_pls", 6.0))
        front.readback("dv_pls", 0.5, 0.05)
        assert len(a.waiting()) == 2


def test_a_readback_that_comes_before_the_reply_is_not_lost() -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters) as front:
        parameters.after_set = front.readback
        assert len(tell(front, a, built(P + "/param/dv_pls", 0.5))) == 2


def test_setting_what_is_already_so_is_echoed_at_once() -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters) as front:
        for _ in range(2):
            answers = tell(front, a, built(P + "/param/dv_pls", 0.2))  # 0.2 in 32 bits, twice
            front.readback("dv_pls", 0.2, 0.02)
            assert a.waiting() == []
            assert answers == [
                ("/drumstick/param/dv_pls", [near(0.2)]),
                ("/drumstick/param/dv_pls/norm", [near(0.02)]),
            ]


@pytest.mark.parametrize("form", ["", "/norm"])
def test_setting_what_is_already_so_is_told_to_nobody_else(form: str) -> None:
    parameters = FakeParameters()
    with client() as a, client() as sender, client() as b, opened_front(parameters, a, sender, b) as front:
        value = 0.2 if not form else parameters.table["dv_pls"].norm(0.2)
        answers = tell(front, sender, built(f"{P}/param/dv_pls{form}", value))
        assert answers == [
            ("/drumstick/param/dv_pls", [near(0.2)]),
            ("/drumstick/param/dv_pls/norm", [near(0.02)]),
        ]
        assert a.waiting() == b.waiting() == []
        assert parameters.sets == []


@pytest.mark.parametrize("name", ["k_coll", "z_ss", "z_h0", "tau", "m", "dv_pls"])
def test_what_comes_back_from_a_rig_that_holds_32_bits_is_no_change(name: str) -> None:
    ours, theirs = FakeParameters(), FakeParameters()
    row = ours.table[name]
    with client() as a, opened_front(ours) as front, opened_front(theirs) as other:
        for share in range(1, 400):
            value = row.from_norm(0.3 + share * 1e-3 / 3.0)
            ours.set({name: value}, "test")
            tell(other, a, osc.param(P, name, ours.values()[name]))
            changes = (len(ours.sets), len(theirs.sets))
            tell(other, a, osc.param_norm(P, name, row.norm(ours.values()[name])))
            tell(front, a, osc.param(P, name, theirs.values()[name]))
            tell(front, a, osc.param_norm(P, name, row.norm(theirs.values()[name])))
            assert (len(ours.sets), len(theirs.sets)) == changes


@pytest.mark.parametrize("name", ["k_coll", "z_ss", "dv_pls"])
def test_the_next_number_of_32_bits_is_a_change(name: str) -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters) as front:
        following = float(np.nextafter(np.float32(parameters.values()[name]), np.float32(math.inf)))
        tell(front, a, built(f"{P}/param/{name}", following))
        assert parameters.sets[-1][0] == {name: following}


def test_what_a_target_was_told_anyway_is_not_told_again_when_it_sends_it_back() -> None:
    time = Time()
    with client() as target, client() as plain, opened_front(FakeParameters(), target, now=time) as front:
        back = built(P + "/param/dv_pls", 0.2)
        for tell_it in (
            lambda: front.readback("dv_pls", 0.2, 0.02),
            lambda: front.receive(built(P + "/param/dv_pls"), plain.endpoint),
            lambda: front.receive(built(P + "/sync"), plain.endpoint),
        ):
            tell_it()
            plain.waiting()
            target.waiting()
            assert tell(front, target, back) == []
            assert len(tell(front, plain, back)) == 2
            time.s += 2.0
        assert len(tell(front, target, back)) == 2


def test_the_same_again_and_again_is_answered_a_few_times() -> None:
    time = Time()
    with client() as a, client() as b, opened_front(FakeParameters(), now=time) as front:
        same = built(P + "/param/dv_pls", 0.2)
        assert sum(len(tell(front, a, same)) for _ in range(50)) == 2 * ANSWERS
        assert len(tell(front, b, same)) == 2
        time.s += 2.0
        assert len(tell(front, a, same)) == 2


def test_a_crowd_that_is_told_is_not_remembered() -> None:
    told = EchoFilter()
    crowd = [("127.0.0.1", port) for port in range(1, 1001)]
    told.note("tau", 0.5, crowd, 0.0)
    assert [told.spend("tau", 0.5, each, 0.0) for each in crowd] == [True] * 1000
    told.note("tau", 0.5, crowd, 0.0)
    assert not told.spend("tau", 0.5, crowd[-1], 0.0)


def test_a_readback_with_another_last_digit_ends_the_wait() -> None:
    with client() as a, opened_front(FakeParameters()) as front:
        front.receive(built(P + "/param/z_h0", 0.01), a.endpoint)
        for value in (0.01 * (1 + 1e-9), 0.02):  # z_h0 comes back through z_ss
            front.readback("z_h0", value, 0.5)
        assert [round(v, 6) for address, (v,) in a.waiting() if address.endswith("z_h0")] == [0.01]


def test_a_flood_of_senders_is_not_remembered() -> None:
    echoes = ReplyTargets()
    for port in range(1, 1001):
        echoes.expect("tau", ("127.0.0.1", port), 0.5, 0.0)
    assert echoes.claim("tau", 0.5, 0.0) == [("127.0.0.1", port) for port in range(1001 - MAX_WAITING, 1001)]
    assert echoes.claim("tau", 0.5, 0.0) == []
