"""The servo's hard ticks, beside the loop that one writes first: difference the positions, clamp the force, go on."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import live_sets
import sampled_arm
from drumstick.safety import envelope
from drumstick.scenes.table import Refusal
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from haptic_server.block_header import ARM
from haptic_server.records import EVENT, NO_FAULT, NOT_A_NUMBER, RELEASE, STALLED
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from haptic_server.servo.force.velocity import follow, new_track
from haptic_server.servo.simulation import phantom
from live_sets import PERIOD_NS, T
from realtime import ring
from realtime.atomics import poke
from stability.catalogue import shows

COUNT_M, MAX_N = 3e-5, 8.5
K, R = 3500.0, 2.5  # of the sampled arm's head


@shows("speed from encoder counts")
def test_a_difference_of_counts_buzzes_and_the_window_is_calm_and_hardly_later() -> None:
    """Held still with a quarter of a count of noise; then a blow of 15 ms. What the damper makes of it is felt."""
    chance, t = np.random.default_rng(8), np.arange(4000) * T

    def counted(z: np.ndarray) -> np.ndarray:
        return COUNT_M * np.round((z + chance.normal(0.0, 0.25 * COUNT_M, len(z))) / COUNT_M)

    def told(z: np.ndarray) -> np.ndarray:
        track = new_track()
        return np.array([follow(track[0], i * T, float(at), COUNT_M) for i, at in enumerate(z)])[1:]

    still = counted(np.full(len(t), 1.3e-5))
    plain, window = np.diff(still) / T, told(still)
    assert np.max(np.abs(R * plain)) > 0.05  # N, and another sign from tick to tick
    assert np.sqrt(np.mean(window**2)) < 0.25 * np.sqrt(np.mean(plain**2))
    w = math.pi / 0.015
    swung = counted(0.5 / w * np.sin(w * t[:200]))
    true = 0.5 * np.cos(w * (t[1:200] - 0.5 * T))
    late = np.sqrt(np.mean((told(swung) - true)[16:] ** 2))
    assert late < 0.12 * 0.5
    # Filtered by one pole until it is as calm at rest, the plain difference is late by a large part of the contact.
    smooth, filtered = 0.0, list[float]()
    for v in np.diff(swung) / T:
        smooth += 0.12 * (v - smooth)
        filtered.append(smooth)
    assert np.sqrt(np.mean((np.array(filtered) - true)[16:] ** 2)) > 4.0 * late


def _plain_forces(positions: npt.ArrayLike) -> list[float]:
    """Force of the plain loop for a position a tick: the head's spring and damper, the speed by the usual period."""
    forces, before = list[float](), float(np.asarray(positions)[0])
    for z in np.asarray(positions)[1:]:
        v, before = (float(z) - before) / T, float(z)
        forces.append(-K * z - R * v if z < 0.0 else 0.0)
    return forces


def _pushing() -> tuple[memory.Servo, int]:
    # A servo whose arm is pressed into the head right now, and the time of its last tick.
    servo = sampled_arm.servo_of(sampled_arm.scene("press"))
    now = loop.run_virtual(servo, 1000, 0)
    while not servo.tick_state[0]["force_N"] > 0.3:
        now = loop.run_virtual(servo, 1, now)
    return servo, now


def _force(servo: memory.Servo, now_ns: int, span_s: float, **told: float) -> float:
    reading = servo.reading[0]
    phantom.measure(servo.plant[0], reading, now_ns)
    for name, value in told.items():
        reading[name] = value
    return sampled_arm.render_once(servo, reading, now_ns, span_s)


