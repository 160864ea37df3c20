"""The recording's time line, and what its recorder says is missing."""

from hypothesis import given
from hypothesis import strategies as st

from protocol.clock import HapticClock
from protocol.messages import Contact
from recordings import a_release, a_strike
from rig.recording import channels
from rig.recording.lost_messages import LostMessages
from rig.recording.times import TimeLine, wall_minus_monotonic_ns

MS = 1_000_000
NOW = 500_000 * MS


def line(offset_ns: int = 10**18, haptic_ns: int = 7 * MS, boot: int = 3) -> TimeLine:
    return TimeLine(offset_ns, HapticClock(boot, haptic_ns, 1 * MS))


def test_an_event_has_its_own_time_and_is_heard_later() -> None:
    assert line().event_ns(NOW + 7 * MS - 2 * MS, 3, NOW) == 10**18 + NOW - 2 * MS
    assert line().wall_ns(NOW) == 10**18 + NOW


def test_a_strike_that_waited_for_a_gateway_keeps_its_instant() -> None:
    assert line().event_ns(NOW - 60_000 * MS, 3, NOW) == 10**18 + NOW - 60_007 * MS


def test_a_time_of_hours_ago_is_nobodys_and_spoils_no_recording() -> None:
    """Anybody may publish one; a recording that held it would seem to last as long."""
    hour = 3_600_000 * MS
    late = line(offset_ns=10**18, haptic_ns=0)
    assert late.event_ns(0, 3, hour) == 10**18
    assert late.event_ns(0, 3, hour + 1) == 10**18 + hour + 1


def test_without_a_clock_for_it_an_event_is_when_it_was_heard() -> None:
    heard = 10**18 + NOW
    assert line().event_ns(None, None, NOW) == heard
    assert line().event_ns(NOW, 4, NOW) == heard, "of another boot"
    assert TimeLine(10**18).event_ns(NOW, 3, NOW) == heard
    assert line().event_ns(NOW - 5000 * MS, None, NOW) == heard, "a meter of a machine without our clock"
    assert line().event_ns(NOW + 6 * MS, None, NOW) == heard - 1 * MS


@given(st.integers(-(2**63), 2**64 - 1))
def test_any_time_in_a_message_gives_one_that_a_file_can_hold(t_ns: int) -> None:
    assert 0 <= line().event_ns(t_ns, 3, NOW) < 2**63


def test_only_a_clock_that_says_something_new_moves_the_times() -> None:
    times = line(haptic_ns=0)
    assert not times.learn(HapticClock(3, 2 * MS, 1 * MS)), "within both errors"
    assert times.clock == HapticClock(3, 0, 1 * MS)
    assert times.learn(HapticClock(3, 2 * MS + 1, 1 * MS)), "it drifted"
    assert times.learn(HapticClock(3, 2 * MS, MS // 8)), "much truer"
    assert times.learn(HapticClock(4, 2 * MS, 1 * MS)), "another start"


def test_the_wall_clock_is_where_it_is() -> None:
    import time

    before = time.time_ns() - time.monotonic_ns()
    found = wall_minus_monotonic_ns()
    after = time.time_ns() - time.monotonic_ns()
    assert min(before, after) - 50 * MS < found < max(before, after) + 50 * MS


def piece(seq: int, tick: int, count: int = 2, boot: int = 1) -> Contact:
    return Contact(boot=boot, seq=seq, first_tick=tick, rate_Hz=1000.0, forces=bytes(4 * count))


def test_gaps_in_the_numbers_are_counted_once() -> None:
    gaps = LostMessages()
    for seq in (5, 6, 9, 9, 8, 10):
        gaps.note(channels.STRIKE, a_strike(seq))
    gaps.note(channels.STRIKE, a_strike(1, boot=8))
    gaps.note(channels.RELEASE, a_release(5))
    gaps.note(channels.RELEASE, a_release(7))
    assert dict(gaps.missing) == {"/strike": 2, "/release": 1}


def test_a_hole_in_a_contact_is_counted_and_the_time_between_contacts_is_none() -> None:
    gaps = LostMessages()
    for each in (piece(1, 100), piece(1, 102), piece(2, 140), piece(2, 144), piece(2, 146), piece(1, 101)):
        gaps.note(channels.CONTACT, each)
    assert dict(gaps.missing) == {"/contact": 1}
