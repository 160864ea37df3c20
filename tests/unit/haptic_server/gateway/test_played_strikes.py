"""Played strikes: checked, limited, numbered apart from the stick's, and told like them."""

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.scenes.table import Refusal
from drumstick.stick.contact_ahead import isolated
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.gateway.link import ServoLink
from haptic_server.gateway.play_rate_limit import OF_ALL, OF_ONE, PlayRateLimit
from haptic_server.gateway.played_strikes import PlayedStrikes
from haptic_server.gateway.settings import Parameters
from protocol.messages import Choke, Release, Strike, number_of

ROLL = parse(shipped_text("roll"), "roll")
SECOND_NS = 10**9


class Bench:
    """Played strikes of a rig whose servo stands still, and what they published."""

    def __init__(self, folder: Path) -> None:
        self.block = blocks.create(folder, law_of(ROLL))
        self.parameters = Parameters(ROLL, ServoLink(folder, law_of(ROLL)))
        self.now_ns = SECOND_NS
        self.strikes: list[Strike] = []
        self.releases: list[Release] = []
        self.played = PlayedStrikes(ROLL.strike, self.parameters, lambda: self.now_ns)
        self.chokes: list[Choke] = []
        self.played.begin(self.strikes.append, self.releases.append, self.chokes.append)

    def play(self, x: float = 0.3, y: float = -0.4, level: float = 0.5, source: str = "test") -> Strike:
        return self.played.play(x, y, level, source)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    return Bench(tmp_path)


@pytest.mark.parametrize("level", [0.001, 0.5, 1.0])
def test_a_played_strike_announces_an_isolated_blow_at_the_speed_of_its_level(
    bench: Bench, level: float
) -> None:
    told = bench.play(level=level)
    blow = isolated(law_of(ROLL)[0], 2.0 * level)
    assert bench.strikes == [told]
    assert (told.x, told.y, told.level, told.z_speed_m_per_s) == (0.3, -0.4, level, 2.0 * level)
    assert (told.peak_estimate_N, told.contact_estimate_s, told.impulse_N_s) == blow
    assert (told.t_ns, told.source) == (bench.now_ns, "test")


def test_it_follows_what_is_set_live(bench: Bench) -> None:
    soft = bench.play()
    bench.parameters.set({"k_coll": 20000.0}, "test")
    assert bench.play().contact_estimate_s == soft.contact_estimate_s  # the servo does not use it yet
    revision, law = bench.parameters.revision, law_of(ROLL)
    law["k_coll"] = 20000.0
    bench.parameters.latched(revision, law)
    assert bench.play().contact_estimate_s < 0.6 * soft.contact_estimate_s


def test_its_release_comes_when_the_contact_is_over(bench: Bench) -> None:
    told = bench.play()
    bench.played.step(bench.now_ns)
    assert bench.releases == []
    bench.played.step(bench.now_ns + round(told.contact_estimate_s * 1e9))
    (release,) = bench.releases
    assert (release.boot, release.seq, release.source) == (told.boot, told.seq, "test")
    assert release.t_ns == told.t_ns + round(told.contact_estimate_s * 1e9)
    assert 0.0 < release.exit_speed_m_per_s < told.z_speed_m_per_s
    bench.played.step(10 * SECOND_NS)
    assert len(bench.releases) == 1


def test_releases_that_are_not_due_come_when_the_scene_ends(bench: Bench) -> None:
    played = [bench.play(), bench.play()]
    bench.played.release_all()
    assert [release.seq for release in bench.releases] == [strike.seq for strike in played]
    bench.played.step(10 * SECOND_NS)
    assert len(bench.releases) == 2


def test_its_numbers_never_meet_the_sticks(bench: Bench) -> None:
    first, second = bench.play(), bench.play()
    assert first.boot == second.boot >= 2**48 > bench.block.boot
    assert (first.seq, second.seq) == (1, 2)
    assert number_of(first) == -1


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, -1.1])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_numbers_that_no_strike_has_are_refused_by_name(bench: Bench, value: float, place: int) -> None:
    numbers = [0.1, 0.1, 0.1]
    numbers[place] = value
    with pytest.raises(Refusal, match=("x ", "y ", "level ")[place]):
        bench.play(*numbers)
    assert bench.strikes == []
    assert bench.played.counters == {"refused": 1}


