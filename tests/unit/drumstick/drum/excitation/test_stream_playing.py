"""The streamed force on the audio thread, in virtual time: whole impulses; gaps, jumps and drift."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drumstick.drum.block import render_all
from drumstick.drum.build import new_engine
from drumstick.drum.engine import Engine
from drumstick.drum.excitation.feed import Feed
from drumstick.drum.excitation.force_resampling import FADE_S, HOLD_S
from drumstick.drum.excitation.offline import StreamedContact
from drumstick.drum.memory.strikes import StrikeRing
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick_lab.accuracy.drums.blows import pressed
from realtime.kernels.jit import allocations
from streamed_engine import MS, Player, streamed

T = 1e-3


def half_sine(rate_Hz: float, t_s: float, contact_s: float, peak_N: float) -> tuple[int, np.ndarray]:
    """Its first tick, and its means over ticks."""
    first = math.floor(t_s * rate_Hz)
    ends = (first + np.arange(math.ceil(contact_s * rate_Hz) + 3)) / rate_Hz - t_s
    cumulated = peak_N * contact_s / math.pi * (1.0 - np.cos(math.pi * np.clip(ends / contact_s, 0.0, 1.0)))
    return first, np.diff(cumulated) * rate_Hz


@settings(max_examples=40)
@given(
    st.lists(st.floats(-50.0, 50.0, width=32), min_size=1, max_size=60),
    st.sampled_from([500.0, 1000.0, 1313.0, 4000.0, 16000.0, 44100.0]),
    st.integers(-5_000_000, 30_000_000),
    st.floats(0.0, 1.0),
)
def test_the_impulse_is_that_of_the_samples(
    forces: list[float], rate_Hz: float, ahead_ns: int, at: float
) -> None:
    """Whatever the rate, the phase and the lead: late, too near for the parabolas' reach, or long before."""
    player = Player()
    player.play(round(at * MS))
    player.push(3, [*forces, 0.0], ahead_ns, rate_Hz)
    sound = player.play(round(45 * MS + 62e9 / rate_Hz))
    expected = np.float32(forces).astype(np.float64).sum() / rate_Hz
    assert sound.sum() * player.step_s == pytest.approx(expected, rel=1e-11, abs=1e-11 * len(forces))
    assert player.state["idle"] == 1


def test_a_force_that_goes_by_a_parabola_comes_out_as_it_was() -> None:
    k = np.arange(60)
    cumulated = 2.0 * k - 0.05 * k**2 + 0.003 * k**3 / 3.0  # of 2 - 0.1 t + 0.003 t^2
    player = Player()
    player.push(0, np.diff(cumulated), 0, 1000.0)
    sound = player.play(57 * MS)[3 * 16 :]
    t = 3.0 + (np.arange(len(sound)) + 0.5) / 16.0
    mean = 2.0 - 0.1 * t + 0.003 * (t**2 + 1.0 / 12.0 / 256.0)
    np.testing.assert_allclose(sound[: 50 * 16], mean[: 50 * 16], rtol=2e-6)


def sin_4(t_s: np.ndarray, width_s: float) -> np.ndarray:
    """The integral up to t of sin(pi t/width)^4, which begins and ends as smoothly as t^4."""
    x = math.pi * np.clip(t_s / width_s, 0.0, 1.0)
    return width_s / math.pi * (3.0 * x / 8.0 - np.sin(2.0 * x) / 4.0 + np.sin(4.0 * x) / 32.0)


def test_a_smooth_force_is_met_to_the_third_order_at_least() -> None:
    errors: list[float] = []
    for rate_Hz in (1000.0, 2000.0, 4000.0):
        player = Player()
        forces = np.diff(sin_4(np.arange(round(0.012 * rate_Hz) + 1) / rate_Hz, 0.012)) * rate_Hz
        player.push(0, [*forces, 0.0], 5 * MS, rate_Hz)
        sound = player.play(30 * MS)
        ends = np.arange(len(sound) + 1) * player.step_s - 0.005
        errors.append(float(np.sqrt(np.mean((sound - np.diff(sin_4(ends, 0.012)) / player.step_s) ** 2))))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 2.9).all(), (errors, orders)


@pytest.mark.parametrize(
    ("rate_Hz", "top_Hz", "most"), [(1000, 250, 0.03), (1000, 500, 0.06), (4000, 1000, 0.01)]
)
def test_it_sounds_as_the_half_sine_that_it_samples(rate_Hz: int, top_Hz: int, most: float) -> None:
    """Below a quarter of the servo's rate to 3 %, below half of it to 6 %: there is nothing to know beyond."""
    scene = Scene("drum")
    from drumstick.drum.calibrate import strike_for_speed

    blow = dataclasses.replace(strike_for_speed(scene, 1.0, 0.5, 0.0, 0.0503), impulse_N_s=0.0)
    analytic = np.fft.rfft(render(scene, [blow], 0.5, 48000)[:, 0])
    first, forces = half_sine(rate_Hz, blow.t_s, blow.contact_s, blow.peak_N)
    press = StreamedContact(first, rate_Hz, blow.x, blow.y, forces)
    sound = np.fft.rfft(render(streamed(), [], 0.5, 48000, [press])[:, 0])
    band = np.fft.rfftfreq(24000, 1.0 / 48000) < top_Hz
    error = np.linalg.norm((sound - analytic)[band]) / np.linalg.norm(analytic[band])
    assert error < most


