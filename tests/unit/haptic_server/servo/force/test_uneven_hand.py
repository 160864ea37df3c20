"""A hand that is no machine, live: the tick plays what `simulate` plays, and judges a set at the hand's strongest."""

import dataclasses

import numpy as np
import pytest

import drumstick as ds
from drumstick.parameters.rig import Human
from drumstick.stick import moving_hand
from drumstick.stick.law import law_of
from haptic_server import block as blocks
from haptic_server.records import NO_FAULT, STRIKE, set_type
from haptic_server.servo import loop
from haptic_server.servo.device.pointer import Pointed
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import memory
from realtime import triple_buffer
from sampled_arm import events_of, hold_at

ROLL = ds.scene("roll")


def _uneven(scene: ds.Scene = ROLL, interval_percent: float = 3.0, level_dB: float = 1.0) -> ds.Scene:
    return dataclasses.replace(
        scene, hand=dataclasses.replace(scene.hand, human=Human(interval_percent, level_dB))
    )


SCENE = _uneven()


def _servo(scene: ds.Scene = SCENE) -> memory.Servo:
    device = Simulated(scene)
    block = blocks.in_memory(law_of(scene))
    return device.attach_simulation(memory.prepare(scene, block, specification=device.info().specification))


def _offer(servo: memory.Servo, revision: int, dv_pls: float) -> None:
    wanted = np.zeros(1, set_type(servo.law.dtype))
    wanted["revision"], wanted["law"] = revision, law_of(SCENE)
    wanted["law"]["pulse"]["dv_pls"] = dv_pls
    triple_buffer.publish(servo.block.wanted_cells, servo.block.wanted, wanted[0])


def test_the_live_stick_plays_what_simulate_plays_bit_for_bit() -> None:
    played, expected = ds.servo(SCENE, 20.0), ds.simulate(SCENE, 20.0).contacts
    assert not played.fault
    assert len(played.strikes) == len(expected) > 400
    assert np.array_equal(played.strikes["speed_m_per_s"], -expected["v_in_m_per_s"])
    np.testing.assert_allclose(played.strikes["t_s"], expected["t_in_s"], atol=2e-9)  # whole nanoseconds
    # A strike announces the contact that follows, with the pulse that this one gets.
    np.testing.assert_allclose(played.strikes["peak_force_N"], expected["peak_force_N"], rtol=1e-9)


def test_what_is_set_is_what_is_shown_and_the_hand_varies_about_it() -> None:
    servo = _servo()
    now = loop.run_virtual(servo, 2000, 0)
    factor = float(servo.law["pulse"]["dv_pls"][0]) / 0.2
    assert factor != 1.0
    _offer(servo, 1, 0.4)
    now = loop.run_virtual(servo, 200, now)
    shown = servo.block.live[triple_buffer.take(servo.block.live_cells)]
    assert shown["law"]["pulse"]["dv_pls"] == 0.4
    assert shown["law"]["z_ss"] == ROLL.stick.z_ss_m
    events_of(servo)
    speeds = list[float]()
    for _ in range(20):
        now = loop.run_virtual(servo, 500, now)
        events = events_of(servo)
        speeds += events["speed_m_per_s"][events["kind"] == STRIKE].tolist()
    louder = ds.simulate(ds.scene("roll", dv_pls=0.4), 5.0).contacts["v_in_m_per_s"][-1]
    assert np.mean(speeds) == pytest.approx(-louder, rel=0.05)
    assert 0.03 < np.std(speeds) / np.mean(speeds) < 0.3
    assert servo.tick_state["fault"][0] == NO_FAULT


def test_a_set_whose_strongest_strikes_are_too_fast_is_refused_by_the_servo() -> None:
    """dv of 0.4 m/s alone stays below 3 m/s; varied by a quarter, thrice that at most, it could pass it."""
    guard = dataclasses.replace(ROLL.guard, max_speed_m_per_s=3.0)
    scene = dataclasses.replace(ROLL, guard=guard)
    uneven, machine = _servo(_uneven(scene)), _servo(scene)
    for servo in (uneven, machine):
        _offer(servo, 1, 0.4)
        loop.run_virtual(servo, 200, 0)
    assert uneven.tick_state["refused_revision"][0] == 1
    assert machine.tick_state["revision"][0] == 1


@pytest.mark.parametrize(("pressing", "waits"), [(1.0, 0), (2.0, 1)])
def test_a_set_waits_while_a_firmer_hand_would_bring_the_stick_down_too_fast(
    pressing: float, waits: int
) -> None:
    """From 50 mm up it comes down at 2.4 m/s, at 2.9 where the hand presses twice as firmly; 2.7 is the limit."""
    guard = dataclasses.replace(ROLL.guard, max_speed_m_per_s=2.7)
    servo = _servo(_uneven(dataclasses.replace(ROLL, guard=guard)))
    now = loop.run_virtual(servo, 1, 0)
    hold_at(servo, 0.05)
    servo.moving["human"]["pressing"] = pressing
    _offer(servo, 1, 0.21)
    loop.run_virtual(servo, 1, now)
    assert servo.tick_state["refused"][0] == 0
    assert servo.tick_state["is_pending"][0] == waits


def test_a_scene_whose_strongest_strikes_are_too_fast_is_not_played() -> None:
    guard = dataclasses.replace(ROLL.guard, max_speed_m_per_s=1.5)
    scene = dataclasses.replace(ROLL, guard=guard)
    assert not ds.servo(scene, 0.1).fault
    with pytest.raises(ds.OutOfEnvelope, match=r"hand\.human: the roll itself .* could reach 1\.8\d m/s"):
        ds.servo(_uneven(scene), 0.1)


def test_what_the_roll_cannot_be_is_said_at_the_start() -> None:
    with pytest.raises(DeviceError, match=r"roll: hand\.human: level_dB = 1\.5 alone"):
        Simulated(_uneven(ROLL, 0.1, 1.5)).open()
    with pytest.raises(ds.SceneError, match=r"roll: hand\.human: level_dB = 1\.5 alone"):
        ds.servo(_uneven(ROLL, 0.1, 1.5), 0.1)


def test_a_hand_that_a_person_moves_is_left_alone() -> None:
    block = blocks.in_memory(law_of(SCENE))
    device = Pointed(SCENE)
    held = device.attach_simulation(memory.prepare(SCENE, block, specification=device.info().specification))
    assert held.moving is None


def test_a_scene_without_it_has_none_of_its_memory() -> None:
    assert _servo(ROLL).moving is None
    assert "human" not in (moving_hand.HAND.names or ())
