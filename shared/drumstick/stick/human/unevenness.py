"""Uneven strikes: at each release the hand draws how strong the next pulse is and how firmly it presses until then.

Above the head equation (1) is linear: where the hand presses as much harder as the stick leaves faster, the flight
lasts as long and is higher. A player keeps time like this: `pressing` follows v_E, beside the v_E that the hand is used
to, and its own error comes on top. The pulse's error is what makes strikes louder and softer. Both are sums of three
numbers: nearly normal, and bounded. How large they must be: drumstick.stick.human.spread. Kernels: tick thread; no
allocation.
"""

from typing import Any

from drumstick.stick import composition
from drumstick.stick.effects.pulse import PulseLaw
from drumstick.stick.effects.random_numbers import uniform
from drumstick.stick.records import Motion
from realtime.kernels.jit import njit, only_with
from realtime.records import Record

LOOSEST, FIRMEST = 0.5, 2.0  # of z_ss: beyond, the hand no longer keeps time
LARGEST = 3.0  # standard deviations: no draw is larger
_USED_TO = 64.0  # strikes


class Unevenness(Record):
    """Unevenness of a hand. dv_pls: as set, m/s; dv_factor, pressing: what it makes of that and of z_ss now;
    used_to_m_per_s: a running mean of v_E; spreads: standard deviations of both factors; drawn: numbers so far.
    """

    dv_pls: float
    dv_factor: float
    pressing: float
    used_to_m_per_s: float
    dv_spread: float
    pressing_spread: float
    seed: int
    drawn: int


@only_with("human", otherwise=0.0)
def pulse_of(hand: Any, law: Any) -> float:
    """The law's pulse, m/s."""
    pulse: PulseLaw = law.pulse
    return pulse.dv_pls


@only_with("human")
def set_pulse(hand: Any, law: Any, dv_pls: float) -> None:
    """Make this the law's pulse, m/s."""
    pulse: PulseLaw = law.pulse
    pulse.dv_pls = dv_pls


@only_with("human")
def take(hand: Any, law: Any) -> None:
    """Take the law's pulse as what is set."""
    human: Unevenness = hand.human
    human.dv_pls = pulse_of(hand, law)


@only_with("human")
def put_back(hand: Any, law: Any) -> None:
    """Put the pulse that is set into the law."""
    human: Unevenness = hand.human
    set_pulse(hand, law, human.dv_pls)


@only_with("human", otherwise=False)
def is_there(hand: Any) -> bool:
    """True when the hand is no machine."""
    return True


@only_with("human", otherwise=1.0)
def pressing(hand: Any) -> float:
    """Factor that the hand makes of a z_ss below 0 now."""
    human: Unevenness = hand.human
    return human.pressing


@only_with("human")
def hold(hand: Any, law: Any) -> None:
    """Put what the hand does now into the law, whose z_ss is what is set. A hand that lifts does not vary."""
    human: Unevenness = hand.human
    set_pulse(hand, law, human.dv_factor * human.dv_pls)
    if law.z_ss < 0.0:
        law.z_ss *= human.pressing


@only_with("human")
def hold_worst(hand: Any, law: Any) -> None:
    """Make of a law that is set the strongest pulse and the firmest pressing that the hand can come to."""
    human: Unevenness = hand.human
    set_pulse(hand, law, pulse_of(hand, law) * (1.0 + LARGEST * human.dv_spread))
    if law.z_ss < 0.0:
        law.z_ss *= FIRMEST


@njit()
def vary(human: Unevenness, v_e: float, strength: float, pressure: float) -> None:
    """Vary after a strike that left at v_e m/s; strength, pressure: errors, in standard deviations."""
    human.dv_factor = max(1.0 + human.dv_spread * strength, 0.0)
    pressing = v_e / (human.used_to_m_per_s * (1.0 + human.pressing_spread * pressure))
    human.pressing = min(max(pressing, LOOSEST), FIRMEST)
    human.used_to_m_per_s += (v_e - human.used_to_m_per_s) / _USED_TO


@njit()
def _nearly_normal(seed: int, index: int) -> float:
    # Three numbers uniform in -1 .. 1: together of variance 1.
    first = 3 * index
    return 2.0 * (uniform(seed, first) + uniform(seed, first + 1) + uniform(seed, first + 2)) - LARGEST


@only_with("human")
def draw(hand: Any, law: Any, motion: Motion) -> None:
    """Draw the next strike's errors; call it at a release."""
    human: Unevenness = hand.human
    v_e = motion.v_out + composition.remaining_speed(law, motion)
    vary(human, v_e, _nearly_normal(human.seed, human.drawn), _nearly_normal(human.seed, human.drawn + 1))
    human.drawn += 2
