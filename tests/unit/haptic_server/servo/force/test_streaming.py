"""The force of each tick in contact, from servo to ring: it adds up to the impulse; nobody pays without a listener."""

import numpy as np
import pytest

import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.law import law_of
from drumstick.stick.motion import exact
from haptic_server import block as blocks
from haptic_server import contacts
from haptic_server.block_header import PANIC, BlockError
from haptic_server.contacts import LISTENED, SAMPLE, SLOTS, ContactRing
from haptic_server.records import EVENT, RELEASE, STRIKE
from haptic_server.servo import loop
from haptic_server.servo.force import memory
from realtime import ring
from realtime.atomics import add_to, poke
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import allocations, njit
from streamed_engine import STREAMS, streamed_text

PERIOD_NS = 1_000_000


def streamed(name: str = "roll", rate_hz: int = 1000) -> Scene:
    return parse(streamed_text(name) + f"\n[servo]\nrate_Hz = {rate_hz}\n", name)


def servo_of(played: Scene, listened: bool = True) -> memory.Servo:
    servo = memory.prepare(played, blocks.in_memory(law_of(played)))
    poke(ring_of(servo).cells, LISTENED, int(listened))
    return servo


def ring_of(servo: memory.Servo) -> ContactRing:
    assert servo.stream is not None
    return servo.stream.contacts


def samples_of(servo: memory.Servo) -> np.ndarray:
    out = np.zeros(SLOTS, SAMPLE)
    return out[: ring.drain(ring_of(servo).cells, ring_of(servo).slots, out)]


def events_of(servo: memory.Servo) -> np.ndarray:
    out = np.zeros(blocks.RING_SLOTS, EVENT)
    return out[: ring.drain(servo.block.ring_cells, servo.block.events, out)]


def compare_with_releases(samples: np.ndarray, events: np.ndarray, period_s: float) -> int:
    """Each contact's samples add up to the impulse that its release told; returns how many were looked at."""
    releases = events[events["kind"] == RELEASE]
    for release in releases:
        own = samples[samples["seq"] == release["seq"]]
        assert own["force_N"].sum() * period_s == pytest.approx(release["impulse_N_s"], rel=1e-12, abs=1e-15)
        assert np.diff(own["tick"]).tolist() == [1] * (len(own) - 1), "contiguous"
        assert own["force_N"][-1] == 0.0, "closed"
    return len(releases)