def test_dense_samples_are_the_analytic_blow() -> None:
    """At the mesh's own rate and phase a sample is the mean over its step, as the analytic force is."""
    scene = Scene("drum")
    from drumstick.drum.calibrate import strike_for_speed

    blow = dataclasses.replace(strike_for_speed(scene, 1.0, 0.5, 0.0, 0.05), impulse_N_s=0.0)
    analytic = render(scene, [blow], 0.3, 48000)
    first, forces = half_sine(16000.0, blow.t_s, blow.contact_s, blow.peak_N)
    sound = render(streamed(), [], 0.3, 48000, [StreamedContact(first, 16000.0, blow.x, blow.y, forces)])
    assert np.linalg.norm(sound - analytic) < 2e-4 * np.linalg.norm(analytic)


def test_a_lost_end_is_held_then_faded_and_counted_once() -> None:
    player = Player()
    player.push(0, [1.0, 2.0, 2.0, 2.0], 10 * MS, 1000.0)  # the closing 0 never comes
    sound = player.play(40 * MS)
    after = sound[14 * 16 :]
    assert after[: round((HOLD_S - T) * 16000)] == pytest.approx(2.0, abs=0.05)
    assert np.abs(after[round((HOLD_S + FADE_S + 2 * T) * 16000) :]).max() == 0.0
    assert player.state["underflows"] == 1
    assert player.state["idle"] == 1
    player.push(100, [3.0, 0.0], 5 * MS, 1000.0)
    assert player.play(30 * MS).sum() * player.step_s == pytest.approx(3.0 * T)
    assert player.state["underflows"] == 1


def test_a_lost_piece_is_bridged_and_the_rest_is_as_it_was() -> None:
    whole, holed = Player(), Player()
    forces = 2.0 + np.sin(np.arange(30) / 3.0)
    for player in (whole, holed):
        player.push(0, forces[:10], 5 * MS, 1000.0)
        if player is whole:
            player.push(10, forces[10:12], 15 * MS, 1000.0)
        player.push(12, [*forces[12:], 0.0], 17 * MS, 1000.0)
    both = whole.play(60 * MS), holed.play(60 * MS)
    differs = np.flatnonzero(np.abs(both[0] - both[1]) > 1e-9)
    assert differs.min() >= (5 + 10 - 2) * 16
    assert differs.max() < (5 + 12 + 2) * 16
    assert (whole.state["underflows"], holed.state["underflows"]) == (0, 1)
    assert np.abs(both[1]).max() < 1.2 * np.abs(both[0]).max()


def test_what_comes_after_its_time_is_left_out_and_counted() -> None:
    player = Player()
    player.push(0, [1.0, 1.0, 1.0, 1.0], 0, 1000.0)
    player.play(2 * MS)
    player.push(0, [5.0, 5.0], 0, 1000.0)
    player.push(4, [0.0], 2 * MS, 1000.0)
    assert player.play(20 * MS).max() < 1.5
    assert player.state["late"] >= 2


def test_a_press_sounds_as_it_comes_and_as_it_goes_and_is_silent_while_the_stick_lies_in_the_head() -> None:
    """A dead stroke: it swings in to 2 N, lies there for two seconds, and is lifted within 5 ms."""
    t = np.arange(2000) * T
    lying = 2.0 * (1.0 - np.exp(-t / 0.003) * np.cos(2.0 * np.pi * t / 0.012))
    forces = np.concatenate([lying, 2.0 * (1.0 - np.arange(1, 6) / 6.0), [0.0]])
    sound = render(streamed(), [], 3.5, 48000, [StreamedContact(100, 1000.0, 0.3, 0.1, forces)])
    coming, lies, lifted, after = (
        float(np.abs(sound[round(48000 * begin) : round(48000 * end)]).max())
        for begin, end in ((0.1, 0.2), (1.8, 2.0), (2.1, 2.2), (3.3, 3.5))
    )
    assert coming > 0.01
    assert lies < 1e-3 * coming
    assert lifted > 0.1 * coming
    assert after < 1e-3 * coming


def test_two_contacts_in_quick_succession_are_the_sum_of_both() -> None:
    """A flam, and two that share a tick: the same as each by itself, added."""
    _, forces = half_sine(1000.0, 0.0, 0.0055, 4.0)
    sounds: list[np.ndarray] = []
    for starts in ([0, 4], [0], [4]):
        player = Player()
        player.push(-1 + 1, [0.0], 10 * MS, 1000.0)  # the grid, for all three
        for start in starts:
            player.push(start, forces, (10 + start) * MS, 1000.0)
        sounds.append(player.play(40 * MS))
    np.testing.assert_allclose(sounds[0], sounds[1] + sounds[2], atol=1e-12)


