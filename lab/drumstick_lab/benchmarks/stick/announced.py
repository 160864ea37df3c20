"""Announced contacts beside the real ones, and what looking ahead costs: drumstick lab announced.

Every shipped scene on the exact stick, thrown and played on; and a simulated arm that a hand makes strokes with, at
several stiffnesses and rates, or rolls by single or double strokes. Peak force and impulse in decibels, time in the
head in percent: median, and the worst. Where the hand's way is given, it is that of the simulated hand, which no servo
can know: what is then left is the encoder's and the sampled law's.
Beside it what was announced before 2026-11-24, a lone blow without hand, pulse and effects. Contacts that do not end by
themselves are not counted. Cost: CPU time of one look ahead at 0.3 m/s, the least of several runs; also where it is the
dearest, in a stick that is pressed down under a random force or a head that is itself sampled. Results go to
lab/results/announced.json.
"""

import time
from typing import Any

import numpy as np
import numpy.typing as npt

import sampled_arm
from drumstick.parameters.scene import Scene
from drumstick.scenes.scene_text import parse, shipped_names, shipped_text
from drumstick.stick.contact_ahead import PredictedContact, contact_ahead, isolated
from drumstick.stick.law import law_of, thrown
from drumstick.stick.motion import exact
from drumstick_lab.measuring import stored
from haptic_server.records import RELEASE, STRIKE
from haptic_server.servo import loop
from realtime.kernels.jit import njit
from realtime.records import Records

CONTACTS, EVENTS, ARM_S = 200, 2000, 20.0
ARMS = ((3500.0, 2.5), (1500.0, 2.5), (800.0, 2.0), (400.0, 1.5))  # K_coll N/m, R_in N s/m
RATES_HZ = (1000, 4000)
ROLLS = ("single-stroke-roll", "double-stroke-roll")
STEP_S = 1e-6
RUNS, LOOKS = 7, 200
PRESSED = """
[stick]
m_kg = 0.05
k_coll_N_per_m = 800.0
r_in_N_s_per_m = 2.0
k_hand_N_per_m = 400.0
r_out_N_s_per_m = 0.01
z_ss_m = -0.01
"""
DEAREST = {
    "a random force": "[effects.noise]\nforce_N = 0.2",
    "a head sampled every 0.1 ms": "[effects.system_delay]\nperiod_s = 0.0001\ndelay_ticks = 8",
}

Floats = npt.NDArray[np.float64]
Triples = list[tuple[PredictedContact, PredictedContact, PredictedContact]]  # announced, of a lone blow, real


def of_the_stick(scene: Scene) -> Triples:
    """Contacts of the exact stick."""
    law, motion = law_of(scene), thrown(scene, scene.hand.throw_m_per_s)
    stick, ahead = motion[0], motion.copy()
    found: Triples = []
    announced = alone = PredictedContact(0.0, 0.0, 0.0)
    for _ in range(EVENTS):
        if len(found) == CONTACTS or stick["outcome"] != exact.MOVING:
            break
        what, _ = exact.advance(law[0], stick, 1.0)
        if what == exact.ENTRY:
            announced = contact_ahead(law[0], stick, ahead)
            alone = isolated(law[0], -float(stick["v_in"]))
        elif what == exact.RELEASE:
            found.append(
                (
                    announced,
                    alone,
                    PredictedContact(*(float(stick[name]) for name in PredictedContact._fields)),
                )
            )
    return found


def arm_of(k: float, r: float, rate_Hz: int, gesture: str) -> Scene:
    """A hand that plays a simulated arm."""
    text = sampled_arm.SCENE.format(gesture=gesture, device="", guard="") + f"[servo]\nrate_Hz = {rate_Hz}\n"
    return parse(
        text.replace("3500.0", f"{k}").replace("r_in_N_s_per_m = 2.5", f"r_in_N_s_per_m = {r}"), "arm"
    )


def of_an_arm(k: float, r: float, rate_Hz: int, gesture: str = "strokes") -> Triples:
    """Contacts of an arm, from what encoders tell, by the tick that plays, in virtual time."""
    scene = arm_of(k, r, rate_Hz, gesture)
    servo = sampled_arm.servo_of(scene)
    loop.run_virtual(servo, round(ARM_S * rate_Hz), 0)
    return _pairs(scene, sampled_arm.events_of(servo))


def _pairs(scene: Scene, events: np.ndarray) -> Triples:
    strikes = {int(one["seq"]): one for one in events[events["kind"] == STRIKE]}
    found: Triples = []
    for one in events[events["kind"] == RELEASE]:
        begun = strikes.get(int(one["seq"]))
        if begun is not None and one["speed_m_per_s"] > 0.0:
            ahead, real = (
                PredictedContact(*(float(each[name]) for name in PredictedContact._fields))
                for each in (begun, one)
            )
            found.append((ahead, isolated(law_of(scene)[0], float(begun["speed_m_per_s"])), real))
    return found


