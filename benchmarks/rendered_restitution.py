"""Does a sampled device give back what the design says? python benchmarks/rendered_restitution.py.

A simulated arm (0.03 mm encoders, held force, no friction, no hand) falls on the rendered head at 0.3 m/s, at 32 phases
of the tick. Its coefficient of restitution over K_coll, T and delay, with and without prediction, without the guard's
energy account, against the design value (unilateral closed form) and against the theory of lag,
R_eff = R_in - K_coll (T/2 + t_d). Besides: whether the envelope lets the set pass, and what the guard makes of it.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from machine import description

from drumstick import contact, envelope
from drumstick.law import law_of
from drumstick.parameters import Refusal
from drumstick.scene import parse
from haptic_server import block as blocks
from haptic_server.device.simulated import Simulated
from haptic_server.limits import lag_s, limits_of
from haptic_server.servo import memory
from haptic_server.servo.fall import fall

RESULT = Path(__file__).parent / "results" / "rendered_restitution.json"
M_KG, R_IN, SPEED = 0.075, 2.5, 0.3
STIFFNESSES = (250.0, 500.0, 1000.0, 2000.0, 3500.0)
RATES_HZ = (500, 1000, 2000, 4000)
DELAYS = (0, 1, 2)
PHASES = 32

SCENE = """
[stick]
m_kg = {m}
k_coll_N_per_m = {k}
r_in_N_s_per_m = {r}
k_hand_N_per_m = 0.0
r_out_N_s_per_m = 0.0
z_ss_m = 0.0
release = "unilateral"
[servo]
rate_Hz = {rate}
predictor = "{predictor}"
[device]
plant = "phantom"
delay_ticks = {delay}
friction_N = 0.0
"""


def measured(scene: Any, guarded: bool) -> list[float]:
    device = Simulated(scene)
    block = blocks.in_memory(law_of(scene))
    servo = device.furnish(memory.prepare(scene, block, specification=device.info().specification))
    return [fall(servo, SPEED, phase / PHASES, guarded) for phase in range(PHASES)]


def passes(scene: Any) -> bool:
    try:
        envelope.require(law_of(scene), limits_of(scene, Simulated(scene).info().specification))
    except Refusal:
        return False
    return True


def theory(k: float, lag: float) -> float | None:
    """Restitution with R_eff in the closed form; None where R_eff is negative, which that form does not know."""
    effective = R_IN - k * lag
    return float(contact.beta_unilateral(M_KG, k, effective)) if effective >= 0.0 else None


def row(k: float, rate: int, delay: int) -> dict[str, Any]:
    found: dict[str, Any] = {"k_coll": k, "rate_Hz": rate, "delay_ticks": delay}
    for predictor in ("off", "lead"):
        text = SCENE.format(m=M_KG, k=k, r=R_IN, rate=rate, delay=delay, predictor=predictor)
        scene = parse(text, "fall")
        free, guarded = measured(scene, guarded=False), measured(scene, guarded=True)
        found[predictor] = {"mean": float(np.mean(free)), "least": min(free), "most": max(free)}
        found[predictor]["guarded_most"] = max(guarded)
        found["lag_s"], found["passes_envelope"] = lag_s(scene), passes(scene)
    found["ticks_in_contact"] = contact.contact_time(contact.UNILATERAL, M_KG, k, R_IN) * rate
    found["design"] = float(contact.beta_unilateral(M_KG, k, R_IN))
    found["theory"] = theory(k, found["lag_s"])
    return found


def main() -> None:
    rows = [row(k, rate, delay) for k in STIFFNESSES for rate in RATES_HZ for delay in DELAYS]
    for found in rows:
        print(found)
    result = {"machine": description(), "m_kg": M_KG, "r_in": R_IN, "speed_m_per_s": SPEED, "rows": rows}
    RESULT.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
