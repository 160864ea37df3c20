"""Requests for a rate and a level: what is set when, and what becomes of them. In virtual time, without a process."""

import functools
from collections.abc import Callable
from itertools import count
from queue import SimpleQueue
from threading import Event

import pytest

from drumstick.analysis.inverse import Inverse, Roll
from drumstick.analysis.ramp import STEP_S, Leg
from drumstick.safety.envelope import Limits
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal, table_of, with_changes
from drumstick.stick.law import law_of
from haptic_server.gateway.rolls.__main__ import Finder
from haptic_server.gateway.rolls.messages import Answer, Question, Refused
from haptic_server.gateway.rolls.rolls import Outcome, Rolls, Standing
from osc_bench import BOUND_S, FakeParameters, Time
from protocol.requests import ANYBODY, Claim

SCENE = parse(shipped_text("roll"), "roll")


@functools.cache  # not on import: every worker imports every file
def _now() -> Roll:
    return Inverse(SCENE).present(law_of(SCENE))


class _Parameters(FakeParameters):
    pending, live_revision, held = False, 0, False

    def require_quiet(self, claim: Claim) -> None:
        if self.held:
            raise Refusal("a panic is latched")
        self.require_free(claim)


class _Finder(Finder):
    def __init__(self) -> None:
        super().__init__(SCENE, Limits.of(SCENE))

    def ask(self, question: Question) -> Answer:
        return self.answer(question)

    def close(self) -> None: ...


class _Bench:
    """Rolls whose thread never began, and everything that they answered."""

    def __init__(self) -> None:
        self.parameters, self.now = _Parameters(), Time()
        self.told: list[Standing] = []
        self.outcomes: list[Outcome] = []
        self.finder = _Finder()
        self.rolls = Rolls(self.parameters, self.finder, SCENE, self.now)  # pyright: ignore[reportArgumentType]
        self.rolls.publish = self.told.append

    def ask(self, claim: Claim = ANYBODY, **legs: Leg) -> None:
        self.rolls.request(legs, "test", claim, self.outcomes.append)
        self.rolls.step()

    def pass_time(self, seconds: float, each: Callable[[], None] = lambda: None) -> None:
        for _ in range(round(seconds / STEP_S)):
            self.now.s += STEP_S
            each()
            self.rolls.note_change()
            self.rolls.step()

    def predicted(self) -> tuple[float, float]:
        values = {n: v for n, v in self.parameters.values().items() if n != "z_h0"}
        roll = Inverse(SCENE).present(with_changes(law_of(SCENE), table_of(SCENE), values))
        return roll.rate_Hz, roll.level


@pytest.fixture
def bench() -> _Bench:
    return _Bench()


def test_request_is_one_set_and_what_holds_is_told(bench: _Bench) -> None:
    bench.ask(rate=Leg(30.0))
    (outcome,) = bench.outcomes
    assert (outcome.rate_Hz, outcome.level) == pytest.approx((30.0, _now().level))
    assert [set(changes) for changes, _ in bench.parameters.sets] == [{"k_hand", "z_ss", "dv_pls"}]
    bench.pass_time(STEP_S)
    assert bench.told[-1][:2] == pytest.approx((30.0, _now().level))
    bench.ask(rate=Leg(30.1), level=Leg(_now().level))
    assert bench.outcomes[-1].reply is not None
    assert not bench.outcomes[-1].reply.pending
    assert len(bench.parameters.sets) == 1


def test_refusal_sets_nothing_and_names_the_nearest(bench: _Bench) -> None:
    bench.ask(rate=Leg(90.0))
    assert "nearest:" in bench.outcomes[0].refusal
    assert bench.parameters.sets == []


def test_steps_of_a_ramp_wait_for_no_other_process(bench: _Bench) -> None:
    asked: list[Question] = []
    find = bench.finder.ask
    bench.finder.ask = lambda question: (asked.append(question), find(question))[1]
    bench.ask(level=Leg(0.6, 2.0))
    bench.pass_time(1.0)
    assert len(asked) == 1
    assert _now().level + 0.05 < bench.told[-1].level < 0.6 - 0.05
    assert bench.told[-1].rate_Hz == pytest.approx(_now().rate_Hz)


