"""Words of `drumstick monitor` about a rig, from what came over the network."""

import json

import msgspec

from protocol.messages import Meter, Release, State, Strike, encode
from rig.network.monitor import Monitor
from rig_messages import state, strike

STATE = state(roll_rate_Hz=23.05, strikes=12, overruns=3, lateness_p99_us=50.0, lateness_worst_us=90.0)
METER = Meter(
    id="s", t_ns=0, sink="null", peak_left=0.0, peak_right=0.0, load=0.0, xruns=1, latency_ms=5.0, played=11, late=2,
    duplicates=0, underflows=4, limited_frames=120, clipped_frames=3,
)  # fmt: skip


def struck(seq: int, peak_N: float) -> bytes:
    return encode(strike(seq=seq, peak_estimate_N=peak_N, impulse_N_s=0.01))


def release(seq: int) -> bytes:
    return encode(
        Release(
            boot=1, seq=seq, t_ns=0, exit_speed_m_per_s=0.5, impulse_N_s=0.01, peak_N=5.0, contact_s=0.005
        )
    )


def test_a_rig_that_plays_in_words() -> None:
    monitor = Monitor()
    monitor.note(encode(STATE), State, 10.0)
    monitor.note(encode(METER), Meter, 10.0)
    monitor.note(struck(1, 5.0), Strike, 10.0)
    monitor.note(release(1), Release, 10.0)
    assert monitor.line(11.0, as_json=False) == (
        "playing, 12 strikes, 23.1 Hz, 3 ticks missed. Sound (null): 11 played, 2 too late, 4 gaps, 1 xruns, "
        "120 frames limited, 3 clipped. "
        "Strikes against contacts, the last contact: peak force announced +0.0 dB (worst +0.0 dB), "
        "impulse +0.0 dB (worst +0.0 dB)."
    )


def test_a_drum_that_is_being_built_is_told() -> None:
    monitor = Monitor()
    meter = msgspec.structs.replace(METER, waiting="another drum for pitch \x1b[2J")
    monitor.note(encode(meter), Meter, 10.0)
    (heard,) = json.loads(monitor.line(11.0, as_json=True))["sound"]
    assert heard["waiting"] == meter.waiting
    words = monitor.line(11.0, as_json=False)
    assert "Not yet heard: another drum for pitch" in words
    assert "\x1b" not in words


def test_what_is_not_heard_any_more_is_not_told() -> None:
    monitor = Monitor()
    monitor.note(encode(STATE), State, 10.0)
    monitor.note(encode(METER), Meter, 10.0)
    assert monitor.line(20.0, as_json=False) == (
        "No data from the force loop. Strikes against contacts: no contact was heard from beginning to end yet."
    )
    told = json.loads(monitor.line(20.0, as_json=True))
    assert (told["state"], told["strikes"], told["sound"], told["announced"]) == (None, None, [], None)


def test_as_json_the_difference_is_in_dB_whatever_the_order_and_nonsense_is_counted() -> None:  # noqa: N802
    monitor = Monitor()
    for seq, peak_N in ((1, 5.0), (2, 5.0), (3, 10.0)):
        monitor.note(release(seq), Release, 10.0)
        monitor.note(struck(seq, peak_N), Strike, 10.0)
    monitor.note(b"\xff\x00", Strike, 10.0)
    told = json.loads(monitor.line(10.0, as_json=True))
    assert told["unreadable"] == 1
    announced = told["announced"]
    assert (announced["contacts"], announced["good"]) == (3, True)
    assert announced["peak_median_dB"] == 0.0
    assert round(announced["peak_worst_dB"], 3) == 6.021


def test_what_a_stranger_makes_up_steers_no_terminal_and_fills_no_memory() -> None:
    import msgspec

    monitor = Monitor()
    monitor.note(encode(msgspec.structs.replace(STATE, status="\x1b[2J\r")), State, 10.0)
    for number in range(1000):
        monitor.note(encode(msgspec.structs.replace(METER, id=str(number), sink="\x1b[2J")), Meter, 10.0)
    line = monitor.line(10.0, as_json=False)
    assert "\x1b" not in line
    assert "\r" not in line
    assert line.count("Sound (") == 100