@pytest.mark.parametrize("off_ns", [-1, 0, 1])
def test_a_contact_is_at_its_place_from_the_first_newton_to_the_last(off_ns: int) -> None:
    """Ticks and steps of the mesh begin together, to a nanosecond; the contact before it was elsewhere."""
    player = Player()
    player.push(0, [2.0, 3.0, 0.0], 5 * MS, 1000.0)
    player.play(20 * MS)
    forces = np.float32([2.0, 5.0, 1.0, 0.0])
    assert player.feed.push(1, 25, player.now_ns + 5 * MS + off_ns, 1e6, -0.5, 0.2, forces)
    junctions: set[int] = set()
    force, impulse = np.zeros(1), 0.0
    for _ in range(20 * 16):
        pressed(player.engine, player.now_ns, force)
        player.now_ns += round(player.step_s * 1e9)
        impulse += force[0] * player.step_s
        listed = player.engine.forces[: int(player.engine.control["forces"][0])]
        junctions |= {int(entry["junction"]) for entry in listed}
    assert impulse == pytest.approx(8.0 * T)
    assert len(junctions) == 1


def test_another_servo_starts_anew_whatever_its_ticks_are() -> None:
    player = Player()
    player.push(1_000_000, [2.0] * 20, 5 * MS, 1000.0, epoch=7)
    player.play(10 * MS)
    player.push(3, [1.0, 1.0, 0.0], 5 * MS, 1000.0, epoch=8)
    sound = player.play(40 * MS)
    assert sound[5 * 16 :].sum() * player.step_s == pytest.approx(2.0 * T, rel=1e-9)
    assert player.state["epoch"] == 8
    assert player.state["resyncs"] == 0


@pytest.mark.parametrize("drift", [-0.02, 0.02])
def test_a_servo_whose_clock_drifts_far_is_caught_up_with(drift: float) -> None:
    """A press of ten seconds by a servo 2 % quicker or slower: never more than 60 ms behind, and mostly unbroken."""
    player = Player()
    behind: list[float] = []
    for tick in range(0, 10_000, 2):
        due_ns = round(tick * MS * (1.0 + drift)) + 1020 * MS
        while player.now_ns < due_ns - 8 * MS:
            player.play(MS)
        player.push_at(tick, [3.0, 3.0], due_ns, 1000.0)
        state = player.state
        if state["idle"] == 0:
            plays_ns = player.now_ns + (tick - state["tick"] - state["inside"]) * MS
            behind.append((plays_ns - due_ns) / MS)
    assert np.abs(behind).max() < 60.0
    forces = np.concatenate(player.sounds)
    assert np.mean(np.abs(forces - 3.0) < 0.3) > 0.8


def test_far_numbers_do_no_harm() -> None:
    player = Player()
    for first in (0, 2**53 - 1, 5, 2**52):
        player.push(first, [1e4] * 40, 5 * MS, 1000.0)
        assert np.isfinite(player.play(10 * MS)).all()


def test_the_hardest_force_leaves_the_mesh_finite_and_the_sound_limited() -> None:
    rng = np.random.default_rng(5)
    press = StreamedContact(10, 1000.0, 0.3, 0.1, rng.choice([-1e4, 1e4], 2000))
    sound = render(streamed(), [], 2.5, 48000, [press])
    assert np.isfinite(sound).all()
    assert np.abs(sound).max() <= 1.0
    assert np.abs(sound[-4800:]).max() > 0.0


def test_a_scene_that_does_not_stream_has_none_of_it() -> None:
    engine = new_engine(Scene("drum"), 48000, StrikeRing())
    assert engine.stream is None
    with pytest.raises(ValueError, match="does not stream"):
        render(Scene("drum"), [], 0.1, 48000, [StreamedContact(0, 1000.0, 0.0, 0.0, np.ones(3))])
    more = StreamedContact(0, 500.0, 0.0, 0.0, np.ones(3))
    with pytest.raises(ValueError, match="different rates"):
        render(streamed(), [], 0.1, 48000, [StreamedContact(0, 1000.0, 0.0, 0.0, np.ones(3)), more])


def test_the_head_wakes_for_a_stream_and_sleeps_after_it() -> None:
    scene = streamed()
    scene = dataclasses.replace(scene, drum=dataclasses.replace(scene.drum, t60_s=0.05))
    engine: Engine = new_engine(scene, 48000, StrikeRing())
    out = np.zeros((48000, 2), np.float32)
    render_all(engine, out[:480], 128, 1_000_000_000)
    assert engine.control["asleep"][0] == 1
    assert engine.stream is not None
    Feed(engine.stream).push(1, 0, 1_020_000_000, 1e6, 0.3, 0.1, np.float32([4.0, 4.0, 0.0]))
    before = allocations()
    render_all(engine, out[:2400], 128, 1_010_000_000)
    few = allocations() - before
    assert np.abs(out[:2400]).max() > 0.0
    before = allocations()
    render_all(engine, out, 128, 1_060_000_000)
    assert allocations() - before == few  # none for each of 375 blocks
    assert engine.control["asleep"][0] == 1
    assert not engine.head.time_levels.any()
