"""Estimate of the hand that holds an arm, from positions in steps of the encoder, and the forces rendered."""

from typing import Any

import numpy as np
import pytest

import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse
from haptic_server.servo import loop
from haptic_server.servo.force import event_output, rendering
from realtime.kernels.borrowed_view import borrowed_view
from realtime.kernels.jit import njit

HAND_M, HAND_M_PER_S = 0.02, -0.25
STEP_M = 3e-5


def scene(device: str = "", rate_Hz: int = 1000) -> Scene:
    text = sampled_arm.SCENE.format(gesture="hold", device=device, guard="")
    return parse(f"{text}[servo]\nrate_Hz = {rate_Hz}\n", "arm")


@njit()
def feel_once(servo: sampled_arm.memory.Servo, z: float, now_ns: int) -> None:
    rendering.observe_hand(borrowed_view(servo), z, now_ns)


@njit()
def hold_once(servo: sampled_arm.memory.Servo) -> None:
    event_output.foresee_hand(borrowed_view(servo))


def felt(played: Scene, force_N: float, seconds: float, step_m: float = STEP_M) -> sampled_arm.memory.Servo:
    """A servo whose arm a hand carried down at a steady speed, under an alternating rendered force."""
    servo = sampled_arm.servo_of(played)
    stick, period_s = played.stick, 1.0 / played.servo.rate_Hz
    z, v, t_s, queue = HAND_M, 0.0, 0.0, [0.0] * played.device.delay_ticks
    fine = 50
    for tick in range(round(seconds / period_s)):
        feel_once(servo, round(z / step_m) * step_m, 1 + round(tick * period_s * 1e9))
        asked = force_N * (1.0 if tick % 60 < 20 else 0.0)
        servo.tick_state["force_N"] = asked
        queue.append(asked)
        acting = queue.pop(0)
        for _ in range(fine):
            t_s += period_s / fine
            hand_m = HAND_M + HAND_M_PER_S * t_s
            friction = np.sign(v) * played.device.friction_N
            a = stick.k_hand_N_per_m * (hand_m - z) - stick.r_out_N_s_per_m * v + acting - friction
            v += period_s / fine * a / stick.m_kg
            z += period_s / fine * v
    return servo


@pytest.mark.parametrize("device", ["", "delay_ticks = 2"])
@pytest.mark.parametrize("rate_Hz", [500, 1000, 4000])
@pytest.mark.parametrize("force_N", [0.0, 4.0])
def test_it_finds_where_the_hand_is_and_how_fast_it_goes(device: str, rate_Hz: int, force_N: float) -> None:
    played = scene(device, rate_Hz)
    servo = felt(played, force_N, 0.25)
    assert servo.hand is not None
    hand: Any = servo.hand[0]
    metres = played.stick.m_kg / played.stick.k_hand_N_per_m
    there_m = HAND_M + HAND_M_PER_S * (0.25 - 1.0 / rate_Hz)
    assert hand["pull_m_per_s2"] * metres == pytest.approx(there_m, abs=1.2e-3)
    assert hand["rate_m_per_s3"] * metres == pytest.approx(HAND_M_PER_S, abs=0.12)


def test_the_foreseen_hand_is_where_it_will_be_on_the_mean() -> None:
    """5 ms at its own speed, then still, over a contact of 14.5 ms: a mean of 4.14 ms."""
    played = scene()
    servo = felt(played, 0.0, 0.25, step_m=1e-9)
    hold_once(servo)
    there_m = HAND_M + HAND_M_PER_S * 0.249
    assert servo.ahead_law["z_ss"][0] == pytest.approx(there_m + HAND_M_PER_S * 0.00414, abs=1e-4)
    assert servo.law["z_ss"][0] == played.stick.z_ss_m


def test_a_hand_that_was_felt_too_shortly_is_the_scenes() -> None:
    servo = felt(scene(), 0.0, 0.03)
    hold_once(servo)
    assert servo.ahead_law["z_ss"][0] == servo.law["z_ss"][0]


def test_after_a_pause_it_begins_anew() -> None:
    servo = felt(scene(), 0.0, 0.25)
    feel_once(servo, -0.04, 260_000_000)
    hold_once(servo)
    assert servo.ahead_law["z_ss"][0] == servo.law["z_ss"][0]


def test_a_hand_too_stiff_to_be_followed_is_the_scenes() -> None:
    servo = felt(scene(), 0.0, 0.1)
    servo.law["k_hand"] = 1.01 * 0.075 * 200.0**2
    for tick in range(100):
        feel_once(servo, 0.01, 100_000_000 + tick * 1_000_000)
    hold_once(servo)
    assert servo.ahead_law["z_ss"][0] == servo.law["z_ss"][0]


def test_the_exact_stick_has_no_such_hand() -> None:
    servo = sampled_arm.memory.prepare(scene(), sampled_arm.blocks.in_memory(sampled_arm.law_of(scene())))
    assert servo.hand is None
    assert servo.ahead_law is servo.law
    loop.run_virtual(servo, 10, 0)
