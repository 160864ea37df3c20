import ctypes
import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drumstick.drum.block import render_all
from drumstick.drum.build import describe_renderer
from drumstick.drum.calibrate import PEAK_OF_FULL_SCALE, build, full_scale, strike_for_speed
from drumstick.drum.engine import PENDING, Engine
from drumstick.drum.memory.strikes import OfflineStrike, StrikeRing
from drumstick.drum.output.limiter import limited
from drumstick.drum.output.upsample import TAPS
from drumstick.drum.render import render
from drumstick.drum.tiers import divisor_for
from drumstick.parameters.scene import Scene
from realtime.kernels.jit import allocations
from sound_server.mixer import Mixer
from sound_server.sinks.callback import CallbackData, block_start, stream_callback
from sound_server.sinks.load_meter import noted
from sound_server.sinks.sink import NOTED, SINK_COUNTERS

RATE = 48000
SCENE = Scene("drum")


def drum(
    f01_Hz: float = 150.0, t60_s: float = 1.2, accuracy: str = "standard", gain_dB: float = 0.0
) -> Scene:
    return dataclasses.replace(
        SCENE,
        drum=dataclasses.replace(SCENE.drum, f01_Hz=f01_Hz, t60_s=t60_s),
        mesh=dataclasses.replace(SCENE.mesh, accuracy=accuracy),
        listen=dataclasses.replace(SCENE.listen, gain_dB=gain_dB),
    )


@given(st.floats(-1e30, 1e30))
def test_the_limiter_is_clear_below_the_knee_and_never_exceeds_full_scale(x: float) -> None:
    y = limited(x)
    assert abs(y) <= 1.0
    assert y == x if abs(x) <= 0.75 else 0.75 <= abs(y) <= abs(x)
    assert math.copysign(1.0, y) == math.copysign(1.0, x)


def test_the_limiter_has_no_corner() -> None:
    x = np.linspace(0.7, 0.8, 1001)
    slope = np.diff([limited(v) for v in x]) / np.diff(x)
    assert np.abs(np.diff(slope)).max() < 1e-3


@pytest.mark.parametrize("f01_Hz", [40.0, 150.0, 900.0])
@pytest.mark.parametrize("accuracy", ["draft", "fine"])
def test_a_full_scale_strike_peaks_at_about_half(f01_Hz: float, accuracy: str) -> None:
    scene = drum(f01_Hz, accuracy=accuracy)
    sound = render(scene, [full_scale(scene)], 0.3, RATE)
    assert 0.8 * PEAK_OF_FULL_SCALE < np.abs(sound).max() < 1.7 * PEAK_OF_FULL_SCALE


def test_gain_and_speed_scale_the_sound() -> None:
    loud = render(drum(), [strike_for_speed(SCENE, 1.0, 0.5, 0.0)], 0.1, RATE)
    assert np.allclose(
        render(drum(), [strike_for_speed(SCENE, 0.5, 0.5, 0.0)], 0.1, RATE), loud / 2.0, atol=1e-6
    )
    assert np.allclose(
        render(drum(gain_dB=-6.0206), [strike_for_speed(SCENE, 1.0, 0.5, 0.0)], 0.1, RATE),
        loud / 2.0,
        atol=1e-5,
    )


def test_there_is_no_constant_part() -> None:
    sound = render(drum(), [full_scale(SCENE)], 3.0, RATE)
    assert np.abs(sound.mean(axis=0)).max() < 1e-5


def test_onsets_are_kept_to_less_than_a_sample() -> None:
    """A strike half a device sample later is the same sound half a sample later: phase, not level, tells."""
    early = render(drum(), [OfflineStrike(0.0100, 0.5, 0.0, 5.0, 0.005)], 0.2, RATE)[:, 0].astype(np.float64)
    later = render(drum(), [OfflineStrike(0.0100 + 0.5 / RATE, 0.5, 0.0, 5.0, 0.005)], 0.2, RATE)[
        :, 0
    ].astype(np.float64)
    turn = np.fft.rfft(later * np.hanning(len(later))) / np.fft.rfft(early * np.hanning(len(early)))
    f = np.fft.rfftfreq(len(early), 1.0 / RATE)
    near = np.argmin(np.abs(f - 150.0))
    assert -np.angle(turn[near]) / (2.0 * np.pi * f[near]) * RATE == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("block", [1, 37, 128, 5000])
