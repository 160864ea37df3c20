"""Ping, panic, subscriptions; floods, sources and faults."""

import logging
import math
from ipaddress import ip_network
from pathlib import Path

import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from haptic_server import files
from haptic_server.gateway.osc.targets import MAX_OF_A_HOST, MAX_SUBSCRIPTIONS, Targets
from haptic_server.gateway.played_strikes import NOBODY_PLAYS
from haptic_server.gateway.rolls.rolls import Rolls
from haptic_server.gateway.scenes.requests import SceneRequests
from haptic_server.set_list import SetList
from osc_bench import FakeParameters, Time, built, client, no_preset, opened_front, tell
from protocol import osc
from protocol.requests import Claim
from stability.catalogue import shows

P = "/drumstick"


def test_a_ping_brings_its_arguments_back_to_the_sender_alone() -> None:
    with client() as a, client() as target, opened_front(FakeParameters(), target) as front:
        datagram = built(P + "/ping", 1, 0.5, "ab")
        assert tell(front, a, datagram) == [("/drumstick/pong", [1, 0.5, "ab"])]
        assert target.waiting() == []


@pytest.mark.parametrize("args", [[], [1.0], ["now"], [math.nan]])
def test_panic_is_never_refused(args: list[float | str]) -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters) as front:
        assert tell(front, a, built(P + "/panic", *args)) == []
        assert parameters.panics == [f"osc {a.endpoint[0]}:{a.endpoint[1]}"]


class _Player:
    def __init__(self) -> None:
        self.heard: list[tuple[object, ...]] = []

    def play(self, *given: object) -> None:
        self.heard.append(given)

    def choke(self, source: str) -> None:
        self.heard.append((source,))


def test_a_strike_is_played_as_its_senders() -> None:
    player = _Player()
    with client() as a, opened_front(FakeParameters(), player=player) as front:
        assert tell(front, a, built(P + "/play/strike", 0.5, -0.25, 1)) == []
        assert player.heard == [(0.5, -0.25, 1.0, f"osc {a.endpoint[0]}:{a.endpoint[1]}")]


@pytest.mark.parametrize("args", [[], [1], [0.5]])
def test_a_choke_is_its_senders(args: list[float]) -> None:
    player = _Player()
    with client() as a, opened_front(FakeParameters(), player=player) as front:
        assert tell(front, a, built(P + "/play/choke", *args)) == []
        assert player.heard == [(f"osc {a.endpoint[0]}:{a.endpoint[1]}",)]


def test_a_button_that_is_let_go_chokes_nothing_and_a_text_is_refused() -> None:
    player = _Player()
    with client() as a, opened_front(FakeParameters(), player=player) as front:
        assert tell(front, a, built(P + "/play/choke", 0)) == []
        ((address, said),) = tell(front, a, built(P + "/play/choke", "now"))
        assert (address, said[0]) == ("/drumstick/error", P + "/play/choke")
        assert player.heard == []


def test_without_a_rig_a_choke_is_refused_in_words() -> None:
    with client() as a, opened_front(FakeParameters()) as front:
        ((_, said),) = tell(front, a, built(P + "/play/choke"))
        assert said == [P + "/play/choke", "no rig plays strikes here"]


@pytest.mark.parametrize("args", [[], [0.5], [0.1, 0.2, "loud"], [0.1, 0.2, 0.3, 0.4]])
def test_what_is_no_strike_is_answered_with_what_is_expected(args: list[float | str]) -> None:
    with client() as a, opened_front(FakeParameters()) as front:
        ((address, said),) = tell(front, a, built(P + "/play/strike", *args))
        assert (address, said) == (
            "/drumstick/error",
            [P + "/play/strike", "expects three numbers: x, y, level"],
        )


@pytest.mark.parametrize("as_kind", [int, float])
def test_a_subscription_lasts_a_minute_and_can_be_renewed(as_kind: type) -> None:
    time = Time()
    with client() as sender, client() as listener, opened_front(FakeParameters(), now=time) as front:
        subscribe = built(P + "/subscribe", as_kind(listener.endpoint[1]))
        assert tell(front, sender, subscribe) == []
        time.s += 59.0
        front.alive("main", "ready", 0)
        assert len(listener.waiting()) == 1
        front.receive(subscribe, sender.endpoint)
        time.s += 59.0
        front.alive("main", "ready", 0)
        assert len(listener.waiting()) == 1
        time.s += 1.0
        front.alive("main", "ready", 0)
        assert listener.waiting() == []
        assert sender.waiting() == []


