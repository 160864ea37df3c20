"""A recorded grip, live: the exact stick's tick plays what `simulate` plays; on an arm the arm's own hand changes."""

import dataclasses

import numpy as np
import pytest

import drumstick as ds
import sampled_arm
from drumstick.scenes.gesture import stick_gesture
from drumstick.scenes.scene_text import shipped_gesture
from drumstick.scenes.table import table_of
from drumstick.stick.law import law_of
from drumstick.stick.motion import exact
from haptic_server import block as blocks
from haptic_server.records import NO_FAULT, STRIKE, set_type
from haptic_server.servo import loop
from haptic_server.servo.device.gesture import gesture_of
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force import gestured_hand, memory
from realtime import triple_buffer
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import njit
from sampled_arm import events_of, hold_at

SCENE = ds.scene("grip")
TEXT = shipped_gesture("grip.csv")


@njit()
def grip_once(servo: memory.Servo, max_speed: float) -> None:
    gestured_hand.grip(borrowed_view(servo), max_speed)


def _servo(scene: ds.Scene = SCENE, text: str = TEXT) -> memory.Servo:
    device = Simulated(scene)
    device.follow(gesture_of(text.splitlines(), "mine.csv", scene))
    block = blocks.in_memory(law_of(scene))
    return device.attach_simulation(memory.prepare(scene, block, specification=device.info().specification))


def _offer(servo: memory.Servo, revision: int, **changes: float) -> None:
    wanted = np.zeros(1, set_type(servo.law.dtype))
    wanted["revision"], wanted["law"] = revision, law_of(SCENE)
    for name, value in changes.items():
        record = wanted["law"]["pulse"] if name == "dv_pls" else wanted["law"]
        record[name] = value
    triple_buffer.publish(servo.block.wanted_cells, servo.block.wanted, wanted[0])


def test_the_live_stick_plays_what_simulate_plays() -> None:
    played, expected = ds.servo(SCENE, 9.0), ds.simulate(SCENE, 9.0).contacts
    assert len(played.strikes) == len(expected) > 150
    np.testing.assert_allclose(played.strikes["t_s"], expected["t_in_s"], atol=5e-9)
    np.testing.assert_allclose(played.strikes["speed_m_per_s"], -expected["v_in_m_per_s"], rtol=1e-6)


def test_the_speed_that_may_be_kept_is_judged_where_the_hand_lifts_highest() -> None:
    """From the first tick on, as after a set of the same values."""
    text = "t_s,z_m\n0,-0.02\n1,0.05\n2,-0.02\n"
    servo = _servo(text=text)
    before = servo.tick_state["max_entry_speed"][0]
    assert before < _servo().tick_state["max_entry_speed"][0]
    _offer(servo, 1)
    loop.run_virtual(servo, 200, 0)
    assert servo.tick_state["refused"][0] == 0
    assert servo.tick_state["max_entry_speed"][0] == pytest.approx(before, rel=1e-12)


def test_a_set_moves_the_whole_gesture_and_is_what_is_shown() -> None:
    servo = _servo()
    now = loop.run_virtual(servo, 4000, 0)
    assert servo.law["k_hand"][0] == pytest.approx(27.1)
    _offer(servo, 1, k_hand=13.55)
    now = loop.run_virtual(servo, 200, now)
    assert servo.law["k_hand"][0] == pytest.approx(13.55)
    loop.run_virtual(servo, 3000, now)  # the gesture has gone on
    assert servo.law["k_hand"][0] == pytest.approx(2.5)
    shown = servo.block.live[triple_buffer.take(servo.block.live_cells)]
    assert shown["law"]["k_hand"] == 13.55
    assert servo.tick_state["refused"][0] == 0


def test_what_is_only_heard_waits_for_nothing() -> None:
    """A grip that moves is no change of the stick's set."""
    servo = _servo()
    now = loop.run_virtual(servo, 2500, 0)
    while servo.motion["contact_phase"][0] == exact.ABOVE:
        now = loop.run_virtual(servo, 1, now)
    wanted = np.zeros(1, set_type(servo.law.dtype))
    wanted["revision"], wanted["law"] = 1, law_of(SCENE)
    gain = table_of(SCENE)["listen.gain"]
    gain.part_of(wanted["law"][0])[gain.field] = -6.0
    triple_buffer.publish(servo.block.wanted_cells, servo.block.wanted, wanted[0])
    loop.run_virtual(servo, 1, now)
    assert servo.tick_state["revision"][0] == 1