def test_the_block_size_changes_nothing(block: int) -> None:
    outs: list[object] = []
    for size in (block, 128):
        ring = StrikeRing()
        engine = build(drum(), RATE, ring)
        ring.push(1_000_000_000 + 3_210_000, 0.3, 0.3, 5.0, 0.004)
        out = np.zeros((5000, 2), np.float32)
        render_all(engine, out, size, 1_000_000_000)
        outs.append(out)
    # A block's start is rounded to 1 ns, and the onset with it.
    assert np.allclose(outs[0], outs[1], atol=2e-5)


def test_rendering_allocates_nothing() -> None:
    ring = StrikeRing()
    engine = build(drum(), RATE, ring)
    out = np.zeros((48000, 2), np.float32)
    render_all(engine, out[:128], 128, 0)
    counts: list[int] = []
    for frames in (128, 48000):
        ring.push(0, 0.3, 0.3, 5.0, 0.004)
        before = allocations()
        render_all(engine, out[:frames], 128, 0)
        counts.append(allocations() - before)
    # The call from Python wraps its arrays once; 375 blocks more must not add to that.
    assert counts[0] == counts[1]
    assert np.abs(out).max() > 0.01


def test_a_head_at_rest_falls_asleep_at_exactly_zero_and_wakes() -> None:
    ring = StrikeRing()
    engine = build(drum(t60_s=0.05), RATE, ring)
    out = np.zeros((RATE, 2), np.float32)
    ring.push(0, 0.3, 0.3, 5.0, 0.004)
    render_all(engine, out, 128, 0)
    assert engine.control["asleep"][0] == 1
    assert not engine.head.time_levels.any()
    first = out.copy()
    ring.push(0, 0.3, 0.3, 5.0, 0.004)
    render_all(engine, out, 128, 0)
    assert np.abs(out).max() == pytest.approx(np.abs(first).max(), rel=1e-3)


def test_a_flood_of_strikes_waits_without_loss_and_keeps_playing() -> None:
    ring = StrikeRing()
    engine = build(drum(), RATE, ring)
    out = np.zeros((128, 2), np.float32)
    late_ns = 10_000_000_000
    for _ in range(2):
        for _ in range(PENDING):
            assert ring.push(late_ns, 0.0, 0.0, 1.0, 0.001)
        render_all(engine, out, 128, 1_000_000_000)
    assert engine.control["pending"][0] == PENDING  # the waiting list is full, the rest stays in the ring
    assert not ring.push(late_ns, 0.0, 0.0, 1.0, 0.001)
    render_all(engine, out, 128, late_ns)
    assert engine.control["begun"][0] == PENDING
    render_all(engine, out, 128, late_ns)
    assert engine.control["begun"][0] == 2 * PENDING


@pytest.mark.parametrize(
    ("f01_Hz", "accuracy", "divisor"), [(150.0, "draft", 4), (150.0, "standard", 3), (150.0, "fine", 2)]
)
def test_accuracy_sets_the_rate_of_the_mesh(f01_Hz: float, accuracy: str, divisor: int) -> None:
    assert divisor_for(drum(f01_Hz, accuracy=accuracy), RATE) == divisor


def test_a_high_drum_gets_a_faster_mesh_and_a_very_low_one_a_slower() -> None:
    assert divisor_for(drum(1000.0), RATE) == 1
    low = divisor_for(drum(20.0, accuracy="fine"), RATE)
    assert low > 4
    engine = build(drum(20.0, accuracy="fine"), RATE, StrikeRing())
    assert np.count_nonzero(engine.head.weights) * RATE / low < 2.5e9
    assert f"at {RATE / low:g} Hz" in describe_renderer(engine)


def through_callback(engine: Engine, frames: int, block: int, channels: int) -> np.ndarray:
    """Samples that a device would get: the compiled C callback is called as PortAudio would call it."""
    counters = np.zeros(1, SINK_COUNTERS)
    counters["rate_Hz"], counters["channels"] = RATE, channels
    mixer = Mixer(RATE)
    heard = CallbackData(mixer, counters)
    call = ctypes.CFUNCTYPE(
        ctypes.c_int,
        *[ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p, ctypes.c_ulong, ctypes.c_void_p],
    )(stream_callback.address)
    out = np.full((frames, channels), 9.0, np.float32)
    assert call(None, out.ctypes.data, block, None, 0, heard.address) == 0
    assert not out[:block].any()  # silence before the first engine
    mixer.enter(engine)
    for start in range(0, frames, block):
        assert call(None, out[start : start + block].ctypes.data, block, None, 4, heard.address) == 0
    assert counters["xruns"][0] == counters["calls"][0] - 1 == frames // block
    assert counters["load"][0] > 0.0
    told = noted(counters)[1:]  # after the one before there was a drum
    assert len(told) == frames // block
    assert np.all(told[1:, 0] >= told[:-1, 0] + told[:-1, 1])  # one after another
    assert np.all(told[:, 2] == 1)  # struck once, in the first block
    return out


