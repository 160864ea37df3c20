"""The simulated arm, its hand, a recording, and the estimate of speed that they are seen through."""

import math
from pathlib import Path

import numpy as np
import pytest

import sampled_arm
from drumstick.stick.hand_path import GESTURES, hand_at
from haptic_server.records import RELEASE, STRIKE
from haptic_server.servo import loop
from haptic_server.servo.device.protocol import DeviceError
from haptic_server.servo.device.replay import ReplayDevice, read
from haptic_server.servo.device.selection import chosen
from haptic_server.servo.device.simulated import Simulated
from haptic_server.servo.force.velocity import LONGEST, follow, forget, new_track
from haptic_server.servo.simulation import phantom
from stability.catalogue import shows

RESOLUTION = 3e-5
T = 1e-3


def _plant(**values: float) -> np.ndarray:
    plant = np.zeros(1, phantom.PLANT)
    plant["m_kg"], plant["resolution_m"], plant["max_force_N"] = 0.075, RESOLUTION, 8.5
    plant["lowest_m"], plant["highest_m"] = -1.0, 1.0
    for name, value in values.items():
        plant[name] = value
    return plant


def test_a_free_arm_under_a_held_force_flies_a_parabola() -> None:
    plant = _plant(v_m_per_s=0.3, force_N=-0.6)
    for _ in range(100):
        phantom.move_on(plant[0], T)
    assert plant["v_m_per_s"][0] == pytest.approx(0.3 - 0.1 * 0.6 / 0.075, rel=1e-12)
    assert plant["z_m"][0] == pytest.approx(0.3 * 0.1 - 0.5 * 0.6 / 0.075 * 0.01, rel=1e-12)


def test_friction_brakes_it_to_a_stop_and_holds_it() -> None:
    """v^2 = 2 F s/m; a hand that pulls less than the friction does not move it."""
    plant = _plant(v_m_per_s=0.2, friction_N=0.3, k_hand_N_per_m=0.0)
    for _ in range(200):
        phantom.move_on(plant[0], T)
    assert plant["v_m_per_s"][0] == 0.0
    assert plant["z_m"][0] == pytest.approx(0.2**2 * 0.075 / (2.0 * 0.3), rel=1e-9)
    held = float(plant["z_m"][0])
    plant["force_N"] = 0.29
    phantom.move_on(plant[0], 1.0)
    assert plant["z_m"][0] == held
    plant["force_N"] = 0.31
    phantom.move_on(plant[0], 1.0)
    assert plant["z_m"][0] == pytest.approx(held + 0.5 * 0.01 / 0.075, rel=1e-9)


def test_friction_turns_with_the_motion() -> None:
    """A spring with Coulomb friction loses 2 F/K of amplitude each half swing, whatever the ticks."""
    plant = _plant(z_m=0.05, k_hand_N_per_m=60.0, friction_N=0.2)
    turns = []
    before = 0.0
    for _ in range(4000):
        phantom.move_on(plant[0], T / 2.0)
        now = float(plant["v_m_per_s"][0])
        if before * now < 0.0:
            turns.append(abs(float(plant["z_m"][0])))
        before = now
    np.testing.assert_allclose(-np.diff(turns), 2.0 * 0.2 / 60.0, rtol=0.03)
    assert abs(plant["z_m"][0]) <= 0.2 / 60.0


def test_encoders_round_and_late_motors_queue() -> None:
    plant = _plant(z_m=1.4999e-5, delay_ticks=2)
    reading = np.zeros(1, sampled_arm.memory.READING)
    phantom.measure(plant[0], reading[0], 5)
    assert reading["z_m"][0] == 0.0
    plant["z_m"] = 1.5001e-5
    phantom.measure(plant[0], reading[0], 6)
    assert reading["z_m"][0] == RESOLUTION
    forces = []
    for asked in (1.0, 2.0, 30.0, 4.0, 5.0):
        phantom.apply_force(plant[0], asked)
        forces.append(float(plant["force_N"][0]))
    assert forces == [0.0, 0.0, 1.0, 2.0, 8.5]


@pytest.mark.parametrize("gesture", GESTURES[:-1])
def test_every_gesture_begins_above_and_stays_in_its_range(gesture: str) -> None:
    played = sampled_arm.scene(gesture)
    hand = Simulated(played).attach_simulation(sampled_arm.servo_of(played)).gesture[0]
    heights = [hand_at(hand, np.zeros((2, 2)), t) for t in np.arange(0.0, 3.0, 1e-3)]
    assert heights[0] == pytest.approx(-0.01 + 0.04)
    assert min(heights) >= -0.01 - 1e-12
    assert max(heights) <= 0.03 + 1e-12
    assert min(heights) == pytest.approx(-0.01, abs=1e-4)
    assert max(np.abs(np.diff(heights[301:]))) < 1e-3  # no jump after the lift


