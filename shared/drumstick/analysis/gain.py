"""Gain of a small pulse in the speed after the contact: v_E = beta |v_in| + kappa dv, kappa in closed form.

Equation (7) says kappa = beta, without a word about when the pulse comes and which way it pushes. To first order in
dv and without the hand, a pulse that fires T seconds before the contact ends adds

    kappa = sign (G'(T)/tau + exp(-T/tau) + 2 a G(T)/tau),   a = R_in/(2m)

with G the response of the head to exp(-t/tau) (drumstick.stick.segment): the speed it has given by then, what it
has still to give, and the shift of the moment of release at z = 0, where the stick decelerates by 2 a v. A head that
only pushes lets go when the acceleration is 0: then the shift costs nothing and the last term is absent. A pulse at
exit gives all of dv.
"""

import math

from drumstick.parameters.stick import Stick
from drumstick.stick import contact
from drumstick.stick.effects.pulse import Pulse
from drumstick.stick.segment import forced_response, free_response

_ROUNDING = 1e-12


def overdamped(stick: Stick) -> bool:
    """True when equation (3) has no value: R_in^2 >= 4 m K_coll, to within rounding."""
    critical = 4.0 * stick.m_kg * stick.k_coll_N_per_m
    return stick.r_in_N_s_per_m**2 >= critical * (1.0 - _ROUNDING)


def _until_let_go_s(stick: Stick, trigger: str) -> float:
    # From the trigger to z = 0 (paper) or to the moment when the head stops pushing (unilateral).
    m, k_coll, r_in = stick.m_kg, stick.k_coll_N_per_m, stick.r_in_N_s_per_m
    unilateral_s = contact.contact_time(contact.UNILATERAL, m, k_coll, r_in)
    turn_s = 0.5 * unilateral_s  # both are multiples of acos(zeta)/w_d
    whole_s = (
        contact.contact_time(contact.PAPER, m, k_coll, r_in) if stick.release == "paper" else unilateral_s
    )
    return whole_s - turn_s if trigger == "turn" else whole_s


def gain(stick: Stick, trigger: str, sign: int, tau_s: float) -> float | None:
    """kappa of a pulse with this trigger, sign and tau; None for an overdamped head that may pull: no contact ends."""
    if stick.release == "paper" and overdamped(stick):
        return None
    if trigger == "exit":
        return float(sign)
    a, w2, lam = 0.5 * stick.r_in_N_s_per_m / stick.m_kg, stick.k_coll_N_per_m / stick.m_kg, 1.0 / tau_s
    span_s = _until_let_go_s(stick, trigger)
    c, s, s_rate = free_response(a, w2, span_s)
    response, response_rate = forced_response(a, w2, lam, span_s, c, s, s_rate)
    shift = 2.0 * a * response if stick.release == "paper" else 0.0
    return sign * (lam * (response_rate + shift) + math.exp(-lam * span_s))


def kappa(stick: Stick, pulse: Pulse) -> float | None:
    """`gain` of the scene's pulse."""
    return gain(stick, pulse.trigger, pulse.sign, pulse.tau_s)
