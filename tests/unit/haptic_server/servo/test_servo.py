"""The servo's tick in virtual time: the live rig plays what `exact` predicts, and is never talked into nonsense."""

import numpy as np
import pytest

from drumstick.parameters.scene import Scene
from drumstick.safety import envelope
from drumstick.safety.entry_speed import entry_speed
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from drumstick.stick.motion import exact
from drumstick.stick.simulate import simulate
from haptic_server import block as blocks
from haptic_server import block_header
from haptic_server.records import EVENT, PANIC, PLAYING, RELEASE, STRIKE, set_type
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from realtime import ring, triple_buffer
from realtime.atomics import add_to, poke
from realtime.kernels.jit import allocations


def scene(name: str = "roll", rate_hz: int = 1000) -> Scene:
    return parse(shipped_text(name) + f"\n[servo]\nrate_Hz = {rate_hz}\n", name)


def servo_of(played: Scene) -> memory.Servo:
    return memory.prepare(played, blocks.in_memory(law_of(played)))


def events_of(servo: memory.Servo) -> np.ndarray:
    out = np.zeros(blocks.RING_SLOTS, EVENT)
    return out[: ring.drain(servo.block.ring_cells, servo.block.events, out)]


def offer(servo: memory.Servo, revision: int, **changes: float) -> None:
    wanted = np.zeros(1, set_type(servo.law.dtype))
    wanted["revision"] = revision
    wanted["law"] = servo.law
    for name, value in changes.items():
        owner = wanted["law"]["pulse"] if name in ("dv_pls", "tau") else wanted["law"]
        owner[name] = value
    triple_buffer.publish(servo.block.wanted_cells, servo.block.wanted, wanted[0])


@pytest.mark.parametrize("rate_hz", [500, 1000, 4000])
@pytest.mark.parametrize("name", ["roll", "paper-roll"])
@pytest.mark.daily("roll-*")
def test_the_live_stick_plays_what_exact_predicts(name: str, rate_hz: int) -> None:
    played = scene(name, rate_hz)
    servo = servo_of(played)
    loop.run_virtual(servo, 2 * rate_hz, 0)
    events = events_of(servo)
    expected = simulate(played, 2.0, played.hand.throw_m_per_s).contacts
    strikes, releases = events[events["kind"] == STRIKE], events[events["kind"] == RELEASE]
    n = len(expected) - 1
    assert n > 40
    assert strikes["seq"][:n].tolist() == list(range(1, n + 1))
    np.testing.assert_allclose(strikes["t_ns"][:n] * 1e-9, expected[:n, 0], atol=2e-9)
    np.testing.assert_allclose(strikes["speed_m_per_s"][:n], -expected[:n, 1], rtol=1e-9)
    np.testing.assert_allclose(releases["speed_m_per_s"][:n], expected[:n, 3], rtol=1e-9)
    np.testing.assert_allclose(releases["peak_N"][:n], expected[:n, 5], rtol=1e-9)
    np.testing.assert_allclose(releases["impulse_N_s"][:n], expected[:n, 6], rtol=1e-9)


def test_a_tick_allocates_nothing() -> None:
    servo = servo_of(scene())
    start = allocations()
    loop.run_virtual(servo, 1, 0)
    one = allocations()
    loop.run_virtual(servo, 100_000, 1_000_000)
    assert allocations() - one == one - start  # what the call from Python costs, whatever the number of ticks


def test_a_set_waits_until_the_stick_is_above_the_head() -> None:
    servo = servo_of(scene())
    now = 0
    while servo.motion["contact_phase"][0] != exact.CONTACT:
        now = loop.run_virtual(servo, 1, now)
    offer(servo, 7, k_coll=8000.0)
    while servo.motion["contact_phase"][0] != exact.ABOVE or servo.motion["z"][0] <= 0.0:
        assert servo.law["k_coll"][0] == 5000.0
        now = loop.run_virtual(servo, 1, now)
    loop.run_virtual(servo, 1, now)
    assert servo.law["k_coll"][0] == 8000.0
    live = np.zeros(1, set_type(servo.law.dtype))
    assert triple_buffer.read_into(servo.block.live_cells, servo.block.live, live)
    assert live["revision"][0] == 7
    assert servo.tick_state["is_pending"][0] == 0, "it is used once"


