"""Held arms: sets of parameters for a sampled arm in a hand, drawn at random or at the envelope's boundary, and played.

Virtual time, any thread. The judge is arm_witness.
"""

import math
from typing import Any

import numpy as np

import arm_witness
import live_sets
from drumstick.parameters.rig import Device, Guard, Hand, Servo
from drumstick.parameters.scene import Scene
from drumstick.parameters.stick import Stick
from drumstick.safety import envelope
from drumstick.stick.law import law_of
from haptic_server.limits import limits_of
from haptic_server.servo.device.simulated import Simulated

RATES_HZ, DELAYS, FRICTIONS_N = (500, 1000, 2000, 4000), (0, 0, 1, 2, 4, 8), (0.0, 0.04, 0.2)
NEAR = 0.02  # of the boundary
MAX_S, MIN_S, STEP_S, STILL_M_PER_S = 30.0, 3.0, 0.25, 1e-3
SET = {
    "m": 0.075, "k": 3500.0, "r": 75.0, "k_hand": 60.0, "r_out": 0.5, "z_ss": -0.01, "release": "unilateral",
    "rate": 1000, "predictor": "lead", "delay": 0, "friction": 0.04, "force": 8.5,
}  # fmt: skip
# Seen to hammer for ever at the motors' full force.
KNOWN: dict[str, dict[str, Any]] = {
    "a tick of delay": {"delay": 1},
    "500 Hz": {"r": 95.0, "rate": 500},
    "no delay": {"r": 120.0},
    "a light arm": {"m": 0.03, "r": 60.0},
}


def scene_of(**values: Any) -> Scene:
    """A held arm without effects, in which nobody throws."""
    v = {**SET, **values}
    return Scene(
        "held arm",
        stick=Stick(v["m"], v["k"], v["r"], v["k_hand"], v["r_out"], v["z_ss"], v["release"]),
        servo=Servo(rate_Hz=v["rate"], predictor=v["predictor"]),
        device=Device("phantom", v["delay"], v["friction"]),
        hand=Hand(gesture="hold", rest_s=60.0),
        guard=Guard(max_force_N=v["force"]),
    )


def judged(scene: Scene) -> envelope.Judgement:
    """Verdict of the envelope on the scene on its own device."""
    limits = limits_of(scene, Simulated(scene).info().specification)
    return envelope.judge(law_of(scene)[0], limits.record()[0], envelope.new_scratch())


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """A set at random, evenly over the decades."""
    m, k_hand = _log_uniform(rng, 0.02, 0.5), _log_uniform(rng, 5.0, 500.0)
    r = _log_uniform(rng, 0.05, 300.0)
    return {
        "m": m,
        "k": _log_uniform(rng, 50.0, 3500.0),
        "r": r,
        "k_hand": k_hand,
        "r_out": min(_log_uniform(rng, 0.05, 2.0) * math.sqrt(m / 0.075), r),
        "z_ss": -_log_uniform(rng, 0.001, 0.03) * 60.0 / max(k_hand, 60.0),
        "release": str(rng.choice(["unilateral", "paper"])),
        "rate": int(rng.choice(RATES_HZ)),
        "predictor": str(rng.choice(["lead", "off"])),
        "delay": int(rng.choice(DELAYS)),
        "friction": float(rng.choice(FRICTIONS_N)),
    }


def _passes(law: Any, limits: Any, room: Any, field: str, value: float) -> bool:
    tried = law.copy()
    tried[field] = value
    return envelope.judge(tried[0], limits[0], room).code == envelope.OK


class Trial:
    """One arm in its hand, with a set that the envelope accepts, and the judge's memory."""

    def __init__(self, rng: np.random.Generator, near: bool) -> None:
        room = envelope.new_scratch()
        self.tried = 0
        while True:
            self.tried += 1
            self.values = drawn(rng)
            scene = scene_of(**self.values)
            law = law_of(scene)
            limits = limits_of(scene, Simulated(scene).info().specification).record()
            if envelope.judge(law[0], limits[0], room).code != envelope.OK:
                continue
            if near and not self._move_to_boundary(law, limits, room, rng):
                continue
            break
        self.scene, self.law = scene, law

    def _move_to_boundary(self, law: Any, limits: Any, room: Any, rng: np.random.Generator) -> bool:
        # Along r_in or k_coll, up or down, to within NEAR of where the envelope refuses.
        field, up = str(rng.choice(["r_in", "k_coll"])), bool(rng.integers(2))
        good = float(law[field][0])
        bad = good * (100.0 if up else 0.01)
        if _passes(law, limits, room, field, bad):
            return False
        while abs(bad - good) > NEAR * good:
            middle = math.sqrt(good * bad)
            if _passes(law, limits, room, field, middle):
                good = middle
            else:
                bad = middle
        if not (1.0 <= good <= 1e3):  # of the table's range, for both
            return False
        law[field] = good
        self.values["r" if field == "r_in" else "k"] = good
        return True

    def seconds(self) -> float:
        """Time that it may take to come to rest: 3 s, or ten of its passive time constants if longer."""
        value = self.values
        return max(MIN_S, 10.0 * time_constant(value))


def time_constant(value: dict[str, Any]) -> float:
    """The slowest passive one, s: of the arm on its hand, and in the head, at its design values."""

    def slowest(m: float, r: float, k: float) -> float:
        left = r * r - 4.0 * m * k
        return 2.0 * m / r if left <= 0.0 else 2.0 * m / (r - math.sqrt(left))

    own = slowest(value["m"], value["r_out"], value["k_hand"])
    return max(own, slowest(value["m"], value["r"], value["k"] + value["k_hand"]))


def play(trial: Trial, other: Trial | None, guarded: bool) -> dict[str, Any]:
    """Play the set until the arm is at rest, or its time is over; `other`: a set that it is changed to on the way."""
    scene = scene_of(**trial.values)
    servo = live_sets.servo_of(scene)
    if not guarded:
        servo.guard["max_added_speed"] = 1e3
    seen = np.zeros(1, arm_witness.SEEN)
    arm_witness.begin(servo, seen)
    rate, now, gone = trial.values["rate"], 0, 0.0
    limit, quiet = min(trial.seconds(), MAX_S), 0
    if other is not None:
        now = arm_witness.watch(servo, seen, round(0.45 * rate), now, False)
        changes = {name: float(other.law[name][0]) for name in ("k_coll", "r_in")}
        wanted = live_sets.changed(servo.law, scene, changes)
        if envelope.judge(wanted[0], servo.envelope_limits[0], envelope.new_scratch()).code == envelope.OK:
            live_sets.offer(servo, 1, wanted)
        seen["entries"] = 0  # a set may give the energy of its height: it counts as a throw
    while gone < limit:
        seen["late_m_per_s"] = 0.0
        seen["late_entry_J"] = 0.0
        now = arm_witness.watch(servo, seen, round(STEP_S * rate), now, True)
        gone += STEP_S
        quiet = quiet + 1 if float(seen["late_m_per_s"][0]) < STILL_M_PER_S else 0
        if quiet >= 2 and gone >= 0.75:
            break
    found = arm_witness.verdict(servo, seen)
    return {"guarded": guarded, "changed": other is not None, **found._asdict()}
