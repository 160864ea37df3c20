"""Negative damping above the head, live: the tick plays what `exact` predicts, whoever holds the stick."""

import dataclasses
from collections.abc import Iterator

import numpy as np
import pytest

from drumstick.scenes.scene_text import parse, shipped_text
from drumstick.stick.effects.negative_damping import NegativeDamping
from drumstick.stick.law import law_of
from drumstick.stick.motion import exact
from drumstick.stick.simulate import simulate
from haptic_server import block as blocks
from haptic_server.block_header import PANIC
from haptic_server.records import POINTER, RELEASE, STRIKE, set_type
from haptic_server.servo import loop
from haptic_server.servo.device.pointer import Pointed
from haptic_server.servo.force import memory
from realtime import triple_buffer
from realtime.atomics import add_to
from sampled_arm import events_of

SCENE = parse(shipped_text("gaining-flight"), "gaining-flight")


def _servo() -> memory.Servo:
    return memory.prepare(SCENE, blocks.in_memory(law_of(SCENE)))


def _offer(servo: memory.Servo, revision: int, **changes: float) -> None:
    wanted = np.zeros(1, set_type(servo.law.dtype))
    wanted["revision"], wanted["law"] = revision, servo.law
    for name, value in changes.items():
        wanted["law"]["negative_damping"][name] = value
    triple_buffer.publish(servo.block.wanted_cells, servo.block.wanted, wanted[0])


def test_the_live_stick_plays_what_exact_predicts() -> None:
    """The first second: beyond, a roll that never repeats multiplies rounding."""
    servo = _servo()
    loop.run_virtual(servo, 1000, 0)
    events = events_of(servo)
    expected = simulate(SCENE, 1.0, SCENE.hand.throw_m_per_s).contacts
    strikes, releases = events[events["kind"] == STRIKE], events[events["kind"] == RELEASE]
    n = len(expected) - 1
    assert n > 15
    np.testing.assert_allclose(strikes["speed_m_per_s"][:n], -expected[:n, 1], rtol=1e-6)
    np.testing.assert_allclose(releases["speed_m_per_s"][:n], expected[:n, 3], rtol=1e-6)


def test_sets_in_the_middle_of_flights_are_taken_and_never_too_fast() -> None:
    """Every set that the servo takes keeps the speed that its own judgement allows; a roll goes on meanwhile."""
    servo, now, rng = _servo(), 0, np.random.default_rng(1)
    taken, fastest = 0, 0.0
    for revision in range(1, 400):
        _offer(servo, revision, r=float(rng.uniform(0.3, 2.0)), below=float(rng.uniform(0.3, 1.5)))
        now = loop.run_virtual(servo, int(rng.integers(3, 40)), now)
        taken += int(servo.tick_state["revision"][0] == revision)
        strikes = events_of(servo)
        fastest = max(fastest, strikes["speed_m_per_s"].max(initial=0.0))
        assert strikes["speed_m_per_s"].max(initial=0.0) <= servo.tick_state["max_entry_speed"][0]
    assert taken > 300
    assert fastest > 0.6
    assert servo.tick_state["refused"][0] == 0


def test_a_set_out_of_the_envelope_is_refused_by_the_servo_too() -> None:
    servo = _servo()
    _offer(servo, 1, r=5.0, below=9.9)
    loop.run_virtual(servo, 100, 0)
    assert servo.tick_state["refused_revision"][0] == 1
    assert servo.law["negative_damping"]["below"][0] == 0.5


def test_panic_ends_the_gain() -> None:
    servo = _servo()
    now = loop.run_virtual(servo, 300, 0)
    add_to(servo.block.control, PANIC, 1)
    loop.run_virtual(servo, 5, now)
    assert servo.motion["negative_damping"]["flight"][0] == 0


def _pumped(below: float, limit: float, ticks: int) -> Iterator[memory.Servo]:
    # A hand that lifts a stick that gains, and lets it down again; the servo after every so many ticks.
    scene = dataclasses.replace(
        SCENE,
        effects={"negative_damping": NegativeDamping(2.0, below, "above")},
        guard=dataclasses.replace(SCENE.guard, max_speed_m_per_s=limit),
    )
    device = Pointed(scene)
    block = blocks.in_memory(law_of(scene))
    servo = device.attach_simulation(memory.prepare(scene, block, specification=device.info().specification))
    now = 1_000_000_000
    for k in range(0, 4800, ticks):
        record = np.zeros(1, POINTER)
        record["t_ns"], record["held"], record["lift"] = now, True, float(k % 240 >= 120)
        triple_buffer.publish(servo.block.pointer_cells, servo.block.pointer, record[0])
        now = loop.run_virtual(servo, ticks, now)
        yield servo


@pytest.mark.parametrize(("below", "limit"), [(0.5, 1.3), (1.0, 2.6)])
def test_a_hand_that_points_cannot_pump_it_up(below: float, limit: float) -> None:
    """It would come down several times as fast as the limit."""
    most = 0.0
    for servo in _pumped(below, limit, 8):
        most = max(most, events_of(servo)["speed_m_per_s"].max(initial=0.0))
    assert 0.5 * limit < most <= servo.tick_state["max_entry_speed"][0] <= limit
    assert servo.status["fault"][0] == 0


@pytest.mark.parametrize(("below", "limit"), [(0.5, 1.3), (1.0, 10.0)])
def test_the_flight_to_come_is_not_decided_in_contact(below: float, limit: float) -> None:
    """Deep in the head the stick is slow, whatever it leaves with: that flight then never gained."""
    asked, gains = 0, 0
    for servo in _pumped(below, limit, 1):
        in_contact = servo.motion["contact_phase"][0] != exact.ABOVE
        flight = servo.motion["negative_damping"]["flight"][0]
        assert not (in_contact and flight != 0)
        asked += int(flight != 0)
        gains += int(flight == 1)
    assert asked > 1000
    assert gains > 0