@shows("NaN from the device")
def test_a_position_that_is_no_number_passes_comparisons_and_not_the_guard() -> None:
    """z < lowest, z < 0 and z > highest are all false of it: no fault, no contact; and a filter never recovers."""
    smooth, forces = 0.0, list[float]()
    for z in (-1e-3, math.nan, -1e-3, -1e-3):
        fault = z < -0.1 or z > 0.3
        smooth += 0.5 * (z - smooth)  # a filtered position
        pushed = -K * smooth if smooth < 0.0 else 0.0
        forces.append(min(max(pushed, -MAX_N), MAX_N))
        assert not fault
    assert forces[0] > 1.0
    assert forces[1:] == [0.0] * 3  # the head has gone for good, and nobody is told

    servo, now = _pushing()
    assert _force(servo, now + PERIOD_NS, T, z_m=math.nan) == 0.0
    assert servo.tick_state[0]["fault"] == NOT_A_NUMBER
    poke(servo.block.control, ARM, 1)
    loop.run_virtual(servo, 3000, now + 2 * PERIOD_NS)
    assert servo.tick_state[0]["fault"] == NO_FAULT
    assert np.max(servo.trace["force_N"]) > 0.3  # armed again by hand, it plays on


@shows("stall")
@pytest.mark.parametrize("stall_ms", range(1, 31))
def test_after_a_stall_nothing_kicks(stall_ms: int) -> None:
    """The hand went on at 0.2 m/s, into the head. Over the usual period that is up to 6 m/s: a kick by the damper."""
    servo, now = _pushing()
    z, before = float(servo.plant[0]["z_m"]), float(servo.tick_state[0]["force_N"])
    below = z - 0.2 * stall_ms * T
    # The plain loop on such a way: a tick each ms up to the stall and after it. Its damper takes the stall's way for
    # that of a tick, and lets go on the next: a blow that neither hand nor head gave.
    at_ms = np.concatenate([np.arange(5.0), 4.0 + stall_ms + np.arange(5.0)])
    forces = np.array(_plain_forces(-1e-3 - 0.2 * T * at_ms))
    kicks = np.diff(forces) - K * 0.2 * T * np.diff(at_ms)[1:]  # what the spring does not account for
    blow = R * 0.2 * (stall_ms - 1)
    assert kicks == pytest.approx([0.0] * 3 + [blow, -blow] + [0.0] * 3, abs=1e-9)
    assert (blow > MAX_N) == (stall_ms > 18)
    span_s = stall_ms * T
    force = _force(servo, now + stall_ms * PERIOD_NS, span_s, z_m=below)
    assert servo.tick_state[0]["fault"] == (STALLED if stall_ms > 20 else NO_FAULT)
    if stall_ms > 5:
        assert force == 0.0
        for tick in range(1, 60):  # it is still in the head: nothing pushes before it was above
            assert _force(servo, now + (stall_ms + tick) * PERIOD_NS, T, z_m=below) == 0.0
    else:
        # What the spring and the true speed ask for, grown no faster than 20 N a tick.
        assert force <= min(MAX_N, before + 20.0)
        assert force <= K * (0.5 * T * 0.2 - min(below, 0.0)) * 1.3 + 2.0 * R * 0.2 + before


@shows("parameter jump in contact")
def test_a_stiffness_that_jumps_in_contact_gives_energy_and_one_that_waits_does_not() -> None:
    """From 5000 to 15000 N/m at the deepest point: out at the root of three times the speed."""
    scene = live_sets.roll()
    law, motion = law_of(scene), thrown(scene, -1.0)
    law["r_in"] = law["r_out"] = 0.0
    while exact.advance(law[0], motion[0], 1.0)[0] != exact.TURN:
        pass
    law["k_coll"] *= 3.0
    while exact.advance(law[0], motion[0], 1.0)[0] != exact.RELEASE:
        pass
    assert motion["v_out"][0] > 1.6

    left: list[bytes] = []
    for jumps in (False, True):
        servo, out, now = live_sets.servo_of(scene), np.zeros(4096, EVENT), 0
        now = loop.run_virtual(servo, 1000, now)
        while not (servo.motion["contact_phase"][0] == exact.CONTACT and servo.motion["v"][0] > 0.0):
            now = loop.run_virtual(servo, 1, now)
        ring.drain(servo.block.ring_cells, servo.block.events, out)
        if jumps:
            live_sets.offer(servo, 1, live_sets.changed(servo.law, scene, {"k_coll": 15000.0, "r_in": 5.0}))
        while servo.motion["contact_phase"][0] == exact.CONTACT:
            assert servo.law["k_coll"][0] == 5000.0
            now = loop.run_virtual(servo, 1, now)
        events = out[: ring.drain(servo.block.ring_cells, servo.block.events, out)]
        left.append(events[events["kind"] == RELEASE].tobytes())
        loop.run_virtual(servo, 20, now)
        assert servo.law["k_coll"][0] == (15000.0 if jumps else 5000.0)
    assert left[0] == left[1]