@njit()
def _carried(law: Records, speed: float, hand_m: Floats, period_s: float) -> PredictedContact:
    # A contact with the hand on its way, by steps so small that they do not count.
    one, z, v, t = law[0], 0.0, -speed, 0.0
    peak = impulse = 0.0
    while z <= 0.0 and t < period_s * (len(hand_m) - 1):
        push = max(-one.k_coll * z - (one.r_in - one.r_out) * v, 0.0)
        hand = hand_m[int(t / period_s)]
        v += STEP_S / one.m * (push - one.r_out * v - one.k_hand * (z - hand))
        z += STEP_S * v
        t += STEP_S
        peak = max(peak, push)
        impulse += STEP_S * push
    return PredictedContact(peak, t, impulse)


def with_the_hands_way(k: float, r: float, rate_Hz: int) -> Triples:
    """Strokes as `of_an_arm` has them, foreseen from the servo's own speed and where the hand then went."""
    scene = arm_of(k, r, rate_Hz, "strokes")
    law, servo, ticks, now_ns = law_of(scene), sampled_arm.servo_of(scene), round(ARM_S * rate_Hz), 0
    hand_m, begun, kept = np.zeros(ticks), dict[int, int](), list[Any]()
    for tick in range(ticks):
        now_ns = loop.run_virtual(servo, 1, now_ns)
        hand_m[tick] = servo.plant["hand_m"][0]
        for event in sampled_arm.events_of(servo):
            kept.append(event.copy())
            if event["kind"] == STRIKE:
                begun[int(event["seq"])] = tick
    found: Triples = []
    events = np.array(kept)
    releases = [one for one in events[events["kind"] == RELEASE] if one["speed_m_per_s"] > 0.0]
    speeds = {int(one["seq"]): float(one["speed_m_per_s"]) for one in events[events["kind"] == STRIKE]}
    for one, (_, alone, real) in zip(releases, _pairs(scene, events), strict=True):
        seq = int(one["seq"])
        ahead = _carried(law, speeds[seq], hand_m[begun[seq] :], 1.0 / rate_Hz)
        found.append((PredictedContact(*ahead), alone, real))
    return found


@njit()
def _looks(law: Records, motion: Records, ahead: Records, times: int) -> float:
    force = 0.0
    for _ in range(times):
        force += contact_ahead(law[0], motion[0], ahead).peak_N
    return force


def cost_us(scene: Scene) -> float:
    """CPU time of one look ahead."""
    law, motion = law_of(scene), thrown(scene, 0.0)
    motion["v_in"] = motion["v"] = -0.3
    motion["contact_phase"] = exact.CONTACT
    ahead = motion.copy()
    _looks(law, motion, ahead, 1)
    spent: list[int] = []
    for _ in range(RUNS):
        begun = time.thread_time_ns()
        _looks(law, motion, ahead, LOOKS)
        spent.append(time.thread_time_ns() - begun)
    return min(spent) * 1e-3 / LOOKS


def _row(name: str, found: Triples) -> dict[str, Any]:
    ahead, alone, real = (np.array(column, float) for column in zip(*found, strict=True))
    row: dict[str, Any] = {"name": name, "contacts": len(found)}
    for at, field in enumerate(PredictedContact._fields):
        for which, numbers in (("announced", ahead), ("alone", alone)):
            share = numbers[:, at] / real[:, at]
            off = 100.0 * (share - 1.0) if field == "contact_s" else 20.0 * np.log10(share)
            row[f"{which}_{field}"] = [float(np.median(off)), float(off[np.argmax(np.abs(off))])]
    return row


def main() -> None:
    rows: list[dict[str, Any]] = []
    for name in shipped_names():
        scene = parse(shipped_text(name), name)
        rows.append(_row(name, of_the_stick(scene)) | {"look_us": cost_us(scene)})
        print(rows[-1])
    arms: list[dict[str, Any]] = []
    for k, r in ARMS:
        for rate_Hz in RATES_HZ:
            arms.append(_row(f"{k:g} N/m at {rate_Hz} Hz", of_an_arm(k, r, rate_Hz)))
            print(arms[-1])
    k, r = ARMS[-1]
    arms.append(_row(f"{k:g} N/m at 1000 Hz, the hand's way given", with_the_hands_way(k, r, 1000)))
    print(arms[-1])
    k, r = ARMS[0]
    for gesture in ROLLS:
        arms.append(_row(f"{gesture}, {k:g} N/m at 1000 Hz", of_an_arm(k, r, 1000, gesture)))
        print(arms[-1])
    dearest = {name: cost_us(parse(PRESSED + effect, name)) for name, effect in DEAREST.items()}
    print(dearest)
    result = {"stick": rows, "arm": arms, "dearest_us": dearest}
    stored.store("announced", result)


if __name__ == "__main__":
    main()
