"""Old positions and lost time: what tells a frozen driver from an arm that lies still, and what the real law does."""

from collections.abc import Generator, Iterable

import numpy as np
import pytest

from haptic_server.block_header import ARM
from haptic_server.records import NO_FAULT, STALE, STALLED
from haptic_server.servo.device.openhaptics.freshness import (
    FRESHNESS,
    MOVING_M_PER_S,
    OVER_S,
    PRESSING_N,
    is_new,
)
from haptic_server.servo.force.guard import STALE_S, STALL_FAULT_S
from haptic_server.servo.force.rendering import render
from hd_laws import servo_at
from hd_stand_in import CENTRE_MM, StandIn, Stepped
from realtime.atomics import poke

T = 1e-3
COUNT_MM = 0.03


def told(heights_mm: Iterable[float], force_N: float = 0.0, span_s: float = T) -> list[bool]:
    """For each height in turn, whether it is taken for new; the force was on all the time."""
    state, position = np.zeros(1, FRESHNESS), np.zeros(3)
    found: list[bool] = []
    for height in heights_mm:
        position[1] = height
        found.append(bool(is_new(state[0], position, force_N, span_s)))
    return found


def counted(heights_mm: np.ndarray) -> np.ndarray:
    """As encoders tell them."""
    return np.round(heights_mm / COUNT_MM) * COUNT_MM


def ramp(speed_m_per_s: float, ticks: int, span_s: float = T) -> np.ndarray:
    return counted(1e3 * speed_m_per_s * span_s * np.arange(ticks))


def test_an_arm_that_lies_still_is_told_for_ever_in_the_same_place() -> None:
    assert all(told([12.0] * 5000))
    assert all(told([12.0] * 5000, force_N=0.74)), "a stick laid down on the head, by its own weight"


@pytest.mark.parametrize("speed", [0.12, 0.5, -2.0])
@pytest.mark.parametrize("span_s", [1.0 / 500, T, 1.0 / 2000])
def test_what_moved_and_is_told_again_is_old_until_it_moves(speed: float, span_s: float) -> None:
    moving = ramp(speed, round(0.05 / span_s), span_s)
    found = told([*moving, *[moving[-1]] * 40, moving[-1] + COUNT_MM], span_s=span_s)
    assert all(found[: len(moving)])
    assert not any(found[len(moving) : -1])
    assert found[-1]


@pytest.mark.parametrize("speed", [0.0, 0.003, 0.02, 0.05])
def test_slow_movements_are_told_in_counts_with_pauses_between(speed: float) -> None:
    assert all(told(ramp(speed, 5000), force_N=0.5))


def test_a_swing_that_turns_and_one_that_comes_to_rest_are_new_all_the_time() -> None:
    t = T * np.arange(20_000)
    swing = counted(20.0 * np.exp(-t / 2.0) * np.cos(2 * np.pi * 4.0 * t))
    assert all(told(swing, force_N=0.5))
    assert swing[-1] == swing[-500], "it did come to rest"


def test_a_single_count_is_no_movement_at_any_rate() -> None:
    """A Touch's count is 0.055 mm: at 2 kHz that is 0.11 m/s for a tick."""
    assert all(told([0.0] * 50 + [0.055] * 200, span_s=0.5e-3))


def test_a_driver_with_half_our_rate_is_not_stale() -> None:
    """Every position comes twice: never old for as long as the guard waits."""
    found = told(np.repeat(ramp(0.5, 500, 2 * T), 2))
    longest = max(len(run) for run in "".join("n" if new else "o" for new in found).split("n"))
    assert longest * T < STALE_S / 2


def test_a_press_that_never_trembles_is_old_after_a_second() -> None:
    found = told([-0.4] * 1500, force_N=1.01 * PRESSING_N)
    assert all(found[:1000])
    assert not any(found[1002:])
    trembling = counted(-0.4 + 0.02 * np.sin(2 * np.pi * 9.0 * T * np.arange(5000)))
    assert all(told(trembling, force_N=3.0))


def test_the_limits_make_sense_together() -> None:
    assert OVER_S < STALE_S < STALL_FAULT_S
    assert MOVING_M_PER_S * T * 1e3 > 3 * COUNT_MM


# The same on the stand-in, with the law that a PHANTOM gets, on a clock of the test's.

PRESSED_MM, LIFTED_MM = CENTRE_MM[1] - 19.0, CENTRE_MM[1] + 8.0


@pytest.fixture
def play(arm: StandIn) -> Generator[Stepped]:
    """The scene `phantom` without its pulses, so that a press comes to rest; pressed into the head right now."""
    arm.sim("place", 0.0, LIFTED_MM, 0.0)
    servo = servo_at()
    servo.law["pulse"]["dv_pls"] = 0.0
    stepped = Stepped(arm, render, servo)
    stepped.tick(500)
    press(stepped)
    yield stepped
    stepped.close()
    arm.clean()


def press(play: Stepped) -> None:
    play.arm.sim("hand", PRESSED_MM)
    play.until(lambda: play.arm.sim("force") > 0.5)


