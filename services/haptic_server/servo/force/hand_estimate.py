"""The hand that holds a sampled arm: its pull and how fast that changes, from positions and rendered forces.

    m z'' = m p - K_hand z - R_out z' - friction + F,    p' = q

Where the scene's hand rests, p = K_hand z_ss/m and q = 0; a player's hand is elsewhere and moves. An observer predicts
the position over each tick, under the force F that then acted, and corrects all four by what the encoder tells instead.
Its gains are those of a third-degree fading memory, all roots at exp(-w T) (Morrison, "Introduction to sequential
smoothing and prediction", 1969). It sees through contacts, since their force is known. Tick thread: no allocation, no
locks, no Python, no exceptions.
"""

import math
from typing import Annotated

import numpy as np
import numpy.typing as npt

from drumstick.parameters.rig import MAX_DELAY_TICKS
from drumstick.parameters.scene import Scene
from drumstick.stick import contact
from drumstick.stick.records import Law
from realtime.kernels.jit import njit
from realtime.records import Record, dtype_of

# How quickly it forgets: 300/s doubles the error that the encoder's steps make, 120/s is late where the hand turns.
_RATE_PER_S = 200.0
_SETTLED_S = 0.04
_MAX_S = 0.005  # after a longer pause it begins anew
# How long a hand is taken to go on as it goes at the strike. It may turn at once, or go on: with 5 ms the impulse of
# strokes, rolls of either kind and a hand that holds is right on the median (docs/measured.md).
_GOES_ON_S = 0.005
_CREEPS_M_PER_S = 1e-3  # below it friction has no sign


class HandEstimate(Record):
    """Estimate of the hand from an arm's motion: its pull as an acceleration, and how that changes."""

    t_ns: int
    known_s: float
    z_m: float
    v_m_per_s: float
    pull_m_per_s2: float
    rate_m_per_s3: float
    friction_N: float
    gains: Annotated[npt.NDArray[np.float64], "f8", (4,)]
    next: int
    queue_N: Annotated[npt.NDArray[np.float64], "f8", (MAX_DELAY_TICKS,)]


HAND = dtype_of(HandEstimate)


def new_hand(scene: Scene) -> npt.NDArray[np.void]:
    """An observer that has seen nothing yet, shape (1,). Control thread."""
    hand = np.zeros(1, HAND)
    period_s = 1.0 / scene.servo.rate_Hz
    fade = math.exp(-_RATE_PER_S * period_s)
    new = 1.0 - fade
    hand["friction_N"] = scene.device.friction_N
    hand["gains"] = (
        1.0 - fade**4,
        new**2 * (11.0 + 14.0 * fade + 11.0 * fade**2) / (6.0 * period_s),
        2.0 * new**3 * (1.0 + fade) / period_s**2,
        new**4 / period_s**3,
    )
    return hand


@njit()
def _acted(hand: HandEstimate, asked_N: float, delay_ticks: int) -> float:
    # The force over the tick that is over: what was asked for so many ticks ago.
    if delay_ticks > 0:
        late = hand.queue_N[hand.next]
        hand.queue_N[hand.next] = asked_N
        hand.next = (hand.next + 1) % delay_ticks
        return float(late)
    return float(asked_N)


@njit()
def _begin(hand: HandEstimate, law: Law, z: float) -> None:
    hand.known_s = 0.0
    hand.z_m = z
    hand.v_m_per_s = 0.0
    hand.pull_m_per_s2 = law.k_hand * law.z_ss / law.m
    hand.rate_m_per_s3 = 0.0


@njit()
def _predict(hand: HandEstimate, law: Law, force: float, span: float) -> None:
    spring, damper = law.k_hand / law.m, law.r_out / law.m
    v = hand.v_m_per_s
    friction = hand.friction_N * v / (abs(v) + _CREEPS_M_PER_S)
    z2 = hand.pull_m_per_s2 - spring * hand.z_m - damper * v + (force - friction) / law.m
    z3 = hand.rate_m_per_s3 - spring * v - damper * z2
    z4 = -spring * z2 - damper * z3
    hand.z_m += span * (v + span * (z2 / 2.0 + span * (z3 / 6.0 + span * z4 / 24.0)))
    hand.v_m_per_s += span * (z2 + span * (z3 / 2.0 + span * z4 / 6.0))
    hand.pull_m_per_s2 += span * hand.rate_m_per_s3


@njit()
def _correct(hand: HandEstimate, law: Law, off: float) -> None:
    # The gains are of z and its derivatives; what they say of z'' and z''' is the hand's.
    spring, damper = law.k_hand / law.m, law.r_out / law.m
    z, v, z2, z3 = hand.gains[0] * off, hand.gains[1] * off, hand.gains[2] * off, hand.gains[3] * off
    hand.z_m += z
    hand.v_m_per_s += v
    hand.pull_m_per_s2 += z2 + damper * v + spring * z
    hand.rate_m_per_s3 += z3 + damper * z2 + spring * v


@njit()
def update_observer(
    hand: HandEstimate, law: Law, asked_N: float, delay_ticks: int, z: float, now_ns: int
) -> None:
    """The arm is at z m now; `asked_N` was asked of it in the tick before this one, and acts some ticks later."""
    force, span = _acted(hand, asked_N, delay_ticks), (now_ns - hand.t_ns) * 1e-9
    hand.t_ns = now_ns
    # A hand's spring that swings faster than the observer forgets would make it unstable.
    is_slow = law.k_hand < law.m * _RATE_PER_S * _RATE_PER_S and law.r_out < law.m * _RATE_PER_S
    if not (0.0 < span < _MAX_S and is_slow):
        _begin(hand, law, z)
        return
    _predict(hand, law, force, span)
    _correct(hand, law, z - hand.z_m)
    hand.known_s += span


@njit()
def write_predicted_hand(hand: HandEstimate, law: Law) -> None:
    """Give the law a hand at rest with the average pull that this one will have during the contact."""
    if hand.known_s < _SETTLED_S or not law.k_hand > 0.0:
        return
    contact_s = contact.contact_time(law.release, law.m, law.k_coll, law.r_in)
    moves_s = min(_GOES_ON_S, contact_s)
    mean_s = moves_s - moves_s * moves_s / (2.0 * contact_s)
    law.z_ss = law.m / law.k_hand * (hand.pull_m_per_s2 + mean_s * hand.rate_m_per_s3)