def test_a_hand_that_lifts_its_spring_takes_the_stick_along_and_nobody_throws_it() -> None:
    servo = _servo(SCENE, "t_s,z_m\n0,-0.02\n1,-0.02\n1.2,0.03\n3.2,0.03\n3.4,-0.02\n")
    loop.run_virtual(servo, 3000, 0)
    assert 0.02 < servo.motion["z"][0] < 0.04
    events = events_of(servo)
    times = events["t_ns"][events["kind"] == STRIKE] * 1e-9
    assert times.max() < 1.3


def test_a_set_that_is_too_fast_where_the_gesture_lifts_is_refused_by_the_servo() -> None:
    """K_hand of 40 N/m with the spring 40 mm up passes 1.8 m/s; pressing at -20 mm it is far from that."""
    scene = dataclasses.replace(SCENE, guard=dataclasses.replace(SCENE.guard, max_speed_m_per_s=1.8))
    lifted, still = _servo(scene, "t_s,z_m\n0,-0.02\n1,0.04\n2,-0.02\n"), _servo(scene)
    for servo in (lifted, still):
        _offer(servo, 1, k_hand=40.0)
        loop.run_virtual(servo, 200, 0)
    assert lifted.tick_state["refused_revision"][0] == 1
    assert still.tick_state["refused"][0] == 0
    assert still.tick_state["revision"][0] == 1


def test_a_grip_that_would_make_too_much_speed_waits() -> None:
    """A stick 50 mm up in a loose hand: closed at once, that would bring it down at 2.8 m/s, and 1.2 is the limit."""
    servo = _servo(SCENE, "t_s,k_hand_N_per_m\n0,2\n1,2\n1.001,27\n1.5,27\n1.6,2\n")
    now = loop.run_virtual(servo, 1000, 0)
    hold_at(servo, 0.05)
    servo.tick_state["max_entry_speed"] = 1.2
    events_of(servo)
    now = loop.run_virtual(servo, 20, now)
    assert servo.law["k_hand"][0] < 27.0
    loop.run_virtual(servo, 200, now)
    assert servo.law["k_hand"][0] == pytest.approx(27.0)
    assert 0.5 < events_of(servo)["speed_m_per_s"].max() < 1.25  # and what a pulse gives


def test_an_arm_s_hand_does_not_close_about_a_spring_that_would_throw_it_too_fast() -> None:
    scene = sampled_arm.scene('recorded"\ngesture_file = "mine.csv')
    servo = _servo(scene, "t_s,k_hand_N_per_m\n0,20\n1,60\n2,20\n")
    plant = servo.plant
    plant["k_hand_N_per_m"], plant["t_s"] = 20.0, 1.3  # amid the file: 60 N/m is wanted
    plant["z_m"], plant["hand_m"], plant["v_m_per_s"] = 0.04, -0.01, 0.5

    def held(max_speed: float) -> float:
        grip_once(servo, max_speed)
        return float(plant["k_hand_N_per_m"][0])

    fits = 0.075 * (1.0 - 0.5**2) / 0.05**2
    assert held(1.0) == pytest.approx(fits)
    assert 20.0 < fits < 60.0
    assert held(0.6) == pytest.approx(fits)  # what it has it keeps
    assert held(2.0) == pytest.approx(60.0)


def test_the_arm_s_own_hand_changes_its_grip() -> None:
    """The roll of a simulated arm follows the grip: faster with the firm one; its impedance is what the file says."""
    roll = ds.scene("phantom")
    scene = dataclasses.replace(
        roll, hand=dataclasses.replace(roll.hand, gesture="recorded", gesture_file="mine.csv")
    )
    servo = _servo(
        scene, "t_s,k_hand_N_per_m,r_out_N_s_per_m\n0,80,0.3\n2,80,0.3\n2.5,300,0.5\n6,300,0.5\n6.5,80,0.3\n"
    )
    now = loop.run_virtual(servo, 1300, 0)
    assert servo.plant["k_hand_N_per_m"][0] == pytest.approx(80.0)
    loop.run_virtual(servo, 4000, now)
    assert servo.plant["k_hand_N_per_m"][0] == pytest.approx(300.0)
    assert servo.plant["r_out_N_s_per_m"][0] == pytest.approx(0.5)
    events = events_of(servo)
    times = events["t_ns"][events["kind"] == STRIKE] * 1e-9
    loose = np.count_nonzero((times > 1.0) & (times < 2.2))
    firm = np.count_nonzero((times > 3.8) & (times < 5.0))
    assert firm > 1.3 * loose > 0
    assert servo.tick_state["fault"][0] == NO_FAULT
    assert servo.law["k_hand"][0] == 300.0  # what is judged is the scene's own