def test_the_devices_callback_plays_the_same_samples() -> None:
    sounds: list[np.ndarray] = []
    for channels in (0, 1, 2):
        ring = StrikeRing()
        engine = build(drum(), RATE, ring)
        ring.push(0, 0.3, 0.3, 5.0, 0.004)
        if channels:
            sounds.append(through_callback(engine, 6400, 128, channels))
        else:
            out = np.zeros((6400, 2), np.float32)
            render_all(engine, out, 128, 0)
            sounds.append(out)
    offline, mono, stereo = sounds
    assert np.array_equal(stereo, offline)
    assert np.allclose(mono[:, 0], [limited(x) for x in offline.mean(axis=1)], atol=1e-6)


def test_the_newest_blocks_are_told_of_oldest_first() -> None:
    counters = np.zeros(1, SINK_COUNTERS)
    assert noted(counters).shape == (0, 3)
    for call in range(NOTED + 5):
        counters["noted"][0, call % NOTED] = call
        counters["calls"] += 1
    assert noted(counters)[:, 0].tolist() == list(range(5, NOTED + 5))


def test_block_starts_follow_the_device_and_not_the_jitter_of_its_callbacks() -> None:
    counters = np.zeros(1, SINK_COUNTERS)
    counters["rate_Hz"] = RATE
    jitter = np.random.default_rng(3).integers(0, 1_000_000, 2000)
    true = 1_000_000_000 + (np.arange(2000) * 128 * 1e9 / (RATE * 1.0001)).astype(np.int64)
    starts = np.array([block_start(counters, int(t + j), 128) for t, j in zip(true, jitter, strict=True)])
    error = (starts - true)[500:]
    assert np.ptp(error) < 0.3 * np.ptp(jitter)
    assert block_start(counters, int(true[-1] + 10**9), 128) == true[-1] + 10**9  # after a stall: at once


@pytest.mark.parametrize("stood_still_ns", [8_000_000, -3_000_000])
def test_a_device_that_stood_still_is_followed_after_a_few_blocks(stood_still_ns: int) -> None:
    counters = np.zeros(1, SINK_COUNTERS)
    counters["rate_Hz"] = RATE
    true = 1_000_000_000 + (np.arange(400) * 64 * 1e9 / RATE).astype(np.int64)
    true[200:] += stood_still_ns
    jitter = np.random.default_rng(3).integers(0, 100_000, 400)
    starts = np.array([block_start(counters, int(t + j), 64) for t, j in zip(true, jitter, strict=True)])
    assert np.abs(starts - true)[208:].max() <= 120_000


def test_callbacks_that_are_late_for_a_while_move_nothing() -> None:
    counters = np.zeros(1, SINK_COUNTERS)
    counters["rate_Hz"] = RATE
    true = 1_000_000_000 + (np.arange(400) * 64 * 1e9 / RATE).astype(np.int64)
    late = np.where((np.arange(400) % 100) < 7, 2_000_000, 0)  # for most of 10 ms
    starts = np.array([block_start(counters, int(t + j), 64) for t, j in zip(true, late, strict=True)])
    assert np.abs(starts - true)[200:].max() <= 400_000


def test_blocks_that_come_sixteen_at_a_time_stay_in_their_time() -> None:
    counters = np.zeros(1, SINK_COUNTERS)
    counters["rate_Hz"] = RATE
    true = 1_000_000_000 + (np.arange(4000) * 64 * 1e9 / RATE).astype(np.int64)
    at_once = np.repeat(true[::16], 16) + np.tile(20_000 * np.arange(16), 250)
    starts = np.array([block_start(counters, int(t), 64) for t in at_once])
    assert np.ptp((starts - true)[2000:]) <= 1_000_000


def test_meters_fall_back_by_themselves() -> None:
    ring = StrikeRing()
    engine = build(drum(t60_s=0.05), RATE, ring)
    out = np.zeros((RATE, 2), np.float32)
    ring.push(0, 0.3, 0.3, 5.0, 0.004)
    render_all(engine, out[:2400], 128, 0)
    top = float(engine.meters["peak_left"][0])
    assert top == pytest.approx(np.abs(out[:2400, 0]).max(), rel=0.2)
    render_all(engine, out, 128, 0)
    assert engine.meters["peak_left"][0] < 0.1 * top
    assert TAPS > 0