@pytest.mark.parametrize(
    ("gesture", "least_per_period"), [("strokes", 1), ("single-stroke-roll", 1), ("double-stroke-roll", 2)]
)
def test_strokes_and_rolls_strike_as_often_as_their_names_say(gesture: str, least_per_period: int) -> None:
    servo = sampled_arm.servo_of(sampled_arm.scene(gesture))
    loop.run_virtual(servo, 10_300, 0)
    events = sampled_arm.events_of(servo)
    assert np.count_nonzero(events["kind"] == STRIKE) >= 20 * least_per_period - 1


def _track(positions: np.ndarray) -> np.ndarray:
    track = new_track()
    return np.array([follow(track[0], i * T, float(z), RESOLUTION) for i, z in enumerate(positions)])


def _quantised(z: np.ndarray) -> np.ndarray:
    return np.round(z / RESOLUTION) * RESOLUTION


@shows("speed from encoder counts", "ours")
def test_a_steady_speed_is_found_to_a_fraction_of_one_count_per_tick() -> None:
    """A plain difference would be off by up to 30 mm/s; the long window brings that down by its length."""
    t = np.arange(400) * T
    for speed in (0.0, 1e-3, 0.013, 0.2, -0.7):
        found = _track(_quantised(speed * t + 1.1e-5))[LONGEST:]
        assert np.max(np.abs(found - speed)) <= 1.05 * 2.0 * RESOLUTION / (T * 3.0)
        assert np.sqrt(np.mean((found - speed) ** 2)) < 0.2 * RESOLUTION / T


@shows("speed from encoder counts", "ours")
def test_a_turn_is_seen_within_a_few_ticks() -> None:
    """In a contact at 15 g's the window shrinks: the lag in speed is that of one or two ticks, not of sixteen."""
    t = np.arange(300) * T
    w = 2.0 * math.pi * 30.0
    v = 0.5 * np.cos(w * t)
    found = _track(_quantised(0.5 / w * np.sin(w * t)))
    late_by_one = np.interp(t - 0.5 * T, t, v)
    assert np.sqrt(np.mean((found[20:] - late_by_one[20:]) ** 2)) < 0.06 * 0.5


def test_forget_starts_afresh() -> None:
    track = new_track()
    for i in range(40):
        follow(track[0], i * T, 0.5 * i * T, RESOLUTION)
    forget(track[0])
    assert follow(track[0], 1.0, 0.2, RESOLUTION) == 0.0
    assert follow(track[0], 1.0 + T, 0.2, RESOLUTION) == 0.0


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0])
def test_time_may_be_uneven(factor: float) -> None:
    track = new_track()
    t = np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 200)) * T * factor
    found = [follow(track[0], float(at), 0.3 * float(at), RESOLUTION) for at in t]
    np.testing.assert_allclose(found[1:], 0.3, rtol=1e-6)


def _recording(folder: Path, text: str) -> Path:
    path = folder / "recording.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_recording_strikes_where_it_meets_the_head(tmp_path: Path) -> None:
    path = _recording(tmp_path, "t_s,x_m,z_m\n0,0.04,0.02\n0.1,0.04,-0.002\n0.15,0.04,0.02\n0.5,0.04,0.02\n")
    device = ReplayDevice(path)
    device.open()
    played = sampled_arm.scene()
    servo = sampled_arm.memory.prepare(
        played,
        sampled_arm.blocks.in_memory(sampled_arm.law_of(played)),
        specification=device.info().specification,
    )
    servo = device.attach_simulation(servo)
    loop.run_virtual(servo, 2000, 0)
    events = sampled_arm.events_of(servo)
    strikes = events[events["kind"] == STRIKE]
    assert len(strikes) == 4  # once every half second
    np.testing.assert_allclose(np.diff(strikes["t_ns"]), 5e8, atol=2e6)
    np.testing.assert_allclose(strikes["speed_m_per_s"], 0.22, rtol=0.05)
    np.testing.assert_allclose(strikes["x"], 0.5)
    assert strikes["t_ns"][0] == pytest.approx(1e9 * 0.1 * 0.02 / 0.022, abs=1.5e6)
    assert np.count_nonzero(events["kind"] == RELEASE) == 4


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1,2\n", "needs the columns t_s (or t_ns) and z_m"),
        ("t_s,z_m\n0,0.1\n", "at least two"),
        ("t_s,z_m\n0,0.1\n1,nan\n", ":3: z_m: nan is not a finite number"),
        ("t_s,z_m\n0,0.1\n1,high\n", ":3: z_m: 'high' is not a number"),
        ("t_s,z_m\n0,0.1\n1,0.2\n1,0.3\n", ":4: t_s does not rise"),
        ("", "it has none"),
    ],
)
def test_a_bad_recording_is_refused_in_words(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DeviceError) as refused:
        read(_recording(tmp_path, text))
    assert said in str(refused.value)


def test_unknown_devices_and_absent_files() -> None:
    with pytest.raises(DeviceError, match="there is simulated, pointer, openhaptics, replay:FILE or what"):
        chosen("falcon", sampled_arm.scene())
    with pytest.raises(DeviceError, match="cannot be read: No such file"):
        read(Path("/nowhere/recording.csv"))
