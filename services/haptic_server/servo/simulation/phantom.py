"""The plant `phantom`: a sampled arm as hardware is, in a simulated hand.

    m z'' + R_out z' + K_hand (z - z_hand) = F + friction

F is held from tick to tick, so between ticks the motion is known in closed form, with Coulomb friction piece by piece
between turns. What it tells is quantised as encoders do; what it is told may come some ticks late and is cut at F_max.
Tick thread: no allocation, no locks, no Python, no exceptions.
"""

import math
from typing import Annotated

import numpy as np
import numpy.typing as npt

from drumstick.parameters.rig import MAX_DELAY_TICKS
from drumstick.stick.hand_path import Gesture, hand_at, later
from drumstick.stick.segment import Segment, propagate
from haptic_server.records import Reading
from realtime.kernels.jit import njit
from realtime.records import Record, dtype_of

_MAX_TRIES = 60
_CLOSE = 1e-14
_MAX_TURNS = 4  # in one tick; a stick that turns more often has come to rest


class Plant(Record):
    """A simulated arm: where it is, what it is made of, and forces on their way to its motors."""

    z_m: float
    v_m_per_s: float
    hand_m: float
    force_N: float
    t_s: float
    phase: float
    m_kg: float
    k_hand_N_per_m: float
    r_out_N_s_per_m: float
    friction_N: float
    resolution_m: float
    max_force_N: float
    lowest_m: float
    highest_m: float
    delay_ticks: int
    next: int
    queue_N: Annotated[npt.NDArray[np.float64], "f8", (MAX_DELAY_TICKS,)]


PLANT = dtype_of(Plant)


@njit()
def _piece(plant: Plant, friction: float) -> Segment:
    m = plant.m_kg
    push = plant.force_N + plant.k_hand_N_per_m * plant.hand_m + friction
    return Segment(
        0.5 * plant.r_out_N_s_per_m / m,
        plant.k_hand_N_per_m / m,
        push / m,
        plant.z_m,
        plant.v_m_per_s,
        (),
        0.0,
        0.0,
        0.0,
        0,
        None,
    )


@njit()
def _turn_time(seg: Segment, sign: float, t: float) -> float:
    # When the speed, which has `sign` at the start and no longer at t, passes 0.
    # By regula falsi with halved ordinates (Illinois): within a tick the speed is nearly a straight line.
    low, high = 0.0, t
    at_low, at_high = sign * propagate(seg, low)[1], sign * propagate(seg, high)[1]
    for _ in range(_MAX_TRIES):
        if high - low <= _CLOSE * t or at_high == 0.0:
            break
        middle = high - at_high * (high - low) / (at_high - at_low)
        found = sign * propagate(seg, middle)[1]
        if found > 0.0:
            low, at_low, at_high = middle, found, 0.5 * at_high
        elif found * at_high > 0.0:
            high, at_high, at_low = middle, found, 0.5 * at_low
        else:
            return middle
    return high


@njit()
def _move_freely(plant: Plant, duration_s: float) -> None:
    left = duration_s
    for _ in range(_MAX_TURNS):
        v = plant.v_m_per_s
        at_rest = plant.force_N + plant.k_hand_N_per_m * (plant.hand_m - plant.z_m)
        if v == 0.0 and abs(at_rest) <= plant.friction_N:
            return
        sign = math.copysign(1.0, v if v != 0.0 else at_rest)
        seg = _piece(plant, -sign * plant.friction_N)
        end = propagate(seg, left)
        if end[1] * sign >= 0.0:
            plant.z_m, plant.v_m_per_s = end[0], end[1]
            return
        turn = _turn_time(seg, sign, left)
        plant.z_m = propagate(seg, turn)[0]
        plant.v_m_per_s = 0.0
        left -= turn


@njit()
def move_on(plant: Plant, duration_s: float) -> None:
    """The arm under its present force for `duration_s` seconds; it stops dead at the ends of its travel."""
    _move_freely(plant, duration_s)
    inside = min(max(plant.z_m, plant.lowest_m), plant.highest_m)
    if inside != plant.z_m:
        plant.z_m, plant.v_m_per_s = inside, 0.0


@njit()
def measure(plant: Plant, reading: Reading, now_ns: int) -> None:
    """Read the simulated encoders."""
    steps = plant.z_m / plant.resolution_m
    reading.z_m = math.floor(steps + 0.5) * plant.resolution_m
    reading.t_ns = now_ns
    reading.fresh = 1


@njit()
def lead(plant: Plant, wanted_m: float, max_speed: float) -> None:
    """Put the hand where it wants to be, or as near as keeps the arm within `max_speed` m/s.

    A hand that swings in time with the arm would else pump it up beyond any limit of speed.
    """
    w2 = plant.k_hand_N_per_m / plant.m_kg
    if w2 > 0.0:
        fits = max(max_speed * max_speed - plant.v_m_per_s * plant.v_m_per_s, 0.0) / w2
        span = max(math.sqrt(fits), abs(plant.z_m - plant.hand_m))
        wanted_m = min(max(wanted_m, plant.z_m - span), plant.z_m + span)
    plant.hand_m = wanted_m


@njit()
def carry(
    plant: Plant, gesture: Gesture, path: npt.NDArray[np.float64], span_s: float, max_speed: float
) -> None:
    """Move on by `span_s` under the force that was last obeyed, with the hand where its gesture has it.

    max_speed: the speed, m/s, that the hand keeps the arm within.
    """
    lead(plant, hand_at(gesture, path, plant.t_s), max_speed)
    move_on(plant, span_s)
    plant.t_s = later(gesture, path, plant.t_s, span_s)


@njit()
def apply_force(plant: Plant, force_N: float) -> None:
    """Take the force to hold until the next tick; it acts some ticks later when the arm is slow."""
    if plant.delay_ticks > 0:
        late = plant.queue_N[plant.next]
        plant.queue_N[plant.next] = force_N
        plant.next = (plant.next + 1) % plant.delay_ticks
        force_N = late
    plant.force_N = min(max(force_N, -plant.max_force_N), plant.max_force_N)
