"""Restitution of a sampled device beside the design's: drumstick lab rendered-restitution.

A simulated arm (0.03 mm encoders, held force, no friction, no hand) falls on the rendered head at 0.3 m/s, at 32 phases
of the tick. Its coefficient of restitution over K_coll, T and delay, with and without prediction, without the guard's
energy account, against the design value (unilateral closed form) and against the theory of lag,
R_eff = R_in - K_coll (T/2 + t_d). Besides: whether the envelope lets the set pass, and what the guard makes of it.
"""

from typing import Any

from drumstick_lab.accuracy.servo import DELAYS, RATES_HZ, STIFFNESSES
from drumstick_lab.accuracy.sticks import falling
from drumstick_lab.accuracy.sticks.falling import PREDICTORS, Sampled
from drumstick_lab.measuring import stored
from haptic_server.limits import lag_s


def row(k: float, rate: int, delay: int) -> dict[str, Any]:
    found: dict[str, Any] = {"k_coll": k, "rate_Hz": rate, "delay_ticks": delay}
    for predictor in PREDICTORS:
        scene = Sampled(k, rate, delay, predictor).scene()
        free, guarded = (falling.rebounds(scene, guarded) for guarded in (False, True))
        found[predictor] = falling.spread(free) | {"guarded_most": max(guarded)}
        found["lag_s"], found["passes_envelope"] = lag_s(scene), falling.passes(scene)
    found["ticks_in_contact"] = falling.ticks_in_contact(k, rate)
    found["design"] = falling.design(k)
    found["theory"] = falling.theory(k, found["lag_s"])
    return found


def main() -> None:
    rows = [row(k, rate, delay) for k in STIFFNESSES for rate in RATES_HZ for delay in DELAYS]
    for found in rows:
        print(found)
    result = {
        "m_kg": falling.M_KG,
        "r_in": falling.R_IN,
        "speed_m_per_s": falling.SPEED,
        "rows": rows,
    }
    stored.store("rendered_restitution", result)


if __name__ == "__main__":
    main()
