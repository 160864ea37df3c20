"""The scene `phantom` goes on rolling on its simulated arm: with friction, whatever start, and an arm 15 % off.

In virtual time, by the tick that plays live.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
import pytest

import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_text
from haptic_server.records import NO_FAULT, STRIKE
from haptic_server.servo import loop
from haptic_server.servo.trace import ordered
from stability.catalogue import shows

_AT_ONCE = 250  # ticks, of the trace's thousand
_SETTLED_S = 1.0
_LONGEST_GAP_S = 0.1  # the slowest roll here has 14 strikes a second
# Where the arm is let go: height m, speed m/s. The second is where `drumstick haptic` starts it.
STARTS = ((0.0015, 0.3), (0.02, 0.0), (0.021, -0.3), (0.035, 0.0))


class Played(NamedTuple):
    """Times of the strikes, s; the largest force, N; the fault."""

    strikes_s: np.ndarray
    peak_N: float
    fault: int


def _on_the_arm(scene: Scene, friction_N: float) -> Scene:
    return dataclasses.replace(scene, device=dataclasses.replace(scene.device, friction_N=friction_N))


def _play(
    scene: Scene, duration_s: float, start: tuple[float, float] = STARTS[1], mass: float = 1.0
) -> Played:
    # mass: the arm's, over what the scene declares.
    servo = sampled_arm.servo_of(scene)
    plant = servo.plant[0]
    plant["z_m"] = plant["hand_m"] = start[0]
    plant["v_m_per_s"] = start[1]
    plant["m_kg"] *= mass
    now_ns, peak_N, strikes = 0, 0.0, []
    for _ in range(round(duration_s * scene.servo.rate_Hz) // _AT_ONCE):
        now_ns = loop.run_virtual(servo, _AT_ONCE, now_ns)
        ticks = ordered(servo.trace, int(servo.tick_state[0]["traced"]))[-_AT_ONCE:]
        peak_N = max(peak_N, float(np.abs(ticks["force_N"]).max()))
        events = sampled_arm.events_of(servo)
        strikes.append(events["t_ns"][events["kind"] == STRIKE] * 1e-9)
    return Played(np.concatenate(strikes), peak_N, int(servo.tick_state[0]["fault"]))


def _longest_gap(played: Played, duration_s: float) -> float:
    since = played.strikes_s[played.strikes_s > _SETTLED_S]
    return float(np.diff(np.concatenate(([_SETTLED_S], since, [duration_s]))).max())


@shows("arm mass other than the scene's", "ours")
@pytest.mark.parametrize(
    ("friction_N", "mass"), [(0.0, 0.85), (0.0, 1.2), (0.04, 1.0), (0.06, 0.85), (0.06, 1.2)]
)
def test_it_rolls_for_a_minute(friction_N: float, mass: float) -> None:
    scene = _on_the_arm(parse(shipped_text("phantom"), "phantom"), friction_N)
    for start in STARTS:
        played = _play(scene, 60.0, start, mass)
        assert played.fault == NO_FAULT
        assert played.peak_N <= scene.guard.max_force_N
        assert _longest_gap(played, 60.0) < _LONGEST_GAP_S


def test_a_looser_hand_and_a_smaller_pulse_die_and_are_lifted_again() -> None:
    """Set E with a small pulse: without friction it rolls, with 0.0077 N its two cycles meet and are gone.

    It dies, trembles by encoder counts, and the hand takes it up again.
    """
    loose = sampled_arm.scene("hold")
    assert _longest_gap(_play(_on_the_arm(loose, 0.0), 10.0), 10.0) < _LONGEST_GAP_S
    died = _play(_on_the_arm(loose, 0.04), 10.0)
    assert _longest_gap(died, 10.0) > 2.0 * _LONGEST_GAP_S
    assert died.strikes_s[-1] > 8.0
