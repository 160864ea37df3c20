"""Times of a replay's messages, and what they say by then."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.messages import Choke, Contact, Message, Readback, Release, State, Strike
from recordings import a_choke, a_release, a_state, a_strike, made
from rig.recording.reading import read
from rig.replaying.cues import Cue, Renumbering, cues_of, numbers_of, pass_ns
from rig.replaying.lateness import Lateness

MS = 1_000_000


def recorded(path: Path, messages: list[tuple[float, str, Message]], speed: float = 1.0) -> list[Cue]:
    path.unlink(missing_ok=True)
    return cues_of(read(made(path, messages)).events, speed)


def played(cues: list[Cue], begin_ns: int = 10**12, turns: int = 1) -> list[tuple[int, Message]]:
    """(when, message) of all passes."""
    renumbering = Renumbering(99, numbers_of(cues))
    lasts = pass_ns(cues)
    return [
        (begin_ns + turn * lasts + cue.at_ns, renumbering.renumbered(cue, begin_ns + turn * lasts, turn))
        for turn in range(turns)
        for cue in cues
    ]


@given(
    st.lists(
        st.tuples(st.sampled_from([7, 8]), st.integers(1, 200), st.floats(0.0, 9.0)), min_size=1, max_size=20
    ),
    st.sampled_from([0.25, 1.0, 3.0]),
    st.integers(1, 3),
)
def test_strikes_of_all_boots_and_passes_become_one_boot_without_a_number_twice(
    tmp_path_factory: pytest.TempPathFactory, given_: list[tuple[int, int, float]], speed: float, turns: int
) -> None:
    once = {(boot, seq): at_s for boot, seq, at_s in given_}
    messages = [(at_s, "/strike", a_strike(seq, boot)) for (boot, seq), at_s in once.items()]
    messages.sort(key=lambda message: message[0])
    cues = recorded(tmp_path_factory.getbasetemp() / "b.mcap", messages, speed)
    told = played(cues, turns=turns)
    assert [when for when, _ in told] == sorted(when for when, _ in told)
    strikes = [(when, strike) for when, strike in told if isinstance(strike, Strike)]
    assert len({strike.seq for _, strike in strikes}) == len(once) * turns
    assert {strike.boot for _, strike in strikes} == {99}
    assert all(strike.t_ns == when for when, strike in strikes)
    first_s = min(once.values())
    due = sorted(round((at_s - first_s) * 1e9 / speed) for at_s in once.values())
    begin = strikes[0][0]
    # A recording keeps whole nanoseconds, of which a slow replay makes several.
    assert [when - begin for when, _ in strikes[: len(once)]] == pytest.approx(due, abs=2.0 + 1.0 / speed)


def test_the_numbers_of_a_restarted_servo_follow_those_before(tmp_path: Path) -> None:
    messages = [(0.0, "/strike", a_strike(41)), (0.1, "/release", a_release(41)), (1.0, "/strike", a_strike(1, 8)),
                (1.1, "/state", a_state(1, 8)), (2.0, "/strike", a_strike(2, 8))]  # fmt: skip
    told = [message for _, message in played(recorded(tmp_path / "a.mcap", messages), turns=2)]
    assert [m.seq for m in told if isinstance(m, Strike)] == [41, 42, 43, 44, 45, 46]
    assert [m.seq for m in told if isinstance(m, Release)] == [41, 44]
    assert [m.strikes for m in told if isinstance(m, State)] == [42, 45]


def test_chokes_keep_their_place_among_the_strikes_and_have_a_number_each(tmp_path: Path) -> None:
    messages = [(0.0, "/strike", a_strike(1)), (0.5, "/choke", a_choke(1)), (0.6, "/choke", a_choke(2))]
    told = played(recorded(tmp_path / "a.mcap", messages, speed=2.0), begin_ns=0, turns=2)
    chokes = [(when, choke) for when, choke in told if isinstance(choke, Choke)]
    assert [choke.seq for _, choke in chokes] == [1, 2, 3, 4]
    assert {choke.boot for _, choke in chokes} == {99}
    assert all(choke.t_ns == when for when, choke in chokes)
    assert [when for when, _ in chokes][:2] == pytest.approx([250 * MS, 300 * MS])


def test_a_pass_lasts_a_beat_longer_than_its_last_strike(tmp_path: Path) -> None:
    cues = recorded(tmp_path / "a.mcap", [(0.2 * k, "/strike", a_strike(k)) for k in range(1, 6)])
    assert pass_ns(cues) == pytest.approx(5 * 200 * MS, abs=5)


def piece(seq: int, first_tick: int, count: int, boot: int = 7, timed: bool = True) -> Contact:
    t_ns = first_tick * MS if timed else None
    return Contact(
        boot=boot, seq=seq, first_tick=first_tick, rate_Hz=1000.0, forces=bytes(4 * count), t_ns=t_ns
    )


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_a_contact_keeps_its_length_at_any_speed(tmp_path: Path, speed: float) -> None:
    messages = [(0.001 * tick, "/contact", piece(seq, tick, 2))
                for seq, tick in ((1, 1000), (1, 1002), (1, 1004), (2, 1043), (2, 1045))]  # fmt: skip
    told = played(recorded(tmp_path / "a.mcap", messages, speed))
    pieces = [message for _, message in told if isinstance(message, Contact)]
    apart = round(43 / speed)
    first = pieces[0].first_tick
    assert [p.first_tick - first for p in pieces] == [0, 2, 4, apart, apart + 2]
    begin = pieces[0].t_ns
    assert begin is not None
    assert [p.t_ns - begin for p in pieces if p.t_ns is not None] == pytest.approx(
        [0, 2 * MS, 4 * MS, 43 * MS / speed, 43 * MS / speed + 2 * MS], abs=3
    )
    assert {p.boot for p in pieces} == {99}


def test_pieces_without_a_time_get_none(tmp_path: Path) -> None:
    cues = recorded(tmp_path / "a.mcap", [(0.0, "/contact", piece(1, 1000, 2, timed=False))])
    assert [message.t_ns for _, message in played(cues) if isinstance(message, Contact)] == [None]


def test_readbacks_are_told_as_they_were_and_meters_and_presences_not_at_all(tmp_path: Path) -> None:
    from recordings import Presence

    readback = Readback(value=0.3, revision=4)
    cues = recorded(
        tmp_path / "a.mcap",
        [(0.0, "/param/dv_pls", readback), (0.1, "/alive", Presence(service="sound", id="1", alive=True))],
    )
    assert [(cue.name, message) for cue, (_, message) in zip(cues, played(cues), strict=True)] == [
        ("dv_pls", readback)
    ]


def test_revisions_never_go_back_over_passes_and_restarts_of_the_servo(tmp_path: Path) -> None:
    """An older revision would be taken for one that was overtaken, and dropped."""
    messages: list[tuple[float, str, Message]] = [
        (0.0, "/strike", a_strike(1)),
        (0.1, "/param/muffle", Readback(value=0.1, revision=4)),
        (0.2, "/param/muffle", Readback(value=0.2, revision=6)),
        (0.3, "/param/muffle", Readback(value=0.3, revision=0)),  # the servo began anew
    ]
    told = [message for _, message in played(recorded(tmp_path / "a.mcap", messages), turns=2)]
    readbacks = [message for message in told if isinstance(message, Readback)]
    assert [readback.value for readback in readbacks] == [0.1, 0.2, 0.3, 0.1, 0.2, 0.3]
    revisions = [readback.revision for readback in readbacks]
    assert revisions == sorted(revisions)


def test_lateness_is_counted() -> None:
    late = Lateness()
    assert late.percentile_us(0.99) == 0.0
    for us in (10, 20, 30, 120, 5000):
        late.note(us * 1000)
    assert (late.percentile_us(0.5), late.percentile_us(0.8), late.late) == (50.0, 150.0, 1)
    assert late.worst_ns == 5_000_000
    late.note(10**12)
    assert late.percentile_us(1.0) == 100_000.0