@pytest.mark.parametrize("rate_hz", [500, 1000, 4000])
@pytest.mark.parametrize("name", ["roll", "paper-roll"])
def test_a_contacts_samples_add_up_to_its_impulse(name: str, rate_hz: int) -> None:
    servo = servo_of(streamed(name, rate_hz))
    loop.run_virtual(servo, rate_hz, 5_000_000_000)
    samples, events = samples_of(servo), events_of(servo)
    assert compare_with_releases(samples, events, 1.0 / rate_hz) > 15
    # Each strike falls into the tick of its first sample.
    for strike in events[events["kind"] == STRIKE]:
        own = samples[samples["seq"] == strike["seq"]]
        first = own[0]
        assert -1 <= strike["t_ns"] - first["t_ns"] <= 1e9 / rate_hz + 1
        assert set(zip(own["x"], own["y"], strict=True)) == {(strike["x"], strike["y"])}, (
            "it is where it began"
        )
    assert np.ptp(samples["t_ns"] - samples["tick"] * (1_000_000_000 // rate_hz)) == 0
    assert ring_of(servo).cells[ring.DROPPED] == 0


def test_a_buzz_of_many_contacts_in_one_tick_keeps_every_impulse() -> None:
    servo = servo_of(streamed("paper-roll"))
    servo.law["m"] = 1e-4  # thrown back before the head is compressed, thousands of times a second
    servo.law["k_coll"] = 1e6
    servo.law["pulse"]["dv_pls"] = 0.004
    samples, events, now = [], [], 0
    for _ in range(200):
        now = loop.run_virtual(servo, 50, now)
        samples.append(samples_of(servo))
        events.append(events_of(servo))
    together = np.concatenate(samples)
    pressed = together[together["force_N"] > 0.0]
    assert np.bincount(pressed["tick"]).max() > 5
    assert compare_with_releases(together, np.concatenate(events), 1e-3) > 50
    assert ring_of(servo).cells[ring.DROPPED] == 0


@njit()
def tick_once(servo: memory.Servo, now_ns: int, span_s: float) -> None:
    loop.traced_tick(borrowed_view(servo), now_ns, span_s)


@pytest.mark.parametrize("ticks", [1, 4, 20])
def test_an_overrun_spreads_the_impulse_over_the_ticks_it_took(ticks: int) -> None:
    servo = servo_of(streamed())
    now = 0
    while servo.motion["contact_phase"][0] != exact.CONTACT:
        now = loop.run_virtual(servo, 1, now)
    first = int(samples_of(servo)["tick"][-1])
    now += ticks * PERIOD_NS
    tick_once(servo, now, ticks * 1e-3)
    late = samples_of(servo)
    late = late[late["seq"] == late["seq"][0]]
    inside = late[:ticks]["force_N"]
    assert late["tick"][:ticks].tolist() == list(range(first + 1, first + 1 + ticks))
    assert np.ptp(inside) < 1e-12 * inside.max()
    loop.run_virtual(servo, 20, now)
    samples, events = np.concatenate([late, samples_of(servo)]), events_of(servo)
    release = events[(events["kind"] == RELEASE) & (events["seq"] == late["seq"][0])]
    own = samples[samples["seq"] == late["seq"][0]]
    # All but what went out before, which this test took from the ring.
    assert own["force_N"].sum() * 1e-3 < release["impulse_N_s"][0]
    assert np.diff(own["tick"]).tolist() == [1] * (len(own) - 1)


def test_nobody_listens_and_nothing_is_written() -> None:
    servo = servo_of(streamed(), listened=False)
    loop.run_virtual(servo, 2000, 0)
    assert ring_of(servo).cells[ring.WRITTEN] == ring_of(servo).cells[ring.DROPPED] == 0
    assert not ring_of(servo).slots["seq"].any()
    poke(ring_of(servo).cells, LISTENED, 1)  # in the middle of whatever goes on
    loop.run_virtual(servo, 2000, 2_000_000_000)
    assert len(samples_of(servo)) > 100


def test_a_full_ring_drops_counts_and_goes_on() -> None:
    servo = servo_of(streamed())
    loop.run_virtual(servo, 60_000, 0)
    kept = len(samples_of(servo))
    assert kept == SLOTS
    assert ring_of(servo).cells[ring.DROPPED] > 0
    loop.run_virtual(servo, 1000, 60_000_000_000)
    assert 0 < len(samples_of(servo)) < 1000


def test_a_tick_allocates_nothing() -> None:
    servo = servo_of(streamed())
    loop.run_virtual(servo, 10, 0)
    counts: list[int] = []
    for ticks in (10, 5000):
        before = allocations()
        loop.run_virtual(servo, ticks, 1_000_000_000)
        counts.append(allocations() - before)
    assert counts[0] == counts[1]


def test_panic_in_contact_closes_it() -> None:
    servo = servo_of(streamed())
    now = 0
    while servo.motion["contact_phase"][0] != exact.CONTACT or servo.motion["z"][0] > -1e-4:
        now = loop.run_virtual(servo, 1, now)
    add_to(servo.block.control, PANIC, 1)
    now = loop.run_virtual(servo, 5, now)
    samples = samples_of(servo)
    assert samples["force_N"][-1] == 0.0
    assert compare_with_releases(samples, events_of(servo), 1e-3) >= 1


def test_a_fault_leaves_no_number_that_is_none() -> None:
    servo = servo_of(streamed())
    now = 0
    while servo.motion["contact_phase"][0] != exact.CONTACT:
        now = loop.run_virtual(servo, 1, now)
    servo.motion["v"] = np.nan
    loop.run_virtual(servo, 5, now)
    samples = samples_of(servo)
    assert servo.tick_state["fault"][0] != 0
    assert np.isfinite(samples["force_N"]).all()
    assert samples["force_N"][-1] == 0.0


def test_a_scene_that_does_not_stream_has_no_ring() -> None:
    played = parse(shipped_text("roll"), "roll")
    assert memory.prepare(played, blocks.in_memory(law_of(played))).stream is None


def test_the_arms_samples_are_the_force_that_is_held() -> None:
    played = parse(
        sampled_arm.SCENE.format(gesture="strokes", device="", guard="") + f"[drum]\n{STREAMS}\n", "arm"
    )
    servo = sampled_arm.servo_of(played)
    poke(ring_of(servo).cells, LISTENED, 1)
    loop.run_virtual(servo, 4000, 0)
    samples, events = samples_of(servo), events_of(servo)
    assert compare_with_releases(samples, events, 1e-3) > 3
    for release in events[events["kind"] == RELEASE]:
        own = samples[samples["seq"] == release["seq"]]
        assert own["force_N"].max() == pytest.approx(release["peak_N"])
        assert own["t_ns"][-1] == release["t_ns"] + PERIOD_NS or own["t_ns"][-1] == release["t_ns"]


def test_the_file_is_private_and_of_one_start(tmp_path) -> None:
    mine = contacts.create(tmp_path, 77)
    seen = contacts.attach(tmp_path)
    poke(mine.cells, LISTENED, 5)
    assert (seen.boot, seen.cells[LISTENED]) == (77, 5)
    assert [path.stat().st_mode & 0o777 for path in tmp_path.iterdir()] == [0o600]
    (tmp_path / "contacts.ring").write_bytes(b"short")
    with pytest.raises(BlockError, match="expected"):
        contacts.attach(tmp_path)