def test_unsubscribing_one_port_or_all() -> None:
    with client() as sender, client() as one, client() as two, opened_front(FakeParameters()) as front:
        ports = [one.endpoint[1], two.endpoint[1]]

        def subscribe() -> None:
            for port in ports:
                front.receive(built(P + "/subscribe", port), sender.endpoint)

        def heard() -> list[int]:
            front.alive("main", "ready", 0)
            return [len(one.waiting()), len(two.waiting())]

        subscribe()
        assert heard() == [1, 1]
        front.receive(built(P + "/unsubscribe", ports[0]), sender.endpoint)
        assert heard() == [0, 1]
        subscribe()
        front.receive(built(P + "/unsubscribe"), sender.endpoint)
        assert heard() == [0, 0]
        assert tell(front, sender, built(P + "/unsubscribe", 9)) == []
        subscribe()
        for another_machine in (built(P + "/unsubscribe"), built(P + "/unsubscribe", ports[0])):
            front.receive(another_machine, ("127.0.0.2", sender.endpoint[1]))
        assert heard() == [1, 1]


def test_a_given_target_stays_whatever_is_unsubscribed() -> None:
    with client() as target, opened_front(FakeParameters(), target) as front:
        front.receive(built(P + "/subscribe", target.endpoint[1]), target.endpoint)
        front.receive(built(P + "/unsubscribe"), target.endpoint)
        front.alive("main", "ready", 0)
        assert len(target.waiting()) == 1


def test_one_host_has_at_most_16_subscriptions_and_keeps_no_other_out() -> None:
    time = Time()
    with client() as sender, client() as target, opened_front(FakeParameters(), target, now=time) as front:
        ports = [p for p in range(20000, 20000 + MAX_OF_A_HOST + 2) if p != front.endpoint[1]]
        for port in ports[:MAX_OF_A_HOST]:
            assert tell(front, sender, built(P + "/subscribe", port)) == []
        full = built(P + "/subscribe", ports[MAX_OF_A_HOST])
        answers = tell(front, sender, full)
        assert "16 ports of 127.0.0.1 have subscribed: end one, or wait 60 s" in str(answers[0][1][1])
        assert tell(front, sender, built(P + "/subscribe", ports[0])) == []  # a renewal is always possible
        target.waiting()
        assert tell(front, target, built(P + "/subscribe", target.endpoint[1])) == []  # needs no subscription
        with client("127.0.0.2") as neighbour:
            assert tell(front, neighbour, built(P + "/subscribe", neighbour.endpoint[1])) == []
            front.alive("main", "ready", 0)
            assert len(neighbour.waiting()) == 1
        time.s += 60.0
        assert tell(front, sender, full) == []