@shows("negative damping behind a clamp")
def test_a_clamp_does_not_tame_negative_damping_and_the_envelope_refuses_it() -> None:
    """R_in = -5 N s/m on an arm of 75 g that a light hand holds down: |F| <= 8 N holds, and it hammers for ever."""
    z, v, dt_s, hits, saturated = 0.01, 0.0, 1e-4, 0, 0
    heights: list[float] = []
    for _ in range(100_000):
        asked = -K * z + 5.0 * v if z < 0.0 else 0.0
        force = min(max(asked, -8.0), 8.0)
        saturated += force != asked
        hand = -1.0 - 0.1 * v
        v += dt_s * (force + hand) / 0.075
        was, z = z, z + dt_s * v
        hits += was >= 0.0 > z
        heights.append(z)
    assert hits > 20  # in ten seconds
    assert saturated > 0.05 * len(heights)
    assert max(heights[-20_000:]) > 5.0 * 0.01  # higher than it was dropped from
    played = sampled_arm.scene()
    law = law_of(played)
    law["r_in"] = -5.0
    with pytest.raises(Refusal, match="r_in"):
        envelope.require(law, live_sets.limits_for(played))


def _strikes(clock: type[np.number[Any]], start: float, tick: float, every: float) -> list[int]:
    """The ticks at which a loop strikes that counts its time in `clock`, and strikes when the next time has come."""
    with np.errstate(over="ignore"):
        now, step, apart = clock(start), clock(tick), clock(every)
        due, struck = now + apart, list[int]()
        for i in range(4000):
            now = now + step
            if now >= due:
                struck.append(i)
                due = due + apart
    return struck


@shows("month of ticks", "naive")
def test_usual_clocks_burst_or_stand_still_within_a_month() -> None:
    """A stroke each 40 ms. Milliseconds in 32 bits wrap after 24.9 days; float32 seconds stand still after 4.6 h."""
    on_time = list(range(39, 4000, 40))
    wraps_ms, month_s = 2**31, 30 * 86_400
    assert 1000 * month_s > wraps_ms
    assert _strikes(np.int32, 0, 1, 40) == on_time
    # From where the next time has wrapped one at every tick; then none, until the clock has come as far.
    apart = np.diff(_strikes(np.int32, wraps_ms - 2030, 1, 40))
    assert np.count_nonzero(apart == 1) > 20
    assert np.max(apart) > 800
    assert apart[0] == apart[-1] == 40
    assert _strikes(np.float32, 0.0, 2.0**-10, 40 * 2.0**-10) == on_time
    assert not _strikes(np.float32, 4.6 * 3600.0, 2.0**-10, 40 * 2.0**-10)
    # After a month even the next time rounds to now.
    assert _strikes(np.float32, month_s, 2.0**-10, 40 * 2.0**-10) == list(range(4000))
    summed = 0.0  # an hour of adding the period
    for _ in range(3_600_000):
        summed += 0.001
    assert abs(summed - 3600.0) > 1e-9
    assert _strikes(np.int64, month_s * 10**9, 10**6, 40 * 10**6) == on_time
