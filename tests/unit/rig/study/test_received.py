"""Strikes off the wire: each once, those of the metronome left out, what is missing counted, nobody's address kept."""

import pytest

from protocol.messages import Strike, encode
from rig.study.rig_link import METRONOME
from rig.study.session import Received


def sent(seq: int, source: str = "stick", boot: int = 1) -> bytes:
    return encode(
        Strike(boot=boot, seq=seq, t_ns=seq, x=0.0, y=0.0, z_speed_m_per_s=1.0, level=0.5, peak_estimate_N=1.0,
               contact_estimate_s=0.001, source=source)
    )  # fmt: skip


def test_twice_is_once_and_a_gap_is_counted() -> None:
    received = Received("stick")
    logged = [received.strike(sent(seq)) for seq in (4, 5, 5, 8)]
    assert [each and each.t_ns for each in logged] == [4, 5, None, 8]
    assert (received.lost, received.unreadable) == (2, 0)


def test_a_strike_that_was_overtaken_is_not_lost() -> None:
    received = Received("stick")
    logged = [received.strike(sent(seq)) for seq in (4, 6, 5, 8)]
    assert [each and each.t_ns for each in logged] == [4, 6, 5, 8]
    assert received.lost == 1


def test_the_metronomes_strikes_are_no_players_and_leave_no_gap() -> None:
    received = Received("osc")
    assert received.strike(sent(1, METRONOME)) is None
    assert received.strike(sent(2, "osc 127.0.0.1:5005")) is not None
    assert received.strike(sent(3, METRONOME)) is None
    assert received.lost == 0


@pytest.mark.parametrize(
    ("source", "wanted", "way", "counts"),
    [
        ("osc 192.168.1.7:5005", "osc", "osc", True),
        ("zenoh Ada", "zenoh", "zenoh", True),
        ("zenoh Ada", "zenoh Ada", "zenoh", True),
        ("zenoh Adam", "zenoh Ada", "zenoh", False),
        ("midi", "stick", "midi", False),
    ],
)
def test_only_the_way_is_kept_of_a_source(source: str, wanted: str, way: str, counts: bool) -> None:
    strike = Received(wanted).strike(sent(1, source))
    assert strike is not None
    assert (strike.source, strike.counts) == (way, counts)


def test_nonsense_is_counted() -> None:
    received = Received("stick")
    assert received.strike(b"nonsense") is None
    assert received.unreadable == 1