def test_change_soon_after_another_is_told_in_its_turn() -> None:
    """The thread itself: it waits for nothing, and then for the next tenth of a second."""
    told, calls = SimpleQueue[Standing](), count()
    rolls = Rolls(_Parameters(), _Finder(), SCENE, lambda: 0.01 * next(calls))  # pyright: ignore[reportArgumentType]
    rolls.publish = told.put
    rolls.start()
    try:
        for _ in range(5):
            rolls.note_change()
            told.get(timeout=BOUND_S)
    finally:
        rolls.close()


def test_one_on_its_way_is_left_there_by_a_request_for_the_other(bench: _Bench) -> None:
    bench.ask(rate=Leg(30.0, 2.0))
    bench.pass_time(1.0)
    halfway = bench.told[-1].rate_Hz
    assert _now().rate_Hz + 2.0 < halfway < 28.0
    bench.ask(level=Leg(0.6))
    assert bench.outcomes[-1].level == pytest.approx(0.6)
    bench.pass_time(STEP_S * 10)
    assert bench.told[-1].rate_Hz == pytest.approx(halfway, abs=1.0)
    assert bench.told[-1].level == pytest.approx(0.6)
    bench.pass_time(1.5)
    assert bench.predicted() == pytest.approx((30.0, 0.6), rel=1e-6)
    assert not any(outcome.refusal for outcome in bench.outcomes)


def test_answer_to_a_ramp_has_the_values_of_its_end_which_wait(bench: _Bench) -> None:
    bench.ask(rate=Leg(30.0, 0.5))
    reply = bench.outcomes[-1].reply
    assert reply is not None
    assert reply.pending
    bench.pass_time(0.7)
    values = bench.parameters.values()
    assert reply.values == pytest.approx({name: values[name] for name in ("k_hand", "z_ss", "dv_pls")})


def test_ramp_ends_where_somebody_sets_the_stick(bench: _Bench) -> None:
    bench.ask(level=Leg(0.6, 2.0))
    bench.pass_time(0.5)
    bench.parameters.set({"k_hand": 25.0}, "somebody else")
    sets = len(bench.parameters.sets)
    bench.pass_time(0.5)
    assert bench.outcomes[-1].late
    assert "changed meanwhile" in bench.outcomes[-1].refusal
    assert len(bench.parameters.sets) == sets
    assert bench.parameters.values()["k_hand"] == 25.0


def test_ramp_ends_beside_another_lease(bench: _Bench) -> None:
    bench.ask(level=Leg(0.6, 2.0))
    bench.pass_time(0.5)
    bench.parameters.take_lease("secret", "Anna", 5.0)
    bench.pass_time(0.5)
    assert "Anna" in bench.outcomes[-1].refusal
    with pytest.raises(Refusal, match="Anna"):
        bench.ask(rate=Leg(30.0))
    bench.ask(Claim(lease="secret"), rate=Leg(30.0))
    assert bench.outcomes[-1].rate_Hz == pytest.approx(30.0)


def test_ramp_ends_with_a_panic(bench: _Bench) -> None:
    bench.ask(level=Leg(0.6, 2.0))
    bench.pass_time(0.5)
    sets, bench.parameters.held = len(bench.parameters.sets), True
    bench.pass_time(0.5)
    assert "panic" in bench.outcomes[-1].refusal
    bench.parameters.held = False
    bench.pass_time(0.5)
    assert len(bench.parameters.sets) == sets


def test_request_after_a_set_by_somebody_else_sets_out_from_that(bench: _Bench) -> None:
    bench.ask(level=Leg(0.6, 2.0))
    bench.pass_time(0.5)
    bench.parameters.set({"k_coll": 2.0 * bench.parameters.values()["k_coll"]}, "somebody else")
    bench.ask(rate=Leg(30.0))
    assert bench.outcomes[-2].late
    assert bench.predicted() == pytest.approx(bench.outcomes[-1][1:3], rel=1e-6)


def test_what_somebody_sets_while_a_roll_is_sought_is_kept(bench: _Bench) -> None:
    find = bench.finder.ask

    def ask(question: Question) -> Answer:
        bench.parameters.set({"k_hand": 25.0}, "somebody else")
        return find(question)

    bench.finder.ask = ask
    bench.ask(rate=Leg(30.0))
    assert "meanwhile" in bench.outcomes[-1].refusal
    assert bench.parameters.values()["k_hand"] == 25.0