def test_an_arm_plays_place_and_grip_together() -> None:
    scene = sampled_arm.scene('recorded"\ngesture_file = "mine.csv')
    text = "t_s,z_m,k_hand_N_per_m\n0,0.03,60\n1,0.03,20\n2,0.03,60\n"
    servo = _servo(scene, text)
    loop.run_virtual(servo, 1301, 0)
    assert servo.plant["hand_m"][0] == pytest.approx(0.03)
    assert servo.plant["k_hand_N_per_m"][0] == pytest.approx(20.0, abs=0.1)


def test_a_file_of_places_alone_has_none_of_the_grip_s_memory() -> None:
    scene = sampled_arm.scene('recorded"\ngesture_file = "mine.csv')
    servo = _servo(scene, "t_s,z_m\n0,0.02\n1,-0.01\n2,0.02\n")
    assert servo.path.tolist() == [[0.0, 0.02], [1.0, -0.01], [2.0, 0.02]]
    assert servo.gripping is None
    assert servo.moving is None


REFUSED = {
    "firmer than the scene": (
        "0,5,0.1\n1,30,0.1\n",
        "grip.csv:3: k_hand_N_per_m: 30 N/m is outside 0.0271 .. 27.1 N/m",
    ),
    "below 0": ("0,5,0.1\n1,-1,0.1\n", "grip.csv:3: k_hand_N_per_m: -1 N/m is outside 0.0271 .. 27.1 N/m"),
    "looser than the scene": (
        "0,5,0.05\n1,5,0.1\n",
        "grip.csv:2: r_out_N_s_per_m: 0.05 N s/m is outside 0.1 .. 1.3",
    ),
    "tighter than in contact": (
        "0,5,0.1\n1,5,2\n",
        "grip.csv:3: r_out_N_s_per_m: 2 N s/m is outside 0.1 .. 1.3",
    ),
    "no number": ("0,5,0.1\n1,firm,0.1\n", "grip.csv:3: k_hand_N_per_m: 'firm' is not a number"),
    "a short row": ("0,5,0.1\n1,5\n", "grip.csv:3: r_out_N_s_per_m is missing in this row"),
    "time back": ("0,5,0.1\n1,5,0.1\n0.5,5,0.1\n", "grip.csv:4: t_s does not rise"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_every_mistake_in_a_grip_is_named_with_its_line(name: str) -> None:
    rows, said = REFUSED[name]
    text = "t_s,k_hand_N_per_m,r_out_N_s_per_m\n" + rows
    with pytest.raises(ds.SceneError) as refused:
        ds.simulate(SCENE, 1.0, gesture=text)
    assert said in str(refused.value)
    with pytest.raises(ds.SceneError) as refused:
        ds.servo(SCENE, 1.0, gesture=text)
    assert said in str(refused.value)


def test_a_place_out_of_the_envelope_is_named_with_its_line() -> None:
    """A spring held so high would throw a stick of this grip faster than the guard allows."""
    scene = dataclasses.replace(SCENE, guard=dataclasses.replace(SCENE.guard, max_speed_m_per_s=2.0))
    text = "t_s,z_m\n0,-0.02\n1,0.0\n2,0.1\n3,-0.02\n"
    with pytest.raises(ds.SceneError, match=r"mine\.csv:4: z_m: 0\.1 m: ") as refused:
        ds.servo(
            dataclasses.replace(scene, hand=dataclasses.replace(scene.hand, gesture_file="mine.csv")),
            1.0,
            text,
        )
    assert "envelope" in str(refused.value) or "m/s" in str(refused.value)


def test_where_a_grip_ends_elsewhere_the_hand_takes_its_reaction_time_back() -> None:
    scene = dataclasses.replace(SCENE, hand=dataclasses.replace(SCENE.hand, gesture_file="mine.csv"))
    found = stick_gesture(scene, "t_s,k_hand_N_per_m\n0,5\n1,20\n")
    assert found is not None
    assert found[-1, 0] == pytest.approx(1.1)
    assert found[-1, 4] == 5.0