@pytest.mark.parametrize(
    "changes",
    [
        {"m": 0.0}, {"m": -1.0}, {"m": np.nan}, {"k_coll": np.inf}, {"k_coll": 1e12}, {"r_in": -5.0}, {"r_in": 0.0},
        {"dv_pls": 1e6}, {"dv_pls": np.nan}, {"tau": 0.0}, {"tau": -0.0}, {"tau": 1e-300}, {"z_ss": np.inf},
        {"k_hand": -1.0}, {"m": 1e308}, {"r_out": np.nan}, {"dv_pls": 2.2},
    ],
)  # fmt: skip
def test_the_servos_own_fence_refuses_what_the_gateway_should_have(changes: dict[str, float]) -> None:
    servo = servo_of(scene())
    now = loop.run_virtual(servo, 500, 0)
    before = servo.law.copy()
    offer(servo, 3, **changes)
    loop.run_virtual(servo, 500, now)
    assert servo.law == before
    assert servo.status["refused"][0] == 1
    assert servo.status["refused_revision"][0] == 3
    assert servo.status["status"][0] == PLAYING
    assert np.isfinite(servo.motion["z"][0])


def test_a_longer_tau_in_mid_pulse_adds_no_speed() -> None:
    # Naively the push h/m would go on for the new tau: 0.2 m/s would become 0.2 * 100.
    servo = servo_of(scene())
    now = 0
    while not (servo.motion["pulse"]["acceleration"][0] > 10.0 and servo.motion["z"][0] > 0.0):
        now = loop.run_virtual(servo, 1, now)
    left = servo.motion["pulse"]["acceleration"][0] * servo.law["pulse"]["tau"][0]
    offer(servo, 1, tau=0.2)
    loop.run_virtual(servo, 1, now)
    assert servo.law["pulse"]["tau"][0] == 0.2
    assert servo.motion["pulse"]["acceleration"][0] * 0.2 == pytest.approx(left, rel=0.01)


def test_panic_stops_everything_until_armed() -> None:
    servo = servo_of(scene())
    now = loop.run_virtual(servo, 1000, 0)
    struck = int(servo.tick_state["seq"][0])
    add_to(servo.block.control, block_header.PANIC, 1)
    now = loop.run_virtual(servo, 5000, now)
    assert servo.tick_state["seq"][0] == struck
    assert servo.status["status"][0] == PANIC
    assert servo.status["force_N"][0] == 0.0
    poke(servo.block.control, block_header.ARM, 1)
    loop.run_virtual(servo, 1000, now)
    assert servo.tick_state["seq"][0] > struck
    assert servo.status["status"][0] == PLAYING


def test_a_servo_that_starts_held_shows_a_stick_at_rest_until_somebody_arms() -> None:
    played = scene()
    block = blocks.in_memory(law_of(played))
    poke(block.control, block_header.HELD, 1)
    servo = memory.prepare(played, block)
    now = loop.run_virtual(servo, 100, 0)
    assert servo.status["status"][0] == PANIC
    assert servo.status["v_m_per_s"][0] == servo.status["z_m"][0] == servo.status["force_N"][0] == 0.0
    poke(servo.block.control, block_header.ARM, 1)
    loop.run_virtual(servo, 1000, now)
    assert servo.status["status"][0] == PLAYING
    assert servo.tick_state["seq"][0] > 3


def test_nan_in_the_motion_is_a_latched_fault_on_the_same_tick() -> None:
    servo = servo_of(scene())
    now = loop.run_virtual(servo, 100, 0)
    servo.motion["v"] = np.nan
    now = loop.run_virtual(servo, 1, now)
    assert servo.status["fault"][0] != 0
    assert servo.status["force_N"][0] == 0.0
    loop.run_virtual(servo, 3000, now)
    assert servo.status["fault"][0] != 0, "a fault stays until somebody arms"


def test_a_dead_roll_is_thrown_again() -> None:
    servo = servo_of(scene())
    offer(servo, 1, dv_pls=0.0)
    loop.run_virtual(servo, 20_000, 0)
    strikes = events_of(servo)
    strikes = strikes[strikes["kind"] == STRIKE]
    gaps_s = np.diff(strikes["t_ns"]) * 1e-9
    throws = int(np.sum(gaps_s > 0.5))
    assert throws >= 5
    # Every throw starts alike: the same first strike, to the tick.
    firsts = strikes["speed_m_per_s"][1:][gaps_s > 0.5]
    np.testing.assert_allclose(firsts, firsts[0], rtol=1e-6)


def test_a_full_ring_drops_and_counts_and_the_tick_goes_on() -> None:
    servo = servo_of(scene())
    loop.run_virtual(servo, 400_000, 0)
    kept = len(events_of(servo))
    dropped = int(servo.block.ring_cells[ring.DROPPED])
    assert kept == blocks.RING_SLOTS
    total = 2 * int(servo.tick_state["seq"][0]) - (servo.motion["contact_phase"][0] != exact.ABOVE)
    assert kept + dropped == total