def test_fader_of_the_level_moves_it_while_a_ramp_of_the_rate_ends_in_time(bench: _Bench) -> None:
    bench.ask(rate=Leg(40.0, 2.0))
    for step in range(90):
        bench.ask(level=Leg(0.3 + 0.001 * step))
        bench.pass_time(STEP_S)
    rate, level, *_ = bench.told[-1]
    assert rate == pytest.approx(38.0, abs=1.0)
    assert level == pytest.approx(0.389, abs=0.01)
    bench.pass_time(0.3)
    assert bench.predicted() == pytest.approx((40.0, 0.389), rel=1e-6)


class _StandingFinder(_Finder):
    """Finds nothing until it is closed."""

    def __init__(self) -> None:
        super().__init__()
        self.asked, self.closed = Event(), Event()

    def ask(self, question: Question) -> Answer:
        self.asked.set()
        assert self.closed.wait(BOUND_S)
        return Refused("closed")

    def close(self) -> None:
        self.closed.set()


def test_who_still_waits_when_the_scene_ends_is_answered(bench: _Bench) -> None:
    finder, told = _StandingFinder(), list[Standing]()
    rolls = Rolls(bench.parameters, finder, SCENE, bench.now)  # pyright: ignore[reportArgumentType]
    rolls.start()
    try:
        for name, value in (("rate", 24.0), ("rate", 25.0), ("level", 0.3)):
            rolls.request({name: Leg(value)}, name, ANYBODY, bench.outcomes.append)
            assert finder.asked.wait(BOUND_S)  # by the first; the other two wait in the queue
        rolls.tell(told.append)
    finally:
        rolls.close()
    assert len(bench.outcomes) == 3
    assert sum("this scene is over" in outcome.refusal for outcome in bench.outcomes) >= 1
    assert len(told) == 1
    with pytest.raises(Refusal, match="this scene is over"):
        rolls.request({"rate": Leg(24.0)}, "late", ANYBODY, bench.outcomes.append)


def test_newest_of_a_kind_wins(bench: _Bench) -> None:
    for rate in (24.0, 26.0, 28.0):
        bench.rolls.request({"rate": Leg(rate)}, "test", ANYBODY, bench.outcomes.append)
    bench.rolls.step()
    assert ["newer" in outcome.refusal for outcome in bench.outcomes] == [True, True, False]
    assert bench.predicted()[0] == pytest.approx(28.0, rel=1e-6)


@pytest.mark.parametrize("leg", [Leg(float("nan")), Leg(30.0, float("inf")), Leg(30.0, -1.0), Leg(30.0, 1e9)])
def test_what_is_no_number_of_use_is_refused(bench: _Bench, leg: Leg) -> None:
    try:
        bench.ask(rate=leg)
    except Refusal:
        assert bench.outcomes == []
    else:
        assert bench.outcomes[0].refusal
    assert bench.parameters.sets == []


def test_who_asks_is_answered_though_nothing_was_found_and_a_flood_of_them_is_refused(bench: _Bench) -> None:
    def ask(question: Question) -> Answer:
        return Refused(f"no answer to {question}")

    bench.finder.ask = ask
    heard: list[Standing] = []
    for _ in range(256):
        bench.rolls.tell(heard.append)
    with pytest.raises(Refusal, match="too many"):
        bench.rolls.tell(heard.append)
    bench.rolls.step()
    assert len(heard) == 256
    assert {standing[:2] for standing in heard} == {(0.0, 0.0)}


def test_scene_without_such_a_roll_says_so_at_once() -> None:
    drum = parse(shipped_text("bare-drum"), "bare-drum")
    rolls = Rolls(_Parameters(), _Finder(), drum)  # pyright: ignore[reportArgumentType]
    with pytest.raises(Refusal, match="no pulse"):
        rolls.request({"rate": Leg(30.0)}, "test", ANYBODY, lambda _outcome: None)
    with pytest.raises(Refusal, match="no pulse"):
        rolls.tell(lambda _standing: None)
