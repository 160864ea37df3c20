"""Strikes beside the contacts that they announced: in any order, lost, twice, cut short, in any number."""

import random

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.announced import KEPT, Announcements, Report, sentence
from protocol.messages import Release, Strike


def strike(
    seq: int, peak_N: float = 5.0, impulse_N_s: float = 0.01, boot: int = 7, source: str = "stick"
) -> Strike:
    return Strike(
        boot=boot, seq=seq, t_ns=0, x=0.0, y=0.0, z_speed_m_per_s=1.0, level=0.5, peak_estimate_N=peak_N,
        contact_estimate_s=0.005, impulse_N_s=impulse_N_s, source=source,
    )  # fmt: skip


def release(
    seq: int, peak_N: float = 5.0, impulse_N_s: float = 0.01, boot: int = 7, speed: float = 0.5
) -> Release:
    return Release(
        boot=boot, seq=seq, t_ns=0, exit_speed_m_per_s=speed, impulse_N_s=impulse_N_s, peak_N=peak_N, contact_s=0.005
    )  # fmt: skip


def noted(*messages: Strike | Release) -> Announcements:
    found = Announcements()
    for message in messages:
        if isinstance(message, Strike):
            found.note_strike(message)
        else:
            found.note_release(message)
    return found


def report(*messages: Strike | Release) -> Report:
    found = noted(*messages).report()
    assert found is not None
    return found


def test_a_strike_that_announces_twice_the_peak_and_half_the_impulse() -> None:
    told = report(strike(1, peak_N=10.0, impulse_N_s=0.005), release(1))
    assert told.contacts == 1
    assert told.peak == pytest.approx((6.0206, 6.0206), abs=1e-3)
    assert told.impulse == pytest.approx((-6.0206, -6.0206), abs=1e-3)
    assert not told.is_good


def test_the_worst_is_the_farthest_either_way_and_the_median_is_not_moved_by_it() -> None:
    peaks = (5.0, 5.1, 2.5, 5.0, 5.0)
    told = report(*(strike(n, peak_N=peak) for n, peak in enumerate(peaks)), *(release(n) for n in range(5)))
    assert told.contacts == 5
    assert told.peak == pytest.approx((0.0, -6.0206), abs=1e-3)
    assert told.impulse == (0.0, 0.0)
    assert told.is_good


@given(st.randoms(use_true_random=False), st.integers(2, 60))
def test_loss_repetition_and_order_change_nothing_but_what_was_lost(
    chance: random.Random, contacts: int
) -> None:
    """Each number has its own error: a strike beside another's release would show."""
    sent: list[Strike | Release] = []
    for seq in range(contacts):
        sent += [strike(seq, peak_N=2.0 + seq), release(seq, peak_N=2.0 + seq, impulse_N_s=0.01)]
    arriving = [message for message in sent if chance.random() < 0.8]
    arriving += [message for message in arriving if chance.random() < 0.3]
    chance.shuffle(arriving)
    came = [{m.seq for m in arriving if isinstance(m, kind)} for kind in (Strike, Release)]
    both = came[0] & came[1]
    found = noted(*arriving).report()
    assert (0 if found is None else found.contacts) == len(both)
    if found is not None:
        assert found.peak == found.impulse == (0.0, 0.0)


def test_what_belongs_to_another_start_of_the_servo_is_another_contact() -> None:
    assert noted(strike(1, boot=7), release(1, boot=8)).report() is None


@pytest.mark.parametrize(
    "messages",
    [
        (strike(1, source="osc"), release(1)),
        (strike(1, impulse_N_s=0.0), release(1)),  # told by an older server
        (strike(1, peak_N=0.0), release(1)),
        (strike(1), release(1, speed=0.0)),  # cut short by a panic
        (strike(1), release(1, peak_N=0.0)),
        (strike(1), release(1, impulse_N_s=-1e-3)),
    ],
)
def test_what_announces_nothing_or_did_not_end_is_left_out(messages: tuple[Strike | Release, ...]) -> None:
    assert noted(*messages).report() is None
    assert "no contact was heard" in sentence(noted(*messages).report())


def test_only_the_newest_contacts_count_and_memory_is_bounded() -> None:
    found = Announcements()
    for seq in range(5000):
        found.note_strike(strike(seq, peak_N=50.0 if seq < 4000 else 5.0))
        found.note_release(release(seq))
    for seq in range(5000, 50_000):
        found.note_strike(strike(seq))  # whose releases never come
    told = found.report()
    assert told is not None
    assert told.contacts == KEPT
    assert told.peak == (0.0, 0.0)
    assert len(found._pairs) <= 1024


def test_an_older_servers_strike_has_no_impulse_and_no_source() -> None:
    assert msgspec.convert(msgspec.to_builtins(strike(1))[:-2], Strike).impulse_N_s == 0.0


def test_the_sentence_says_how_far_and_what_may_be_wrong() -> None:
    good = sentence(report(strike(1), release(1)))
    assert good == (
        "Strikes against contacts, the last contact: peak force announced +0.0 dB (worst +0.0 dB), "
        "impulse +0.0 dB (worst +0.0 dB)."
    )
    assert "does the scene describe this hand?" in sentence(report(strike(1, peak_N=8.0), release(1)))