def test_there_are_at_most_64_subscriptions() -> None:
    targets = Targets([])
    hosts = [f"127.0.0.{number}" for number in range(2, 2 + MAX_SUBSCRIPTIONS // MAX_OF_A_HOST)]
    for host in hosts:
        for port in range(20000, 20000 + MAX_OF_A_HOST):
            assert targets.subscribe((host, port), 0.0) == ""
    assert targets.subscribe(("127.0.0.9", 20000), 1.0) == "64 ports have subscribed"
    assert targets.subscribe((hosts[0], 20000), 1.0) == ""
    assert targets.subscribe(("127.0.0.9", 20000), 60.5) == ""


def test_errors_are_capped_for_each_source_but_ping_and_panic_never() -> None:
    parameters, time = FakeParameters(), Time()
    with (
        client() as bad,
        client() as good,
        client() as target,
        opened_front(parameters, target, now=time) as front,
    ):
        wrong = built(P + "/nonsense")
        for _ in range(500):
            front.receive(wrong, bad.endpoint)
        assert len(bad.waiting()) == 20
        assert len(target.waiting()) == 20
        assert front.counters["address"] == 500
        for _ in range(200):
            assert tell(front, bad, built(P + "/ping")) == [("/drumstick/pong", [])]
        for _ in range(50):
            front.receive(built(P + "/panic"), bad.endpoint)
        assert len(parameters.panics) == 50
        assert len(tell(front, good, wrong)) == 1  # another source has its own allowance
        time.s += 1.0
        assert len(tell(front, bad, wrong)) == 1


@shows("flood of nonsense", "ours")
def test_errors_to_many_sources_are_bounded_together() -> None:
    time = Time()
    with client() as target, opened_front(FakeParameters(), target, now=time) as front:
        heard = 0
        for port in range(30000, 32000):
            front.receive(b"/x\0\0", ("127.0.0.1", port))
            heard += len(target.waiting())
        assert heard == 200


def test_answers_to_a_flood_of_questions_go_to_the_asker_only() -> None:
    time = Time()
    with client() as a, client() as target, opened_front(FakeParameters(), target, now=time) as front:
        to_target = 0
        for _ in range(300):
            assert len(tell(front, a, built(P + "/param/tau"))) == 2
            to_target += len(target.waiting())
        assert to_target == 200


@shows("flood of nonsense", "ours")
def test_a_flood_writes_at_most_one_line_a_second(caplog: pytest.LogCaptureFixture) -> None:
    time = Time()
    with client() as a, opened_front(FakeParameters(), now=time) as front, caplog.at_level(logging.WARNING):
        for _ in range(3):
            for _ in range(100):
                front.receive(b"junk", a.endpoint)
            time.s += 1.0
        front.close()
    told = [r.getMessage() for r in caplog.records]
    assert len(told) <= 4  # three seconds, and what close() still had to tell
    assert sum(int(line.split()[2]) for line in told) == 300
    assert told[0].startswith("osc: refused 1 from 127.0.0.1, last: ?: ")


def test_two_rigs_do_not_answer_each_others_errors() -> None:
    with client() as a, opened_front(FakeParameters()) as front:
        assert tell(front, a, osc.error(P, "/drumstick/strike", "no such address")) == []
        assert tell(front, a, osc.pong(P, [1])) == []
        assert front.counters["address"] == 2


def test_only_allowed_sources_are_heard() -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters, allow=[ip_network("127.0.0.2/32")]) as front:
        assert tell(front, a, built(P + "/ping")) == []
        assert tell(front, a, built(P + "/panic")) == []
        assert parameters.panics == []
        assert front.counters == {"source": 2}
        front.receive(built(P + "/panic"), ("127.0.0.2", 5000))
        assert len(parameters.panics) == 1


def test_loopback_alone_is_allowed_by_default() -> None:
    parameters = FakeParameters()
    with opened_front(parameters) as front:
        for host in ("192.168.1.4", "10.0.0.1", "8.8.8.8", "0.0.0.0"):
            front.receive(built(P + "/panic"), (host, 5000))
        assert parameters.panics == []
        front.receive(built(P + "/panic"), ("127.3.2.1", 5000))
        assert len(parameters.panics) == 1


def test_a_fault_of_the_rig_is_told_and_does_not_deafen_it(caplog: pytest.LogCaptureFixture) -> None:
    parameters, time = FakeParameters(), Time()
    with client() as a, opened_front(parameters, now=time) as front:
        parameters.broken = True
        answers = tell(front, a, built(P + "/param/tau"))
        assert answers == [("/drumstick/error", ["/drumstick/param/tau", "a fault of the rig: see its log"])]
        assert front.counters["fault"] == 1
        for _ in range(50):
            front.receive(built(P + "/sync"), a.endpoint)
        assert sum(r.exc_info is not None for r in caplog.records) == 1
        assert "the block is gone" in caplog.text
        front.receive(built(P + "/panic"), a.endpoint)
        assert len(parameters.panics) == 1


def test_a_preset_is_loaded_as_one_set_or_refused() -> None:
    parameters = FakeParameters()
    with client() as a, client() as target, opened_front(parameters, target) as front:
        assert tell(front, a, built(P + "/preset/load", "slow")) == []
        assert parameters.asked == [{"dv_pls": 0.1, "k_hand": 20.0}]
        answers = tell(front, a, built(P + "/preset/load", "fast"))
        assert answers == [("/drumstick/error", ["/drumstick/preset/load", "no preset 'fast'"])]
        assert target.waiting() == answers
        for args in ([], [3], [0.5], ["a", "b"]):
            answers = tell(front, a, built(P + "/preset/load", *args))
            assert answers == [("/drumstick/error", ["/drumstick/preset/load", "send one text"])]
        front.preset("slow")
        assert target.waiting()[-1] == ("/drumstick/preset", ["slow"])


def test_a_lease_belongs_to_the_port_that_took_it() -> None:
    parameters = FakeParameters()
    with client() as a, client() as b, opened_front(parameters) as front:
        assert tell(front, a, built(P + "/lease", "Ada")) == [("/drumstick/lease", ["Ada", 5.0])]
        for refused in (
            built(P + "/param/dv_pls", 0.5),
            built(P + "/param/dv_pls/norm", 0.5),
            built(P + "/preset/load", "slow"),
            built(P + "/lease", "Bob"),
            built(P + "/lease", ""),
        ):
            ((address, (_, why)),) = tell(front, b, refused)
            assert address == "/drumstick/error"
            assert "Ada is tuning" in str(why)
        assert parameters.sets == []
        front.receive(built(P + "/param/dv_pls", 0.5), a.endpoint)
        assert parameters.sets[-1][0] == {"dv_pls": 0.5}
        front.receive(built(P + "/panic"), b.endpoint)
        assert parameters.panics != []
        assert tell(front, a, built(P + "/lease", "")) == [("/drumstick/lease", ["", 0.0])]
        front.receive(built(P + "/param/dv_pls", 0.625), b.endpoint)
        assert parameters.sets[-1][0] == {"dv_pls": 0.625}


def test_presets_are_capped_for_each_sender() -> None:
    parameters, time = FakeParameters(), Time()
    with client() as a, client() as b, opened_front(parameters, now=time) as front:
        for _ in range(50):
            front.receive(built(P + "/preset/load", "slow"), a.endpoint)
        assert len(parameters.asked) == 5
        assert "more than 5 presets in a second" in str(a.waiting()[-1])
        front.receive(built(P + "/preset/load", "slow"), b.endpoint)
        assert len(parameters.asked) == 6
        time.s += 1.0
        front.receive(built(P + "/preset/load", "slow"), a.endpoint)
        assert len(parameters.asked) == 7


def test_scenes_are_asked_for_by_name_or_step_with_the_lease_of_the_sender() -> None:
    asked: list[tuple[str, str]] = []

    class Scenes:
        def ask_for(self, name: str, claim: Claim) -> None:
            asked.append((name, claim.lease))
            if name == "next":
                raise Refusal("the set list ends")

    parameters = FakeParameters()
    with client() as a, opened_front(parameters) as front:
        ((_, (_, why)),) = tell(front, a, built(P + "/scene/load", "tom"))
        assert why == "no rig plays scenes here"
        front.hear_scenes(Scenes())  # pyright: ignore[reportArgumentType]
        front.receive(built(P + "/lease", "Ada"), a.endpoint)
        a.waiting()
        assert tell(front, a, built(P + "/scene/load", "tom")) == []
        for ignored in (0.0, 0):  # a button that is let go
            assert tell(front, a, built(P + "/scene/previous", ignored)) == []
        assert tell(front, a, built(P + "/scene/previous", 1.0)) == []
        answers = tell(front, a, built(P + "/scene/next"))
        assert answers == [("/drumstick/error", [P + "/scene/next", "the set list ends"])]
        ((_, (_, why)),) = tell(front, a, built(P + "/scene/load", 3))
        assert why == "send one text"
        holder = str(parameters.lease.holder(0.0).name)
    assert holder == "Ada"
    assert [name for name, _ in asked] == ["tom", "previous", "next"]
    (lease,) = {lease for _, lease in asked}
    parameters.lease.require(lease, 0.0)  # the sender's own


def test_next_sent_twice_is_two_steps(tmp_path: Path) -> None:
    (tmp_path / files.SET_LIST).write_text(SetList(("roll", "tom", "snare")).text())
    with client() as a, opened_front(FakeParameters()) as front:
        front.hear_scenes(SceneRequests(tmp_path, True, lambda _claim: None))
        for _ in range(2):
            assert tell(front, a, built(P + "/scene/next")) == []
        assert (tmp_path / files.WANTED).read_text() == "2"


def test_fader_of_the_roll_hears_what_came_of_its_newest_request_and_no_error() -> None:
    parameters = FakeParameters()
    with client() as a, opened_front(parameters) as front:
        front.hear_rolls(Rolls(parameters, None, parse(shipped_text("roll"), "roll")))  # pyright: ignore[reportArgumentType]
        for rate in (30.0, 31.0):
            assert tell(front, a, built(P + "/play/rate", rate)) == []
        front.roll(31.0, 0.5)
        assert a.waiting() == [(P + "/play/rate", [31.0])]


def test_another_scene_has_its_own_addresses_and_nobody_is_dropped() -> None:
    before, after = FakeParameters(), FakeParameters()
    after.table = {"dv_pls": after.table["dv_pls"]}
    with client() as a, client() as listener, opened_front(before) as front:
        front.receive(built(P + "/subscribe", listener.endpoint[1]), a.endpoint)
        front.play_scene(after, no_preset, NOBODY_PLAYS)  # pyright: ignore[reportArgumentType]
        front.receive(built(P + "/param/dv_pls", 0.5), a.endpoint)
        assert (before.sets, after.sets[-1][0]) == ([], {"dv_pls": 0.5})
        assert tell(front, a, built(P + "/param/tau", 0.1)) == [
            ("/drumstick/error", [P + "/param/tau", "no such address"])
        ]
        front.receive(built(P + "/panic"), a.endpoint)
        assert (before.panics, len(after.panics)) == ([], 1)
        listener.waiting()
        front.scene_refused("roll plays on")
        assert listener.waiting() == [("/drumstick/error", [P + "/scene/load", "roll plays on"])]