def test_a_set_that_would_turn_height_into_speed_waits_for_the_head() -> None:
    # Naively latched at the apex, a hand of 1e4 N/m would shoot the stick into the head at the square root of
    # K/m z (z - 2 z_ss), some 6 m/s from 5 mm.
    servo = servo_of(parse(shipped_text("roll") + "\n[guard]\nmax_speed_m_per_s = 6.0\n", "roll"))
    now = 0
    while not servo.motion["z"][0] > 0.005:
        now = loop.run_virtual(servo, 1, now)
    offer(servo, 1, k_hand=1500.0)
    now = loop.run_virtual(servo, 1, now)
    high = servo.motion["z"][0]
    assert high * (high + 0.04) * 1500.0 / 0.015 > 4.0**2
    assert (servo.tick_state["is_pending"][0], servo.law["k_hand"][0]) == (1, 20.0)
    wanted = servo.law.copy()
    wanted["k_hand"] = 1500.0
    fastest = envelope.judge(
        wanted[0], envelope.Limits(100.0, 6.0).record()[0], envelope.new_scratch()
    ).max_entry_speed
    assert entry_speed(wanted[0], high, 0.0) > fastest > entry_speed(wanted[0], 0.0, 0.5)
    events_of(servo)
    loop.run_virtual(servo, 2000, now)
    assert servo.law["k_hand"][0] == 1500.0, "taken at the next release at the latest"
    assert events_of(servo)["speed_m_per_s"].max() < 6.0


@pytest.mark.parametrize(
    "changes",
    [
        {"k_coll": 1.0, "k_hand": 0.0, "dv_pls": 0.0, "tau": 1.0},
        {
            "m": 1.0,
            "k_coll": 56.0,
            "r_in": 112.0,
            "k_hand": 0.0027,
            "r_out": 0.0023,
            "z_ss": 0.00078,
            "dv_pls": 0.03,
        },
        {"dv_pls": 0.0, "r_in": 50.0},
    ],
)
def test_whatever_was_set_the_next_set_is_latched_too(changes: dict[str, float]) -> None:
    servo = servo_of(scene())
    offer(servo, 1, **changes)
    now = loop.run_virtual(servo, 3000, 0)
    assert servo.tick_state["revision"][0] == 1
    servo.law["pulse"]["overlap"] = 0
    roll = law_of(scene())
    offered = np.zeros(1, set_type(roll.dtype))
    offered["revision"] = 2
    offered["law"] = roll
    triple_buffer.publish(servo.block.wanted_cells, servo.block.wanted, offered[0])
    loop.run_virtual(servo, 20_000, now)
    assert servo.tick_state["revision"][0] == 2
    assert servo.status["status"][0] == PLAYING


def test_a_buzz_cannot_take_the_tick_over() -> None:
    # Entry pulses that throw the stick back before it compresses the head: thousands of contacts a second.
    played = parse(shipped_text("paper-roll"), "paper-roll")
    servo = servo_of(played)
    servo.law["m"] = 1e-4  # past the envelope, as if both fences had failed
    servo.law["k_coll"] = 1e6
    servo.law["pulse"]["dv_pls"] = 0.004
    loop.run_virtual(servo, 10_000, 0)
    out = np.zeros(blocks.RING_SLOTS, EVENT)
    count = ring.drain(servo.block.ring_cells, servo.block.events, out)
    per_tick = np.bincount((out["t_ns"][:count] // 1_000_000).astype(np.int64))
    assert per_tick.max() <= 65


def test_panic_in_contact_ends_the_strikes_note() -> None:
    servo = servo_of(scene())
    now = 0
    while servo.motion["contact_phase"][0] != exact.CONTACT:
        now = loop.run_virtual(servo, 1, now)
    add_to(servo.block.control, block_header.PANIC, 1)
    loop.run_virtual(servo, 1, now)
    events = events_of(servo)
    assert events["kind"][-1] == RELEASE
    assert events["seq"][-1] == events["seq"][-2]
    assert events["speed_m_per_s"][-1] == 0.0


@pytest.mark.long
def test_half_an_hour_of_ticks_keeps_the_rate_to_a_part_in_a_million() -> None:
    servo = servo_of(scene())
    far = 2**62  # later than any uptime: no counter may wrap
    now = loop.run_virtual(servo, 10_000, far)
    early = float(servo.status["roll_rate_Hz"][0])
    loop.run_virtual(servo, 1_800_000, now)
    assert float(servo.status["roll_rate_Hz"][0]) == pytest.approx(early, rel=1e-6)
    assert servo.status["tick"][0] == 1_810_000