def lift(play: Stepped) -> None:
    play.arm.sim("hand", LIFTED_MM)
    play.until(lambda: play.arm.sim("height") > CENTRE_MM[1] + 2.0)


def fault_of(play: Stepped) -> int:
    return int(play.servo.tick_state[0]["fault"])


def forces_since(play: Stepped, first: int) -> np.ndarray:
    return play.arm.sent()[0][first:]


def count(play: Stepped) -> int:
    return play.arm.sent()[0].size


@pytest.mark.daily("6")
@pytest.mark.parametrize("stall_ms", [6, 10, 19])
@pytest.mark.needs("cc")
def test_a_short_stall_is_no_force_until_it_was_above_and_then_a_ramp(play: Stepped, stall_ms: int) -> None:
    play.tick(1500)  # until it lies still in the head: the held force throws nothing
    before = count(play)
    play.tick(span_s=stall_ms * T)
    play.tick(300)
    assert (forces_since(play, before) == 0.0).all(), "on that tick, and pressed on in the head after it"
    assert play.arm.sim("height") < CENTRE_MM[1]
    lift(play)
    assert (fault_of(play), play.servo.guard[0]["stalls"]) == (NO_FAULT, 1)
    play.arm.sim("hand", PRESSED_MM)
    play.tick(400)
    forces, heights = (told[before:] for told in play.arm.sent())
    assert forces.max() > 0.5
    # The ramp takes 300 ms from when it was seen above; the head alone would push K depth + R v, a little ahead.
    since = np.arange(len(heights)) - int(np.argmax(heights > CENTRE_MM[1] + 1.0))
    depth_m = 1e-3 * (CENTRE_MM[1] - heights) + 1e-3
    full_N = np.maximum(3500.0 * depth_m + 2.5 * 1.0, 0.0)
    assert (forces <= np.clip(since / 300.0, 0.0, 1.0) * full_N).all()


@pytest.mark.parametrize("stall_ms", [21, 50, 500])
@pytest.mark.needs("cc")
def test_a_longer_stall_is_a_fault_until_somebody_arms_and_lifts(play: Stepped, stall_ms: int) -> None:
    before = count(play)
    play.tick(span_s=stall_ms * T)
    assert fault_of(play) == STALLED
    lift(play)
    play.arm.sim("hand", PRESSED_MM)
    play.tick(500)
    assert fault_of(play) == STALLED
    poke(play.servo.block.control, ARM, 1)
    play.tick(200)
    assert fault_of(play) == NO_FAULT
    assert (forces_since(play, before) == 0.0).all(), "armed in the head: still nothing"
    lift(play)
    press(play)


@pytest.mark.parametrize("stall_ms", [1, 2, 4])
@pytest.mark.needs("cc")
def test_a_late_tick_is_played_over(play: Stepped, stall_ms: int) -> None:
    play.tick(1500)
    before = count(play)
    play.tick(span_s=stall_ms * T)
    play.tick(50)
    assert fault_of(play) == NO_FAULT
    assert forces_since(play, before).min() > 0.5


@pytest.mark.needs("cc")
def test_a_driver_that_freezes_in_mid_stroke_gets_no_force_after_ten_milliseconds(play: Stepped) -> None:
    lift(play)
    play.arm.sim("hand", PRESSED_MM)
    play.until(lambda: play.arm.sim("force") > 0.3)
    frozen = count(play)
    play.arm.sim("freeze", 1)
    waits = round(STALE_S / T)
    play.tick(waits)
    assert fault_of(play) == NO_FAULT
    play.tick(2)
    assert fault_of(play) == STALE
    play.tick(50)
    poke(play.servo.block.control, ARM, 1)
    play.tick(50)
    assert fault_of(play) == STALE, "arming does not thaw it"
    assert (forces_since(play, frozen + waits + 1) == 0.0).all()
    play.arm.sim("freeze", 0)
    lift(play)
    play.tick(500)
    poke(play.servo.block.control, ARM, 1)
    play.tick(100)
    assert (fault_of(play), play.arm.sim("force")) == (NO_FAULT, 0.0)
    press(play)


@pytest.mark.needs("cc")
def test_a_driver_that_freezes_under_a_press_is_noticed_after_a_second(play: Stepped) -> None:
    play.tick(1500)  # until it lies still in the head
    assert play.arm.sim("force") > PRESSING_N
    play.arm.sim("freeze", 1)
    play.tick(990)
    assert fault_of(play) == NO_FAULT
    play.tick(40)
    assert (fault_of(play), play.arm.sim("force")) == (STALE, 0.0)


@pytest.mark.needs("cc")
def test_an_arm_that_rests_above_the_head_is_not_taken_for_frozen(play: Stepped) -> None:
    """It cannot be told apart, and nothing pushes."""
    lift(play)
    play.tick(1500)
    play.arm.sim("freeze", 1)
    play.tick(2000)
    assert (fault_of(play), play.arm.sim("force")) == (NO_FAULT, 0.0)