def test_beside_the_head_and_at_level_0_nothing_is_struck(bench: Bench) -> None:
    with pytest.raises(Refusal, match="beside the head"):
        bench.play(0.8, 0.8)
    with pytest.raises(Refusal, match="0 strikes nothing"):
        bench.play(level=0.0)
    bench.play(math.cos(0.7), math.sin(0.7))  # the rim


@given(st.floats(), st.floats(), st.floats())
def test_what_is_played_is_a_strike_that_sounds(
    tmp_path_factory: pytest.TempPathFactory, x: float, y: float, level: float
) -> None:
    bench = Bench(tmp_path_factory.mktemp("rig"))
    try:
        told = bench.play(x, y, level)
    except Refusal:
        return
    assert math.hypot(told.x, told.y) < 1.001
    assert 0.0 < told.level <= 1.0
    assert 0.0 <= told.peak_estimate_N < 100.0


def test_a_lease_keeps_nobody_back_and_neither_does_a_panic(bench: Bench) -> None:
    bench.parameters.take_lease("secret", "Ada", 5.0)
    bench.play()
    bench.parameters.panic("test")
    bench.play()
    assert len(bench.strikes) == 2


def test_before_the_relay_runs_nothing_is_played(tmp_path: Path) -> None:
    early = PlayedStrikes(ROLL.strike, Bench(tmp_path).parameters)
    with pytest.raises(Refusal, match="starting"):
        early.play(0.0, 0.0, 0.5, "test")
    with pytest.raises(Refusal, match="starting"):
        early.choke("test")


def test_a_choke_is_published_with_who_stopped_the_drum(bench: Bench) -> None:
    told = [bench.played.choke("test"), bench.played.choke("midi")]
    assert bench.chokes == told
    assert [(choke.boot, choke.seq, choke.source) for choke in told] == [
        (bench.play().boot, 1, "test"),
        (bench.play().boot, 2, "midi"),
    ]
    assert told[0].t_ns == bench.now_ns
    assert bench.played.counters["chokes"] == 2


def test_a_lease_and_a_panic_keep_no_choke_back(bench: Bench) -> None:
    bench.parameters.take_lease("secret", "Ada", 5.0)
    bench.parameters.panic("test")
    bench.played.choke("test")
    assert len(bench.chokes) == 1


def test_chokes_are_limited_together_with_strikes(bench: Bench) -> None:
    assert flood(lambda: (bench.play(), bench.played.choke("test")), 1000) == OF_ONE.at_once / 2
    with pytest.raises(Refusal, match="not played"):
        bench.played.choke("test")
    assert len(bench.chokes) == OF_ONE.at_once / 2


def flood(play: Callable[[], object], times: int) -> int:
    """Number of strikes that were played."""
    played = 0
    for _ in range(times):
        try:
            play()
        except Refusal:
            continue
        played += 1
    return played


def test_a_flood_from_one_source_is_held_back_and_another_one_plays(bench: Bench) -> None:
    assert flood(lambda: bench.play(source="osc 1"), 1000) == OF_ONE.at_once
    assert flood(lambda: bench.play(source="osc 2"), 5) == 5
    assert bench.played.counters["held_back"] == 1000 - OF_ONE.at_once
    bench.now_ns += SECOND_NS // 10
    assert flood(lambda: bench.play(source="osc 1"), 1000) == pytest.approx(OF_ONE.per_s / 10, abs=2)


def test_all_sources_together_never_fill_the_drum() -> None:
    limit = PlayRateLimit()
    assert sum(limit.spend(source, 5.0) for source in range(1000)) == OF_ALL.at_once
    assert sum(limit.spend(source, 6.0) for source in range(5000)) == OF_ALL.at_once
