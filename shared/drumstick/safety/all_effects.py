"""Upper bounds of what all of a scene's effects do together; `drumstick.safety.bounds` makes bounds of a roll of them.

Each function calls the function of its name of every effect that the scene names and that has one. Kernels: any thread;
no allocation.
"""

from drumstick.stick.effects.registry import EFFECTS
from drumstick.stick.records import Law
from realtime.kernels.folding import added, all_of, folded, largest, multiplied, single


@folded(EFFECTS, all_of)
def usable(law: Law) -> bool:
    """True when the effects' numbers are fit for a device. Comparisons are written so that NaN fails them."""
    return True


@folded(EFFECTS, added)
def max_added_speed(law: Law) -> float:
    """The most speed, m/s, that they add to one contact, whatever its own."""
    return 0.0


@folded(EFFECTS, added)
def max_speed_factor(law: Law) -> float:
    """The most speed that they add to one contact, over the contact's own."""
    return 0.0


@folded(EFFECTS, added)
def max_force(law: Law) -> float:
    """The largest force, N, that the head has besides spring and damper."""
    return 0.0


@folded(EFFECTS, added)
def max_acceleration(law: Law, soonest: float) -> float:
    """The largest acceleration, m/s^2, by pulses that are at least `soonest` seconds apart."""
    return 0.0


@folded(EFFECTS, added)
def max_acceleration_per_speed(law: Law, soonest: float) -> float:
    """Largest acceleration by pulses that are as strong as the blow was fast, m/s^2 per m/s of the blow."""
    return 0.0


@folded(EFFECTS, largest)
def time_constant(law: Law) -> float:
    """The longest that a pulse takes to fade to 1/e, s."""
    return 0.0


@folded(EFFECTS, multiplied)
def max_stiffening(law: Law) -> float:
    """The most that K_coll is multiplied by."""
    return 1.0


@folded(EFFECTS, added)
def max_lag_s(law: Law) -> float:
    """The oldest that the head's force can be, s, by the effects alone."""
    return 0.0


@folded(EFFECTS, single)
def late_blow(law: Law, r: float, ratio: float) -> tuple[float, float, float, float]:
    """Upper bounds of one contact whose force is a held sample, with damping r and a spring `ratio` times as stiff
    while the stick rises: see drumstick.stick.effects.delayed_contact.
    """
    return 0.0, 0.0, 0.0, 0.0


@folded(EFFECTS, largest)
def slow_speed(law: Law) -> float:
    """The entry speed, m/s, up to which a contact has another damping, `slow_damping`; 0: none has."""
    return 0.0


@folded(EFFECTS, largest)
def slow_flight_speed(law: Law) -> float:
    """The speed, m/s, below which a flight has another damping, `slow_flight_damping`; 0: none has."""
    return 0.0


@folded(EFFECTS, single)
def slow_flight_damping(law: Law) -> float:
    """The damping of such a flight, N s/m, at least -sqrt(m K_hand)."""
    return 0.0


@folded(EFFECTS, single)
def slow_flight_growth(law: Law) -> float:
    """By what half a swing of such a flight about its rest multiplies its amplitude, at least 1."""
    return 1.0


@folded(EFFECTS, single)
def slow_damping(law: Law) -> float:
    """The damping of such a contact, N s/m, above -sqrt(m K_coll)."""
    return 0.0
